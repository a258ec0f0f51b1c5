//! FLIP's passes compared with naive f64 implementations and with analysis.
mod exact;
mod gaps;

use crate::support::flip::*;
use crate::support::{context, jitter, lattice, noise};
use glam::DVec3;
use swell::{
    domain::{bricks::CELLS, motion::Motion, particles::Particles, solver::Solver},
    scene::flip::AFFINE,
    scene::{Scene, Wall, WaveMaker, flip::Transfer},
    solve::flip::{
        buffers::{FACE_CHANGE, FACE_OPEN, FACE_VELOCITY, SOLID_FLUX},
        capacity,
    },
};

/// Water in part of a box, with random velocities.
fn scattered() -> (Scene, Particles) {
    let mut scene = scene([18.0, 17.0, 12.0]);
    scene.shot.frames_per_second = 1e4;
    let mut particles = block([0, 2, 3], [13, 9, 9]);
    jitter(&mut particles, 0.03);
    for (k, v) in particles.velocity.iter_mut().enumerate() {
        *v = std::array::from_fn(|c| noise(7_000_000 + 3 * k as u64 + c as u64) as f32);
    }
    // No particle is beyond a wall; cells exist only inside.
    for position in &mut particles.position {
        for (x, cells) in position.iter_mut().zip([18.0, 17.0, 12.0]) {
            *x = x.clamp(0.01, cells * DX as f32 - 0.01);
        }
    }
    (scene, particles)
}

/// Hat-function sums over all particles at the face of `component` of a cell: Σ w v, Σ w, and the
/// number of particles in reach.
fn naive_face(
    particles: &Particles,
    component: usize,
    cell: [usize; 3],
    spoil: f64,
) -> (f64, f64, f64) {
    let place = |c: usize| cell[c] as f64 + if c == component { 0.0 } else { 0.5 };
    let face = DVec3::new(place(0), place(1), place(2)) * DX;
    let (mut momentum, mut sum, mut count) = (0.0, 0.0, 0.0);
    for k in 0..particles.len() {
        let d = (position(particles, k) - face).abs() / (DX * spoil);
        if d.max_element() < 1.0 {
            let weight = (1.0 - d.x) * (1.0 - d.y) * (1.0 - d.z);
            momentum += weight * velocity(particles, k)[component];
            sum += weight;
            count += 1.0;
        }
    }
    (momentum, sum, count)
}

/// Largest difference relative to its bound, and the number of faces compared.
fn particle_to_grid_gap(spoil: f64) -> (f64, u32) {
    let (scene, particles) = scattered();
    let mut solver = solver(&context(), &scene, &particles);
    solver.advance().unwrap();
    let after = Field::new(&solver, FACE_VELOCITY, 3);
    let change = Field::new(&solver, FACE_CHANGE, 3);
    let (mut worst, mut faces) = (0.0f64, 0);
    for component in 0..3 {
        for z in 1..12 {
            for y in 1..12 {
                // One cell in three: the naive sum is O(n²).
                for x in (1..14).filter(|x| (x + y + z) % 3 == 0) {
                    let cell = [x, y, z];
                    let (momentum, sum, count) = naive_face(&particles, component, cell, spoil);
                    if sum < 0.5 {
                        continue;
                    }
                    let old = after.at(component, cell) - change.at(component, cell);
                    // Positions of up to 18 cells round by 18 ε / 2, once in each of the three
                    // factors of a weight; speeds differ by up to 2 m/s. The sums of at most 64
                    // terms and the difference of two velocities round by less.
                    let epsilon = f64::from(f32::EPSILON);
                    let bound = count * 2.0 * 3.0 * 9.0 * epsilon / sum + 70.0 * epsilon;
                    worst = worst.max((old - momentum / sum).abs() / bound);
                    faces += 1;
                }
            }
        }
    }
    (worst, faces)
}

#[test]
fn particle_to_grid_matches_the_naive_twin() {
    let (worst, faces) = particle_to_grid_gap(1.0);
    println!("{faces} faces, {worst} of the bound");
    assert!(faces > 500 && worst < 1.0, "{worst}");
    // Negative control: hats 1 % wider.
    let (worst, _) = particle_to_grid_gap(1.01);
    assert!(worst > 1.0, "{worst}");
}

/// Mean speed with which a wall at 0.2 m/s pushes into a box `width` cells wide, m/s: the flux over
/// the wall's area.
fn pushed_by(width: f64) -> f64 {
    let mut scene = scene([8.0, 8.0, width]);
    scene.wave_makers.push(WaveMaker {
        absorption: None,
        wall: Wall::NAMED[0].1,
        motion: Motion::ConstantVelocity {
            velocity: 0.2,
            until: None,
        },
    });
    let particles = block([1, 0, 0], [6, 5, 3]);
    let mut solver = solver(&context(), &scene, &particles);
    solver.advance().unwrap();
    let elements = CELLS as usize * (solver.bricks().active as usize + 1);
    let flux: Vec<f32> = solver.field(SOLID_FLUX, elements).unwrap();
    let sum: f64 = flux.into_iter().map(f64::from).sum();
    -sum / (8.0 * width)
}

/// A side wall that cuts cells closes a part of their faces, through which the wave maker does not
/// push.
#[test]
fn a_wave_maker_pushes_the_open_part_of_cells_that_a_side_wall_cuts() {
    for width in [3.0, 3.25, 3.5, 3.9] {
        let speed = pushed_by(width);
        // Sums of a few dozen faces of 0.2 m/s.
        assert!((speed - 0.2).abs() < 1e-5, "{width} cells: {speed} m/s");
    }
}

/// The matrix A of a divergence-free flow u = A x about the middle of the block. FLIP's means at
/// the block's boundary faces are off along their normals, so no velocity component may depend on
/// its own axis there, or the projection would have something to remove.
fn slopes(transfer: Transfer) -> [[f64; 3]; 3] {
    let diagonal = if transfer == Transfer::Apic { 0.1 } else { 0.0 };
    [
        [4.0 * diagonal, -0.7, 0.2],
        [0.9, -3.0 * diagonal, 0.5],
        [-0.6, 0.1, -diagonal],
    ]
}

fn linear(slopes: &[[f64; 3]; 3], x: DVec3) -> DVec3 {
    let row = |k: usize| DVec3::from_array(slopes[k]).dot(x - DVec3::splat(0.8));
    DVec3::new(row(0), row(1), row(2))
}

/// Runs a block of water in free space in a linear velocity field. Returns the largest error in
/// velocity, m/s, and in slope, 1/s, after a transfer to the grid and back.
fn linear_gap(transfer: Transfer, spoil: f32) -> (f64, f64) {
    let mut scene = scene([16.0; 3]);
    scene.water.gravity = DVec3::ZERO;
    // The frame is so short that motion is below the rounding of positions.
    scene.shot.frames_per_second = 1e6;
    flip(&mut scene).transfer = transfer;
    flip(&mut scene).pic_blend = 1.0;
    flip(&mut scene).density_correction = false;
    let slopes = slopes(transfer);
    let mut particles = block([4, 4, 4], [8, 8, 8]);
    if transfer == Transfer::Apic {
        jitter(&mut particles, 0.02);
        for (name, slope) in AFFINE.iter().zip(slopes.as_flattened()) {
            particles
                .attributes
                .insert((*name).to_owned(), vec![*slope as f32; particles.len()]);
        }
    }
    for k in 0..particles.len() {
        particles.velocity[k] = linear(&slopes, position(&particles, k))
            .as_vec3()
            .to_array();
    }
    let start = particles.clone();
    particles.velocity[0][0] += spoil;
    let (state, _) = run(&context(), &scene, &particles, 1);
    let (mut gap, mut slope_gap) = (0.0f64, 0.0f64);
    for k in 0..state.len() {
        // The lattice's hats are symmetric about a face only where water is on all sides of it.
        let inner = (position(&start, k) - DVec3::splat(0.8))
            .abs()
            .max_element()
            < 0.25;
        if transfer == Transfer::Flip && !inner {
            continue;
        }
        gap = gap.max(
            (velocity(&state, k) - linear(&slopes, position(&start, k)))
                .abs()
                .max_element(),
        );
        for (name, slope) in AFFINE.iter().zip(slopes.as_flattened()) {
            if let Some(values) = state.attributes.get(*name) {
                slope_gap = slope_gap.max((f64::from(values[k]) - slope).abs());
            }
        }
    }
    (gap, slope_gap)
}

#[test]
fn a_linear_field_survives_both_transfers() {
    for transfer in [Transfer::Flip, Transfer::Apic] {
        let (gap, slope_gap) = linear_gap(transfer, 0.0);
        println!("{transfer:?} {gap} {slope_gap}");
        // Speeds of 1 m/s in sums of up to 64 weights that each round by 3 × 16 ε / 2, of either
        // sign: about 8 × 24 ε. A slope is the difference of two of them over Δx.
        let tolerance = 200.0 * f64::from(f32::EPSILON);
        assert!(
            gap < tolerance && slope_gap < 2.0 * tolerance / DX,
            "{gap} {slope_gap}"
        );
    }
    // Negative control: one particle of 4096 off by 1 cm/s.
    assert!(linear_gap(Transfer::Apic, 0.01).0 > 1e-4);
}

/// Area of the part of a unit square with n·x > d, by clipping in the face's plane.
fn clipped_area(corners: [DVec3; 4], n: DVec3, d: f64) -> f64 {
    let mut kept: Vec<DVec3> = Vec::new();
    for k in 0..4 {
        let (a, b) = (corners[k], corners[(k + 1) % 4]);
        let (fa, fb) = (n.dot(a) - d, n.dot(b) - d);
        if fa > 0.0 {
            kept.push(a);
        }
        if fa * fb < 0.0 {
            kept.push(a + (b - a) * (fa / (fa - fb)));
        }
    }
    let fan = |k: usize| 0.5 * (kept[k] - kept[0]).cross(kept[k + 1] - kept[0]).length();
    (1..kept.len().saturating_sub(1)).map(fan).sum()
}

#[test]
fn face_fractions_of_a_plane_are_exact() {
    let context = context();
    let scene = scene([16.0; 3]);
    for n in [
        DVec3::new(0.3, 0.8, -0.2),
        DVec3::new(1.0, 1.0, 0.0),
        DVec3::new(0.0, 1.0, 0.0),
    ] {
        let n = n.normalize();
        let d = n.dot(DVec3::splat(0.8)) + 0.013;
        let particles = block([6, 10, 6], [4, 4, 4]);
        let mut solver = solver_with(
            &context,
            &scene,
            &particles,
            &half_space(n, d),
            capacity(&scene.with_flip().unwrap(), &particles),
        );
        solver.advance().unwrap();
        let open = Field::new(&solver, FACE_OPEN, 3);
        let (mut worst, mut control, mut cut) = (0.0f64, 0.0f64, 0);
        for component in 0..3 {
            for k in 0..15 * 15 * 15 {
                let cell = [k % 15, k / 15 % 15, k / 225].map(|c| c + 1 - usize::from(c > 14));
                let at = |b: f64, c: f64| {
                    let mut p = cell.map(|c| c as f64);
                    p[(component + 1) % 3] += b;
                    p[(component + 2) % 3] += c;
                    DVec3::from_array(p)
                };
                let corners = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
                let found = open.at(component, cell);
                let expected = clipped_area(corners, n, d / DX + 1e-4);
                cut += u32::from(expected > 0.0 && expected < 1.0);
                // A face that is open by less than a fiftieth counts as closed.
                if expected < 0.0199 {
                    assert!(found == 0.0, "{found} of {expected}");
                } else if expected > 0.0201 {
                    worst = worst.max((found - expected).abs());
                    control = control.max((found - clipped_area(corners, n, d / DX + 0.01)).abs());
                }
            }
        }
        println!("{n}: {cut} cut, {worst} {control}");
        // Distances of up to 2 m in f32 over Δx: 2 × 1.2e-7 / 0.1 in cells, eight of them; a line
        // across a face is at most √2 long. Both sides include the skin of 1e-4.
        assert!(worst < 8.0 * 2.4e-6 * 1.5, "{worst}");
        // Negative control: a plane shifted by a hundredth of a cell.
        assert!(control > 5e-3, "{control}");
    }
}

#[test]
fn free_fall_is_a_parabola() {
    let context = context();
    let mut scene = scene([20.0, 200.0, 20.0]);
    scene.shot.frames_per_second = 50.0;
    let mut particles = lattice([0.913, 18.477, 1.041], [1; 3], [DX; 3]);
    particles.velocity[0] = [0.5, 2.0, -0.25];
    let mut solver = solver(&context, &scene, &particles);
    let (mut y, mut v, mut state) = (position(&particles, 0).y, 2.0, particles.clone());
    for _ in 0..50 {
        let (next, report) = solver.advance().unwrap();
        state = next;
        let dt = 0.02 / f64::from(report.substeps);
        for _ in 0..report.substeps {
            v -= 9.81 * dt;
            y += v * dt;
        }
    }
    assert!(
        (position(&state, 0).y - y).abs() < 1e-4,
        "{:?} {y}",
        state.position[0]
    );
}
