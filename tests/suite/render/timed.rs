//! Rays with times of their own, compared with rays in f64 at the same times.

use std::path::Path;

use glam::DVec3;
use swell::{
    check::render::{Summary, Surfaces},
    domain::{bounds::Bounds, level_set::kernels::Kernels, particles::Particles},
    files::parse_look,
    gpu::adapter::Context,
    reference::rays::{cast, cast_through, moment},
    render::{RayTimes, RenderScene, Renderer, eye, opaque},
    scene::look::{Look, MethodSpec},
};

use super::{
    analytic::{context, spoiled},
    scenes::city_scene,
};

const SPACING: f64 = 0.1;
const RATE: f64 = 24.0;
/// Of a frame.
const SHUTTER: f64 = 0.5;

/// A camera that flies over the water, slowly at first.
fn look() -> Look {
    let text = format!(
        "[camera]\nfocal_length_mm = 27.0\nfilm_back_mm = [36.0, 20.25]\n\
         [[camera.keyframe]]\nframe = 0\nposition = [-1.5, 1.9, 2.0]\ntarget = [2.0, 0.6, 2.0]\n\
         [[camera.keyframe]]\nframe = 2\nposition = [-0.5, 2.2, 1.6]\ntarget = [2.2, 0.5, 2.2]\n\
         [image]\nwidth = 240\nheight = 136\nshutter = {SHUTTER:?}\n\
         [sky]\nmodel = \"hosek_wilkie\"\n"
    );
    parse_look(&text, Path::new("flight.toml")).unwrap()
}

fn scene() -> RenderScene {
    RenderScene {
        domain: Bounds {
            min: DVec3::ZERO,
            max: DVec3::new(4.0, 3.0, 4.0),
        },
        solids: Vec::new(),
        particle_spacing: SPACING,
        frames_per_second: RATE,
        ..city_scene()
    }
}

/// Uneven water with a crest, which runs towards the camera, rises and turns: up to 9.2 m/s, a
/// spacing within half of the open time.
fn water() -> Particles {
    let mut seed = 1u32;
    let mut off = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        0.2 * SPACING * (f64::from(seed >> 8) / 16_777_216.0 - 0.5)
    };
    let mut water = Particles::default();
    let along = |count: u32| (0..count).map(|k| (f64::from(k) + 0.5) * SPACING);
    for (x, z) in along(30).flat_map(|x| along(40).map(move |z| (x + 0.5, z))) {
        let surface = 0.5 + 0.6 / (2.0 * (x - 2.0)).cosh().powi(2) + 0.1 * (2.0 * z).sin();
        for y in along(12).filter(|y| *y < surface) {
            let place = DVec3::new(x + off(), y + off(), z + off());
            let turning = DVec3::new(0.5, 1.0, -0.5).cross(place - DVec3::new(2.0, 0.5, 2.0));
            let velocity = DVec3::new(-6.5, 2.0, 0.5) + turning;
            water.position.push(place.as_vec3().to_array());
            water.velocity.push(velocity.as_vec3().to_array());
            water.id.push(water.id.len() as u32);
        }
    }
    water
}

fn kernels(water: &Particles, seconds: f64) -> Kernels {
    let wide = |v: &[f32; 3]| DVec3::from(v.map(f64::from));
    let moved = water.position.iter().zip(&water.velocity);
    let places: Vec<DVec3> = moved.map(|(p, v)| wide(p) + seconds * wide(v)).collect();
    Kernels::fit(&places, scene().domain.size(), SPACING)
}

/// Errors of rays at the frame's instant.
fn still() -> Summary {
    let (look, scene, water) = (look().of_surface(MethodSpec::Ray), scene(), water());
    let eye = eye(&look, DVec3::ZERO, 1.0, RATE);
    let box_of = (scene.domain.size(), SPACING);
    let opaque = opaque(&look, &scene).unwrap();
    let truth = cast(&eye, &kernels(&water, 0.0), box_of, &opaque);
    let image = Renderer::new(&context(), &look, &scene)
        .unwrap()
        .render(1, &water)
        .unwrap();
    let mut surfaces = Surfaces::default();
    surfaces.add(&image, &truth, &eye, SPACING);
    surfaces.summary().unwrap()
}

/// What rays meet at their own times, of some moments the pixels and f64 rays.
struct Truth(Vec<(Vec<usize>, Vec<swell::reference::rays::RayHit>)>);

impl Truth {
    /// With times that are longer by a factor than those of the picture's rays.
    fn new(longer: f64) -> Self {
        const EVERY: usize = 7;
        let (look, scene, water) = (look().of_open_surface(SHUTTER), scene(), water());
        let times = RayTimes::of(&look, 1, RATE).unwrap();
        let width = look.spec().image.width;
        let pixels = |index: usize| {
            let all = 0..width * look.spec().image.height;
            let has = |pixel: &u32| {
                let at = [pixel % width, pixel / width];
                moment(times.seed, [0, 1].map(|k| at[k] + times.first[k])) == index
            };
            all.filter(has)
                .map(|pixel| pixel as usize)
                .collect::<Vec<_>>()
        };
        let of = |index: usize| {
            let (pixels, seconds) = (pixels(index), longer * times.seconds[index]);
            let eye = eye(&look, DVec3::ZERO, 1.0 + seconds * RATE, RATE);
            let box_of = (scene.domain.size(), SPACING);
            let opaque = opaque(&look, &scene.standing_at(seconds)).unwrap();
            let kernels = kernels(&water, seconds);
            let seen = cast_through(&pixels, &eye, &kernels, box_of, &opaque);
            (pixels, seen)
        };
        Self((0..times.seconds.len()).step_by(EVERY).map(of).collect())
    }

    fn against(&self, context: &Context) -> Summary {
        let (look, scene) = (look().of_open_surface(SHUTTER), scene());
        let image = Renderer::new(context, &look, &scene)
            .unwrap()
            .render(1, &water())
            .unwrap();
        let mut surfaces = Surfaces::default();
        for (pixels, seen) in &self.0 {
            surfaces.add_some(&image, pixels, seen, SPACING);
        }
        surfaces.summary().unwrap()
    }
}

/// By how much, in spacings, depths may be worse than at the frame's instant, at the 95th
/// percentile: a spin of 1.2 /s moves what moves by a spacing by half of 1.2 /s times 10 ms of it,
/// 0.007; velocities are smoothed over two spacings, 0.02; and a slope lets the depth see three
/// times that.
const WORSE: f64 = 0.08;

#[test]
fn water_is_met_where_it_is_at_the_ray_s_time() {
    let still = still();
    let truth = Truth::new(1.0);
    let open = truth.against(&context());
    assert!(open.pixels > 1000, "{open:?}");
    let is_within = |found: &Summary| {
        found.depth[1] < still.depth[1] + WORSE && found.normal[0] < still.normal[0] + 1.0
    };
    assert!(is_within(&open), "{open:?} {still:?}");
    // Controls: times that are longer by a tenth; water, or the camera, at the sample's instant;
    // one component of the velocities backwards; rays all at the same time.
    let off = Truth::new(1.1).against(&context());
    assert!(off.depth[1] > open.depth[1] + 0.01, "{off:?} {open:?}");
    for (from, to) in [
        ("own_since = moments[index].since", "own_since = 0.0"),
        (
            "at.position = moments[index].position",
            "at.position = camera.position",
        ),
        (
            "(steps - AT_REST) *",
            "(steps - AT_REST) * vec3f(-1.0, 1.0, 1.0) *",
        ),
        ("moments[0].seed))) >> 26u", "moments[0].seed))) >> 31u"),
    ] {
        let found = truth.against(&spoiled("rays/aovs", from, to));
        assert!(!is_within(&found), "{from}: {found:?}");
    }
}
