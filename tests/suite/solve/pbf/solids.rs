//! PBF with solids at rest and moving walls.

use glam::DVec3;
use swell::{
    domain::{
        boundary::Boundary, bounds::Bounds, mesh::TriangleMesh, motion::Motion,
        particles::Particles, sampling::boundary_samples, signed_distance::SignedDistance,
        solver::Solver,
    },
    scene::{Wall, WaveMaker},
};

use crate::support::{D, box_mesh, context, lattice, run, scene, solver};

fn boundary_of(mesh: &TriangleMesh, domain: &Bounds) -> Boundary {
    let bounds = mesh.bounds().unwrap().grown(4.0 * D);
    Boundary {
        samples: boundary_samples(mesh, domain, D),
        distance: Some(SignedDistance::from_mesh(mesh, &bounds, D).unwrap()),
        ..Boundary::default()
    }
}

#[test]
fn solids_hold_water_off() {
    let context = context();
    let scene = scene([2.0, 2.0, 1.0]);
    let (min, max) = (DVec3::new(1.2, 0.0, 0.3), DVec3::new(1.6, 1.0, 0.7));
    let mesh = box_mesh(Bounds { min, max });
    let boundary = boundary_of(&mesh, &scene.domain);
    assert!(boundary.samples.len() > 150);
    let mut particles = lattice([0.0; 3], [8, 12, 10], [D; 3]);
    for velocity in &mut particles.velocity {
        *velocity = [4.0, 0.0, 0.0];
    }
    let depth = |state: &Particles| {
        let inside = |p: &[f32; 3]| {
            let p = glam::Vec3::from_array(*p).as_dvec3();
            (p - min).min(max - p).min_element()
        };
        state
            .position
            .iter()
            .map(inside)
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let mut with = solver(&context, &scene, &particles, &boundary);
    let mut without = solver(&context, &scene, &particles, &Boundary::default());
    let (mut worst, mut control) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    for _ in 0..40 {
        worst = worst.max(depth(&with.advance().unwrap().0));
        control = control.max(depth(&without.advance().unwrap().0));
    }
    // Trilinear distances cut edges and corners by at most (1 − 1/√3) of a node spacing, minus the
    // contact distance: 0.42 d − 0.25 d.
    assert!(worst < 0.17 * D, "{worst}");
    assert!(control > D, "water came nowhere near: {control}");
}

#[test]
fn nothing_stays_behind_a_piston() {
    let context = context();
    let mut scene = scene([3.0, 1.5, 0.6]);
    scene.wave_makers.push(WaveMaker {
        absorption: None,
        wall: Wall {
            axis: 0,
            is_max: false,
        },
        motion: Motion::ConstantVelocity {
            velocity: 8.0,
            until: None,
        },
    });
    let particles = lattice([0.0; 3], [20, 6, 6], [D; 3]);
    let mut solver = solver(&context, &scene, &particles, &Boundary::default());
    for frame in 1..=12 {
        let (state, report) = solver.advance().unwrap();
        // 8 m/s for 10 ms is 0.8 d, and water ahead of it is faster.
        assert!(report.substeps >= 1);
        let wall = 0.08 * f64::from(frame);
        let least = state
            .position
            .iter()
            .map(|p| f64::from(p[0]))
            .fold(f64::INFINITY, f64::min);
        assert!(least > wall, "frame {frame}: {least} behind {wall}");
    }
    assert!(
        run(&context, &scene, &particles, 12).1.substeps > 1,
        "the piston counts in the CFL number"
    );
}
