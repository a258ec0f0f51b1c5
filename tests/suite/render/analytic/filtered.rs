//! AOVs filtered over the whole pixel, like the picture itself.

use glam::DVec3;
use swell::{
    domain::{bounds::Bounds, particles::Particles},
    render::{Image, RenderScene},
};

use super::{
    geometry::box_mesh,
    support::{Eye, Setup, ball, context, draw, scene, uniform_sky},
};

const SAMPLES: u32 = 16;
const BLOCK: Bounds = Bounds {
    min: DVec3::new(4.0, 3.0, 4.0),
    max: DVec3::new(6.0, 5.0, 6.0),
};

/// Looks up, so that only the sky is behind the block.
fn eye() -> Eye {
    Eye::new([0.0, 1.0, 1.0], [5.0, 4.2, 5.0], 90.0)
}

fn picture(method: &'static str, filter: &str, (set, water): (&RenderScene, &Particles)) -> Image {
    let setup = Setup {
        method,
        samples: SAMPLES,
        background: false,
        output: format!("aov_filter = \"{filter}\"\n"),
        ..Setup::new(eye())
    };
    draw(&context(), &setup, &uniform_sky, set, water, 1)
}

fn block() -> RenderScene {
    RenderScene {
        solids: vec![box_mesh(BLOCK)],
        ..scene(0.1, 1.0)
    }
}

/// Fraction of a pixel that is covered.
fn cover(image: &Image, i: usize) -> f64 {
    f64::from(image.beauty[i][3])
}

/// Numbers of partly covered pixels with a depth, of those without, and of pixels that show two
/// faces by a tenth or more.
fn counts(image: &Image) -> [usize; 3] {
    let z = image.aovs.z.as_ref().unwrap();
    let n = image.aovs.n.as_ref().unwrap();
    let mut found = [0; 3];
    for i in 0..z.len() {
        let part = cover(image, i);
        if part > 0.01 && part < 0.99 {
            found[usize::from(z[i] > 1e6)] += 1;
        }
        let faces = n[i].iter().filter(|side| side.abs() > 0.1).count();
        found[2] += usize::from(faces > 1);
    }
    found
}

#[test]
fn channels_are_means_over_what_the_samples_meet() {
    let set = block();
    let nothing = Particles::default();
    let forward = eye().forward();
    for method in ["ssfr", "ray"] {
        let image = picture(method, "beauty", (&set, &nothing));
        let aovs = &image.aovs;
        let (z, p) = (aovs.z.as_ref().unwrap(), aovs.p.as_ref().unwrap());
        let n = aovs.n.as_ref().unwrap();
        let mut whole = 0;
        for i in 0..z.len() {
            let part = cover(&image, i);
            // A sample weighs 1/16: a pixel has a depth exactly if a sample hits something.
            assert_eq!(
                z[i] < 1e6,
                part > 0.5 / f64::from(SAMPLES),
                "{method}: {part}"
            );
            if z[i] > 1e6 {
                continue;
            }
            whole += usize::from(part > 0.99);
            // The block's three faces are axis-aligned, so their shares of a pixel add up to one. A
            // normal of a splatted solid has 12 bits per axis; f32 rounding is smaller.
            let sum: f64 = n[i].iter().map(|side| f64::from(-side)).sum();
            assert!((sum - 1.0).abs() < 1e-5, "{method}: {:?}", n[i]);
            // Depth is linear in position, so the means agree as the values do: f32 at 8 m, and its
            // square root in the distances of rays.
            let place = DVec3::from(p[i].map(f64::from));
            let along = (place - eye().position).dot(forward);
            assert!(
                (along - f64::from(z[i])).abs() < 2e-4,
                "{method}: {along} {}",
                z[i]
            );
        }
        assert!(whole > 200, "{method}: {whole}");
        let [with, without, shared] = counts(&image);
        assert!(with > 50 && without == 0, "{method}: {with} {without}");
        assert!(shared > 30, "{method}: {shared}");
        // Control: a pixel's centre is on one face or on none, whatever the picture shows there.
        let centre = picture(method, "centre", (&set, &nothing));
        assert!(centre.beauty == image.beauty, "{method}: another picture");
        let [_, without, shared] = counts(&centre);
        assert!(without > 15 && shared == 0, "{method}: {without} {shared}");
    }
}

#[test]
fn thickness_is_a_mean_over_the_whole_pixel() {
    let water = ball(DVec3::new(5.0, 4.2, 5.0), DVec3::ZERO);
    let set = scene(1.0, 1.0);
    let image = picture("ssfr", "beauty", (&set, &water));
    let centre = picture("ssfr", "centre", (&set, &water));
    let thickness = |image: &Image| image.aovs.thickness.clone().unwrap();
    let (mean, still) = (thickness(&image), thickness(&centre));
    let sum = |all: &[f32]| all.iter().map(|&v| f64::from(v)).sum::<f64>();
    // Both are the ball's volume over the pixels' solid angle, with one point or sixteen per pixel;
    // N points in the outline's pixels have an error of a few of them.
    let ratio = sum(&mean) / sum(&still);
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    let edge = (0..mean.len()).filter(|&i| mean[i] > 0.0 && still[i] == 0.0);
    let edge = edge.count();
    assert!(edge > 5, "pixels that the ball only touches: {edge}");
}
