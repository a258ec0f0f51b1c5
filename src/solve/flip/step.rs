//! How long a substep is, and what it knows.

use glam::DVec3;

use crate::{
    domain::bricks::{Bricks, CELLS, table_dims},
    scene::{
        Scene,
        plan::{Plan, stored_cells},
    },
    solve::params::FlipParams,
};

/// Particles keep this part of their spacing from walls and solids; at rest the lattice stands at 0.5.
const CONTACT: f64 = 0.1;

/// Displacement cap of a substep over the CFL displacement: what the projection speeds up beyond this is slowed
/// and counted.
const CAP: f64 = 2.0;

/// A piece of a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Substep {
    /// Seconds from the shot's start.
    pub(super) start: f64,
    /// Seconds.
    pub(super) length: f64,
    /// Most cells that a particle moves, as its speed, gravity, walls and solids have it.
    pub(super) displacement: f64,
}

/// How many equal substeps the CFL number asks of the `remaining` seconds from `start` on, where the fastest
/// particle has `speed`, and the first of them.
pub(super) fn next(scene: &Scene, start: f64, remaining: f64, speed: f64) -> (f64, Substep) {
    let flip = scene.solver.flip();
    let speed = speed.max(scene.peak_boundary_speed(start, start + remaining));
    let gravity = scene.water.gravity.length();
    // v t + g t² = cfl Δx.
    let room = flip.cfl * flip.cell_size;
    let longest = 2.0 * room / (speed + (speed * speed + 4.0 * gravity * room).sqrt());
    let wanted = if longest.is_finite() {
        (remaining / longest).ceil().max(1.0)
    } else {
        1.0
    };
    let length = remaining / wanted;
    let displacement = (speed + gravity * length) * length / flip.cell_size;
    (
        wanted,
        Substep {
            start,
            length,
            displacement,
        },
    )
}

/// Faces of the box at a time, relative to the domain's least corner.
fn walls(scene: &Scene, time: f64) -> (DVec3, DVec3) {
    let (mut low, mut high) = (DVec3::ZERO, scene.domain.size());
    for maker in &scene.wave_makers {
        let inward = maker.motion.displacement(time);
        if maker.wall.is_max {
            high[maker.wall.axis] -= inward;
        } else {
            low[maker.wall.axis] += inward;
        }
    }
    (low, high)
}

/// α of a substep, so that a frame takes the same part of the grid's velocity in however many substeps:
/// 1 − (1 − α)^(Δt / frame). At a fixed α halving Δt would double the dissipation. Effects take their part
/// beside it.
fn pic_blend(scene: &Scene, length: f64) -> f64 {
    let effects = scene.effects.flip_plans(0);
    let kept: f64 = effects.iter().map(|effect| 1.0 - effect.blend).product();
    let kept = (1.0 - scene.solver.flip().pic_blend) * kept;
    1.0 - kept.powf(length / scene.shot.frame_seconds())
}

pub(super) fn params(scene: &Scene, plan: &Plan, bricks: &Bricks, step: &Substep) -> FlipParams {
    let flip = scene.solver.flip();
    let (before_low, before_high) = walls(scene, step.start);
    let (low, high) = walls(scene, step.start + step.length);
    let cut = |wall: DVec3| (wall / flip.cell_size).as_vec3().to_array();
    // What takes a wall exactly to where it then stands.
    let speed = |after: DVec3, before: DVec3| ((after - before) / step.length).as_vec3().to_array();
    FlipParams {
        wall_min: low.as_vec3().to_array(),
        particle_count: plan.counts.particles as u32,
        wall_max: high.as_vec3().to_array(),
        wet_cells: bricks.wet * CELLS,
        cut_min: cut(before_low),
        active_cells: bricks.active * CELLS,
        cut_max: cut(before_high),
        stride: plan.counts.bricks.slots as u32 * CELLS,
        wall_velocity_min: speed(low, before_low),
        partial_stride: plan.counts.bricks.wet as u32 * CELLS,
        wall_velocity_max: speed(high, before_high),
        time_step: step.length as f32,
        velocity_step: (scene.water.gravity * step.length).as_vec3().to_array(),
        cell_size: flip.cell_size as f32,
        cells: plan.grid_dims,
        inverse_cell_size: (1.0 / flip.cell_size) as f32,
        table_dims: table_dims(stored_cells(plan.grid_dims)),
        pic_blend: pic_blend(scene, step.length) as f32,
        particle_share: 1.0 / flip.particles_per_cell as f32,
        contact_distance: (CONTACT * flip.particle_spacing()) as f32,
        max_displacement: (CAP * flip.cfl * flip.cell_size) as f32,
        padding: 0.0,
    }
}
