//! Parameters of a substep's passes.

use crate::{
    params::{FlipParams, Inlets},
    plan::Plan,
};
use swell_domain::{
    absorber::AbsorberStates,
    bounds::Bounds,
    bricks::{Bricks, CELLS, table_dims},
    flip::{CAP, CONTACT, stored_cells},
};
use swell_scene::{FlipScene, step::Substep};

/// Returns the walls that cut a substep's cells, in cells.
pub(super) fn cut(scene: &FlipScene, absorbers: &AbsorberStates, step: &Substep) -> Bounds {
    let (walls, size) = (
        scene.walls(absorbers, step.start),
        scene.settings().cell_size,
    );
    Bounds {
        min: walls.min / size,
        max: walls.max / size,
    }
}

pub(super) fn params(
    scene: &FlipScene,
    plan: &Plan,
    absorbers: &AbsorberStates,
    bricks: &Bricks,
    step: &Substep,
) -> FlipParams {
    let flip = scene.settings();
    let after = scene.walls(absorbers, step.start + step.length);
    let cut = cut(scene, absorbers, step);
    let speed = scene.wall_velocity(absorbers, step.start + step.length, step.length);
    FlipParams {
        wall_min: after.min.as_vec3().to_array(),
        particle_count: plan.counts.particles as u32,
        wall_max: after.max.as_vec3().to_array(),
        wet_cells: bricks.wet * CELLS,
        cut_min: cut.min.as_vec3().to_array(),
        active_cells: bricks.active * CELLS,
        cut_max: cut.max.as_vec3().to_array(),
        stride: plan.counts.bricks.slots as u32 * CELLS,
        wall_velocity_min: speed.min.as_vec3().to_array(),
        partial_stride: plan.counts.bricks.laden as u32 * CELLS,
        wall_velocity_max: speed.max.as_vec3().to_array(),
        time_step: step.length as f32,
        velocity_step: (scene.water.gravity * step.kick).as_vec3().to_array(),
        cell_size: flip.cell_size as f32,
        cells: plan.grid_dims,
        inverse_cell_size: (1.0 / flip.cell_size) as f32,
        table_dims: table_dims(stored_cells(plan.grid_dims, scene.periodic)),
        pic_blend: scene.substep_pic_blend(step.length) as f32,
        particle_share: 1.0 / flip.particles_per_cell as f32,
        contact_distance: (CONTACT * flip.particle_spacing()) as f32,
        max_displacement: (CAP * flip.cfl * flip.cell_size) as f32,
        apart: flip.apart() as f32,
        periodic: (0..3)
            .map(|axis| u32::from(scene.periodic[axis]) << axis)
            .sum(),
        apart_from_walls: flip.apart_from_walls() as f32,
        kick: step.kick as f32,
        band: flip.band.unwrap_or(0) as f32,
    }
}

/// Returns the uniform with the boxes of cells where water enters.
pub(super) fn inlets(scene: &FlipScene, step: &Substep) -> Inlets {
    let mut inlets = Inlets::default();
    let all = scene.inlets(step.start, step.length);
    for (k, inlet) in all.into_iter().enumerate() {
        inlets.low[k][..3].copy_from_slice(&inlet.low);
        inlets.high[k][..3].copy_from_slice(&inlet.high);
        inlets.rate[k][0] = inlet.rate as f32;
        inlets.count += 1;
    }
    inlets
}
