//! Domains that move: free drops, water that rests in a tank that turns, and sloshing, with both
//! solvers, on the GPU and in f64.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use std::path::Path;

use swell::{
    domain::{
        frame::{FrameMotion, FrameTurn},
        motion::Motion,
        particles::Particles,
    },
    files::parse_scene,
    gpu::adapter::Context,
    scene::{Method, Scene, forces::MovingFrame},
    stage::{device::Opened, drive::Drive, prepare::Start},
};

use crate::support::{
    context,
    device::{self, PooledDevice},
    flip as of_flip,
    solvers::{self, RATE, SOLVERS, scene},
};

const G: f64 = 9.81;

/// States after each frame, on the GPU or, without a context, of the reference.
fn run(context: Option<&Context>, scene: &Scene, start: &Particles, frames: u32) -> Vec<Particles> {
    let all = solvers::run(context, scene, start, frames);
    all.into_iter().map(|(state, _)| state).collect()
}

fn wide(v: [f32; 3]) -> DVec3 {
    Vec3::from(v).as_dvec3()
}

/// A domain that slides and turns at once.
fn shaken() -> FrameMotion {
    let sine = |stroke, period| Motion::Sine {
        stroke,
        period,
        ramp: 0.0,
    };
    FrameMotion {
        slide: Some((DVec3::new(1.0, 0.0, 2.0), sine(0.3, 0.9))),
        turn: Some(FrameTurn {
            pivot: DVec3::new(0.5, 0.4, 0.7),
            axis: DVec3::new(1.0, 0.5, -2.0),
            motion: sine(70.0, 1.3),
        }),
        gravity: -G * DVec3::Y,
        reach: 4.0,
    }
}

/// Largest distance of two drops, after 0.3 s, from where a parabola in the frame at rest takes
/// them, metres.
fn drops_off(context: Option<&Context>, solver: (Method, bool), frame: Option<FrameMotion>) -> f64 {
    let start = Particles {
        id: vec![0, 1],
        position: vec![[1.16, 2.32, 0.83], [1.07, 2.07, 1.12]],
        velocity: vec![[0.0; 3], [0.4, 1.0, -0.5]],
        ..Particles::default()
    };
    // Velocities belong to the middle of a step, and gravity's first half step comes before them.
    let mut begun = start.clone();
    for v in &mut begun.velocity {
        v[1] += (0.5 * G / RATE) as f32;
    }
    let mut scene = scene(solver, [16.0, 32.0, 16.0]);
    scene.frame = frame.map(MovingFrame::new);
    let frames = 30;
    let states = run(context, &scene, &begun, frames);
    let (state, motion, end) = (states.last().unwrap(), shaken(), f64::from(frames) / RATE);
    let (direction, way) = motion.slide.as_ref().unwrap();
    let pivot = motion.turn.as_ref().unwrap().pivot;
    let moved = pivot + direction.normalize() * way.displacement(end);
    let off = |k: usize| {
        let (x, v) = (wide(start.position[k]), wide(start.velocity[k]));
        let free = x + end * v + 0.5 * end * end * motion.gravity;
        (moved + motion.turned(end) * (wide(state.position[k]) - pivot) - free).length()
    };
    off(0).max(off(1))
}

/// A drop falls as it does outside. The projected solvers have an error of second order: 5e-4 m for
/// the same steps of 10 ms by hand, in f64. Without a projection positions go with the velocity of
/// the step's end, which is a Δt t / 2, with accelerations of up to 25 m/s².
#[test]
fn a_drop_in_a_moving_domain_flies_its_parabola() {
    let context = context();
    for solver in SOLVERS {
        for device in [Some(&*context), None] {
            let found = drops_off(device, solver, Some(shaken()));
            let still = drops_off(device, solver, None);
            println!(
                "{solver:?}, {}: {found:.1e} m, at rest {still:.1e}",
                device.is_some()
            );
            let most = if solver.1 { 1e-3 } else { 0.0375 };
            assert!(found < most, "{solver:?}: {found}");
            // Control: without the motion.
            assert!(still > 0.2, "{solver:?}: {still}");
        }
    }
    let spoil = |pass, from, to| -> PooledDevice { device::spoiled(pass, from, to) };
    for (solver, pass) in [
        (SOLVERS[0], "effects/turn_sorted"),
        (SOLVERS[2], "effects/turn_particles"),
    ] {
        let off = spoil(pass, "v + change_by_turn(v)", "v");
        let found = drops_off(Some(&off), solver, Some(shaken()));
        assert!(found > 0.05, "{pass} without Coriolis: {found}");
    }
}

/// Heights of the water over the columns of cells along x, from the volume of its particles.
fn heights(state: &Particles, [along, across]: [usize; 2]) -> Vec<f64> {
    let volume = (of_flip::DX / 2.0).powi(3) / (across as f64 * of_flip::DX.powi(2));
    let mut sums = vec![0.0; along];
    for x in &state.position {
        let column = (f64::from(x[0]) / of_flip::DX) as usize;
        sums[column.min(along - 1)] += volume;
    }
    sums
}

/// Water under a paraboloid y = y0 + Ω² r² / 2g goes round with a tank that turns about its middle,
/// and so rests in it.
#[test]
fn water_rests_in_a_tank_that_turns_steadily() {
    let context = context();
    let (cells, spin) = (12, 3.0);
    let length = cells as f64 * of_flip::DX;
    let middle = DVec3::new(0.5 * length, 0.0, 0.5 * length);
    let frame = FrameMotion {
        slide: None,
        turn: Some(FrameTurn {
            pivot: middle,
            axis: DVec3::Y,
            motion: Motion::ConstantVelocity {
                velocity: f64::to_degrees(spin),
                until: None,
            },
        }),
        gravity: -G * DVec3::Y,
        reach: 2.0,
    };
    let mut water = of_flip::block([0; 3], [cells, 12, cells]);
    let kept: Vec<bool> = (water.position.iter())
        .map(|x| {
            let r = (wide(*x) - middle).with_y(0.0).length();
            f64::from(x[1]) < 0.4 + (spin * r).powi(2) / (2.0 * G)
        })
        .collect();
    water.retain(&kept);
    // The tank is at rest before the start, and the water turns as it does from then on.
    water.velocity = (water.position.iter())
        .map(|x| {
            (spin * DVec3::Y)
                .cross(wide(*x) - middle)
                .as_vec3()
                .to_array()
        })
        .collect();
    let resting = heights(&water, [cells, cells]);
    for solver in [SOLVERS[0], SOLVERS[1]] {
        for device in [Some(&*context), None] {
            let seen = |frame: Option<&FrameMotion>| {
                let mut scene = scene(solver, [cells as f64, 16.0, cells as f64]);
                scene.frame = frame.cloned().map(MovingFrame::new);
                let states = run(device, &scene, &water, 50);
                let last = states.last().unwrap();
                let mean = |k: usize| wide(last.velocity[k]).length_squared();
                let speed = (0..last.len()).map(mean).sum::<f64>() / last.len() as f64;
                let found = heights(last, [cells, cells]);
                let off = found.iter().zip(&resting).map(|(a, b)| (a - b).abs());
                (speed.sqrt(), off.fold(0.0, f64::max))
            };
            let (speed, off) = seen(Some(&frame));
            println!(
                "{solver:?}, {}: {speed:.3} m/s, {off:.3} m",
                device.is_some()
            );
            // A twentieth of the speed of the walls; half a cell.
            assert!(speed < 0.05 * spin * 0.5 * length, "{solver:?}: {speed}");
            assert!(off < 0.5 * of_flip::DX, "{solver:?}: {off}");
            // Controls: centrifugal acceleration the other way would be another axis; without the
            // motion the water turns in the tank.
            assert!(seen(None).0 > 0.3 * spin * 0.5 * length, "{solver:?}");
        }
    }
}

/// Difference of the levels at the ends of a tank that slides by `motion`, after linear theory: the
/// odd modes β'' + ω² β = 4 tanh(k h) / (k L) x'', integrated from rest; metres, at each frame.
fn linear(motion: &Motion, [length, depth]: [f64; 2], frames: u32) -> Vec<f64> {
    const PARTS: u32 = 200;
    let step = 1.0 / (RATE * f64::from(PARTS));
    let mut sums = vec![0.0; frames as usize];
    for mode in (1..12).step_by(2) {
        let k = f64::from(mode) * PI / length;
        let (square, drive) = (
            G * k * (k * depth).tanh(),
            4.0 * (k * depth).tanh() / (k * length),
        );
        let (mut amplitude, mut rate) = (0.0, 0.0);
        // Mean of the mode over a column of cells at each end, in the uppermost layer of particles.
        let half = 0.5 * k * of_flip::DX;
        let lower = (k * (depth - 0.25 * of_flip::DX)).sinh() / (k * depth).sinh();
        let share = half.sin() / half * half.cos() * lower;
        for frame in 0..frames {
            for part in 0..PARTS {
                let t = (f64::from(frame * PARTS) + f64::from(part)) * step;
                rate += drive * (motion.velocity(t + step) - motion.velocity(t))
                    - square * amplitude * step;
                amplitude += rate * step;
            }
            sums[frame as usize] += 2.0 * share * amplitude;
        }
    }
    sums
}

/// A tank that slides to and fro sloshes as linear theory says: root mean square of the difference
/// of the levels at its ends, over two periods of the first mode, within a twelfth of theory's.
#[test]
fn a_tank_that_slides_sloshes_as_linear_theory_says() {
    let context = context();
    let (cells, depth, frames) = (32, 16, 160);
    let length = cells as f64 * of_flip::DX;
    let motion = Motion::Sine {
        stroke: 0.06,
        period: 1.5,
        ramp: 0.0,
    };
    let size = [length, depth as f64 * of_flip::DX];
    let expected = linear(&motion, size, frames);
    let water = of_flip::block([0; 3], [cells, depth, 4]);
    let off = |solver: (Method, bool), direction: DVec3| {
        let mut scene = scene(solver, [cells as f64, 24.0, 4.0]);
        scene.frame = Some(MovingFrame::new(FrameMotion {
            slide: Some((direction, motion.clone())),
            turn: None,
            gravity: -G * DVec3::Y,
            reach: 3.0,
        }));
        let states = run(Some(&context), &scene, &water, frames);
        // The uppermost layer of particles rises as the surface does.
        let top = |k: usize| f64::from(water.position[k][1]) > size[1] - 0.5 * of_flip::DX;
        let rise = |state: &Particles, is_in: &dyn Fn(f64) -> bool| {
            let there =
                (0..water.len()).filter(|&k| top(k) && is_in(f64::from(water.position[k][0])));
            let by_id = |k: usize| state.id.iter().position(|id| *id == water.id[k]).unwrap();
            let rises: Vec<f64> = there
                .map(|k| f64::from(state.position[by_id(k)][1] - water.position[k][1]))
                .collect();
            rises.iter().sum::<f64>() / rises.len() as f64
        };
        let squares = states.iter().zip(&expected).map(|(state, theory)| {
            let low = rise(state, &|x| x < of_flip::DX);
            let high = rise(state, &|x| x > length - of_flip::DX);
            ((low - high - theory).powi(2), theory.powi(2))
        });
        let [gap, whole] = squares.fold([0.0; 2], |s, (a, b)| [s[0] + a, s[1] + b]);
        f64::sqrt(gap / whole)
    };
    for solver in [SOLVERS[0], SOLVERS[1]] {
        let found = off(solver, DVec3::X);
        println!("{solver:?}: {found:.3} of theory");
        assert!(found < 1.0 / 12.0, "{solver:?}: {found}");
    }
    // Controls: the other way, and across.
    let found = [DVec3::NEG_X, DVec3::Z].map(|way| off(SOLVERS[0], way));
    assert!(found[0] > 1.0 && found[1] > 0.5, "{found:?}");
}

/// Root mean square of the speed of water that goes round with a tank off the lattice, beside a
/// slope and a pier that go with it, after two seconds, m/s.
fn beside_solids(opened: &Opened, method: Method, turn: &str) -> f64 {
    const SPIN: f64 = 2.0;
    let text = format!(
        "[shot]\nname = \"round\"\nframes = 48\nframes_per_second = 24\n\
         [domain]\nmin = [0.013, 0, -0.007]\nmax = [1.217, 0.9, 1.205]\n{turn}\
         [[water.block]]\nmin = [0.013, 0, -0.007]\nmax = [1.217, 0.9, 1.205]\n\
         [[solid]]\nmesh = \"box.obj\"\ntranslate = [1.0, -0.1697, 0.35]\n\
         rotate_degrees = [0, 0, 14.03624]\nscale = [2.4, 0.8, 1]\n\
         [[solid]]\nmesh = \"box.obj\"\ntranslate = [0.33, 0.2, 0.29]\nscale = [0.3, 2, 0.3]\n\
         [solver]\nmethod = \"{}\"\n[solver.flip]\ncell_size = 0.06\n\
         [solver.pbf]\nparticle_spacing = 0.03\n",
        method.name(),
    );
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hard_cases");
    let scene = parse_scene(&text, Path::new("round.toml"), &folder, &[]).unwrap();
    let mut start = Start::of(&scene).unwrap();
    let axis = DVec3::new(0.6, 0.0, 0.5) - scene.origin;
    let away = |x: [f32; 3]| (wide(x) - axis).with_y(0.0);
    let water = &mut start.particles;
    let kept: Vec<bool> = (water.position.iter())
        .map(|&x| f64::from(x[1]) < 0.4 + (SPIN * away(x).length()).powi(2) / (2.0 * G))
        .collect();
    water.retain(&kept);
    water.velocity = (water.position.iter())
        .map(|&x| (SPIN * DVec3::Y).cross(away(x)).as_vec3().to_array())
        .collect();
    let mut drive = Drive::new(opened, &scene, &start, false).unwrap();
    let state = (0..48).map(|_| drive.advance().unwrap().particles).last();
    let velocity = state.unwrap().velocity;
    let squares = velocity.iter().map(|&v| wide(v).length_squared());
    (squares.sum::<f64>() / velocity.len() as f64).sqrt()
}

/// What turns rigidly rests in its domain, whatever solids go with it. The start is rough by half a
/// spacing beside the solids and along the surface, and that sloshes: a twentieth of the walls' 1.2
/// m/s.
#[test]
fn water_rests_beside_solids_that_turn_with_it() {
    let opened = Opened::Gpu(Box::new((*context()).clone()));
    let turns = |speed: f64| {
        format!(
            "pivot = [0.6, 0, 0.5]\naxis = [0, 1, 0]\n\
             turn = {{ kind = \"constant_velocity\", degrees_per_second = {speed} }}\n"
        )
    };
    let spin = f64::to_degrees(2.0);
    for method in [Method::Flip, Method::Pbf] {
        let [found, still, faster] = [turns(spin), String::new(), turns(1.2 * spin)]
            .map(|turn| beside_solids(&opened, method, &turn));
        println!("{method:?}: {found:.3} m/s, at rest {still:.3}, a fifth faster {faster:.3}");
        assert!(found < 0.06, "{method:?}: {found}");
        // Controls: a domain at rest, and one that turns a fifth faster than the water.
        assert!(still > 2.0 * found && faster > 1.5 * found, "{method:?}");
    }
}
