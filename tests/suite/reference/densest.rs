//! The position of the largest density in a report, on the device and in f64.

use glam::{DVec3, Vec3};
use swell::{
    domain::{boundary::Boundary, particles::Particles, solver::Solver},
    reference::{flip::Flip, pbf::Pbf},
};

use crate::support::{D, context, flip, lattice, noise, paper::Paper, scene, solver};

/// Adds 60 particles around `middle`, each coordinate off by at most `within`, m.
fn with_clump(mut water: Particles, middle: DVec3, within: f64) -> Particles {
    for k in 0..60u64 {
        let offset = DVec3::from_array([0, 1, 2].map(|axis| noise(7 * k + axis)));
        water
            .position
            .push((middle + within * offset).as_vec3().to_array());
        water.velocity.push([0.0; 3]);
        water.id.push(water.id.len() as u32);
    }
    water
}

/// A clump is placed in one cell, or in another as the control: the report gives the centre of that
/// cell, in the world coordinates of a scene with an origin of its own.
#[test]
fn the_densest_cell_is_where_a_clump_is() {
    let mut scene = flip::scene([8.0; 3]);
    scene.origin = DVec3::new(1000.0, 0.0, -500.0);
    scene.water.gravity = DVec3::ZERO;
    flip::flip(&mut scene).density_correction = false;
    for cell in [[3.0, 1.0, 5.0], [5.0, 2.0, 2.0]] {
        let middle = (DVec3::from(cell) + 0.5) * flip::DX;
        let water = with_clump(flip::block([0; 3], [8, 4, 8]), middle, 0.1 * flip::DX);
        let mut gpu = flip::solver(&context(), &scene, &water);
        let mut reference = Flip::new(&scene.with_flip().unwrap(), &Boundary::default());
        reference.load(0, &water).unwrap();
        let reports = [gpu.advance().unwrap().1, reference.advance().unwrap().1];
        for report in reports {
            assert!(report.density_error_max > 2.0, "{report:?}");
            let found = DVec3::from(report.densest_at.unwrap());
            let off = (found - scene.origin - middle).length();
            assert!(off < 1e-9, "{found}: {off} from the clump");
        }
    }
}

/// The same with PBF, whose report gives a particle: the densest one by sums over all pairs, which
/// was in the clump or met it.
#[test]
fn the_densest_particle_is_where_a_clump_is() {
    let mut scene = scene([1.0; 3]);
    scene.origin = DVec3::new(1000.0, 0.0, -500.0);
    scene.water.gravity = DVec3::ZERO;
    let paper = Paper::new(D, scene.solver.pbf().unwrap().support_ratio);
    let block = lattice([0.0; 3], [10, 5, 10], [D; 3]);
    for middle in [DVec3::new(0.31, 0.22, 0.64), DVec3::new(0.73, 0.18, 0.27)] {
        let water = with_clump(block.clone(), middle, 0.3 * D);
        let mut gpu = solver(&context(), &scene, &water, &Boundary::default());
        let mut reference = Pbf::new(&scene.with_pbf().unwrap(), &Boundary::default());
        reference.load(0, &water).unwrap();
        for (state, report) in [gpu.advance().unwrap(), reference.advance().unwrap()] {
            let positions: Vec<DVec3> = (state.position.iter())
                .map(|x| Vec3::from(*x).as_dvec3())
                .collect();
            let water = paper.densities(&positions);
            let density = |k: usize| water[k] + paper.of_walls(positions[k], &scene.domain);
            let densest = (0..state.len())
                .max_by(|a, b| density(*a).total_cmp(&density(*b)))
                .unwrap();
            let found = DVec3::from(report.densest_at.unwrap()) - scene.origin;
            let off = (found - positions[densest]).length();
            assert!(off < 1e-3 * D, "{found}: {off} from the densest particle");
        }
    }
}
