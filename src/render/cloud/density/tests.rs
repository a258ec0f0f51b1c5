#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use super::{super::shade::Shade, *};

const SIZE: DVec3 = DVec3::splat(4.0);
const VOXEL: f64 = 0.1;

/// Drops scattered over the domain; every third one is a bubble.
fn drops(count: u32) -> Vec<Drop> {
    let part = |k: u32, by: f64| (f64::from(k) * by).fract();
    (1..=count)
        .map(|k| Drop {
            place: SIZE * DVec3::new(part(k, 0.618_034), part(k, 0.754_878), part(k, 0.569_840)),
            radius: 0.02 + 0.3 * part(k, 0.414_214),
            area: 0.01 + part(k, 0.732_051),
            is_bubble: k % 3 == 0,
        })
        .collect()
}

fn sums(drops: &[Drop]) -> [f64; 2] {
    [false, true].map(|kind| {
        let own = drops.iter().filter(|it| it.is_bubble == kind);
        own.map(|it| it.area).sum()
    })
}

/// Total cross-sections of drops and of bubbles in the grid, m².
fn areas(cloud: &Cloud) -> [f64; 2] {
    let mut sums = [0.0; 2];
    // Nodes that bricks share count once in total.
    let share = |c: u32| if c == 0 || c == EDGE { 0.5 } else { 1.0 };
    for (index, &word) in (0u32..).zip(cloud.values.iter()) {
        let at = index % VALUES as u32;
        let [x, y, z] = [at % NODES, at / NODES % NODES, at / NODES / NODES];
        let weight = share(x) * share(y) * share(z) * cloud.voxel.powi(3);
        for (sum, bits) in sums.iter_mut().zip([word as u16, (word >> 16) as u16]) {
            *sum += weight * f64::from(f16::from_bits(bits).to_f32());
        }
    }
    sums
}

#[test]
fn a_grid_holds_what_the_drops_hold() {
    for count in [1, 3, 200] {
        let drops = drops(count);
        let cloud = Cloud::new(&drops, SIZE, VOXEL);
        // Each value is rounded to 11 bits; the f32 sums are far more accurate.
        let off = |areas: [f64; 2]| {
            let wanted = sums(&drops);
            (0..2).all(|k| (areas[k] - wanted[k]).abs() <= wanted[k] / 2048.0)
        };
        assert!(off(areas(&cloud)), "{count}: {:?}", areas(&cloud));
        assert!(!off(areas(&cloud).map(|a| 1.001 * a + 1e-9)), "the control");
        // At the voxels' midpoints the trilinear field has the same integral.
        let [nx, ny, nz] = cloud.bricks.map(|n| n * EDGE);
        let mut integral = [0.0; 2];
        for k in 0..nx * ny * nz {
            let cell = DVec3::new((k % nx).into(), (k / nx % ny).into(), (k / nx / ny).into());
            let found = cloud.densities(cloud.corner + (cell + 0.5) * VOXEL);
            for (sum, density) in integral.iter_mut().zip(found) {
                *sum += density * VOXEL.powi(3);
            }
        }
        assert!(off(integral), "{count}: {integral:?}");
    }
}

#[test]
fn a_drop_has_the_spread_of_its_ball() {
    let radius = 0.5;
    let drop = Drop {
        place: DVec3::new(1.93, 2.02, 2.07),
        radius,
        area: 1.0,
        is_bubble: false,
    };
    let cloud = Cloud::new(&[drop], SIZE, VOXEL);
    let [nx, ny, nz] = cloud.bricks.map(|n| n * EDGE);
    let mut square = 0.0;
    for k in 0..nx * ny * nz {
        let cell = DVec3::new((k % nx).into(), (k / nx % ny).into(), (k / nx / ny).into());
        let p = cloud.corner + (cell + 0.5) * VOXEL;
        square += cloud.densities(p)[0] * VOXEL.powi(3) * (p - drop.place).length_squared();
    }
    // A ball has 3/5 r²; trilinear filtering adds a quarter of a squared voxel per axis.
    let expected = 0.6 * radius * radius + 3.0 * 0.25 * VOXEL * VOXEL;
    assert!(
        (square / expected - 1.0).abs() < 0.02,
        "{square} {expected}"
    );
}

/// A horizontal layer of drops, as uniform as the kernels make it.
fn slab() -> (Vec<Drop>, f64) {
    let (n, pitch) = (40, 0.1);
    let at = |k: usize| (k as f64 + 0.5) * pitch;
    let drops = (0..n * n * 5).map(|k| Drop {
        place: DVec3::new(at(k % n), 2.0 + at(k / n / n), at(k / n % n)),
        radius: 0.15,
        area: 2.0 * pitch * pitch * pitch,
        is_bubble: k % 2 == 0,
    });
    // 2 per metre, half a metre thick.
    (drops.collect(), 1.0)
}

#[test]
fn a_slab_shades_as_deep_as_it_is() {
    let (drops, depth) = slab();
    let cloud = Cloud::new(&drops, SIZE, VOXEL);
    for degrees in [90.0f64, 45.0, 30.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let shade = Shade::new(&cloud, DVec3::new(cos, sin, 0.0));
        // Below the slab's middle, on the grid's lowest plane.
        let [nx, ny, nz] = shade.nodes.map(|n| n as usize);
        let found = f64::from(shade.depths[(nz / 2 * ny) * nx + nx / 4]);
        // The middle of the lowest plane is far from the sides: only kernels and half precision
        // remain as errors.
        assert!(
            (found * sin / depth - 1.0).abs() < 0.01,
            "{degrees}°: {found}"
        );
        let off = Shade::new(&cloud, DVec3::new(cos, 1.1 * sin, 0.0).normalize());
        let off = f64::from(off.depths[(nz / 2 * ny) * nx + nx / 4]);
        let is_steep = degrees == 90.0;
        assert!(
            is_steep || (off * sin / depth - 1.0).abs() > 0.01,
            "the control: {off}"
        );
    }
}

#[test]
fn nothing_makes_an_empty_brick_and_order_does_not_matter() {
    let none = Cloud::new(&[], SIZE, VOXEL);
    assert_eq!((none.bricks, none.values.len()), ([1; 3], 0));
    let shade = Shade::new(&none, DVec3::Y);
    assert!(shade.depths.iter().all(|&it| it == 0.0));
    let mut far = drops(50);
    let near = Cloud::new(&far, SIZE, VOXEL);
    far.push(Drop {
        place: DVec3::new(1e7, 0.0, 0.0),
        ..far[0]
    });
    assert_eq!(Cloud::new(&far, SIZE, VOXEL), near);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    assert_eq!(pool.install(|| Cloud::new(&far, SIZE, VOXEL)), near);
}
