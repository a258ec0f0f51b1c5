//! Which bricks a state takes.

use crate::{
    domain::{
        bricks::{Bricks, EDGE, table_dims},
        particles::Particles,
    },
    scene::{
        Scene,
        plan::{Capacity, Counts, DeviceLimits, Plan, layers, stored_cells},
    },
    solve::pressure::LEVELS,
};

/// No flag set, one a brick of the domain.
pub(super) fn no_water(plan: &Plan) -> Vec<bool> {
    let dims = table_dims(stored_cells(plan.grid_dims));
    vec![false; dims.iter().map(|&n| n as usize).product()]
}

pub(super) fn bricks(plan: &Plan, is_wet: &[bool], layers: usize) -> Bricks {
    let reach = (layers as u32).div_ceil(EDGE);
    Bricks::new(stored_cells(plan.grid_dims), is_wet, reach, LEVELS)
}

pub(super) fn capacity_of(bricks: &Bricks) -> Capacity {
    Capacity {
        wet: bricks.wet as usize + 1,
        slots: bricks.slots(),
    }
}

/// Bricks that a state takes in a scene.
pub fn capacity(scene: &Scene, particles: &Particles) -> Capacity {
    let counts = Counts::default();
    let limits = DeviceLimits {
        binding: 0,
        buffer: 0,
        list_budget: 0,
    };
    let plan = Plan::new(scene, counts, limits);
    let mut is_wet = no_water(&plan);
    let dims = table_dims(stored_cells(plan.grid_dims)).map(|n| n as usize);
    let edge = f64::from(EDGE) * scene.solver.flip().cell_size;
    for position in &particles.position {
        let x = glam::Vec3::from_array(*position).as_dvec3() - scene.domain.min;
        let at: [usize; 3] =
            std::array::from_fn(|k| ((x[k] / edge).max(0.0) as usize).min(dims[k] - 1));
        is_wet[(at[2] * dims[1] + at[1]) * dims[0] + at[0]] = true;
    }
    // As deep as layers of a first step reach that is not yet fast.
    capacity_of(&bricks(&plan, &is_wet, layers(1.0)))
}
