//! Brick layouts of particle states, and resizing to other counts.

use crate::{
    SolveError, effects,
    plan::{Capacity, Counts, Plan},
    pressure::{LEVELS, PressureSolver},
};
use swell_domain::{
    bricks::{Bricks, CELLS, EDGE, table_dims},
    flip::{layers, stored_cells},
    particles::Particles,
};
use swell_gpu::{program::Program, sort};
use swell_scene::{FlipScene, step::Substep};

use super::{
    Flip,
    buffers::*,
    plan::{self, extent},
    record::{Commands, Recordings, numbers},
    step,
};

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
    laden_bricks(scene, grid_dims, (is_wet, is_wet), layers)
}

/// Lays out bricks with water, those of `is_laden` first.
pub(super) fn laden_bricks(
    scene: &FlipScene,
    grid_dims: [u32; 3],
    (is_wet, is_laden): (&[bool], &[bool]),
    layers: usize,
) -> Bricks {
    let reach = (layers as u32).div_ceil(EDGE);
    let cells = stored_cells(grid_dims, scene.periodic);
    Bricks::laden_first(cells, scene.periodic, is_wet, is_laden, reach, LEVELS)
}

pub(super) fn capacity_of(bricks: &Bricks) -> Capacity {
    Capacity {
        laden: bricks.laden as usize + 1,
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
    let is_laden = is_wet.clone();
    if let Some(band) = scene.band() {
        is_wet = band.wet_bricks(particles);
    }
    // As many layers as a first substep at a moderate speed reaches.
    let flags = (&is_wet[..], &is_laden[..]);
    capacity_of(&laden_bricks(scene, grid_dims, flags, layers(1.0)))
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

/// Binds the commands of a plan to the current buffers of the program.
pub(super) fn recordings(program: &Program, plan: &Plan, scene: &FlipScene) -> Recordings {
    let effects = effects::of_flip(scene, plan.counts.bricks.cells());
    Recordings::new(program, &Commands::new(plan, scene, &effects))
}

pub(super) fn pressure_solver(scene: &FlipScene, plan: &Plan) -> PressureSolver {
    let flip = scene.settings();
    PressureSolver::new(
        &flip.pressure,
        extent(plan, scene),
        plan.counts.bricks.slots,
    )
}

/// Uploads data that does not change between substeps.
pub(super) fn upload_constants(program: &Program, plan: &Plan, scene: &FlipScene) {
    let cells = plan.counts.bricks.wet * CELLS as usize;
    sort::upload_lengths(program, &CELL_START, cells);
    program.upload(ELEMENT_COUNT, 0, &[[plan.counts.particles as u32, 0, 0, 0]]);
    program.upload_windows(&AXES, &numbers(0, 3));
    // Layer 2 is the first that is extrapolated.
    program.upload_windows(&LAYERS, &numbers(2, layers(scene.settings().cfl)));
}
