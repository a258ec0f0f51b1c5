//! FLIP on the GPU: its passes against naive f64 twins, against analysis, and what must hold in any run.
#![allow(missing_docs, clippy::unwrap_used, reason = "tests")]

mod support;

use glam::{DVec3, Vec3};
use support::{context, jitter, lattice, noise};
use swell::{
    domain::{
        bricks::{Bricks, CELLS},
        particles::Particles,
        signed_distance::SignedDistance,
        solver::{Solver, StepReport},
    },
    gpu::adapter::Context,
    scene::{
        Method, Scene,
        flip::{Flip as Settings, Preconditioner, Pressure, Surface, Transfer},
        plan::{Capacity, Counts},
    },
    solve::{
        boundary::Boundary,
        flip::{Flip, capacity},
        pbf::device_limits,
    },
};

/// Δx.
const DX: f64 = 0.1;

fn settings() -> Settings {
    Settings {
        cell_size: DX,
        particles_per_cell: 8,
        transfer: Transfer::Flip,
        pic_blend: 0.05,
        cfl: 2.0,
        max_substeps: 32,
        surface: Surface::GhostFluid,
        density_correction: true,
        pressure: Pressure {
            preconditioner: Preconditioner::Multigrid,
            tolerance: 1e-5,
            max_iterations: 400,
            residual_limit: 1e-2,
        },
    }
}

/// A box of so many cells.
fn scene(cells: [f64; 3]) -> Scene {
    let mut scene = support::scene(cells.map(|n| n * DX));
    scene.solver.method = Method::Flip;
    scene.solver.flip = Some(settings());
    scene
}

fn flip(scene: &mut Scene) -> &mut Settings {
    scene.solver.flip.as_mut().unwrap()
}

fn solver_with(context: &Context, scene: &Scene, particles: &Particles, boundary: &Boundary, bricks: Capacity) -> Flip {
    let counts = Counts { particles: particles.len(), bricks, ..boundary.counts() };
    let plan = swell::solve::plan(scene, counts, device_limits(context));
    let mut solver = Flip::new(context, scene, plan, boundary, false).unwrap();
    solver.load(0, particles).unwrap();
    solver
}

fn solver(context: &Context, scene: &Scene, particles: &Particles) -> Flip {
    solver_with(context, scene, particles, &Boundary::default(), capacity(scene, particles))
}

fn run(context: &Context, scene: &Scene, particles: &Particles, frames: u32) -> (Particles, StepReport) {
    let mut solver = solver(context, scene, particles);
    let mut last = None;
    for _ in 0..frames {
        last = Some(solver.advance().unwrap());
    }
    last.unwrap()
}

/// A block of water of whole cells, eight particles each.
fn block(corner: [usize; 3], cells: [usize; 3]) -> Particles {
    lattice(corner.map(|c| c as f64 * DX), cells.map(|n| 2 * n), [DX / 2.0; 3])
}

fn position(particles: &Particles, k: usize) -> DVec3 {
    Vec3::from_array(particles.position[k]).as_dvec3()
}

fn velocity(particles: &Particles, k: usize) -> DVec3 {
    Vec3::from_array(particles.velocity[k]).as_dvec3()
}

/// Values of one plane of a field, by cell.
struct Field {
    bricks: Bricks,
    values: Vec<f32>,
    stride: usize,
}

impl Field {
    fn new(solver: &Flip, name: &str, planes: usize) -> Self {
        let stride = solver.plan().counts.bricks.slots * CELLS as usize;
        Self { bricks: solver.bricks().clone(), values: solver.field(name, planes * stride).unwrap(), stride }
    }

    fn at(&self, plane: usize, cell: [usize; 3]) -> f64 {
        let dims = self.bricks.table_dims.map(|n| n as usize);
        let [x, y, z] = cell.map(|c| c / 8);
        let slot = self.bricks.table[(z * dims[1] + y) * dims[0] + x] as usize;
        let local = cell[0] % 8 + 8 * (cell[1] % 8) + 64 * (cell[2] % 8);
        f64::from(self.values[plane * self.stride + 512 * slot + local])
    }
}

/// Water somewhere in a box, with velocities at random.
fn scattered() -> (Scene, Particles) {
    let mut scene = scene([18.0, 17.0, 12.0]);
    scene.shot.frames_per_second = 1e4;
    let mut particles = block([0, 2, 3], [13, 9, 9]);
    jitter(&mut particles, 0.03);
    for (k, v) in particles.velocity.iter_mut().enumerate() {
        *v = std::array::from_fn(|c| noise(7_000_000 + 3 * k as u64 + c as u64) as f32);
    }
    for x in particles.position.iter_mut().flatten() {
        *x = x.max(0.01);
    }
    (scene, particles)
}

/// Hats of all particles at the face of `component` of a cell: Σ w v, Σ w, and how many are in reach.
fn naive_face(particles: &Particles, component: usize, cell: [usize; 3], spoil: f64) -> (f64, f64, f64) {
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

/// Largest difference over its own bound, and how many faces were looked at.
fn particle_to_grid_gap(spoil: f64) -> (f64, u32) {
    let (scene, particles) = scattered();
    let mut solver = solver(&context(), &scene, &particles);
    solver.advance().unwrap();
    let after = Field::new(&solver, "face_velocity", 3);
    let change = Field::new(&solver, "face_change", 3);
    let (mut worst, mut faces) = (0.0f64, 0);
    for component in 0..3 {
        for z in 1..12 {
            for y in 1..12 {
                // One plane of cells in three: the twin is O(n²).
                for x in (1..14).filter(|x| (x + y + z) % 3 == 0) {
                    let cell = [x, y, z];
                    let (momentum, sum, count) = naive_face(&particles, component, cell, spoil);
                    if sum < 0.5 {
                        continue;
                    }
                    let old = after.at(component, cell) - change.at(component, cell);
                    // Places of up to 18 cells round by 18 ε / 2, of which each of the three factors of a weight
                    // has one; speeds differ by up to 2 m/s. The sums of at most 64 terms and the difference of
                    // two velocities round by less.
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
    // Negative control: hats wider by 1 % are seen.
    let (worst, _) = particle_to_grid_gap(1.01);
    assert!(worst > 1.0, "{worst}");
}

/// u = A x about the block's middle, without divergence.
const SLOPES: [[f64; 3]; 3] = [[0.4, -0.7, 0.2], [0.9, -0.3, 0.5], [-0.6, 0.1, -0.1]];

fn linear(x: DVec3) -> DVec3 {
    let row = |k: usize| DVec3::from_array(SLOPES[k]).dot(x - DVec3::splat(0.8));
    DVec3::new(row(0), row(1), row(2))
}

/// A block of water in free space that moves in a linear field, and how well the grid gives it back: the largest
/// gap in velocity, and in slope, m/s and 1/s.
fn linear_gap(transfer: Transfer, spoil: f32) -> (f64, f64) {
    let mut scene = scene([16.0; 3]);
    scene.water.gravity = DVec3::ZERO;
    // So short a frame that nothing moves by more than positions round.
    scene.shot.frames_per_second = 1e6;
    flip(&mut scene).transfer = transfer;
    flip(&mut scene).pic_blend = 1.0;
    flip(&mut scene).density_correction = false;
    let mut particles = block([4, 4, 4], [8, 8, 8]);
    if transfer == Transfer::Apic {
        jitter(&mut particles, 0.02);
        let slopes = SLOPES.as_flattened();
        for (name, slope) in swell::solve::flip::AFFINE.iter().zip(slopes) {
            particles.attributes.insert((*name).to_owned(), vec![*slope as f32; particles.len()]);
        }
    }
    for k in 0..particles.len() {
        particles.velocity[k] = linear(position(&particles, k)).as_vec3().to_array();
    }
    let start = particles.clone();
    particles.velocity[0][0] += spoil;
    let (state, _) = run(&context(), &scene, &particles, 1);
    let (mut gap, mut slope_gap) = (0.0f64, 0.0f64);
    for k in 0..state.len() {
        // The lattice's hats are symmetric about a face only where water is on all sides of it.
        let inner = (position(&start, k) - DVec3::splat(0.8)).abs().max_element() < 0.25;
        if transfer == Transfer::Flip && !inner {
            continue;
        }
        gap = gap.max((velocity(&state, k) - linear(position(&start, k))).abs().max_element());
        for (name, slope) in swell::solve::flip::AFFINE.iter().zip(SLOPES.as_flattened()) {
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
        // Speeds of 1 m/s in sums of up to 64 weights that each round by 3 × 16 ε / 2, of either sign: about 8 × 24 ε.
        // A slope is the difference of two of them over Δx.
        let tolerance = 200.0 * f64::from(f32::EPSILON);
        assert!(gap < tolerance && slope_gap < 2.0 * tolerance / DX, "{gap} {slope_gap}");
    }
    // Negative control: one particle in 4096 off by 1 cm/s is seen.
    assert!(linear_gap(Transfer::Apic, 0.01).0 > 1e-4);
}

/// Area of the unit square of a face on the positive side of n·x = d, by clipping, in the face's plane.
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

/// A half space as a solid.
fn half_space(n: DVec3, d: f64) -> Boundary {
    let (spacing, dims) = (0.05, [50, 50, 50]);
    let origin = DVec3::splat(-0.3);
    let value = |k: usize| {
        let node = DVec3::new((k % 50) as f64, (k / 50 % 50) as f64, (k / 2500) as f64);
        (n.dot(origin + spacing * node) - d) as f32
    };
    let values = (0..125_000).map(value).collect();
    let distance = Some(SignedDistance { origin, spacing, dims, values });
    Boundary { distance, ..Boundary::default() }
}

#[test]
fn face_fractions_of_a_plane_are_exact() {
    let context = context();
    let scene = scene([16.0; 3]);
    for n in [DVec3::new(0.3, 0.8, -0.2), DVec3::new(1.0, 1.0, 0.0), DVec3::new(0.0, 1.0, 0.0)] {
        let n = n.normalize();
        let d = n.dot(DVec3::splat(0.8)) + 0.013;
        let particles = block([6, 10, 6], [4, 4, 4]);
        let mut solver = solver_with(
            &context, &scene, &particles, &half_space(n, d), capacity(&scene, &particles));
        solver.advance().unwrap();
        let open = Field::new(&solver, "face_open", 3);
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
                // What is left of a face below this counts as closed.
                if expected > 2e-3 {
                    worst = worst.max((found - expected).abs());
                    control = control.max((found - clipped_area(corners, n, d / DX + 0.01)).abs());
                }
            }
        }
        println!("{n}: {cut} cut, {worst} {control}");
        // Distances of up to 2 m in f32 over Δx: 2 × 1.2e-7 / 0.1 in cells, eight of them; a line across a face is
        // at most √2 long. The skin's 1e-4 is in both.
        assert!(worst < 8.0 * 2.4e-6 * 1.5, "{worst}");
        // Negative control: a plane aside by a hundredth of a cell.
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
    assert!((position(&state, 0).y - y).abs() < 1e-4, "{:?} {y}", state.position[0]);
}
