//! Whitewater compared with known behaviour of drops, foam and bubbles, on the GPU and in f64.

use std::path::Path;

use glam::{DQuat, DVec3};
use swell::{
    domain::{
        body::BodyState,
        forces::Medium,
        particles::Particles,
        whitewater::{CompleteSettings, Potentials, Thresholds, WhitewaterKind},
    },
    files::parse_scene,
    gpu::adapter::{Context, InjectedFault},
    scene::Scene,
    solve::whitewater::Whitewater,
    stage::prepare::Start,
};

use crate::support::{
    self, D, context,
    forces::push,
    lattice,
    whitewater::{kind, place, run, settings, velocity, white},
};

/// Depth of the pool, m.
const DEPTH: f64 = 0.8;

/// A box of 2 m × `height` × 2 m, periodic along x, with a pool that moves at `speed` m/s along x.
fn pool(height: f64, speed: f64) -> (Scene, Particles) {
    let mut scene = support::scene([2.0, height, 2.0]);
    scene.periodic = [true, false, false];
    let mut water = lattice([0.0; 3], [20, 8, 20], [D; 3]);
    water.velocity.fill([speed as f32, 0.0, 0.0]);
    (scene, water)
}

/// Runs `check` on the GPU and, without a context, in f64.
fn both(check: impl Fn(Option<&Context>)) {
    let context = context();
    check(Some(&context));
    check(None);
}

fn one(
    device: Option<&Context>,
    (scene, water): &(Scene, Particles),
    settings: &CompleteSettings,
    (x, v, kind): (DVec3, DVec3, WhitewaterKind),
    steps: (u32, f64),
) -> Particles {
    run(
        device,
        (scene, water),
        settings,
        &white(&[(x, v, kind)]),
        steps,
    )
    .1
}

/// The trapezoidal rule is exact for constant acceleration; air drag takes 1e-4 of the speed of a
/// ball with a radius of 10 m.
#[test]
fn a_heavy_drop_flies_along_a_parabola() {
    let settings = CompleteSettings {
        drop_radius: 10.0,
        ..settings()
    };
    let (start, v) = (DVec3::new(1.0, 2.0, 1.0), DVec3::new(1.0, 2.0, -0.5));
    both(|device| {
        let moved = one(
            device,
            &pool(4.0, 0.0),
            &settings,
            (start, v, WhitewaterKind::Spray),
            (4, 0.05),
        );
        let expected = start + 0.2 * v - 0.5 * 9.81 * 0.04 * DVec3::Y;
        let off = place(&moved, 0).distance(expected);
        assert!(off < 2e-4, "{off}");
        assert_eq!(kind(&moved, 0), WhitewaterKind::Spray);
        // Control: a drop of one millimetre deviates.
        let light = CompleteSettings {
            drop_radius: 5e-4,
            ..settings.clone()
        };
        let moved = one(
            device,
            &pool(4.0, 0.0),
            &light,
            (start, v, WhitewaterKind::Spray),
            (4, 0.05),
        );
        assert!(place(&moved, 0).distance(expected) > 2e-2);
    });
}

/// Gunn and Kinzer 1949: a drop of 1 mm falls at 4.03 m/s, within 6 % (spheres do not flatten);
/// wind carries it along.
#[test]
fn a_drop_falls_as_fast_as_drops_do() {
    let settings = CompleteSettings {
        drop_radius: 5e-4,
        wind: [3.0, 0.0, 0.0],
        ..settings()
    };
    let start = DVec3::new(1.0, 11.5, 1.0);
    both(|device| {
        let drop = (start, DVec3::ZERO, WhitewaterKind::Spray);
        let moved = one(device, &pool(12.0, 0.0), &settings, drop, (60, 0.04));
        let v = velocity(&moved, 0);
        assert_eq!(kind(&moved, 0), WhitewaterKind::Spray);
        assert!((-v.y / 4.03 - 1.0).abs() < 0.06, "{v}");
        assert!((v.x - 3.0).abs() < 0.01, "{v}");
    });
}

#[test]
fn foam_goes_with_its_water() {
    let x = DVec3::new(1.0, DEPTH, 1.0);
    both(|device| {
        let v = DVec3::new(0.5, 0.0, 0.0);
        let moved = one(
            device,
            &pool(2.0, 0.5),
            &settings(),
            (x, v, WhitewaterKind::Foam),
            (6, 0.05),
        );
        let off = place(&moved, 0).distance(x + 0.15 * DVec3::X);
        assert!(off < 1e-5, "{off}");
        assert_eq!(kind(&moved, 0), WhitewaterKind::Foam);
        // Foam at rest takes on the speed of the water within a frame, in which it moves by half of
        // the water's displacement.
        let moved = one(
            device,
            &pool(2.0, 0.5),
            &settings(),
            (x, DVec3::ZERO, WhitewaterKind::Foam),
            (1, 0.05),
        );
        assert!(velocity(&moved, 0).distance(v) < 1e-5);
        let off = place(&moved, 0).distance(x + 0.5 * 0.05 * v);
        assert!(off < 1e-5, "{off}");
    });
}

#[test]
fn bubbles_rise_at_their_speed_and_float_up_as_foam() {
    let x = DVec3::new(1.0, 0.2, 1.0);
    let settings = settings();
    let speed = settings.rise_speed.unwrap();
    both(|device| {
        let bubble = (x, DVec3::ZERO, WhitewaterKind::Bubble);
        let moved = one(device, &pool(2.0, 0.0), &settings, bubble, (40, 0.025));
        let v = velocity(&moved, 0);
        assert_eq!(kind(&moved, 0), WhitewaterKind::Bubble);
        assert!((v.y / speed - 1.0).abs() < 1e-3, "{v}");
        // From rest: rise speed times (t − response); trapezoids over frames of half the response
        // make it 2 % longer.
        let way = place(&moved, 0).y - x.y;
        let expected = speed * (1.0 - settings.response);
        assert!((way / expected - 1.0).abs() < 0.02, "{way} {expected}");
        let moved = one(device, &pool(2.0, 0.0), &settings, bubble, (160, 0.025));
        assert_eq!(kind(&moved, 0), WhitewaterKind::Foam);
        let y = place(&moved, 0).y;
        assert!((y - DEPTH).abs() < D, "{y}");
    });
}

/// Without a speed in the settings each bubble rises as its size does: within 1e-3 of its own
/// speed, and not of another's.
#[test]
fn bubbles_rise_by_their_size() {
    let settings = CompleteSettings {
        rise_speed: None,
        ..settings()
    };
    let speeds = [0, 1, 2, 3].map(|id| settings.rise_of(id));
    let [least, most] = [f64::min, f64::max].map(|of| speeds.into_iter().reduce(of).unwrap());
    assert!(most > 1.2 * least, "{speeds:?}");
    let bubble = |k: usize| {
        let x = DVec3::new(0.7 + 0.2 * k as f64, 0.2, 1.0);
        (x, DVec3::ZERO, WhitewaterKind::Bubble)
    };
    let white = white(&[0, 1, 2, 3].map(bubble));
    both(|device| {
        let (scene, water) = pool(2.0, 0.0);
        let (_, moved) = run(device, (&scene, &water), &settings, &white, (40, 0.02));
        for (k, speed) in speeds.into_iter().enumerate() {
            assert_eq!(kind(&moved, k), WhitewaterKind::Bubble);
            let v = velocity(&moved, k);
            assert!((v.y / speed - 1.0).abs() < 1e-3, "{k}: {v} {speed}");
        }
    });
}

/// A drop at 6 m/s would be 0.2 m deep at the frame's end. It stays at the surface, where the share
/// is 0.15, 0.6 spacings above the upper side of the last layer, to a 32nd of its path.
#[test]
fn drops_land_on_the_surface() {
    let drop = (
        DVec3::new(1.0, 1.2, 1.0),
        DVec3::new(0.0, -6.0, 0.0),
        WhitewaterKind::Spray,
    );
    let (surface, settings) = (DEPTH + 0.06, settings());
    let landed = |device: Option<&Context>| one(device, &pool(2.0, 0.0), &settings, drop, (1, 0.1));
    both(|device| {
        let moved = landed(device);
        let y = place(&moved, 0).y;
        assert!((y - surface).abs() < 0.03, "{y}");
        assert_eq!(kind(&moved, 0), WhitewaterKind::Foam);
        assert!(velocity(&moved, 0).length() < 1e-5);
    });
    // Control: without the search it is deep in the water.
    let mut spoiled = context();
    spoiled.spoil = Some(InjectedFault {
        pass: "whitewater/advance",
        from: "k < HALVINGS",
        to: "k < 0u",
    });
    let y = place(&landed(Some(&spoiled)), 0).y;
    assert!((y - surface).abs() > 0.1, "{y}");
}

fn potentials(device: Option<&Context>, scene: &Scene, water: &Particles) -> Vec<Potentials> {
    run(device, (scene, water), &settings(), &white(&[]), (1, 0.05)).0
}

/// Index of the particle nearest to a position.
fn nearest(water: &Particles, x: [f64; 3]) -> usize {
    let far = |k: &usize| place(water, *k).distance(DVec3::from_array(x));
    let all = 0..water.len();
    all.min_by(|a, b| far(a).total_cmp(&far(b))).unwrap()
}

/// Two fronts at ±v meet under a surface, a layer of `d` thick: at three spacings the closing
/// speeds times d² add up to the volume that they close, 2 v times the area of the layer, within
/// what is known of it: the surface takes away between none and half of a particle's neighbours.
/// Deep water closes nothing, however it moves, and neither do fronts that part.
#[test]
fn fronts_that_meet_trap_air() {
    let sums = |device: Option<&Context>, d: f64, v: f32| {
        let mut scene = support::scene([2.0, 2.0, 2.0]);
        scene.periodic = [false, false, true];
        support::pbf_of(&mut scene).particle_spacing = d;
        let n = (2.0 / d).round() as usize;
        let mut water = lattice([0.0; 3], [n, n / 2, n], [d; 3]);
        for (x, velocity) in water.position.iter().zip(&mut water.velocity) {
            velocity[0] = if x[0] < 1.0 { v } else { -v };
        }
        let found = potentials(device, &scene, &water);
        let closed = |is_deep: bool| {
            let all = water.position.iter().zip(&found);
            let there = all.filter(|(x, _)| (f64::from(x[1]) < 1.0 - 2.0 * d) == is_deep);
            there.map(|(_, p)| p.trapped_air * d * d).sum::<f64>()
        };
        [closed(true), closed(false)]
    };
    both(|device| {
        let of_layer = [0.2, 0.1, 0.0625].map(|d| {
            let [deep, surface] = sums(device, d, 1.5);
            assert_eq!(deep, 0.0, "{d}");
            // An area of d times 2 m.
            let part = surface / (3.0 * d * 2.0);
            assert!((0.5..1.0).contains(&part), "{d}: {part}");
            assert_eq!(sums(device, d, -1.5), [0.0; 2], "{d}");
            part
        });
        // The same part at each spacing, up to f32.
        for part in of_layer {
            assert!((part / of_layer[0] - 1.0).abs() < 1e-3, "{of_layer:?}");
        }
    });
}

/// Water under a roof of this slope on both sides, with the ridge along z.
fn ridge(slope: f32) -> Particles {
    let mut water = lattice([0.0; 3], [20, 12, 20], [D; 3]);
    let under = |x: &[f32; 3]| x[1] < 1.2 - slope * (x[0] - 1.0).abs();
    let kept: Vec<usize> = (0..water.len())
        .filter(|&k| under(&water.position[k]))
        .collect();
    water.position = kept.iter().map(|&k| water.position[k]).collect();
    water.velocity.truncate(kept.len());
    water.id.truncate(kept.len());
    water
}

/// A crest of 90° is sharper than the 120° at which waves break (Stokes 1880), where the sum is
/// 0.561; one of 150° is not.
#[test]
fn crests_that_move_outward_break() {
    let scene = support::scene([2.0, 2.0, 2.0]);
    let at = |device: Option<&Context>, mut water: Particles, v: [f32; 3], x: [f64; 3]| {
        water.velocity.fill(v);
        let k = nearest(&water, x);
        potentials(device, &scene, &water)[k].wave_crest
    };
    both(|device| {
        let top = [1.05, 1.15, 1.05];
        let least = Thresholds::default().wave_crest[0];
        let sharp = at(device, ridge(1.0), [0.0, 2.0, 0.0], top);
        assert!(sharp > least, "{sharp}");
        let blunt = at(device, ridge(0.268), [0.0, 2.0, 0.0], top);
        assert!(blunt < least, "{blunt}");
        // Controls: a crest that sinks, one that slides along its own ridge, and a flat surface
        // that rises.
        assert_eq!(at(device, ridge(1.0), [0.0, -2.0, 0.0], top), 0.0);
        assert_eq!(at(device, ridge(1.0), [0.0, 0.0, 2.0], top), 0.0);
        let flat = lattice([0.0; 3], [20, 8, 20], [D; 3]);
        let rises = at(device, flat, [0.0, 2.0, 0.0], [1.05, 0.75, 1.05]);
        assert!(rises.abs() < 1e-4, "{rises}");
    });
}

/// In the bulk, beside a wall and in a corner the share is that of full water; in the last layer it
/// is that of a half-space. Walls that meet multiply, within 1.5 % of the lattice's sums in a
/// corner (domain::sph).
#[test]
fn shares_do_not_depend_on_walls() {
    let (mut scene, water) = pool(2.0, 0.0);
    scene.periodic = [false; 3];
    both(|device| {
        let found = potentials(device, &scene, &water);
        let share = |x: [f64; 3]| found[nearest(&water, x)].share;
        for full in [[1.05, 0.35, 1.05], [0.05, 0.35, 1.05], [0.05, 0.05, 0.05]] {
            assert!(
                (share(full) - 1.0).abs() < 0.03,
                "{full:?}: {}",
                share(full)
            );
        }
        for last in [[1.05, 0.75, 1.05], [0.05, 0.75, 0.05]] {
            assert!(
                (share(last) - 0.81).abs() < 0.03,
                "{last:?}: {}",
                share(last)
            );
        }
    });
}

/// A cube of 0.4 m that floats, at rest at the bottom of its tank at the start, and by its state
/// half a metre higher and turned: a drop in its corner there is pushed out of it, and one where it
/// was falls on.
#[test]
fn a_body_is_where_its_state_puts_it() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hard_cases");
    let text = "[shot]\nname = \"float\"\nframes = 2\nframes_per_second = 24\n\
        [domain]\nmin = [0, 0, 0]\nmax = [2, 2, 2]\n\
        [[water.block]]\nmin = [0, 0, 0]\nmax = [0.3, 0.3, 2]\n\
        [[body]]\nmesh = \"cube.obj\"\nscale = 0.4\ntranslate = [0.8, 0.4, 0.8]\ndensity = 500\n\
        [solver]\nmethod = \"pbf\"\n[solver.pbf]\nparticle_spacing = 0.1\n";
    let scene = parse_scene(text, Path::new("float.toml"), &folder, &[]).unwrap();
    let start = Start::of(&scene).unwrap();
    let scene = scene.of_whitewater();
    let turned = BodyState {
        time: 1.0,
        centre: DVec3::new(1.0, 1.3, 1.0),
        turn: DQuat::from_rotation_y(0.5),
        velocity: 2.0 * DVec3::Y,
        spin: DVec3::ZERO,
    };
    let depth = |state: &BodyState, x: DVec3| {
        let off = (state.turn.conjugate() * (x - state.centre)).abs();
        (0.2 - off).min_element()
    };
    // In a corner of the turned cube that the unturned one would not cover, and below it.
    let in_corner = turned.centre + turned.turn * DVec3::new(0.17, 0.1, 0.17);
    let below = DVec3::new(1.0, 0.45, 1.0);
    let drops = [in_corner, below].map(|x| (x, DVec3::ZERO, WhitewaterKind::Spray));
    let after = |device: Option<&Context>, bodies: &[BodyState]| {
        let water = Particles {
            bodies: bodies.to_vec(),
            ..start.particles.clone()
        };
        let mut drops = white(&drops);
        let (time, seconds) = (1.0, 1e-3);
        match device {
            Some(context) => {
                let mut engine =
                    Whitewater::new(context, &scene, &start.boundary, water.len(), false).unwrap();
                engine.set(&settings()).unwrap();
                engine.survey(&water, time, seconds).unwrap();
                engine.advance(&mut drops, 1).unwrap();
            }
            None => {
                let boundary = &start.boundary;
                let mut engine = swell::reference::whitewater::Whitewater::new(&scene, boundary);
                engine.set(&settings());
                engine.survey(&water, time, seconds);
                engine.advance(&mut drops, 1).unwrap();
            }
        }
        [0, 1].map(|k| place(&drops, k))
    };
    both(|device| {
        // The solid's distance is known to a part of its grid's spacing of 0.1 m at an edge.
        let [corner, under] = after(device, &[turned]);
        assert!(depth(&turned, corner) < 0.02, "{corner}");
        assert!(under.distance(below) < 1e-3, "{under}");
        // Control: without the state the body is at its start, where the other drop is.
        let at_start = BodyState {
            centre: DVec3::new(1.0, 0.6, 1.0),
            turn: DQuat::IDENTITY,
            velocity: DVec3::ZERO,
            time: 1.0,
            ..turned
        };
        let [corner, under] = after(device, &[at_start]);
        assert!(corner.distance(in_corner) < 1e-3, "{corner}");
        assert!(depth(&at_start, under) < 0.02, "{under}");
    });
}

/// Under a force beside gravity a heavy drop flies along the parabola of both; one on water alone
/// does not bend it, and foam does not feel either.
#[test]
fn a_force_on_whitewater_bends_the_path_of_a_drop() {
    let settings = CompleteSettings {
        drop_radius: 10.0,
        ..settings()
    };
    let (start, v) = (DVec3::new(1.0, 2.0, 1.0), DVec3::new(1.0, 2.0, -0.5));
    let a = DVec3::new(-3.0, 4.0, 5.0);
    both(|device| {
        let moved = |on: Medium, (x, v, kind): (DVec3, DVec3, WhitewaterKind)| {
            let (mut scene, water) = pool(4.0, 0.0);
            scene.forces = vec![push(a)];
            scene.forces[0].force.on = vec![on];
            let moved = one(device, &(scene, water), &settings, (x, v, kind), (4, 0.05));
            place(&moved, 0)
        };
        let drop = (start, v, WhitewaterKind::Spray);
        let parabola = |a: DVec3| start + 0.2 * v + 0.5 * a * 0.04;
        let gravity = -9.81 * DVec3::Y;
        // As without a force: the drag of a ball with a radius of 10 m.
        let off = moved(Medium::Whitewater, drop).distance(parabola(gravity + a));
        assert!(off < 2e-4, "{off}");
        let off = moved(Medium::Water, drop).distance(parabola(gravity));
        assert!(off < 2e-4, "{off}");
        let foam = (
            DVec3::new(1.0, DEPTH, 1.0),
            DVec3::ZERO,
            WhitewaterKind::Foam,
        );
        assert_eq!(moved(Medium::Whitewater, foam), moved(Medium::Water, foam));
    });
}
