//! Solids on their way to the device.
//!
//! Samples count in the density and push back (Akinci 2012); the distance stops what would tunnel.

use glam::{DQuat, DVec3};

use swell_domain::{
    boundary::Boundary, pose::Passage, signed_distance::SignedDistance, sph::Calibration,
};
use swell_gpu::program::Program;
use swell_scene::Scene;

use super::{
    buffers::{SOLID_DISTANCE, SOLID_GRID},
    flip::buffers::SOLID_GRIDS,
    params::{SolidGrid, SolidGrids},
    pbf::{
        buffers::{BOUNDARY_CELL_START, SAMPLE_VELOCITY},
        upload_places,
    },
    plan::{Counts, Plan},
};

impl Counts {
    /// Samples and grid nodes of solids; no particles.
    pub fn of_solids(boundary: &Boundary) -> Self {
        Self {
            particles: 0,
            boundary_samples: boundary.sample_count(),
            solid_grid: boundary.distance.as_ref().map_or([0; 3], |grid| grid.dims),
            moving_nodes: boundary.moving.iter().map(|grid| grid.values.len()).sum(),
            ..Self::default()
        }
    }
}

/// Fills the buffers that the plan has for solids. Those of solids that move are filled anew for each substep.
pub(super) fn upload(
    boundary: &Boundary,
    program: &Program,
    scene: &Scene,
    plan: &Plan,
    calibration: &Calibration,
) {
    if boundary.distance.is_none() && boundary.moving.is_empty() {
        return;
    }
    upload_samples(boundary, program, scene, plan, calibration, (0.0, 0.0));
    upload_distance(boundary, program, scene);
}

/// Fills in the samples as they stand at a time, moving as what took them there within so many seconds: behind the
/// particles of `predicted`, sorted by cell; their weights are particles' worth of mass.
pub(super) fn upload_samples(
    boundary: &Boundary,
    program: &Program,
    scene: &Scene,
    plan: &Plan,
    calibration: &Calibration,
    (time, step): (f64, f64),
) {
    let samples = scene.solid_samples(boundary, time, step);
    let dims = plan.grid_dims.map(|n| n as usize);
    let spacing = scene.particle_spacing();
    let support = calibration.support_radius;
    let edges = scene.period().edges(plan.grid_dims, support);
    let cell = |p: DVec3| {
        let c = (p / edges).floor().max(DVec3::ZERO).as_uvec3().to_array();
        let c: [usize; 3] = std::array::from_fn(|k| (c[k] as usize).min(dims[k] - 1));
        (c[2] * dims[1] + c[1]) * dims[0] + c[0]
    };
    let mut order: Vec<(usize, usize)> = samples
        .iter()
        .enumerate()
        .map(|(k, sample)| (cell(sample.position), k))
        .collect();
    order.sort_unstable();
    let mut start = vec![0u32; dims.iter().product::<usize>() + 1];
    for &(cell, _) in &order {
        start[cell + 1] += 1;
    }
    for k in 1..start.len() {
        start[k] += start[k - 1];
    }
    if !order.is_empty() {
        let weight = |area: f64| calibration.sample_weight * area / (spacing * spacing);
        let place = |&(_, k): &(usize, usize)| {
            let [x, y, z] = three(samples[k].position);
            [x, y, z, weight(samples[k].area) as f32]
        };
        let places: Vec<[f32; 4]> = order.iter().map(place).collect();
        upload_places(program, plan.page, plan.counts.particles, &places);
    }
    program.upload(BOUNDARY_CELL_START, 0, &start);
    if plan.has_sample_velocities() {
        let velocities: Vec<[f32; 3]> = order
            .iter()
            .map(|&(_, k)| three(samples[k].velocity))
            .collect();
        program.upload(SAMPLE_VELOCITY, 0, &velocities);
    }
}

/// Fills the signed distance that the plan has for solids.
pub(super) fn upload_distance(boundary: &Boundary, program: &Program, scene: &Scene) {
    let mut first = 0;
    for grid in boundary.grids() {
        program.upload(SOLID_DISTANCE, first, &grid.values);
        first += grid.values.len();
    }
    if let (Some(grid), []) = (&boundary.distance, &boundary.moving[..]) {
        program.upload(SOLID_GRID, 0, &[solid_grid(grid, scene.domain.min, 0)]);
    }
}

/// Where solids stand that move; nothing in a scene without them.
pub(super) struct Movers {
    /// All but where they stand.
    resting: SolidGrids,
    /// First nodes, metres, in the scene's coordinates: where each stood at the start.
    origins: Vec<DVec3>,
    /// From a point of a solid that turns to its grid's farthest corner.
    reaches: Vec<f64>,
    /// Before the first that moves.
    statics: usize,
}

impl Movers {
    pub(super) fn of(boundary: &Boundary, scene: &Scene) -> Option<Self> {
        let mut resting = SolidGrids::default();
        let mut first = 0;
        for (slot, grid) in resting.grids.iter_mut().zip(boundary.grids()) {
            *slot = solid_grid(grid, grid.origin, first);
            first += grid.values.len() as u32;
            resting.count += 1;
        }
        let statics = boundary.grids().count() - boundary.moving.len();
        let solids = scene.moving_solids.iter().zip(&boundary.moving);
        (!boundary.moving.is_empty()).then(|| Self {
            resting,
            origins: boundary.grids().map(|grid| grid.origin).collect(),
            reaches: solids
                .map(|(solid, grid)| grid.reach(solid.pose(0.0).rest))
                .collect(),
            statics,
        })
    }

    /// As they stand at `start`, with the velocities that take them to where they then stand `length` seconds
    /// later.
    pub(super) fn upload(&self, program: &Program, scene: &Scene, start: f64, length: f64) {
        let mut grids = self.resting;
        grids.length = length as f32;
        let identity = DQuat::IDENTITY.as_quat().to_array();
        for (k, origin) in self.origins.iter().enumerate() {
            grids.centres[k] = four(*origin - scene.domain.min);
            (grids.backs[k], grids.end_backs[k]) = (identity, identity);
        }
        let solids = scene.moving_solids.iter().zip(&self.reaches);
        for ((solid, reach), k) in solids.zip(self.statics..) {
            let Passage {
                start: pose,
                end_turn,
                velocity,
                spin,
                ..
            } = solid.passage(start, length);
            // The point of rest of a solid that does not turn may be any: its first node rounds least.
            let rest = match solid.turns() {
                true => pose.rest,
                false => self.origins[k],
            };
            grids.grids[k].origin = (self.origins[k] - rest).as_vec3().to_array();
            grids.centres[k] = four(pose.place(rest) - scene.domain.min);
            grids.velocities[k] = four(velocity);
            grids.spins[k] = four(spin);
            grids.backs[k] = pose.turn.conjugate().as_quat().to_array();
            grids.end_backs[k] = end_turn.conjugate().as_quat().to_array();
            let speed = velocity.length() + spin.length() * reach;
            grids.fastest = grids.fastest.max(speed as f32);
        }
        program.upload(SOLID_GRIDS, 0, &[grids]);
    }
}

fn three(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

fn four(v: DVec3) -> [f32; 4] {
    v.as_vec3().extend(0.0).to_array()
}

fn solid_grid(grid: &SignedDistance, origin: DVec3, first: u32) -> SolidGrid {
    SolidGrid {
        origin: (grid.origin - origin).as_vec3().to_array(),
        spacing: grid.spacing as f32,
        dims: grid.dims.map(|n| n as u32),
        first,
    }
}
