//! Solids on their way to the device.
//!
//! Samples count in the density and push back (Akinci 2012); the distance stops what would tunnel.

use glam::{DVec3, Vec3};

use crate::{
    domain::{boundary::Boundary, signed_distance::SignedDistance, sph::Calibration},
    gpu::program::Program,
    scene::Scene,
};

use super::{
    buffers::{SOLID_DISTANCE, SOLID_GRID},
    flip::buffers::SOLID_GRIDS,
    params::{SolidGrid, SolidGrids},
    pbf::buffers::{BOUNDARY_CELL_START, PREDICTED},
    plan::{Counts, Plan},
};

impl Boundary {
    /// Samples and grid nodes; no particles.
    pub fn counts(&self) -> Counts {
        Counts {
            particles: 0,
            boundary_samples: self.samples.len(),
            solid_grid: self.distance.as_ref().map_or([0; 3], |grid| grid.dims),
            moving_nodes: self.moving.iter().map(|grid| grid.values.len()).sum(),
            ..Counts::default()
        }
    }

    /// Fills the buffers that the plan has for solids: samples behind both halves of `predicted`, sorted by
    /// cell; their weights are particles' worth of mass.
    pub(super) fn upload(
        &self,
        program: &Program,
        scene: &Scene,
        plan: &Plan,
        calibration: &Calibration,
    ) {
        if self.distance.is_none() {
            return;
        }
        let origin = scene.domain.min;
        let dims = plan.grid_dims.map(|n| n as usize);
        let spacing = scene.particle_spacing();
        let support = calibration.support_radius;
        let edges = scene.period().edges(plan.grid_dims, support);
        let cell = |p: DVec3| {
            let c = ((p - origin) / edges)
                .floor()
                .max(DVec3::ZERO)
                .as_uvec3()
                .to_array();
            let c: [usize; 3] = std::array::from_fn(|k| (c[k] as usize).min(dims[k] - 1));
            (c[2] * dims[1] + c[1]) * dims[0] + c[0]
        };
        let mut order: Vec<(usize, usize)> = self
            .samples
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
        let packed: Vec<[f32; 4]> = order
            .iter()
            .map(|&(_, k)| {
                let sample = &self.samples[k];
                let x = (sample.position - origin).as_vec3();
                let weight = calibration.sample_weight * sample.area / (spacing * spacing);
                [x.x, x.y, x.z, weight as f32]
            })
            .collect();
        program.upload(PREDICTED, 2 * plan.counts.particles, &packed);
        program.upload(BOUNDARY_CELL_START, 0, &start);
        self.upload_distance(program, scene);
    }

    /// Fills the signed distance that the plan has for solids.
    pub(super) fn upload_distance(&self, program: &Program, scene: &Scene) {
        let mut first = 0;
        for grid in self.grids() {
            program.upload(SOLID_DISTANCE, first, &grid.values);
            first += grid.values.len();
        }
        if let (Some(grid), []) = (&self.distance, &self.moving[..]) {
            program.upload(SOLID_GRID, 0, &[solid_grid(grid, scene.domain.min, 0)]);
        }
    }

    /// In the order in which their nodes stand on the device.
    fn grids(&self) -> impl Iterator<Item = &SignedDistance> {
        self.distance.iter().chain(&self.moving)
    }
}

/// Where solids stand that move; nothing in a scene without them.
pub(super) struct Movers {
    at_start: SolidGrids,
    /// Before the first that moves.
    statics: usize,
}

impl Movers {
    pub(super) fn of(boundary: &Boundary, scene: &Scene) -> Option<Self> {
        let mut at_start = SolidGrids::default();
        let mut first = 0;
        for (slot, grid) in at_start.grids.iter_mut().zip(boundary.grids()) {
            *slot = solid_grid(grid, scene.domain.min, first);
            first += grid.values.len() as u32;
            at_start.count += 1;
        }
        (!boundary.moving.is_empty()).then_some(Self {
            at_start,
            statics: boundary.grids().count() - boundary.moving.len(),
        })
    }

    /// As they stand at `start`, with the velocities that take them to where they then stand `length` seconds
    /// later.
    pub(super) fn upload(&self, program: &Program, scene: &Scene, start: f64, length: f64) {
        let mut grids = self.at_start;
        for (solid, k) in scene.moving_solids.iter().zip(self.statics..) {
            let before = solid.displacement(start);
            let velocity = (solid.displacement(start + length) - before) / length;
            let origin = Vec3::from_array(grids.grids[k].origin).as_dvec3() + before;
            grids.grids[k].origin = origin.as_vec3().to_array();
            grids.velocities[k] = velocity.as_vec3().extend(0.0).to_array();
            grids.fastest = grids.fastest.max(velocity.length() as f32);
        }
        program.upload(SOLID_GRIDS, 0, &[grids]);
    }
}

fn solid_grid(grid: &SignedDistance, origin: DVec3, first: u32) -> SolidGrid {
    SolidGrid {
        origin: (grid.origin - origin).as_vec3().to_array(),
        spacing: grid.spacing as f32,
        dims: grid.dims.map(|n| n as u32),
        first,
    }
}
