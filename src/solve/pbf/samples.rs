//! Uploads of solids for passes on particles. Boundary samples count in the density and push back
//! (Akinci 2012).

use glam::DVec3;

use crate::{boundary::upload_distance, plan::Plan};
use swell_domain::{boundary::Boundary, sph::Calibration};
use swell_gpu::program::Program;
use swell_scene::{Scene, moving_solid::SolidSample};

use super::buffers::*;

/// Fills the plan's buffers for solids. Those of moving solids are uploaded again for each substep.
pub(crate) fn upload(
    boundary: &Boundary,
    program: &Program,
    scene: &Scene,
    plan: &Plan,
    calibration: &Calibration,
) {
    if boundary.distance.is_none() && boundary.moving.is_empty() {
        return;
    }
    let samples = scene.solid_samples(boundary, &[], 0.0, 0.0);
    upload_samples(&samples, program, scene, plan, calibration);
    upload_distance(boundary, program, scene);
}

/// Uploads boundary samples with their velocities: behind the particles in `predicted`, sorted by
/// cell, weighted in units of a particle's mass.
pub(crate) fn upload_samples(
    samples: &[SolidSample],
    program: &Program,
    scene: &Scene,
    plan: &Plan,
    calibration: &Calibration,
) {
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
            let [x, y, z] = samples[k].position.as_vec3().to_array();
            [x, y, z, weight(samples[k].area) as f32]
        };
        let places: Vec<[f32; 4]> = order.iter().map(place).collect();
        upload_places(program, plan.page, plan.counts.particles, &places);
    }
    program.upload(BOUNDARY_CELL_START, 0, &start);
    if plan.has_sample_velocities() {
        let velocities: Vec<[f32; 3]> = order
            .iter()
            .map(|&(_, k)| samples[k].velocity.as_vec3().to_array())
            .collect();
        program.upload(
            velocities_behind(plan.counts.solid_floats()),
            0,
            &velocities,
        );
    }
}

/// Uploads entries of [`PREDICTED`] from index `first` on, split at the end of a page.
pub(super) fn upload_places(
    program: &Program,
    page: Option<usize>,
    first: usize,
    places: &[[f32; 4]],
) {
    let page = page.unwrap_or(usize::MAX);
    let (low, high) = places.split_at(page.saturating_sub(first).min(places.len()));
    if !low.is_empty() {
        program.upload(PREDICTED, first, low);
    }
    if !high.is_empty() {
        program.upload(PREDICTED_HIGH, first.max(page) - page, high);
    }
}
