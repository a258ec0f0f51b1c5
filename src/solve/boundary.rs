//! Solids as the solver meets them: samples with a weight in the density, and a signed distance.
//!
//! Samples count in the density and push back (Akinci 2012); the distance stops what would tunnel.

use glam::DVec3;

use crate::{
    domain::{sampling::BoundarySample, signed_distance::SignedDistance, sph::Calibration},
    gpu::program::Program,
    scene::{
        Scene,
        plan::{Counts, Plan},
    },
};

use super::params::SolidGrid;

/// All static solids of a scene.
#[derive(Clone, Debug, Default)]
pub struct Boundary {
    /// Over all surfaces, world space.
    pub samples: Vec<BoundarySample>,
    /// Of their union; `None` where the scene has no solid.
    pub distance: Option<SignedDistance>,
}

impl Boundary {
    /// Samples and grid nodes; no particles.
    pub fn counts(&self) -> Counts {
        Counts {
            particles: 0,
            boundary_samples: self.samples.len(),
            solid_grid: self.distance.as_ref().map_or([0; 3], |grid| grid.dims),
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
        let cell = |p: DVec3| {
            let c = ((p - origin) / calibration.support_radius)
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
        program.upload("predicted", 32 * plan.counts.particles as u64, &packed);
        program.upload("boundary_cell_start", 0, &start);
        self.upload_distance(program, scene);
    }

    /// Fills the signed distance that the plan has for solids.
    pub(super) fn upload_distance(&self, program: &Program, scene: &Scene) {
        let Some(grid) = &self.distance else { return };
        let origin = scene.domain.min;
        program.upload("solid_distance", 0, &grid.values);
        let uniform = SolidGrid {
            origin: (grid.origin - origin).as_vec3().to_array(),
            spacing: grid.spacing as f32,
            dims: grid.dims.map(|n| n as u32),
            padding: 0,
        };
        program.upload("solid_grid", 0, &[uniform]);
    }
}
