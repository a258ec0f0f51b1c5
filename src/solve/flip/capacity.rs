//! Brick layouts of particle states, and resizing to other counts.

use crate::{
    SolveError,
    plan::{Capacity, Counts},
    pressure::LEVELS,
};
use swell_domain::{
    bricks::{Bricks, EDGE, table_dims},
    flip::{layers, stored_cells},
    particles::Particles,
};
use swell_scene::{FlipScene, step::Substep};

use super::{Flip, PARAMS, plan, pressure_solver, recordings, step, upload_constants};

/// Returns wetness flags of the domain's bricks, none set.
pub(super) fn no_water(scene: &FlipScene, grid_dims: [u32; 3]) -> Vec<bool> {
    let dims = table_dims(stored_cells(grid_dims, scene.periodic));
    vec![false; dims.iter().map(|&n| n as usize).product()]
}

pub(super) fn bricks(
    scene: &FlipScene,
    grid_dims: [u32; 3],
    is_wet: &[bool],
    layers: usize,
) -> Bricks {
    let reach = (layers as u32).div_ceil(EDGE);
    let cells = stored_cells(grid_dims, scene.periodic);
    Bricks::periodic(cells, scene.periodic, is_wet, reach, LEVELS)
}

pub(super) fn capacity_of(bricks: &Bricks) -> Capacity {
    Capacity {
        wet: bricks.wet as usize + 1,
        slots: bricks.slots(),
    }
}

/// Returns the bricks that a particle state needs in a scene.
pub fn capacity(scene: &FlipScene, particles: &Particles) -> Capacity {
    let grid_dims = scene.domain.cells(scene.settings().cell_size);
    let mut is_wet = no_water(scene, grid_dims);
    let dims = table_dims(stored_cells(grid_dims, scene.periodic)).map(|n| n as usize);
    let edge = f64::from(EDGE) * scene.settings().cell_size;
    for position in &particles.position {
        let x = glam::Vec3::from_array(*position).as_dvec3() - scene.domain.min;
        let at: [usize; 3] =
            std::array::from_fn(|k| ((x[k] / edge).max(0.0) as usize).min(dims[k] - 1));
        is_wet[(at[2] * dims[1] + at[1]) * dims[0] + at[0]] = true;
    }
    // As many layers as a first substep at a moderate speed reaches.
    capacity_of(&bricks(scene, grid_dims, &is_wet, layers(1.0)))
}

/// Returns the substep of the first survey, which reads only parameters that do not depend on the
/// substep.
pub(super) fn whole_frame(scene: &FlipScene) -> Substep {
    Substep {
        start: 0.0,
        length: scene.shot.frame_seconds(),
        kick: scene.shot.frame_seconds(),
        displacement: 0.0,
    }
}

impl Flip {
    /// Resizes buffers to other counts.
    pub(super) fn refit(&mut self, counts: Counts) -> Result<(), SolveError> {
        self.plan = plan::plan(&self.scene, counts, self.plan.moves);
        let (buffers, passes) = (self.plan.buffer_specs(), self.plan.pass_specs());
        self.program.refit(&buffers, &passes)?;
        upload_constants(&self.program, &self.plan, &self.scene);
        self.recordings = recordings(&self.program, &self.plan, &self.scene);
        self.pressure = pressure_solver(&self.scene, &self.plan);
        Ok(())
    }

    /// Resizes buffers to another number of particles.
    pub(super) fn resize(&mut self, particles: usize) -> Result<(), SolveError> {
        self.refit(Counts {
            particles,
            ..self.plan.counts
        })?;
        let frame = whole_frame(&self.scene);
        let params = step::params(
            &self.scene,
            &self.plan,
            &self.state.walls,
            &self.bricks,
            &frame,
        );
        self.program.upload(PARAMS, 0, &[params]);
        Ok(())
    }
}
