//! Drops and bubbles as volumes for rays: in reflections and through the water, and their shadows.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use swell::domain::particles::Particles;
use swell::domain::whitewater::{KIND, RADIUS, WhitewaterKind};
use swell::gpu::adapter::Context;
use swell::render::{FrameInputs, Image, RenderScene, WaterParticles};

use crate::support::device::PooledDevice;

use super::rays::{INDEX, LEVEL, SPACING, pool_scene, reflectance, refracted, water};
use super::support::{Eye, Setup, ball, context, draw_inputs, spoiled, uniform_sky};

/// Spacing of drops in a slab, and radius of each, m: so wide that the density between them is
/// uniform to a thousandth.
const PITCH: f64 = 0.25;
const WIDE: f64 = 0.4;

/// A slab of whitewater from `low` to `high`, m.
struct Slab {
    low: f64,
    high: f64,
    kind: WhitewaterKind,
}

/// Extinction of a slab, 1/m, at a density of 1.
fn extinction() -> f64 {
    4.0 / 3.0 * PI * WIDE.powi(3) / PITCH.powi(3)
}

impl Slab {
    /// Particles over 14 m, so that none of the slab's sides is visible.
    fn particles(&self) -> Particles {
        let n = (14.0 / PITCH) as usize;
        let layers = ((self.high - self.low) / PITCH).round() as usize;
        let at = |k: usize| (k as f64 + 0.5) * PITCH;
        let position: Vec<[f32; 3]> = (0..n * n * layers)
            .map(|k| {
                let [x, z] = [k % n, k / n % n].map(|k| at(k) - 2.0);
                [x, self.low + at(k / n / n), z].map(|x| x as f32)
            })
            .collect();
        let count = position.len();
        let mut white = Particles {
            velocity: vec![[0.0; 3]; count],
            id: (0..count as u32).collect(),
            position,
            ..Particles::default()
        };
        let mut attribute = |name: &str, value: f32| {
            white.attributes.insert(name.to_owned(), vec![value; count]);
        };
        attribute(RADIUS, WIDE as f32);
        attribute(KIND, self.kind.number());
        white
    }

    /// Thickness of the slab, m.
    fn height(&self) -> f64 {
        self.high - self.low
    }
}

struct Shot<'a> {
    eye: Eye,
    white: &'a Particles,
    density: f64,
    sun: [f64; 3],
    ground: f64,
    has_water: bool,
}

impl Shot<'_> {
    fn draw(&self, context: &Context, sky: &dyn Fn(DVec3, DVec2) -> [f64; 3]) -> Image {
        let setup = Setup {
            method: "ray",
            water: format!(
                "index = {INDEX:?}\nabsorption_per_metre = [0.0, 0.0, 0.0]\n[whitewater]\n\
                 density_per_metre = {:?}\n",
                self.density
            ),
            sun: self.sun,
            ground: [self.ground; 3],
            ..Setup::new(self.eye)
        };
        let body = if self.has_water {
            water()
        } else {
            Particles::default()
        };
        let body = WaterParticles::new(body);
        let scene = RenderScene {
            particle_spacing: SPACING,
            ..pool_scene()
        };
        let inputs = FrameInputs::alone(&body, self.white);
        draw_inputs(context, &setup, sky, &scene, &inputs, 1).unwrap()
    }
}

/// Looks at a point on the pool, `theta` degrees from straight down.
fn eye_on_pool(theta: f64) -> Eye {
    let (sin, cos) = theta.to_radians().sin_cos();
    let target = DVec3::new(5.0, LEVEL, 5.0);
    Eye {
        up: DVec3::Z,
        ..Eye::new(
            (target + 2.0 * DVec3::new(-sin, cos, 0.0)).to_array(),
            target.to_array(),
            600.0,
        )
    }
}

fn black_sky(_: DVec3, _: DVec2) -> [f64; 3] {
    [0.0; 3]
}

const OVER: Slab = Slab {
    low: 6.0,
    high: 7.0,
    kind: WhitewaterKind::Spray,
};
const UNDER: Slab = Slab {
    low: 0.5,
    high: 1.25,
    kind: WhitewaterKind::Bubble,
};

/// Density that gives the slab an optical depth of 1 straight through.
fn unit(slab: &Slab) -> f64 {
    1.0 / (extinction() * slab.height())
}

fn worst(image: &Image, expected: impl Fn(usize) -> f64) -> f64 {
    let off = image
        .beauty
        .iter()
        .enumerate()
        .map(|(i, pixel)| (f64::from(pixel[1]) / expected(i) - 1.0).abs());
    off.fold(0.0, f64::max)
}

/// Largest error of a slab under a uniform sky with everything else white, seen from above and from
/// within the water.
fn furnace_error(context: &Context, slab: &Slab) -> f64 {
    let white = slab.particles();
    let below = Eye::new([5.0, 1.6, 5.0], [6.0, 0.2, 5.3], 60.0);
    let above = Eye::new([1.0, 4.5, 4.0], [5.0, LEVEL, 5.0], 60.0);
    [above, below]
        .into_iter()
        .map(|eye| {
            let shot = Shot {
                eye,
                white: &white,
                density: 0.7 * unit(slab),
                sun: [0.0, 90.0, 0.0],
                ground: 1.0,
                has_water: true,
            };
            worst(&shot.draw(context, &uniform_sky), |_| 1.0)
        })
        .fold(0.0, f64::max)
}

/// Seen in the pool's reflection, through its surface, and from within it.
#[test]
fn clouds_in_a_white_furnace_are_not_seen() {
    for (slab, from, to) in [
        (
            OVER,
            "mix(around, sky_irradiance(view), 1.0 - exp(-optical_depth)) / PI",
            "mix(around, sky_irradiance(view), 1.0 - exp(-optical_depth)) / (2.0 * PI)",
        ),
        (
            UNDER,
            "sky_irradiance(up) / PI * exp(-extinction * above / shading.sun_path)",
            "sky_irradiance(up) / PI * exp(-extinction * above / shading.sun_path) * 0.9",
        ),
    ] {
        let error = furnace_error(&context(), &slab);
        // As for clear water in a furnace: rays that are not followed.
        assert!(error < 0.01, "{from}: {error}");
        let control = furnace_error(&spoiled("rays/cast", from, to), &slab);
        assert!(control > 0.01, "{to}: {control}");
    }
}

/// Drops that emit no light.
fn black_drops() -> PooledDevice {
    spoiled(
        "rays/cast",
        "return sun + mix(around, sky_irradiance(view), 1.0 - exp(-optical_depth)) / PI;",
        "return vec3f(0.0);",
    )
}

/// Largest error of the sky's reflection in a pool over a black floor, dimmed by an absorbing slab
/// above the eye (Beer); `density` is relative to the slab's.
fn mirrored_error(theta: f64, density: f64) -> f64 {
    let white = OVER.particles();
    let shot = Shot {
        eye: eye_on_pool(theta),
        white: &white,
        density: density * unit(&OVER),
        sun: [0.0, 90.0, 0.0],
        ground: 0.0,
        has_water: true,
    };
    let eye = shot.eye;
    worst(&shot.draw(&black_drops(), &uniform_sky), |i| {
        let cosine = -eye.direction(i).y;
        reflectance(cosine, INDEX) * (-1.0 / cosine).exp()
    })
}

#[test]
fn a_mirrored_ray_is_dimmed_by_a_slab_as_beer_says() {
    for theta in [0.0, 40.0] {
        // The pool's slope is a few thousandths, and the density is uniform to a thousandth of its
        // depth.
        let error = mirrored_error(theta, 1.0);
        assert!(error < 0.02, "{theta}°: {error}");
        let control = mirrored_error(theta, 1.05);
        assert!(control > 0.02, "{theta}°: {control}");
    }
}

/// Largest error of bubbles in a clear pool over a black floor, under a uniform sky: whatever hides
/// the floor is as bright as the sky.
fn bubbles_error(context: &Context, theta: f64) -> f64 {
    let white = UNDER.particles();
    let shot = Shot {
        eye: eye_on_pool(theta),
        white: &white,
        density: 0.5 * unit(&UNDER),
        sun: [0.0, 90.0, 0.0],
        ground: 0.0,
        has_water: true,
    };
    let eye = shot.eye;
    worst(&shot.draw(context, &uniform_sky), |i| {
        let along = eye.direction(i);
        let mirrored = reflectance(-along.y, INDEX);
        let way = 1.0 / -refracted(along, INDEX).y;
        mirrored + (1.0 - mirrored) * (1.0 - (-0.5 * way).exp())
    })
}

#[test]
fn bubbles_brighten_a_pool_by_what_they_hide() {
    for theta in [0.0, 40.0] {
        let error = bubbles_error(&context(), theta);
        assert!(error < 0.02, "{theta}°: {error}");
        let (from, to) = ("let own = cloud_density(", "let own = 1.1 * cloud_density(");
        let control = bubbles_error(&spoiled("rays/cast", from, to), theta);
        assert!(control > 0.02, "{theta}°: {control}");
    }
}

/// Largest error of sunlight on a white floor below a slab of drops, relative to that without one,
/// compared with Beer's law along the path of the light.
fn shadow_error(context: &Context, elevation: f64) -> f64 {
    let (white, none) = (OVER.particles(), Particles::default());
    let draw = |white| {
        let shot = Shot {
            eye: Eye::new([4.5, 2.0, 5.0], [5.0, 0.0, 5.0], 600.0),
            white,
            density: unit(&OVER),
            sun: [90.0, elevation, 1.0],
            ground: 1.0,
            has_water: false,
        };
        shot.draw(context, &black_sky)
    };
    let clear = draw(&none);
    let dimmed = (-1.0 / elevation.to_radians().sin()).exp();
    worst(&draw(&white), |i| f64::from(clear.beauty[i][1]) * dimmed)
}

#[test]
fn a_slab_shades_the_floor_as_beer_says() {
    for elevation in [80.0, 60.0] {
        let error = shadow_error(&context(), elevation);
        assert!(error < 0.02, "{elevation}°: {error}");
        let (from, to) = (
            "seen *= exp(-cloud_sun_depth(world));",
            "seen *= exp(-1.05 * cloud_sun_depth(world));",
        );
        let control = shadow_error(&spoiled("rays/cast", from, to), elevation);
        assert!(control > 0.02, "{elevation}°: {control}");
    }
}

/// Total of the picture's brightness from a ball of bubbles that moves along x, and its variance
/// along x, pixels².
fn spread(context: &Context, speed: f64, shutter: f64) -> [f64; 2] {
    const SAMPLES: u32 = 8;
    let mut white = ball(DVec3::new(5.0, 0.7, 5.0), DVec3::new(speed, 0.0, 0.0));
    for (name, value) in [(RADIUS, 0.2), (KIND, WhitewaterKind::Bubble.number())] {
        white.attributes.insert(name.to_owned(), vec![value]);
    }
    let eye = Eye {
        up: DVec3::Z,
        ..Eye::new([5.0, 1.9, 5.0], [5.0, 0.0, 5.0], 50.0)
    };
    let setup = Setup {
        method: "ray",
        samples: SAMPLES,
        shutter,
        water: "absorption_per_metre = [0.0, 0.0, 0.0]\n[whitewater]\ndensity_per_metre = 1.0\n"
            .to_owned(),
        // Four voxels and more per radius: a ball on the grid has the same width wherever it lies
        // between nodes.
        surface: "voxels_per_spacing = 4.0\n".to_owned(),
        sun: [0.0, 90.0, 0.0],
        ..Setup::new(eye)
    };
    let water = WaterParticles::new(water());
    let inputs = FrameInputs::alone(&water, &white);
    let image = draw_inputs(context, &setup, &uniform_sky, &pool_scene(), &inputs, 1).unwrap();
    let place = |i: usize| (i % 64) as f64 - 31.5;
    let sum = |weigh: &dyn Fn(usize) -> f64| -> f64 {
        let all = image.beauty.iter().enumerate();
        all.map(|(i, pixel)| f64::from(pixel[1]) * weigh(i)).sum()
    };
    let all = sum(&|_| 1.0);
    let mean = sum(&place) / all;
    [all, sum(&|i| (place(i) - mean).powi(2)) / all]
}

#[test]
fn moving_bubbles_are_drawn_along_their_way() {
    let (speed, shutter) = (12.0, 1.0);
    let still = spread(&context(), 0.0, shutter);
    let moving = spread(&context(), speed, shutter);
    // A thin ball hides the same amount wherever it is, except for its distance from the eye and
    // the slope of the view.
    assert!(
        (moving[0] / still[0] - 1.0).abs() < 0.03,
        "{still:?} {moving:?}"
    );
    // Eight instants, evenly over a shutter of a frame: (1 − 1/64) / 12 of the squared
    // displacement, 1.2 m below the eye.
    let way = 50.0 / 1.2 * speed * shutter / 24.0;
    let wider = |found: [f64; 2]| (found[1] - still[1]) / (way * way * (1.0 - 1.0 / 64.0) / 12.0);
    // A nearer part moves farther through the picture, by 1 / z, and fills more of it, by 1 / z²:
    // the mean of 1 / z⁴ over that of 1 / z² is, to second order, 1 + 7 times the variance of z
    // over z². A ball is as deep as it is wide: that variance is the still picture's over the
    // square of the focal length.
    let expected = 1.0 + 7.0 * still[1] / 50f64.powi(2);
    // The rest is the longer path through a ball beside the middle, 2 % by quadrature, and as much
    // for the grid.
    let off = |found| (wider(found) / expected - 1.0).abs();
    assert!(off(moving) < 0.04, "{}", off(moving));
    // Control: 5 % faster, 10 % in the square.
    let faster = spread(&context(), 1.05 * speed, shutter);
    assert!(off(faster) > 0.04, "{}", off(faster));
}
