//! Absorbing and generation zones: how they drive water, and what they leave unaffected.

use glam::DVec3;
use swell::{
    domain::{boundary::Boundary, particles::Particles},
    scene::{
        Effects, Method, Scene, Wall,
        effects::{absorbing_zone::Settings, generation_zone},
        open_waves,
    },
    solve::plan::Plan,
};

use crate::support::{
    choose, context, flip as of_flip, pbf_of, plan,
    solvers::{on_cpu, on_gpu},
};

const METHODS: [Method; 2] = [Method::Flip, Method::Pbf];

/// The lower wall along y.
const FLOOR: Wall = Wall {
    axis: 1,
    is_max: false,
};

const RIGHT: Wall = Wall {
    axis: 0,
    is_max: true,
};

fn zone(walls: &[Wall], length: f64, period: f64) -> Option<Settings> {
    Some(Settings {
        walls: walls.to_vec(),
        length,
        period,
    })
}

/// Waves that travel on the water of [`half_full`].
fn waves(walls: &[Wall], length: f64) -> Option<generation_zone::Settings> {
    Some(generation_zone::Settings {
        walls: walls.to_vec(),
        length,
        waves: open_waves::Waves::Stokes(open_waves::Regular {
            height: 0.05,
            period: 0.9,
            depth: 0.4,
            simulated_depth: None,
            ramp: Some(0.1),
            direction_degrees: 180.0,
        }),
    })
}

/// 16 × 8 × 8 cells of FLIP, or twice as many spacings of PBF, with water in the lower half.
fn half_full(method: Method) -> (Scene, Particles) {
    let mut scene = of_flip::scene([16.0, 8.0, 8.0]);
    let pbf = pbf_of(&mut scene);
    pbf.particle_spacing = of_flip::DX / 2.0;
    pbf.grid_projection = true;
    choose(&mut scene, method);
    scene.shot.frames_per_second = 50.0;
    (scene, of_flip::block([0; 3], [16, 4, 8]))
}

/// Mean of a velocity component in each layer of cells.
fn layers(state: &Particles, axis: usize) -> [f64; 4] {
    let mut sums = [(0.0, 0.0); 4];
    for (x, v) in state.position.iter().zip(&state.velocity) {
        let layer = ((f64::from(x[1]) / of_flip::DX) as usize).min(3);
        sums[layer].0 += f64::from(v[axis]);
        sums[layer].1 += 1.0;
    }
    sums.map(|(sum, count)| sum / count)
}

/// Frames of [`left_of_layers`], each one step.
const FRAMES: u32 = 25;

/// A periodic box without gravity and without FLIP's numerical diffusion, whose zone lies on the
/// floor.
fn zone_on_the_floor(method: Method) -> (Scene, Particles) {
    let (mut scene, particles) = half_full(method);
    scene.periodic = [true, false, true];
    scene.water.gravity = DVec3::ZERO;
    of_flip::flip(&mut scene).pic_blend = 0.0;
    scene.effects.absorbing_zone = zone(&[FLOOR], 0.4, 8.0);
    (scene, particles)
}

/// Part of a velocity's distance from the target that the zone leaves in each layer of cells, which
/// has two layers of particles: Π 1 / (1 + r(y) Δt).
fn left_of_layers() -> [f64; 4] {
    let (rate, step) = (5.0 * std::f64::consts::PI / 8.0, 0.02);
    let left = |y: f64| (1.0f64 + rate * step * (1.0 - y / 0.4).powi(2)).powi(-(FRAMES as i32));
    [0.0, 0.1, 0.2, 0.3].map(|y| 0.5 * (left(y + 0.025) + left(y + 0.075)))
}

/// In a flow along x in a periodic box only the zone takes velocity: a layer of particles at y
/// keeps the fraction Π 1 / (1 + r(y) Δt). With FLIP a layer of cells is the mean over two of them,
/// and α is 0, because α would carry a layer's velocity to the next at α Δx² / (6 Δt); a particle
/// loses what its faces lose, in a field whose second difference is up to 0.01 m/s. With PBF each
/// particle has the rate at its own position.
#[test]
fn a_flow_dies_out_as_the_zone_says() {
    let context = context();
    for method in METHODS {
        let (mut scene, mut particles) = zone_on_the_floor(method);
        particles.velocity.fill([0.5, 0.0, 0.0]);
        let expected = left_of_layers().map(|left| 0.5 * left);
        let states = [
            on_gpu(&context, &scene, &particles, FRAMES),
            on_cpu(&scene, &particles, FRAMES),
        ];
        for state in &states {
            let found = layers(state, 0);
            println!("{method:?}: {found:?}, expected {expected:?}");
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < 0.01, "{found} {expected}");
            }
        }
        // Negative control: half the period, twice the rate.
        scene.effects.absorbing_zone = zone(&[FLOOR], 0.4, 4.0);
        let other = layers(&on_gpu(&context, &scene, &particles, FRAMES), 0);
        assert!((other[0] - expected[0]).abs() > 0.05, "{other:?}");
        // Without the zone the velocity stays.
        scene.effects.absorbing_zone = None;
        let plain = layers(&on_gpu(&context, &scene, &particles, FRAMES), 0);
        assert!(plain.iter().all(|v| (v - 0.5).abs() < 1e-5), "{plain:?}");
    }
}

/// In a box without walls an absorbing zone drives water at rest as a current does: what is left of
/// the difference in each layer is Π 1 / (1 + r(y) Δt), as where a flow dies out. Water that has
/// the current's velocity keeps it to rounding, and with another current it would not.
#[test]
fn a_zone_leads_water_to_the_current() {
    let context = context();
    for method in METHODS {
        let (mut scene, mut particles) = zone_on_the_floor(method);
        let current = DVec3::new(0.5, 0.0, -0.3);
        scene.water.current = current;
        let apart = |state: &Particles, axis: usize| -> f64 {
            let both = layers(state, axis).into_iter().zip(left_of_layers());
            let gaps = both.map(|(found, left)| (found - current[axis] * (1.0 - left)).abs());
            gaps.fold(0.0, f64::max)
        };
        for state in [
            on_gpu(&context, &scene, &particles, FRAMES),
            on_cpu(&scene, &particles, FRAMES),
        ] {
            for axis in [0, 2] {
                let found = apart(&state, axis);
                println!("{method:?}, axis {axis}: {found:.1e} m/s off");
                assert!(found < 0.01, "{found}");
            }
        }
        particles.velocity.fill(current.as_vec3().to_array());
        let off = |scene: &Scene| -> f64 {
            let state = on_gpu(&context, scene, &particles, FRAMES);
            let velocity = state.velocity.iter();
            let off = velocity.map(|v| DVec3::from_array(v.map(f64::from)) - current);
            off.map(DVec3::length).fold(0.0, f64::max)
        };
        let kept = off(&scene);
        scene.water.current = 1.1 * current;
        let moved = off(&scene);
        println!("{method:?}: {kept:.1e} m/s kept, {moved:.1e} with another current");
        assert!(kept < 1e-5 && moved > 0.01, "{kept} {moved}");
    }
}

/// A zone damps existing motion. If it also damped what gravity adds in a step, more near the wall
/// than elsewhere, the water would begin to circulate.
#[test]
fn water_at_rest_in_a_zone_stays_at_rest() {
    let context = context();
    for method in METHODS {
        let (mut scene, particles) = half_full(method);
        let top = |scene: &Scene| {
            let state = on_gpu(&context, scene, &particles, 50);
            let speeds = state
                .velocity
                .iter()
                .map(|v| DVec3::from_array(v.map(f64::from)).length());
            speeds.fold(0.0, f64::max)
        };
        let plain = top(&scene);
        scene.effects.absorbing_zone = zone(&[RIGHT], 0.8, 0.5);
        let absorbed = top(&scene);
        println!("{method:?}: {plain:.2e} m/s without, {absorbed:.2e} m/s with");
        // A hundredth of what gravity adds in a step, 0.2 m/s.
        assert!(absorbed < plain + 2e-3, "{absorbed} {plain}");
    }
}

/// A drop that flies over a zone falls freely: after n steps of g Δt, in f32. Where no grid
/// distinguishes PBF's drops from water, they are damped like water, which is the control.
#[test]
fn drops_over_a_zone_fall_freely() {
    let context = context();
    let (frames, step) = (5, 0.02);
    for method in METHODS {
        let (mut scene, mut particles) = half_full(method);
        for x in [0.4, 1.45] {
            particles.id.push(particles.id.len() as u32);
            particles.position.push([x, 0.74, 0.4]);
            particles.velocity.push([0.0; 3]);
        }
        let falls = |state: &Particles| -> Vec<f32> {
            let last = particles.len() - 2;
            let ids = last as u32..=last as u32 + 1;
            let slots = ids.map(|id| state.id.iter().position(|other| *other == id).unwrap());
            slots.map(|slot| state.velocity[slot][1]).collect()
        };
        let free = -9.81 * step * frames as f32;
        for is_generating in [false, true] {
            scene.effects = Effects::default();
            match is_generating {
                false => scene.effects.absorbing_zone = zone(&[RIGHT], 0.8, 0.5),
                true => scene.effects.generation_zone = waves(&[RIGHT], 0.8),
            }
            for state in [
                on_gpu(&context, &scene, &particles, frames),
                on_cpu(&scene, &particles, frames),
            ] {
                let found = falls(&state);
                println!("{method:?}: {found:?}, expected {free}");
                assert!(
                    found.iter().all(|v| (v / free - 1.0).abs() < 1e-4),
                    "{found:?}"
                );
            }
            if method == Method::Pbf {
                let mut scene = scene.clone();
                pbf_of(&mut scene).grid_projection = false;
                let found = falls(&on_gpu(&context, &scene, &particles, frames));
                assert!(found[1] > 0.8 * free, "{found:?}");
            }
        }
    }
}

/// Water in the zone has the velocity of the waves, up to what walls and the pressure do within a
/// step. On average over the half of the zone at the wall, where there is always water, the error
/// is a third of the waves' velocity; the waves are seven cells long.
#[test]
fn water_in_a_generation_zone_goes_as_the_waves_do() {
    let context = context();
    for method in METHODS {
        let (mut scene, particles) = half_full(method);
        scene.periodic = [false, false, true];
        scene.effects.generation_zone = waves(&[RIGHT], 1.6);
        let theory = scene.effects.waves(scene.water.gravity).unwrap();
        let frames = 40;
        // FLIP's velocities at a frame's end are those of its end, too.
        let time = f64::from(frames) / 50.0;
        let apart = |state: &Particles, time: f64| {
            let of = |(x, v): (&[f32; 3], &[f32; 3])| {
                let [x, v] = [x, v].map(|a| DVec3::from_array(a.map(f64::from)));
                let is_inside = (0.8..1.4).contains(&x.x) && x.y < 0.3;
                let wanted = theory.velocity(x, time);
                is_inside.then(|| [(v - wanted).length_squared(), wanted.length_squared()])
            };
            let both = state.position.iter().zip(&state.velocity).filter_map(of);
            let [off, all] = both.fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
            (off / all).sqrt()
        };
        let states = [
            on_gpu(&context, &scene, &particles, frames),
            on_cpu(&scene, &particles, frames),
        ];
        for state in &states {
            let found = apart(state, time);
            println!("{method:?}: {found}");
            assert!(found < 0.4, "{found}");
        }
        // Negative control: the waves a quarter of a period later.
        let other = apart(&states[0], time + 0.225);
        assert!(other > 0.75, "{other}");
    }
}

/// The absorbing zone adds one pass and no byte; the generation zone adds one pass and its waves.
#[test]
fn a_scene_that_names_no_zone_pays_for_none() {
    let context = context();
    for method in METHODS {
        let (mut scene, particles) = half_full(method);
        let plan = |scene: &Scene| -> Plan {
            plan(&context, scene, particles.len(), &Boundary::default())
        };
        let names = |plan: &Plan| -> Vec<&'static str> {
            plan.passes.iter().map(|pass| pass.spec.name).collect()
        };
        let bare = plan(&scene);
        let names_of_bare = names(&bare);
        let added = |plan: &Plan| -> Vec<&'static str> {
            let names = names(plan).into_iter();
            names.filter(|name| !names_of_bare.contains(name)).collect()
        };
        scene.effects.absorbing_zone = zone(&[RIGHT, FLOOR], 0.3, 1.0);
        let with = plan(&scene);
        assert_eq!(with.bytes(), bare.bytes());
        let expected = match method {
            Method::Flip => "effects/absorb_faces",
            Method::Pbf => "effects/absorb_particles",
        };
        assert_eq!(added(&with), [expected]);
        scene.effects = Effects::default();
        scene.effects.generation_zone = waves(&[RIGHT], 0.3);
        let with = plan(&scene);
        // A wave and its second harmonic, 32 bytes each.
        assert_eq!(with.bytes().0, bare.bytes().0 + 64);
        let expected = match method {
            Method::Flip => "effects/generate_faces",
            Method::Pbf => "effects/generate_particles",
        };
        assert_eq!(added(&with), [expected]);
    }
}
