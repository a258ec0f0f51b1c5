//! Tests with lattices whose surface is known.

use std::f64::consts::PI;

use glam::DMat3;

use super::{
    kernels::{Ellipsoid, Kernels},
    sunlight::Sunlight,
    *,
};

const D: f64 = 0.1;

/// A pseudo-random number in −0.5..0.5 for an index.
fn noise(index: usize) -> f64 {
    let x = (index as f64 * 12.9898).sin() * 43758.5453;
    x - x.floor() - 0.5
}

/// A cubic lattice with `counts` particles along each axis, each displaced by up to half of
/// `jitter` spacings along each axis.
fn lattice(counts: [usize; 3], corner: DVec3, jitter: f64) -> Vec<DVec3> {
    let [nx, ny, nz] = counts;
    (0..nx * ny * nz)
        .map(|at| {
            let place = [at % nx, at / nx % ny, at / nx / ny].map(|c| c as f64 + 0.5);
            let off = [0, 1, 2].map(|axis| jitter * noise(3 * at + axis));
            corner + D * (DVec3::from_array(place) + DVec3::from_array(off))
        })
        .collect()
}

/// Heights at which the field changes sign over a grid of positions, in spacings above `level`.
fn heights(set: &LevelSet, level: f64) -> Vec<f64> {
    let columns = (0..400).map(|k| (f64::from(k % 20), f64::from(k / 20)));
    columns
        .map(|(x, z)| {
            let at = |y: f64| {
                let (x, z) = ((x + 0.5) / 20.0 * set.size.x, (z + 0.5) / 20.0 * set.size.z);
                set.value(DVec3::new(x, y, z))
            };
            let (mut low, mut high) = (level - 2.0 * D, level + 2.0 * D);
            assert!(at(low) > 0.0 && at(high) < 0.0, "{x} {z}: no surface near");
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                match at(middle) > 0.0 {
                    true => low = middle,
                    false => high = middle,
                }
            }
            (low - level) / D
        })
        .collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

/// A pool from wall to wall is level up to the walls. Control: without mirrors the surface falls at
/// the walls.
#[test]
fn a_pool_is_flat_up_to_its_walls() {
    let size = DVec3::new(2.0, 2.0, 1.6);
    let pool = lattice([20, 10, 16], DVec3::ZERO, 0.0);
    let set = LevelSet::new(&pool, size, D);
    // Error of interpolating, at two voxels per spacing, a field that averages 0 half a spacing
    // above the lattice.
    let off = heights(&set, 1.0);
    let most = off.iter().fold(0.0f64, |a, h| a.max(h.abs()));
    assert!(most < 0.06, "{most} spacings off");
    let lonely: Vec<_> = pool
        .iter()
        .map(|&p| p + DVec3::new(5.0, 0.0, 5.0))
        .collect();
    let far = Kernels::fit(&lonely, DVec3::splat(20.0), D);
    let corner = DVec3::new(5.0 + 0.2 * D, 1.0 - 0.3 * D, 5.0 + 0.2 * D);
    assert!(far.field().value(corner) < 0.0);
    assert!(set.value(corner - DVec3::new(5.0, 0.0, 5.0)) > 0.0);
}

/// Particles a fifth of a spacing off their lattice points leave a surface that is 0.08 spacings
/// rough at most, the tolerance of the silhouette. Control: unstretched kernels leave more.
#[test]
fn noise_of_particles_is_smoothed_out_of_the_surface() {
    let size = DVec3::new(2.0, 2.0, 2.0);
    let pool = lattice([20, 10, 20], DVec3::ZERO, 0.4);
    let rough = |set: &LevelSet| {
        let off = heights(set, 1.0);
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        (rms(&off.iter().map(|h| h - mean).collect::<Vec<_>>()), mean)
    };
    let (stretched, mean) = rough(&LevelSet::new(&pool, size, D));
    assert!(
        stretched < 0.08 && mean.abs() < 0.1,
        "{stretched} about {mean}"
    );
    let balls = pool.iter().map(|&centre| Ellipsoid {
        centre,
        inverse: DMat3::from_diagonal(DVec3::splat(0.5 / D)),
        reach: DVec3::splat(2.0 * D),
        longest: 2.0 * D,
        peak: 315.0 / (64.0 * PI) / 8.0,
    });
    let balls = Kernels {
        ellipsoids: balls.collect(),
        level: 0.5,
    };
    let (plain, _) = rough(&LevelSet::of_kernels(&balls, size, D / VOXELS));
    assert!(plain > 1.3 * stretched, "{plain} of balls, {stretched}");
}

/// A sheet one particle thick has no hole between its particles, nor has one that is stretched by
/// a third.
#[test]
fn a_sheet_one_particle_thick_holds_together() {
    let size = DVec3::new(4.0, 2.0, 4.0);
    for stretch in [1.0, 1.33] {
        let sheet: Vec<_> = lattice([16, 1, 16], DVec3::ZERO, 0.2)
            .into_iter()
            .map(|p| DVec3::new(1.0 + stretch * p.x, 1.0, 1.0 + stretch * p.z))
            .collect();
        let set = LevelSet::new(&sheet, size, D);
        let middle = DVec3::new(1.0 + 0.8 * stretch, 1.0, 1.0 + 0.8 * stretch);
        for k in 0..100 {
            let off = DVec3::new(f64::from(k % 10), 0.0, f64::from(k / 10)) * 0.05 - 0.25;
            let at = middle + DVec3::new(off.x, 0.0, off.z);
            assert!(set.value(at) > 0.0, "{stretch}: a hole at {at}");
        }
        let above = middle + DVec3::Y * 1.2 * D;
        assert!(set.value(above) < 0.0, "{stretch}: too thick");
    }
}

/// In water torn to 1/1.3³ = 0.46 of its density every particle lies inside the surface. Control:
/// kernels as in full water give a field of that density, which is below a calm surface's 0.55.
#[test]
fn particles_of_torn_water_are_inside() {
    let size = DVec3::splat(4.0);
    let place = |p: DVec3| 1.3 * p + DVec3::splat(1.0);
    let torn: Vec<DVec3> = (lattice([14; 3], DVec3::ZERO, 0.3).into_iter())
        .map(place)
        .collect();
    let kernels = Kernels::fit(&torn, size, D);
    let field = kernels.field();
    assert!(torn.iter().all(|&p| field.value(p) > 0.0));
    let middle = size * 0.5;
    let deep = || (torn.iter()).filter(|p| (**p - middle).abs().max_element() < 3.0 * D);
    let round = |p: DVec3| {
        let value = |q: &DVec3| (1.0 - (p - q).length_squared() / (2.5 * D).powi(2)).max(0.0);
        let sum: f64 = torn.iter().map(|q| value(q).powi(3)).sum();
        315.0 / (64.0 * PI) * sum / 2.5f64.powi(3)
    };
    assert!(deep().count() > 50 && deep().all(|&p| round(p) < kernels.level));
}

/// A lone particle is a ball of its own volume.
#[test]
fn a_lone_particle_is_a_ball_of_its_volume() {
    let place = DVec3::new(1.013, 0.977, 1.001);
    let set = LevelSet::new(&[place], DVec3::splat(2.0), D);
    let step = D / 20.0;
    let cells = 40i32;
    let inside = (0..cells.pow(3)).filter(|at| {
        let c =
            [at % cells, at / cells % cells, at / cells / cells].map(|c| f64::from(c - 20) + 0.5);
        set.value(place + step * DVec3::from_array(c)) > 0.0
    });
    let volume = inside.count() as f64 * step.powi(3) / D.powi(3);
    // The field is a hat 2.5 voxels wide, and trilinear interpolation lies below a hat: h²/8 of its
    // curvature removes a quarter.
    assert!((0.6..1.0).contains(&volume), "{volume} of its volume");
    let radius = (3.0 / (4.0 * PI)).cbrt() * D;
    let exact = Kernels::fit(&[place], DVec3::splat(2.0), D);
    assert!(exact.field().value(place + DVec3::X * radius * 1.001) < 0.0);
    assert!(exact.field().value(place + DVec3::X * radius * 0.999) > 0.0);
}

/// Bricks agree with the kernels: full and empty ones in the sign, the others in the value.
#[test]
fn bricks_hold_the_field_of_the_kernels() {
    let size = DVec3::new(2.0, 2.1, 1.7);
    let pool = lattice([20, 9, 17], DVec3::ZERO, 0.3);
    let kernels = Kernels::fit(&pool, size, D);
    let field = kernels.field();
    let set = LevelSet::of_kernels(&kernels, size, D / VOXELS);
    let [mut full, mut empty, mut between] = [0; 3];
    for k in 0..2000 {
        let part = DVec3::new(noise(3 * k), noise(3 * k + 1), noise(3 * k + 2)) + 0.5;
        let (held, exact) = (set.value(part * size), field.value(part * size));
        let (slot, _) = set.brick_at(part * size);
        match slot {
            EMPTY => {
                empty += 1;
                assert!(exact < 0.0);
            }
            FULL => {
                full += 1;
                assert!(exact > 0.0);
            }
            _ => {
                between += 1;
                // (Δx²/8) |∇²| of kernels whose shortest half axis is 1.25 voxels, over a peak of
                // about 2.
                assert!((held - exact).abs() < 0.35, "{held} is {exact}");
            }
        }
    }
    assert!(full > 100 && empty > 100 && between > 100);
    // The gradient agrees with finite differences.
    let (at, step) = (DVec3::new(1.0, 0.88, 0.8), 1e-6);
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        let change = field.value(at + step * axis) - field.value(at - step * axis);
        let slope = field.gradient(at).dot(axis);
        // Rounding of values of about 1 over the step, and the squared step times the
        // third derivative.
        assert!((change / (2.0 * step) - slope).abs() < 1e-6 * field.gradient(at).length() + 1e-8);
    }
    // Near the surface the gradient points downward, into the water.
    let down = set.gradient(DVec3::new(1.0, 0.9, 0.8)).normalize();
    assert!(down.y < -0.95, "{down}");
}

/// The same frame gives the same set for any number of threads.
#[test]
fn a_level_set_does_not_depend_on_threads() {
    let size = DVec3::splat(1.5);
    let pool = lattice([15, 6, 15], DVec3::ZERO, 0.4);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let alone = one
        .expect("a thread")
        .install(|| LevelSet::new(&pool, size, D));
    assert_eq!(alone, LevelSet::new(&pool, size, D));
}

/// Below a pool, the light's path is the depth over the cosine; beside a wall of water it is
/// shorter, as part of it is dry.
#[test]
fn light_goes_straight_down_through_a_pool() {
    let size = DVec3::new(3.0, 2.0, 3.0);
    let set = LevelSet::new(&lattice([30, 12, 30], DVec3::ZERO, 0.0), size, D);
    let towards = DVec3::new(0.3, 0.9, 0.1).normalize();
    let light = Sunlight::new(&set, towards);
    let deep = |y: f64| light.path(DVec3::new(1.0, y, 1.2));
    for y in [0.2, 0.5, 0.8] {
        let wanted = (1.2 - y) / towards.y;
        // There are four samples per pitch of two spacings, and the surface lies between two nodes.
        assert!((deep(y) - wanted).abs() < D, "{} is {wanted}", deep(y));
    }
    assert!(deep(1.5) < 1e-6, "there is no water above");
    let straight = Sunlight::new(&set, DVec3::Y);
    assert!(straight.path(DVec3::new(1.0, 0.2, 1.2)) < deep(0.2) - 0.02);
}

/// The field's value and gradient are those of all kernels, whichever cells they are in.
#[test]
fn a_field_is_the_sum_of_all_kernels() {
    let size = DVec3::splat(10.0 * D);
    let place = |k: usize| size * DVec3::from([0, 1, 2].map(|axis| 0.5 + noise(3 * k + axis)));
    let places: Vec<DVec3> = (0..600).map(place).collect();
    let kernels = Kernels::fit(&places, size, D);
    let field = kernels.field();
    let all = |x: DVec3| {
        let sum: f64 = kernels.ellipsoids.iter().map(|it| it.value(x)).sum();
        sum / kernels.level - 1.0
    };
    let mut controls = 0;
    for k in 600..900 {
        let x = 1.2 * place(k) - 0.1 * size;
        let (value, slope) = field.value_and_gradient(x);
        // Some hundred terms of order 1.
        assert!((value - all(x)).abs() < 1e-12, "{value} {}", all(x));
        assert_eq!(value, field.value(x));
        // By central differences: the remainder is h² times a third derivative, 1e-9, and the
        // rounding is 1e-16 over h.
        let h = 1e-5 * D;
        let along = |axis: DVec3| (all(x + h * axis) - all(x - h * axis)) / (2.0 * h);
        let differences = DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z));
        assert!(
            (slope - differences).length() * D < 1e-7,
            "{slope} {differences}"
        );
        // Negative control: a hundredth of a spacing away.
        if slope.length() * D > 0.1 {
            let along = 0.01 * D * slope.normalize();
            assert!((field.value(x + along) - all(x)).abs() > 1e-4);
            controls += 1;
        }
    }
    assert!(controls > 100, "{controls}");
}
