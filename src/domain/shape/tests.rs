use std::f64::consts::PI;

use super::super::{
    mesh::tests::{box_mesh, sphere},
    thin::Needed,
};
use super::*;

const RATE: f64 = 10.0;

fn moved_box(way: f64) -> TriangleMesh {
    box_mesh(Bounds {
        min: DVec3::new(way, 0.0, 0.0),
        max: DVec3::new(1.0 + way, 1.0, 1.0),
    })
}

/// A box that goes 0.3 m along x in each of two intervals.
fn slides() -> ShapeSequence {
    let meshes = [0.0, 0.3, 0.6].map(moved_box);
    ShapeSequence::new(meshes.to_vec(), 0.5, RATE)
}

#[test]
fn vertices_move_evenly_between_two_meshes_and_rest_outside() {
    let shape = slides();
    assert_eq!(shape.times(), [0.5, 0.7]);
    for (time, x) in [
        (0.0, 0.0),
        (0.5, 0.0),
        (0.52, 0.06),
        (0.6, 0.3),
        (0.69, 0.57),
        (3.0, 0.6),
    ] {
        let found = shape.mesh(time).vertices[0].x;
        assert!((found - x).abs() < 1e-12, "{time}: {found}");
    }
    // Before the first mesh, after the last one, and when both ends only touch an interval.
    for (span, speed) in [([0.0, 0.5], 0.0), ([0.0, 0.51], 3.0), ([0.7, 9.0], 0.0)] {
        let found = shape.peak_speed(span[0], span[1]);
        assert!((found - speed).abs() < 1e-12, "{span:?}: {found}");
    }
    assert_eq!(shape.breaks().count(), 0);
}

#[test]
fn a_sliding_box_has_its_exact_distance_and_velocity_at_any_time() {
    let shape = slides();
    let spacing = 0.125;
    let field = ShapeField::new(&shape, 0.5, spacing, None).expect("few nodes");
    // From 0.53 s to 0.62 s it goes from 0.09 to 0.36.
    let step = field.step(0.53, 0.09);
    for (share, x) in [(0.0, 0.09), (1.0, 0.36)] {
        // In front of the middles of its faces distances are linear.
        for off in [-0.2, -0.05, 0.1, 0.3] {
            let front = DVec3::new(1.0 + x + off, 0.5, 0.5);
            assert!(
                (step.sample(front, share) - off).abs() < 1e-6,
                "{share} {off}"
            );
            assert!((step.gradient(front, share) - DVec3::X).length() < 1e-5);
        }
    }
    for x in [
        DVec3::new(1.2, 0.5, 0.5),
        DVec3::new(-0.3, 1.4, 0.2),
        DVec3::splat(0.4),
    ] {
        assert!(
            (step.velocity_at(x) - 3.0 * DVec3::X).length() < 1e-6,
            "{x}"
        );
    }
    assert!((step.fastest - 3.0).abs() < 1e-6);
    // Half of this step is before the first mesh: the mean velocity is half.
    let half = field.step(0.48, 0.04).velocity_at(DVec3::splat(0.5));
    assert!((half - 1.5 * DVec3::X).length() < 1e-6, "{half}");
    let rest = field.step(0.9, 0.1);
    assert_eq!((rest.fastest, &rest.before), (0.0, &rest.after));
    // A shifted field, and one with another origin.
    let other = field.moved(DVec3::Y).shifted(0.01).step(0.53, 0.09);
    let x = DVec3::new(1.3, 0.5, 0.5);
    assert!((other.sample(x + DVec3::Y, 0.0) - step.sample(x, 0.0) - 0.01).abs() < 1e-6);
}

/// A plate thinner than the distance that it goes between two meshes: it never opens.
#[test]
fn a_thin_plate_is_whole_between_its_meshes() {
    let plate = |x: f64| {
        box_mesh(Bounds {
            min: DVec3::new(x, 0.0, 0.0),
            max: DVec3::new(x + 0.2, 1.0, 1.0),
        })
    };
    let shape = ShapeSequence::new(vec![plate(0.0), plate(1.0)], 0.0, 1.0);
    let field = ShapeField::new(&shape, 0.3, 0.1, None).expect("few nodes");
    for time in [0.0, 0.05, 0.33, 0.5, 0.77, 1.0] {
        let depth = field.at(time).sample(DVec3::new(time + 0.1, 0.5, 0.5));
        // At nodes 0.1 m apart the middle is at most half a spacing from one.
        assert!(depth < -0.04, "{time}: {depth}");
    }
    // Control: between the two meshes alone there would be nothing.
    let [a, b] = [0.0, 1.0].map(|time| field.at(time).sample(DVec3::new(0.6, 0.5, 0.5)));
    assert!(0.5 * (a + b) > 0.2, "{a} {b}");
}

#[test]
fn results_do_not_depend_on_what_was_asked_before() {
    let shape = slides();
    let new = || ShapeField::new(&shape, 0.5, 0.125, None).expect("few nodes");
    let times: Vec<f64> = (0..12).map(|k| 0.48 + 0.02 * f64::from(k)).collect();
    let field = new();
    for &time in times.iter().chain(times.iter().rev()) {
        assert_eq!(*field.step(time, 0.02), *new().step(time, 0.02), "{time}");
    }
}

/// A sphere whose radius grows by 0.2 m in a second, with other triangles after a second.
fn grows(rings: [u32; 2]) -> ShapeSequence {
    let [a, b] = [0, 1].map(|k| sphere(DVec3::ZERO, 0.5 + 0.2 * k as f64, rings[k]));
    ShapeSequence::new(vec![a, b], 0.0, 1.0)
}

#[test]
fn other_triangles_take_their_velocity_from_the_nearest_point() {
    for (rings, breaks) in [([24, 24], 0), ([24, 31], 1)] {
        let shape = grows(rings);
        assert_eq!(shape.breaks().count(), breaks, "{rings:?}");
        let field = ShapeField::new(&shape, 0.3, 0.05, None).expect("few nodes");
        let step = field.step(0.25, 0.5);
        // Flat triangles are R (1 − cos(π/48)) below the sphere, twice that in a quad's middle.
        let sagitta = 2.0 * 0.7 * (1.0 - (PI / 48.0).cos());
        for direction in [
            DVec3::X,
            DVec3::new(0.6, 0.0, 0.8),
            DVec3::splat(1.0 / 3f64.sqrt()),
        ] {
            let found = step.velocity_at(0.6 * direction);
            assert!(
                (found - 0.2 * direction).length() < 0.02 + sagitta,
                "{found}"
            );
            for (share, radius) in [(0.0, 0.55), (1.0, 0.65)] {
                // Half a spacing squared over twice the radius of curvature, by trilinear values.
                let most = sagitta + 0.375 * 0.05 * 0.05 / 0.5;
                let found = step.sample(radius * direction, share);
                assert!(found.abs() < most, "{rings:?} {share}: {found}");
            }
        }
        assert!((shape.peak_speed(0.0, 1.0) - 0.2).abs() < sagitta);
    }
}

#[test]
fn samples_cover_the_surface_at_any_time_and_have_its_area_and_velocity() {
    let spacing = 0.05;
    for rings in [[24, 24], [24, 31]] {
        let shape = grows(rings);
        let samples = ShapeSamples::new(&shape, spacing);
        for (time, radius) in [(0.0, 0.5), (0.5, 0.6), (1.0, 0.7), (2.0, 0.7)] {
            let points = samples.at(time, 0.25);
            assert_eq!(points.len(), samples.count());
            let area: f64 = points.iter().map(|point| point.area).sum();
            let later = rings[0] != rings[1] && time > 0.0;
            let whole = if later { 0.7 } else { radius };
            let exact = 4.0 * PI * whole * whole;
            assert!(
                (area / exact - 1.0).abs() < 0.02,
                "{rings:?} {time}: {area} {exact}"
            );
            let speed = if time == 0.0 || time == 2.0 { 0.0 } else { 0.2 };
            for point in points.iter().filter(|point| point.area > 0.0) {
                let normal = point.position.normalize();
                assert!((point.position.length() - radius).abs() < 0.01, "{time}");
                assert!((point.velocity - speed * normal).length() < 0.02, "{time}");
            }
            // No direction is without a sample nearby.
            for k in 0..200u32 {
                let (z, angle) = (1.0 - (f64::from(k) + 0.5) / 100.0, 2.399_963 * f64::from(k));
                let r = (1.0 - z * z).sqrt();
                let x = radius * DVec3::new(r * angle.cos(), r * angle.sin(), z);
                let apart = points.iter().map(|point| point.position.distance(x));
                let least = apart.fold(f64::INFINITY, f64::min);
                assert!(least < 1.3 * spacing, "{rings:?} {time}: {least}");
            }
        }
    }
}

/// A box that becomes five times as long: the samples of the short one alone would be far apart.
#[test]
fn stretched_triangles_get_more_samples() {
    let long = |length: f64| {
        box_mesh(Bounds {
            min: DVec3::ZERO,
            max: DVec3::new(length, 1.0, 1.0 + (5.0 - length)),
        })
    };
    let shape = ShapeSequence::new(vec![long(1.0), long(5.0)], 0.0, 1.0);
    let samples = ShapeSamples::new(&shape, 0.1);
    for (time, length) in [(0.0, 1.0), (1.0, 5.0)] {
        let points = samples.at(time, 0.0);
        let area: f64 = points.iter().map(|point| point.area).sum();
        let exact = long(length).area();
        assert!((area / exact - 1.0).abs() < 1e-9, "{area} {exact}");
        for k in 0..50 {
            let x = DVec3::new(length * (f64::from(k) + 0.5) / 50.0, 0.4, 0.0);
            let apart = points.iter().map(|point| point.position.distance(x));
            let least = apart.fold(f64::INFINITY, f64::min);
            assert!(least < 0.13, "{time} {k}: {least}");
        }
    }
}

/// A plate that is thin beside the nodes has nodes inside, wherever between them it stands, and its
/// velocity. Negative control: as it is, it has none between two nodes.
#[test]
fn a_thin_plate_is_as_thick_as_asked_at_any_time() {
    let plate = |way: f64| {
        box_mesh(Bounds {
            min: DVec3::new(way - 0.01, 0.0, 0.0),
            max: DVec3::new(way + 0.01, 1.0, 1.0),
        })
    };
    let shape = ShapeSequence::new([0.0, 0.3].map(plate).to_vec(), 0.0, RATE);
    let field = |least| ShapeField::new(&shape, 0.5, 0.125, least).expect("few nodes");
    let (thick, as_is) = (field(Some(Needed::Everywhere(0.19))), field(None));
    let mut open = 0;
    for k in 0..10 {
        let time = 0.01 * f64::from(k);
        let middle = DVec3::new(3.0 * time, 0.5, 0.5);
        // Halfway between two nodes the mean of theirs, each off by less than their difference.
        let inside = thick.at(time).sample(middle);
        assert!((-0.095 - 1e-6..0.0).contains(&inside), "{time}: {inside}");
        open += usize::from(as_is.at(time).sample(middle) > 0.0);
        // A node within a quarter of a spacing beyond the middle is as far off it as one before.
        let beside = middle + DVec3::new(0.15, 0.0, 0.0);
        let off = thick.at(time).sample(beside) - 0.055;
        assert!(off.abs() < 0.03, "{time}: {off}");
    }
    assert!(open > 5, "{open}");
    let step = thick.step(0.0, 0.05);
    assert!((step.fastest - 3.0).abs() < 1e-6, "{}", step.fastest);
}
