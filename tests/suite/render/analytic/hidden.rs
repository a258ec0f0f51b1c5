//! Water that other water hides: it is in no pixel, and its part of the way through is kept.

use glam::DVec3;
use swell::{
    domain::{bounds::Bounds, particles::Particles},
    gpu::adapter::Context,
};

use crate::support::box_mesh;

use super::support::{Eye, Setup, context, draw, scene, spoiled, uniform_sky};

/// Between particles, metres.
const D: f64 = 0.25;
/// Particles along each side of the block, and where its least corner is.
const COUNTS: [i32; 3] = [24, 14, 24];
const CORNER: DVec3 = DVec3::new(2.0, 1.0, 2.0);

/// A block of water of 24 × 14 × 24 particles a quarter of a metre apart, without those that are more than `shell` layers in.
fn hollow(shell: i32) -> Particles {
    let [nx, ny, nz] = COUNTS;
    let mut seed = 11u32;
    let mut random = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed >> 8) / 16_777_216.0 - 0.5
    };
    let mut water = Particles::default();
    for k in 0..nx * ny * nz {
        let cell = [k % nx, k / nx % ny, k / (nx * ny)];
        let place = cell.map(|c| D * (f64::from(c) + 0.5 + 0.4 * random()));
        let layer = |axis: usize, n: i32| cell[axis].min(n - 1 - cell[axis]);
        if layer(0, nx).min(layer(1, ny)).min(layer(2, nz)) < shell {
            let at = DVec3::from(place) + CORNER;
            water.position.push(at.as_vec3().to_array());
            water.velocity.push([0.0; 3]);
            water.id.push(k as u32);
        }
    }
    water
}

/// Particles that others hide are not splatted, and no pixel tells: a block and one whose middle is empty, where a
/// particle's shape depends on neighbours within three layers.
#[test]
fn particles_that_others_hide_are_in_no_pixel() {
    let eye = Eye::new([9.5, 8.0, 9.0], [5.0, 3.5, 5.0], 60.0);
    let setup = Setup {
        surface: String::new(),
        ..Setup::new(eye)
    };
    let mut scene = scene(D, 1.0);
    scene.particle_spacing = D;
    let depths = |shell: i32| {
        let image = draw(&context(), &setup, &uniform_sky, &scene, &hollow(shell), 1);
        image.aovs.z.unwrap().to_vec()
    };
    let whole = depths(12);
    // The block's upper face is 4.5 m up; the ray through the middle meets it 3.5 of 4.5 m down.
    let middle = f64::from(whole[32 * 64 + 32]);
    let along = (eye.target - eye.position).length() * 3.5 / 4.5;
    assert!(
        (middle - along).abs() < 2.0 * scene.particle_spacing,
        "{middle}, {along}"
    );
    assert_eq!(whole, depths(6));
    // The control: with a shell of one layer the shapes of its particles are others.
    assert_ne!(whole, depths(1));
}

/// Metres from `eye` along `way` between which a ray is within the block and at least `inside` metres from its faces.
fn span(eye: DVec3, way: DVec3, inside: f64) -> [f64; 2] {
    let high = CORNER + D * DVec3::from(COUNTS.map(f64::from)) - inside;
    let (a, b) = ((CORNER + inside - eye) / way, (high - eye) / way);
    [a.min(b).max_element().max(0.0), a.max(b).min_element()]
}

/// Thickness over the way through the block, as far as it goes before `wall`: the means' ratio over the pixels whose rays go 2 m through it
/// two spacings and more from its faces, and the largest difference. Nearer to its edges balls reach beyond the block.
fn through(context: &Context, wall: Option<f64>) -> [f64; 2] {
    let eye = Eye::new([9.5, 8.0, 9.0], [5.0, 3.5, 5.0], 60.0);
    let mut scene = scene(D, 1.0);
    scene.particle_spacing = D;
    scene.solids.extend(wall.map(|x| {
        box_mesh(Bounds {
            min: DVec3::new(-50.0, -50.0, -50.0),
            max: DVec3::new(x, 50.0, 50.0),
        })
    }));
    let setup = Setup::new(eye);
    let image = draw(context, &setup, &uniform_sky, &scene, &hollow(12), 1);
    let found = image.aovs.thickness.unwrap();
    let (mut sum, mut ways, mut most) = (0.0, 0.0, 0.0f64);
    for (i, &thickness) in found.iter().enumerate() {
        let direction = eye.direction(i);
        let way = |inside: f64| {
            let [enters, leaves] = span(eye.position, direction, inside);
            let stops = wall.map_or(leaves, |x| (x - eye.position.x) / direction.x);
            leaves.min(stops) - enters
        };
        if way(2.0 * D) > 2.0 {
            sum += f64::from(thickness);
            ways += way(0.0);
            most = most.max((f64::from(thickness) - way(0.0)).abs());
        }
    }
    assert!(ways > 1000.0, "{ways}");
    [sum / ways, most]
}

/// What balls in the place of blocks would differ by: their sum is off by 0.1 m along a ray, and some fifty rays of 4 m are independent.
/// Three times that.
const MEAN: f64 = 0.015;

/// Balls at either end reach 0.87 spacings beyond the block or leave as much of it out, and stand up to 0.2 off their lattice.
#[test]
fn blocks_and_particles_make_up_the_way_through_water() {
    let [mean, most] = through(&context(), None);
    assert!((mean - 1.0).abs() < MEAN, "{mean}");
    assert!(most < 2.0 * (0.87 + 0.2) * D, "{most}");
    // The control: blocks that count a twentieth more.
    let spoiled = spoiled(
        "ssfr/splat_bulk",
        "through * block.filled",
        "1.05 * through * block.filled",
    );
    let [mean, _] = through(&spoiled, None);
    assert!(mean > 1.0 + MEAN, "{mean}");
}

#[test]
fn blocks_end_at_what_is_solid() {
    let [mean, _] = through(&context(), Some(4.0));
    assert!((mean - 1.0).abs() < MEAN, "{mean}");
    // The control: a tenth of the depth farther.
    let spoiled = spoiled(
        "ssfr/splat_bulk",
        "min(last.z, end)",
        "min(last.z, 1.1 * end)",
    );
    let [mean, _] = through(&spoiled, Some(4.0));
    assert!(mean > 1.0 + MEAN, "{mean}");
}
