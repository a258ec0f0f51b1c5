//! Both solvers compared with results that need no solver: ballistics, conservation, decay of
//! vortices.

use std::f64::consts::PI;

use crate::support::flip::*;
use crate::support::{self, D, context, jitter, lattice, pbf_of};
use glam::DVec3;
use swell::{
    domain::{particles::Particles, solver::Solver},
    gpu::adapter::{Context, InjectedFault},
    scene::{Iteration, Method, Scene, Stop, flip::Transfer},
    solve::flip::capacity,
};

/// Mean of `f` over all particles.
fn mean(state: &Particles, f: impl Fn(usize) -> DVec3) -> DVec3 {
    (0..state.len()).map(f).sum::<DVec3>() / state.len() as f64
}

/// State after `frames` frames of the scene's solver.
fn advanced(context: &Context, scene: &Scene, particles: &Particles, frames: u32) -> Particles {
    match scene.solver.method() {
        Method::Pbf => support::run(context, scene, particles, frames).0,
        Method::Flip => run(context, scene, particles, frames).0,
    }
}

/// A box of water in free flight, for each solver and transfer.
fn throws() -> Vec<(&'static str, Scene)> {
    let mut pbf = support::scene([4.0, 6.0, 4.0]);
    pbf_of(&mut pbf).cfl = 2.0;
    let of_flip = scene([40.0, 60.0, 40.0]);
    let mut apic = of_flip.clone();
    flip(&mut apic).transfer = Transfer::Apic;
    vec![("pbf", pbf), ("flip", of_flip), ("apic", apic)]
}

/// Position and velocity of a particle after n steps of symplectic Euler, v += g Δt and then x += v
/// Δt: x_n = x_0 + n Δt v_0 + g Δt² n (n + 1) / 2, the parabola plus a first-order term of half a
/// step.
fn flown(x: DVec3, v: DVec3, steps: f64, dt: f64) -> (DVec3, DVec3) {
    let g = DVec3::new(0.0, -9.81, 0.0);
    (
        x + steps * dt * v + g * dt * dt * steps * (steps + 1.0) / 2.0,
        v + steps * dt * g,
    )
}

/// Drops under a ceiling and in its corners: nothing holds them there.
#[test]
fn drops_fall_from_a_ceiling_as_from_anywhere() {
    let steps = 20;
    let mut projected = support::scene([4.0, 6.0, 4.0]);
    pbf_of(&mut projected).grid_projection = true;
    // Above the water of the other tests and far from each other. Particles closer to the ceiling
    // would be pushed by it.
    let places: [[f32; 3]; 4] = [
        [1.55, 5.97, 1.62],
        [0.04, 5.93, 0.05],
        [3.96, 5.95, 2.5],
        [2.5, 5.88, 3.93],
    ];
    let drops = Particles {
        position: places.to_vec(),
        velocity: vec![[0.0; 3]; 4],
        id: vec![0, 1, 2, 3],
        ..Particles::default()
    };
    let fallen = |context: &Context, scene: &Scene| {
        let state = advanced(context, scene, &drops, steps);
        let off = |k: usize| {
            let start = position(&drops, k);
            (position(&state, k) - flown(start, DVec3::ZERO, f64::from(steps), 0.01).0).length()
        };
        (0..4).map(off).fold(0.0, f64::max)
    };
    let context = context();
    let scenes = throws()
        .into_iter()
        .chain([("projected", projected.clone())]);
    for (name, scene) in scenes {
        // A position of 6 m is rounded in each step.
        let off = fallen(&context, &scene);
        assert!(off < 6.0 * 6e-8 * 2.0 * f64::from(steps), "{name}: {off} m");
    }
    // Negative control: the change on the faces around a drop, one of which belongs to the fixed
    // ceiling.
    let mut spoiled = context;
    spoiled.spoil = Some(InjectedFault {
        pass: "flip/grid_to_particle",
        from: "let falling = sorted_velocity[k] + params.velocity_step[axis];",
        to: "let falling = sorted_velocity[k] + value_at(faces.change, a, b, c);",
    });
    for scene in [&throws()[1].1, &projected] {
        let off = fallen(&spoiled, scene);
        assert!(off > 0.1, "{off} m");
    }
}

/// The same beside a solid: the velocity loses its component into the floor; otherwise gravity
/// would add to it forever.
#[test]
fn a_drop_beside_a_solid_lies_still_on_the_floor() {
    let mut scene = scene([16.0; 3]);
    scene.shot.frames_per_second = 50.0;
    let wall = half_space(DVec3::X, 0.4);
    let drop = lattice([0.4, 0.3, 0.8], [1; 3], [D / 2.0; 3]);
    let falls = |context: &Context| {
        let most = capacity(&scene.with_flip().unwrap(), &drop);
        let mut solver = solver_with(context, &scene, &drop, &wall, most);
        let states = (0..40).map(|_| solver.advance().unwrap().0);
        velocity(&states.last().unwrap(), 0).length()
    };
    let context = context();
    // What gravity adds in one step.
    let speed = falls(&context);
    assert!(speed < 9.81 / 50.0, "{speed} m/s");
    // Negative control: the walls are ignored after the rounds that keep a particle out of both.
    let mut spoiled = context;
    spoiled.spoil = Some(InjectedFault {
        pass: "flip/advect",
        from: "at_walls(at_walls(v, free), x)",
        to: "at_walls(v, x)",
    });
    let speed = falls(&spoiled);
    assert!(speed > 4.0, "{speed} m/s");
}

/// Water that nothing touches falls as a whole, every particle along its own parabola.
#[test]
fn free_flight_is_a_parabola() {
    let context = context();
    let (steps, dt) = (40u32, 0.01);
    let start = DVec3::new(0.5, 2.0, -0.25);
    for (name, scene) in throws() {
        let mut particles = lattice([1.5, 3.5, 1.5], [10, 10, 10], [D / 2.0; 3]);
        if scene.solver.method() == Method::Pbf {
            particles = lattice([1.5, 3.5, 1.5], [5, 5, 5], [D; 3]);
        }
        particles.velocity.fill(start.as_vec3().to_array());
        let state = advanced(&context, &scene, &particles, steps);
        let (mut off, mut off_speed, mut half_a_step) = (0.0f64, 0.0f64, f64::MAX);
        for k in 0..state.len() {
            let (x, v) = flown(position(&particles, k), start, f64::from(steps), dt);
            off = off.max((position(&state, k) - x).length());
            off_speed = off_speed.max((velocity(&state, k) - v).length());
            // Explicit Euler moves before it accelerates: n (n − 1) / 2.
            let other = x + DVec3::new(0.0, 9.81 * dt * dt * f64::from(steps), 0.0);
            half_a_step = half_a_step.min((position(&state, k) - other).length());
        }
        println!("{name}: {off:.2e} m, {off_speed:.2e} m/s off");
        // At speeds near 4 m/s each step sums and, on grids, averages eight values twice; each
        // operation rounds by at most ε/2 of 4 m/s. The errors of 40 steps add up. Errors of
        // positions are sums of those of speeds and of their own rounding near 6 m.
        let epsilon = f64::from(f32::EPSILON) / 2.0;
        let speed_bound = 40.0 * 20.0 * epsilon * 4.0;
        let bound = 40.0 * (epsilon * 6.0 + dt * speed_bound);
        assert!(off_speed < speed_bound, "{name}: {off_speed} {speed_bound}");
        assert!(off < bound, "{name}: {off} {bound}");
        // Negative control: explicit Euler's parabola is 3.9 cm away.
        assert!(half_a_step > 100.0 * bound, "{name}: {half_a_step}");
    }
}

/// Runs a blob of water, too dense and jittered, without gravity. Returns how far its mean velocity
/// departs from the initial one and the rms velocity about the mean, both in m/s. Asserts that no
/// particle is lost or duplicated.
fn drift(context: &Context, scene: &Scene, particles: &Particles, frames: u32) -> (f64, f64) {
    let momentum = |state: &Particles| mean(state, |k| velocity(state, k));
    let state = advanced(context, scene, particles, frames);
    assert_eq!(state.id, particles.id, "each particle once, none lost");
    let moved = mean(&state, |k| position(&state, k)) - mean(particles, |k| position(particles, k));
    let rms = (0..state.len())
        .map(|k| (velocity(&state, k) - momentum(&state)).length_squared())
        .sum::<f64>()
        / state.len() as f64;
    assert!(moved.length() > 0.05, "{moved}");
    (
        (momentum(&state) - momentum(particles)).length(),
        rms.sqrt(),
    )
}

/// PBF's corrections are pairwise and opposite where all particles move at once: m Σ v is
/// conserved. The second colour of red/black sees the first at its new positions, and a Chebyshev
/// semi-iteration that restarts does so for one particle of a pair; there the sum changes by a part
/// of the corrections.
#[test]
fn pbf_keeps_mass_and_momentum() {
    let context = context();
    let mut scene = support::scene([4.0; 3]);
    scene.water.gravity = DVec3::ZERO;
    let mut particles = lattice([1.0; 3], [10, 10, 10], [0.97 * D; 3]);
    jitter(&mut particles, 0.01);
    particles.velocity.fill([0.5, 0.25, -0.25]);
    let mut drifts = Vec::new();
    for iteration in [Iteration::Jacobi, Iteration::RedBlack, Iteration::Chebyshev] {
        let pbf = pbf_of(&mut scene);
        pbf.iteration = iteration;
        pbf.stop = Stop::Iterations(4);
        // Jacobi at ω = 1 overshoots, and corrections that are clamped are no longer pairwise.
        pbf.relaxation = 0.5;
        let (drift, rms) = drift(&context, &scene, &particles, 20);
        println!("{iteration:?}: {drift:.2e} m/s of {rms:.2e} m/s that the blob expands with");
        drifts.push(drift);
    }
    // Each of 80 corrections rounds a position near 2 m by at most ε/2, which over 10 ms is a
    // speed; roundings are independent, over 1000 particles and 80 corrections.
    let rounding = f64::from(f32::EPSILON) / 2.0 * 2.0 / 0.01;
    let bound = 3.0 * rounding * (80.0f64).sqrt() / (1000.0f64).sqrt();
    assert!(drifts[0] < bound, "{drifts:?} {bound}");
    // Negative control: with one colour after the other, corrections are not pairwise.
    assert!(drifts[1] > 10.0 * bound, "{drifts:?} {bound}");
}

/// A block that rotates and falls in free space: the error of its mean velocity after 0.4 s, m/s,
/// and its angular momentum relative to the initial one.
fn free_block(transfer: Transfer, pic_blend: f64) -> (DVec3, f64) {
    let mut scene = scene([24.0, 32.0, 24.0]);
    scene.shot.frames_per_second = 50.0;
    flip(&mut scene).transfer = transfer;
    flip(&mut scene).pic_blend = pic_blend;
    let mut particles = block([8, 18, 8], [8, 8, 8]);
    let middle = DVec3::new(1.2, 2.2, 1.2);
    let spin = DVec3::new(0.0, 0.0, 1.0);
    for k in 0..particles.len() {
        let v = spin.cross(position(&particles, k) - middle) + DVec3::new(0.5, 0.0, 0.0);
        particles.velocity[k] = v.as_vec3().to_array();
    }
    affine(&mut particles, |_| [[0.0, -1.0], [1.0, 0.0]]);
    let linear = |state: &Particles| mean(state, |k| velocity(state, k));
    let angular = spin_of(&particles);
    let state = run(&context(), &scene, &particles, 20).0;
    assert_eq!(state.id, particles.id, "each particle once, none lost");
    let expected = DVec3::new(0.5, -9.81 * 0.4, 0.0);
    (linear(&state) - expected, spin_of(&state) / angular)
}

/// Sets the affine attributes of particles to the gradient of a planar flow, ∂(u, v)/∂(x, y).
fn affine(particles: &mut Particles, rows: impl Fn(DVec3) -> [[f64; 2]; 2]) {
    for k in 0..particles.len() {
        let [[xx, xy], [yx, yy]] = rows(position(particles, k));
        let named = [("xx", xx), ("xy", xy), ("yx", yx), ("yy", yy)];
        for (name, value) in named {
            let attribute = particles.attributes.entry(format!("affine_{name}"));
            attribute.or_default().push(value as f32);
        }
    }
}

/// Mean angular momentum per unit mass about the vertical axis through the centre of mass, m²/s.
fn spin_of(state: &Particles) -> f64 {
    let center = mean(state, |k| position(state, k));
    mean(state, |k| {
        (position(state, k) - center).cross(velocity(state, k))
    })
    .z
}

#[test]
fn flip_keeps_mass_and_momentum() {
    for transfer in [Transfer::Flip, Transfer::Apic] {
        let (linear, angular) = free_block(transfer, 0.05);
        println!("{transfer:?}: {linear} m/s off, {angular} of the spin");
        // The pressure of rotating water is not zero, and it acts on faces of unequal mass: an
        // error of one hundredth of 3.9 m/s is allowed.
        assert!(linear.length() < 0.04, "{linear}");
        assert!((0.9..1.05).contains(&angular), "{angular}");
    }
    // Negative control: pure PIC dissipates the rotation.
    let (_, angular) = free_block(Transfer::Flip, 1.0);
    println!("PIC: {angular} of the spin");
    assert!(angular < 0.9, "{angular}");
}

/// Transfer schemes: name, transfer and PIC blend.
const TRANSFERS: [(&str, Transfer, f64); 4] = [
    ("PIC", Transfer::Flip, 1.0),
    ("FLIP", Transfer::Flip, 0.0),
    ("FLIP 0.05", Transfer::Flip, 0.05),
    ("APIC", Transfer::Apic, 0.0),
];

/// Number of steps of the vortex tests.
const STEPS: u32 = 20;

/// Runs a full box of `cells` × `cells` × 4 cells without gravity, with a flow in its plane: `flow`
/// gives u, v and their gradient at x, y. Returns the first state and the one [`STEPS`] steps
/// later.
fn planar(
    context: &Context,
    cells: usize,
    (transfer, pic_blend): (Transfer, f64),
    flow: impl Fn(DVec3) -> ([f64; 2], [[f64; 2]; 2]),
) -> [Particles; 2] {
    let mut scene = scene([cells as f64, cells as f64, 4.0]);
    scene.water.gravity = DVec3::ZERO;
    flip(&mut scene).transfer = transfer;
    flip(&mut scene).pic_blend = pic_blend;
    let mut particles = block([0; 3], [cells, cells, 4]);
    for k in 0..particles.len() {
        let ([u, v], _) = flow(position(&particles, k));
        particles.velocity[k] = [u as f32, v as f32, 0.0];
    }
    if transfer == Transfer::Apic {
        affine(&mut particles, |x| flow(x).1);
    }
    let mut solver = solver(context, &scene, &particles);
    let first = solver.advance().unwrap().0;
    let mut last = first.clone();
    for _ in 0..STEPS {
        last = solver.advance().unwrap().0;
    }
    [first, last]
}

fn energy(state: &Particles) -> f64 {
    mean(state, |k| velocity(state, k) * velocity(state, k)).element_sum() / 2.0
}

/// −ln of the fraction of a Taylor–Green vortex's energy that is left after [`STEPS`] steps.
fn taylor_green(context: &Context, cells: usize, how: (Transfer, f64)) -> f64 {
    let k = PI / (cells as f64 * DX);
    let flow = |x: DVec3| {
        let ([sx, cx], [sy, cy]) = (
            [(k * x.x).sin(), (k * x.x).cos()],
            [(k * x.y).sin(), (k * x.y).cos()],
        );
        (
            [0.5 * sx * cy, -0.5 * cx * sy],
            [
                [0.5 * k * cx * cy, -0.5 * k * sx * sy],
                [0.5 * k * sx * sy, -0.5 * k * cx * cy],
            ],
        )
    };
    let [first, last] = planar(context, cells, how, flow);
    -(energy(&last) / energy(&first)).ln()
}

/// sin(kx) cos(ky) is a steady flow of an ideal fluid, so any decay is numerical. Hat functions to
/// the grid and back take sinc²(k Δx / 2) per axis each time: PIC's amplitude falls by sinc⁸ per
/// step, which is the decay 2 ν k² Δt at ν = Δx² / (6 Δt), the numerical viscosity of METHODS and
/// of Zhu and Bridson.
#[test]
fn taylor_green_decays_as_the_transfer_has_it() {
    let context = context();
    for cells in [16usize, 32] {
        let half = PI / cells as f64 / 2.0;
        let expected = -f64::from(STEPS) * 16.0 * (half.sin() / half).ln();
        let viscous = f64::from(STEPS) * 4.0 * (2.0 * half).powi(2) / 6.0;
        assert!((expected / viscous - 1.0).abs() < 0.01);
        let [pic, flip, blended, apic] = TRANSFERS.map(|(name, transfer, blend)| {
            let loss = taylor_green(&context, cells, (transfer, blend));
            println!("{cells} cells, {name}: −ln of the energy {loss:.5}");
            loss
        });
        println!("expected of PIC {expected:.5}");
        // The row of cells at a wall averages over one side, with an error as large as the
        // smoothing itself: two rows of `cells` for each axis.
        let walls = 2.0 / cells as f64;
        assert!((pic / expected - 1.0).abs() < walls, "{pic} {expected}");
        // A fraction α of the velocity is PIC's. α also damps the part of the rest that the grid
        // does not resolve: the same amount again is allowed.
        let part =
            -2.0 * f64::from(STEPS) * (1.0 - 0.05 * (1.0 - (half.sin() / half).powi(8))).ln();
        assert!((0.9..2.0).contains(&(blended / part)), "{blended} {part}");
        // Affine rows carry what PIC's mean loses to second order in θ = k Δx, and FLIP carries the
        // velocity itself: the remaining loss is of the next order, θ² of PIC's.
        let next = (2.0 * half).powi(2) * pic;
        assert!(flip < next && apic < next, "{flip} {apic} {next}");
        // Negative control: FLIP and APIC do not meet PIC's bound.
        assert!((apic / expected - 1.0).abs() > walls);
    }
}

/// A Rankine vortex: a core of 6 cells that rotates rigidly, inside a free vortex.
#[test]
fn a_rankine_vortex_keeps_its_spin_but_with_pic() {
    let context = context();
    let (cells, core) = (32usize, 0.6);
    let middle = cells as f64 * DX / 2.0;
    let circulation = 1.0;
    let flow = |x: DVec3| {
        let (x, y) = (x.x - middle, x.y - middle);
        let square = (x * x + y * y).max(core * core);
        let is_core = x * x + y * y < core * core;
        let rate = circulation / (2.0 * PI * square);
        let bend = if is_core { 0.0 } else { 2.0 * rate / square };
        (
            [-y * rate, x * rate],
            [
                [bend * x * y, -rate + bend * y * y],
                [rate - bend * x * x, -bend * x * y],
            ],
        )
    };
    let kept = TRANSFERS.map(|(name, transfer, blend)| {
        let [first, last] = planar(&context, cells, (transfer, blend), flow);
        let spin = spin_of(&last) / spin_of(&first);
        let energy = energy(&last) / energy(&first);
        println!("{name}: {spin:.5} of the spin, {energy:.5} of the energy");
        (spin, spin_of(&first))
    });
    // d/dt ∫ r² ω dA = 4 ν Γ takes 2 ν Γ per second from the angular momentum, −½ ∫ r² ω dA +
    // const. Free vortex and core are both without viscous force, and the kink between them spreads
    // (Lamb and Oseen). ν = Δx² / (6 Δt).
    let area = (cells as f64 * DX).powi(2);
    let lost = f64::from(STEPS) * circulation * DX * DX / 3.0 / area / kept[0].1;
    println!("PIC should lose {lost:.5} of the spin");
    let [pic, flip, blended, apic] = kept.map(|(spin, _)| 1.0 - spin);
    // Two of 32 rows at the walls on two axes, as above.
    assert!((pic / lost - 1.0).abs() < 0.125, "{pic} {lost}");
    // FLIP's noise takes less than 1/25 of what PIC takes. With blending, α of PIC's loss is added,
    // and half of that again for the noise that the grid does not resolve.
    assert!(blended < (0.05 + 0.025) * lost + flip, "{blended} {lost}");
    assert!(
        flip.abs() < 0.04 * lost && apic.abs() < 0.01 * lost,
        "{flip} {apic}"
    );
}
