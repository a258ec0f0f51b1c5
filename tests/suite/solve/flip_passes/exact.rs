//! FLIP where the result is known up to rounding, on the GPU and with the reference: affine fields
//! under APIC, modes that the grid does not resolve, and a corner between a wall and a solid.

use glam::{DMat3, DVec3};
use swell::{
    domain::{
        boundary::Boundary,
        bounds::Bounds,
        flip::CONTACT,
        motion::Motion,
        particles::Particles,
        signed_distance::SignedDistance,
        solver::{Solver, StepReport},
    },
    gpu::adapter::Context,
    reference,
    scene::{
        Scene, effects,
        flip::{AFFINE, Transfer},
    },
    solve::flip::capacity,
};

use crate::support::{context, device::spoiled, flip::*, lattice, mover, noise};

const EPSILON: f64 = f32::EPSILON as f64;

/// State and report after `frames` frames, on the GPU and with the reference.
pub(super) fn both(
    context: &Context,
    scene: &Scene,
    particles: &Particles,
    boundary: &Boundary,
    frames: u32,
) -> [(&'static str, Particles, StepReport); 2] {
    fn run<S: Solver>(mut solver: S, particles: &Particles, frames: u32) -> (Particles, StepReport)
    where
        S::Error: std::fmt::Debug,
    {
        solver.load(0, particles).unwrap();
        let mut last = None;
        for _ in 0..frames {
            last = Some(solver.advance().unwrap());
        }
        last.unwrap()
    }
    let bricks = capacity(&scene.with_flip().unwrap(), particles);
    let gpu = solver_with(context, scene, particles, boundary, bricks);
    let cpu = reference::flip::Flip::new(&scene.with_flip().unwrap(), boundary);
    [
        ("GPU", run(gpu, particles, frames)),
        ("reference", run(cpu, particles, frames)),
    ]
    .map(|(name, (state, report))| (name, state, report))
}

/// ∂u_i/∂x_j, 1/s.
type Slopes = [[f64; 3]; 3];

/// Those of a divergence-free flow A x whose straight paths do not contract: tr A² = 0.
const SLOPES: Slopes = [[0.4, -0.7, -0.75], [0.9, -0.3, 0.5], [-0.6, 0.1, -0.1]];

fn affine_field(slopes: &Slopes, x: DVec3) -> DVec3 {
    let row = |k: usize| DVec3::from_array(slopes[k]).dot(x - DVec3::splat(0.8));
    DVec3::new(row(0), row(1), row(2))
}

/// Eight particles per cell, all in the same eighth of it and none at its centre: their means
/// represent the velocity at a face only by way of the affine part. The field is `part` of
/// [`affine_field`].
fn affine_block(slopes: &Slopes, part: f64, frames_per_second: f64) -> (Scene, Particles) {
    let mut scene = scene([16.0; 3]);
    scene.water.gravity = DVec3::ZERO;
    scene.shot.frames_per_second = frames_per_second;
    flip(&mut scene).transfer = Transfer::Apic;
    flip(&mut scene).density_correction = false;
    let mut particles = block([5, 5, 5], [6, 6, 6]);
    for k in 0..particles.len() {
        let cell = (position(&particles, k) / DX).floor();
        let place = |c: u64| 0.1 + 0.2 * (0.5 + 0.5 * noise(9_000 + 3 * k as u64 + c));
        let x = DX * (cell + DVec3::new(place(0), place(1), place(2)));
        particles.position[k] = x.as_vec3().to_array();
        let v = part * affine_field(slopes, position(&particles, k));
        particles.velocity[k] = v.as_vec3().to_array();
    }
    for (name, slope) in AFFINE.iter().zip(slopes.as_flattened()) {
        let values = vec![(part * slope) as f32; particles.len()];
        particles.attributes.insert((*name).to_owned(), values);
    }
    (scene, particles)
}

/// Largest errors of velocities, m/s, and of slopes, 1/s, after a step so short that motion is
/// below the rounding of positions.
fn affine_gaps(context: &Context) -> [(&'static str, f64, f64); 2] {
    let (scene, particles) = affine_block(&SLOPES, 1.0, 1e6);
    both(context, &scene, &particles, &Boundary::default(), 1).map(|(name, state, _)| {
        let (mut gap, mut slope_gap) = (0.0f64, 0.0f64);
        for k in 0..state.len() {
            let exact = affine_field(&SLOPES, position(&particles, k));
            gap = gap.max((velocity(&state, k) - exact).abs().max_element());
            for (name, slope) in AFFINE.iter().zip(SLOPES.as_flattened()) {
                let found = f64::from(state.attributes[*name][k]);
                slope_gap = slope_gap.max((found - slope).abs());
            }
        }
        (name, gap, slope_gap)
    })
}

/// Speeds of 1 m/s: sums of some 64 weights, each of which rounds by 3 × 16 ε / 2, of either sign,
/// give 8 × 24 ε; a slope is a difference of two over Δx. The reference gets velocities, slopes and
/// positions that are rounded to f32, and rounds its output: 4 ε.
#[test]
fn an_affine_field_is_given_back_from_off_centre() {
    let tolerance = 200.0 * EPSILON;
    for (name, gap, slope_gap) in affine_gaps(&context()) {
        println!("{name}: {gap:.1e} m/s, {slope_gap:.1e} 1/s");
        let tolerance = if name == "GPU" {
            tolerance
        } else {
            4.0 * EPSILON
        };
        assert!(gap < tolerance, "{name} {gap:e}");
        assert!(slope_gap < 2.0 * tolerance / DX, "{name} {slope_gap:e}");
    }
    // Negative controls: the distance from a particle to a face off by 1 %, along the component's
    // axis and across it.
    for (from, to) in [
        ("(v - slope.x * f.x)", "(v - 1.01 * slope.x * f.x)"),
        (
            "(v + slope.x * (1.0 - f.x))",
            "(v + 1.01 * slope.x * (1.0 - f.x))",
        ),
        ("b * (to_centers - f.y)", "1.01 * b * (to_centers - f.y)"),
        ("c * (to_centers - f.z)", "1.01 * c * (to_centers - f.z)"),
    ] {
        let [(_, gap, _), _] = affine_gaps(&spoiled("flip/spread_faces", from, to));
        println!("{to}: {gap:.1e} m/s");
        assert!(gap > 2.0 * tolerance, "{to} {gap:e}");
    }
}

/// In u = A x a step moves a particle by A x Δt, and the pressure is zero. Velocities of up to 2 m/s
/// round as above, positions of 2 m by a few ε.
#[test]
fn particles_go_by_the_velocity_at_their_positions() {
    const PART: f64 = 6.0;
    let step = 0.02;
    let (scene, particles) = affine_block(&SLOPES, PART, 1.0 / step);
    let gaps = |context: &Context| {
        both(context, &scene, &particles, &Boundary::default(), 1).map(|(name, state, report)| {
            assert_eq!((report.substeps, report.capped), (1, 0));
            let gap = |k: usize| {
                let x = position(&particles, k);
                let end = x + step * PART * affine_field(&SLOPES, x);
                // Where the grid is affine all along the path.
                let is_inner = (x - DVec3::splat(0.8)).abs().max_element() < 0.2;
                f64::from(u8::from(is_inner)) * position(&state, k).distance(end)
            };
            (name, (0..state.len()).map(gap).fold(0.0, f64::max))
        })
    };
    let tolerance = 2.0 * 200.0 * EPSILON * step + 8.0 * EPSILON;
    for (name, gap) in gaps(&context()) {
        println!("{name}: {gap:.1e} m of {tolerance:.1e}");
        assert!(gap < tolerance, "{name} {gap:e}");
    }
    // Negative control: paths that are 1 % longer.
    let control = spoiled(
        "flip/advect",
        "params.time_step * between",
        "1.01 * params.time_step * between",
    );
    let [(_, gap), _] = gaps(&control);
    assert!(gap > 2.0 * tolerance, "{gap:e} {tolerance:e}");
}

/// A flow that strains along axes, one that strains across them, and one that turns; 1/s.
const STRAINING: [Slopes; 3] = [
    [[6.0, 0.0, 0.0], [0.0, -4.0, 0.0], [0.0, 0.0, -2.0]],
    [[0.0, 3.0, 4.0], [3.0, 0.0, -2.0], [4.0, -2.0, 0.0]],
    [[0.0, -5.0, 1.0], [5.0, 0.0, 2.0], [-1.0, -2.0, 0.0]],
];

/// Largest change of volume along the paths of particles in the middle of a block, relative to what
/// that of the flow without divergence has, ½ Δt² tr A².
fn contracted(context: &Context, slopes: &Slopes) -> [(&'static str, f64); 2] {
    let step = 0.01;
    let (scene, particles) = affine_block(slopes, 1.0, 1.0 / step);
    let a = DMat3::from_cols_array_2d(slopes).transpose();
    let trace = |a: DMat3| a.x_axis.x + a.y_axis.y + a.z_axis.z;
    both(context, &scene, &particles, &Boundary::default(), 1).map(|(name, state, report)| {
        assert_eq!((report.substeps, report.capped), (1, 0));
        let change = |k: usize| {
            let slopes = AFFINE.map(|name| f64::from(state.attributes[name][k]));
            let map = DMat3::IDENTITY + step * DMat3::from_cols_array(&slopes).transpose();
            let off = (position(&particles, k) - DVec3::splat(0.8)).abs();
            let is_inner = off.max_element() < 0.5 * DX;
            f64::from(u8::from(is_inner)) * (map.determinant() - 1.0).abs()
        };
        let most = (0..state.len()).map(change).fold(0.0, f64::max);
        (name, most / (0.5 * step * step * trace(a * a)).abs())
    })
}

/// Straight paths keep the volume of water that strains or turns, to the third order: Δt times the
/// slopes are 0.05. Control: with 80 % of what the projection makes up for they do not.
#[test]
fn straight_paths_keep_the_volume() {
    let context = context();
    let less = spoiled("flip/find_strain", "-rate * rate", "-0.8 * rate * rate");
    for slopes in &STRAINING {
        for (name, part) in contracted(&context, slopes) {
            println!("{name}: {part:.3} of what is lost without");
            assert!(part < 0.1, "{name} {slopes:?}: {part}");
        }
        let [(_, part), _] = contracted(&less, slopes);
        assert!(part > 0.15, "{slopes:?}: {part}");
    }
}

/// Pairs of particles at the same position with opposite velocities: to the grid they are water at
/// rest, which stays. Pairs in cells beside air are at rest unless `everywhere` is set. Returns the
/// largest deviation from a decay by `kept` per frame, m/s, and the substeps of the last frame.
fn unseen_gaps(
    context: &Context,
    change: &dyn Fn(&mut Scene),
    kept: f64,
    frames: u32,
    everywhere: bool,
) -> [(&'static str, f64, u32); 2] {
    let mut scene = scene([16.0; 3]);
    scene.water.gravity = DVec3::ZERO;
    scene.shot.frames_per_second = 100.0;
    flip(&mut scene).density_correction = false;
    change(&mut scene);
    let still = block([4, 5, 4], [6, 5, 6]);
    let mut particles = Particles::default();
    for k in 0..still.len() {
        let cell = (position(&still, k) / DX).floor();
        let is_within =
            cell.cmpge(DVec3::new(5.0, 6.0, 5.0)) & cell.cmplt(DVec3::new(9.0, 9.0, 9.0));
        let size = f32::from(u8::from(everywhere || is_within.all()));
        let v: [f32; 3] =
            std::array::from_fn(|c| size * noise(400 + 3 * k as u64 + c as u64) as f32);
        for v in [v, v.map(|v| -v)] {
            particles.id.push(particles.id.len() as u32);
            particles.position.push(still.position[k]);
            particles.velocity.push(v);
        }
    }
    both(context, &scene, &particles, &Boundary::default(), frames).map(|(name, state, report)| {
        let gap = |k: usize| {
            let exact = kept.powi(frames as i32) * velocity(&particles, k);
            (velocity(&state, k) - exact).abs().max_element()
        };
        let most = (0..state.len()).map(gap).fold(0.0, f64::max);
        (name, most, report.substeps)
    })
}

/// v = α u + (1 − α)(v + Δu) with u = Δu = 0 leaves 1 − α per frame, in however many substeps, and
/// 1 − c of that with viscosity c. A substep rounds v by 2 ε and α by ε; sums at faces are of up to
/// 128 speeds that cancel, which leaves 8 × 3 ε of them and about α of that in v.
#[test]
fn what_the_grid_does_not_see_decays_by_the_blend_alone() {
    const FRAMES: u32 = 5;
    let context = context();
    let blend = |blend: f64, cfl: f64, xsph: Option<f64>| {
        move |scene: &mut Scene| {
            flip(scene).pic_blend = blend;
            flip(scene).cfl = cfl;
            scene.effects.viscosity = xsph.map(effects::viscosity::Settings::xsph);
        }
    };
    for (alpha, cfl, xsph, is_split) in [
        (0.05, 2.0, None, false),
        (0.3, 2.0, None, false),
        (0.05, 0.04, None, true),
        (0.2, 2.0, Some(0.1), false),
        (0.0, 2.0, None, false),
    ] {
        let kept = (1.0 - alpha) * (1.0 - xsph.unwrap_or(0.0));
        let change = blend(alpha, cfl, xsph);
        // Control: beside air, velocities are clamped to the grid's at once.
        for (name, gap, _) in unseen_gaps(&context, &change, kept, 1, true) {
            assert!(gap > 0.5, "{name} {gap:e}");
        }
        for (name, gap, substeps) in unseen_gaps(&context, &change, kept, FRAMES, false) {
            println!("{name}: {gap:.1e} m/s, {substeps} substeps");
            assert_eq!(substeps > 2, is_split, "{substeps}");
            let tolerance = f64::from(FRAMES * substeps) * 12.0 * EPSILON;
            assert!(gap < tolerance, "{name} {alpha} {gap:e} {tolerance:e}");
            // Negative control: a blend 1 % off.
            let other = (1.0 - 1.01 * alpha) * (1.0 - xsph.unwrap_or(0.0));
            let apart = kept.powi(FRAMES as i32) - other.powi(FRAMES as i32);
            assert!(alpha == 0.0 || 0.5 * apart > 2.0 * tolerance, "{apart:e}");
        }
    }
}

/// A particle in the corner between the floor and an overhanging slope at 45°, at the contact
/// distance of the slope and `deep` below that of the floor. The floor lifts it; the slope pushes
/// it back along its normal, which is half as far down again. After n rounds it is at x0 + deep (1
/// − 2^−n), at the floor's contact distance.
#[test]
fn four_rounds_take_a_particle_out_of_a_corner() {
    const ROUNDS: i32 = 4;
    let n = DVec3::new(1.0, -1.0, 0.0) / 2.0f64.sqrt();
    let contact = CONTACT * 0.5 * DX;
    let (deep, x0) = (0.8 * contact, 0.8123);
    let start = DVec3::new(x0, contact - deep, 0.83);
    let slope = half_space(n, n.dot(start) - contact);
    let far = half_space(DVec3::NEG_Y, -1.2);
    let moving = |at_rest: Option<Boundary>| Boundary {
        moving: slope.distance.iter().cloned().collect(),
        ..at_rest.unwrap_or_default()
    };
    let rest = lattice([0.0; 3], [1; 3], [DX; 3]);
    let particles = Particles {
        position: vec![start.as_vec3().to_array()],
        ..rest
    };
    let gaps = |context: &Context, boundary: &Boundary| {
        let mut scene = scene([16.0; 3]);
        scene.water.gravity = DVec3::ZERO;
        scene.shot.frames_per_second = 100.0;
        flip(&mut scene).density_correction = false;
        if !boundary.moving.is_empty() {
            // Along the slope, so that it does not move closer.
            let motion = Motion::ConstantVelocity {
                velocity: 0.5,
                until: None,
            };
            let bounds = Bounds {
                min: DVec3::splat(0.2),
                max: DVec3::splat(0.4),
            };
            scene.moving_solids.push(mover(bounds, DVec3::Z, motion));
        }
        both(context, &scene, &particles, boundary, 1).map(|(name, state, _)| {
            let x = position(&state, 0);
            let exact = x0 + deep * (1.0 - 0.5f64.powi(ROUNDS));
            (name, x.x - exact, x.y - contact)
        })
    };
    // Positions and distances of 2 m round by ε a few times in each round.
    let tolerance = 16.0 * EPSILON;
    let cases = [slope.clone(), moving(None), moving(Some(far))];
    for (k, boundary) in cases.iter().enumerate() {
        for (name, along, up) in gaps(&context(), boundary) {
            println!("{k} {name}: {along:.1e} m along, {up:.1e} m up");
            assert!(along.abs() < tolerance, "{k} {name} {along:e}");
            assert!(up.abs() < tolerance, "{k} {name} {up:e}");
        }
        // Negative control: one round less leaves it 2^−4 of its depth short.
        let control = spoiled("flip/advect", "CORNER_ROUNDS = 4u", "CORNER_ROUNDS = 3u");
        let [(_, along, _), _] = gaps(&control, boundary);
        assert!((along + deep / 16.0).abs() < tolerance, "{k} {along:e}");
    }
}

/// A plate across x = 1.05 m so thin that it closes no face of the grid, and that a quarter of a
/// frame's displacement crosses it.
fn plate() -> SignedDistance {
    let (spacing, dims) = (0.05, [50, 50, 50]);
    let value = |k: usize| ((-0.3 + spacing * (k % 50) as f64 - 1.05).abs() - 0.02) as f32;
    SignedDistance {
        origin: DVec3::splat(-0.3),
        spacing,
        dims,
        values: (0..125_000).map(value).collect(),
    }
}

/// Drops that fly at a plate within a single substep end on its near side, at the contact distance,
/// wherever the pieces of their path end: pieces are no longer than the distance from there to the
/// middle of the plate.
#[test]
fn nothing_thin_is_stepped_over() {
    let mut scene = scene([16.0; 3]);
    scene.water.gravity = DVec3::ZERO;
    scene.shot.frames_per_second = 100.0;
    flip(&mut scene).density_correction = false;
    flip(&mut scene).cfl = 5.0;
    let mut particles = lattice([0.12, 0.13, 0.13], [1, 4, 4], [0.4; 3]);
    for (k, x) in particles.position.iter_mut().enumerate() {
        x[0] = 0.805 - 0.003 * k as f32;
    }
    particles.velocity.fill([40.0, 0.0, 0.0]);
    let end = 1.05 - 0.02 - CONTACT * 0.5 * DX;
    let at_rest = Boundary {
        distance: Some(plate()),
        ..Boundary::default()
    };
    let moving = Boundary {
        moving: vec![plate()],
        ..Boundary::default()
    };
    let mut moving_scene = scene.clone();
    let motion = Motion::ConstantVelocity {
        velocity: 0.5,
        until: None,
    };
    let bounds = Bounds {
        min: DVec3::splat(0.2),
        max: DVec3::splat(0.4),
    };
    (moving_scene.moving_solids).push(mover(bounds, DVec3::Z, motion));
    let gaps = |context: &Context, scene: &Scene, boundary: &Boundary| {
        both(context, scene, &particles, boundary, 1).map(|(name, state, report)| {
            assert_eq!((report.substeps, report.capped), (1, 0));
            let gap = |k: usize| (position(&state, k).x - end).abs();
            (name, (0..state.len()).map(gap).fold(0.0, f64::max))
        })
    };
    for (scene, boundary, steps) in [
        (&scene, &at_rest, "2.0 * length(way)"),
        (&moving_scene, &moving, "2.0 * most"),
    ] {
        for (name, gap) in gaps(&context(), scene, boundary) {
            println!("{name}: {gap:.1e} m");
            // Positions and distances of 2 m round by ε a few times in each of 17 pieces, and the
            // last one counts.
            assert!(gap < 16.0 * EPSILON, "{name} {gap:e}");
        }
        // Negative control: pieces twice as long.
        let half = if steps.contains("most") {
            "most"
        } else {
            "length(way)"
        };
        let [(_, gap), _] = gaps(&spoiled("flip/advect", steps, half), scene, boundary);
        assert!(gap > 0.05, "{gap:e}");
    }
}

/// The scene's tolerance and iteration limit reach the device: a tolerance just above the residual
/// of the k-th iteration stops there, one just below does not, and a limit of k gives k iterations.
/// A residual of 1e-4 is known to 1e-3 of itself (pressure/stops.rs).
#[test]
fn a_scenes_projection_stops_where_the_scene_says() {
    let context = context();
    let (mut scene, mut particles) = tank([16, 16, 12], 9);
    scene.budget.residual = Some(1e3);
    for (k, v) in particles.velocity.iter_mut().enumerate() {
        *v = std::array::from_fn(|c| 0.3 * noise(80 + 3 * k as u64 + c as u64) as f32);
    }
    flip(&mut scene).density_correction = false;
    let asked = |tolerance: f64, most: u32| {
        let mut scene = scene.clone();
        flip(&mut scene).pressure.tolerance = tolerance;
        flip(&mut scene).pressure.max_iterations = most;
        let report = run(&context, &scene, &particles, 1).1;
        assert_eq!(report.substeps, 1);
        let projection = report.projection.unwrap();
        (report.iterations, projection.residual, projection.missed)
    };
    for most in [2, 4] {
        let (iterations, residual, missed) = asked(1e-9, most);
        assert_eq!((iterations, missed), (u64::from(most), 1), "{residual:e}");
        assert!(residual > 1e-4, "{residual:e}");
        let (iterations, _, missed) = asked(1.003 * residual, 100);
        assert_eq!((iterations, missed), (u64::from(most), 0));
        let (iterations, left, missed) = asked(0.997 * residual, 100);
        assert!(iterations > u64::from(most) && left < 0.997 * residual);
        assert_eq!(missed, 0);
    }
}
