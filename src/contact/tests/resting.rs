//! Bodies that come to rest or slide.

use glam::{DAffine3, DQuat};

use super::*;

#[test]
fn a_box_that_falls_rests_on_the_floor() {
    for tilt in [0.0, 0.3, 1.0] {
        let fallen = |resolves: bool| {
            let mesh = cuboid(DVec3::new(0.3, 1.0, 0.2), DVec3::splat(0.5));
            let mut run = Run::new(&[], &[], vec![mesh]);
            run.states[0].turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), tilt);
            run.resolves = resolves;
            run.fall(&floor(), 3.0)
        };
        let run = fallen(true);
        assert!(run.lowest(0).abs() < 1e-3 * 0.5, "{}", run.lowest(0));
        assert!((run.states[0].centre.y - 0.25).abs() < 1e-3 * 0.5);
        assert!(run.fastest() < 1e-3 && run.states[0].spin.length() < 1e-3);
        // Negative control.
        assert!(fallen(false).lowest(0) < -10.0);
    }
}

/// Three boxes of which each is half of the one below, and three of one size.
#[test]
fn stacked_boxes_stay() {
    for sizes in [[0.5, 0.5, 0.5], [0.8, 0.4, 0.2]] {
        let stack = |shift: f64| {
            let mut top = 0.0;
            let boxes = sizes.map(|size| {
                top += size;
                let at = DVec3::new(shift * top, top - 0.5 * size, 0.0);
                cuboid(at, DVec3::splat(size))
            });
            Run::new(&[], &[], boxes.to_vec()).fall(&floor(), 5.0)
        };
        let drift = |run: &Run, index: usize| {
            (run.states[index].centre - run.bodies[index].mass.centre).length()
        };
        let run = stack(0.0);
        for (index, size) in sizes.into_iter().enumerate() {
            let drift = drift(&run, index);
            assert!(drift < 1e-3 * size, "{index}: {drift}");
        }
        assert!(run.fastest() < 1e-3);
        // Negative control: leaning by more than half of a box at the top.
        assert!(drift(&stack(1.5), 2) > 0.1);
    }
}

/// On a slope a box stays if tan a is less than the coefficient of friction, and otherwise slides
/// with g (sin a - μ cos a).
#[test]
fn a_box_slides_down_a_wedge_if_it_is_steep() {
    for (slope, slides) in [(0.25_f64, false), (0.35, true)] {
        let turn = DQuat::from_rotation_z(-slope.atan());
        let tilted = |mesh: TriangleMesh| mesh.transformed(&DAffine3::from_quat(turn));
        let wedge = tilted(cuboid(
            DVec3::new(5.0, -0.5, 0.0),
            DVec3::new(20.0, 1.0, 4.0),
        ));
        let body = tilted(cuboid(DVec3::new(0.0, 0.1, 0.3), DVec3::new(0.3, 0.2, 0.3)));
        let run = Run::new(&[&wedge], &[], vec![body]).fall(&nowhere(), 1.0);
        let way = (run.states[0].centre - run.bodies[0].mass.centre).length();
        let [sine, cosine] = [slope, 1.0].map(|x| x / (1.0 + slope * slope).sqrt());
        let expected = 0.5 * -GRAVITY.y * (sine - FRICTION * cosine).max(0.0);
        // A step of velocity comes before one of position: half a step more.
        let tolerance = if slides { 0.02 * expected } else { 1e-4 };
        assert!((way - expected).abs() < tolerance, "{way} {expected}");
        assert_eq!(expected > 100.0 * tolerance.min(1e-4), slides);
    }
}

/// A plane of many triangles, in random order of diagonals.
fn field(cells: u32, edge: f64) -> TriangleMesh {
    let row = cells + 1;
    let vertices = (0..row * row).map(|n| {
        let [i, j] = [n % row, n / row].map(|k| (f64::from(k) - 0.5 * f64::from(cells)) * edge);
        DVec3::new(i, 0.0, j)
    });
    let quads = (0..cells * cells).flat_map(|n| {
        let a = n / cells * row + n % cells;
        let [b, c, d] = [a + 1, a + row, a + row + 1];
        match n * 7 % 5 < 2 {
            true => [[a, c, b], [b, c, d]],
            false => [[a, c, d], [a, d, b]],
        }
    });
    TriangleMesh {
        vertices: vertices.collect(),
        triangles: quads.collect(),
    }
}

/// Edges between triangles of one plane do not hold a body that slides across them: it stops after
/// v²/2μg, without turning.
#[test]
fn a_box_slides_across_triangles() {
    let ground = field(60, 0.13);
    let mut run = Run::new(
        &[&ground],
        &[],
        vec![cuboid(
            DVec3::new(-1.0, 0.1, 0.05),
            DVec3::new(0.3, 0.2, 0.4),
        )],
    );
    run.states[0].velocity = DVec3::new(2.0, 0.0, 0.3);
    let run = run.fall(&nowhere(), 2.0);
    let way = run.states[0].centre - run.bodies[0].mass.centre;
    let expected = (4.0 + 0.09) / (2.0 * FRICTION * 9.81);
    assert!((way.length() - expected).abs() < 0.02 * expected, "{way}");
    assert!(way.y.abs() < 1e-4 && run.fastest() < 1e-3);
    let turned = run.states[0].turn.angle_between(DQuat::IDENTITY);
    assert!(turned < 0.05, "{turned}");
}

fn heap(count: usize) -> Run {
    let meshes = (0..count).map(|index| {
        let layer = (index / 16) as f64;
        let [i, j] = [index % 4, index / 4 % 4].map(|k| 0.4 * k as f64);
        let shift = DVec3::new(0.07 * layer.sin(), 0.3 + 0.4 * layer, 0.05 * layer.cos());
        cuboid(DVec3::new(i, 0.0, j) + shift, DVec3::new(0.35, 0.3, 0.25))
    });
    Run::new(&[], &[], meshes.collect())
}

fn tank() -> Surroundings<'static> {
    Surroundings {
        walls: Bounds {
            min: DVec3::new(-0.5, 0.0, -0.5),
            max: DVec3::new(1.7, FAR, 1.7),
        },
        ..floor()
    }
}

/// How far any corner is outside the tank, metres.
fn outside(run: &Run) -> f64 {
    let Bounds { min, max } = tank().walls;
    let beyond = |x: DVec3| (min - x).max(x - max).max_element();
    let all = (0..run.bodies.len()).flat_map(|index| run.corners(index));
    all.map(beyond).fold(0.0, f64::max)
}

#[test]
fn a_heap_stays_in_its_tank() {
    // Ten boxes dropped at random angles, and many.
    for (count, seconds, slack) in [(10, 3.0, 1e-4), (120, 3.0, 1e-3)] {
        let dropped = |resolves: bool| {
            let mut run = heap(count);
            run.resolves = resolves;
            for (index, state) in run.states.iter_mut().enumerate() {
                let k = index as f64;
                state.turn = DQuat::from_euler(glam::EulerRot::XYZ, k, 2.0 * k, 3.0 * k);
                state.centre.y += 0.2;
            }
            run.fall(&tank(), seconds)
        };
        let run = dropped(true);
        let beyond = outside(&run);
        assert!(beyond < slack, "{count}: {beyond}");
        assert!(run.states.iter().all(BodyState::is_finite));
        // Negative control.
        assert!(outside(&dropped(false)) > 1.0);
    }
}

#[test]
fn runs_are_the_same_bit_for_bit() {
    let dropped = |shift: f64| {
        let mut run = heap(30);
        run.states[7].centre.x += shift;
        run.fall(&tank(), 0.5).states
    };
    assert_eq!(dropped(0.0), dropped(0.0));
    // Negative control.
    assert_ne!(dropped(0.0), dropped(1e-15));
}

/// A body that overlaps the floor rises at no more than [`PUSH`] and then rests.
#[test]
fn an_overlap_is_pushed_out_gently() {
    let mut run = Run::new(&[], &[], vec![cuboid(DVec3::ZERO, DVec3::splat(0.5))]);
    let mut fastest = 0.0_f64;
    for _ in 0..720 {
        run.step(&floor(), GRAVITY, STEP);
        fastest = fastest.max(run.states[0].velocity.y);
    }
    assert!(fastest < 1.0001 * PUSH && fastest > 0.9 * PUSH, "{fastest}");
    assert!(run.lowest(0).abs() < 5e-4 && run.fastest() < 1e-3);
}

#[test]
fn bodies_keep_the_margin() {
    for margin in [0.0, 0.02] {
        let boxes = [0.3, 0.9].map(|y| cuboid(DVec3::new(0.0, y, 0.0), DVec3::splat(0.5)));
        let mut run = Run::new(&[], &[], boxes.to_vec());
        let pairs = run.bodies.iter().zip(boxes.iter().map(Some));
        run.contacts = Contacts::new(&[], &[], &pairs.collect::<Vec<_>>(), margin).unwrap();
        let run = run.fall(&floor(), 2.0);
        let gap = run.lowest(1) - (run.states[0].centre.y + 0.25);
        assert!((run.lowest(0) - margin).abs() < 1e-4, "{}", run.lowest(0));
        assert!((gap - margin).abs() < 1e-4, "{gap}");
    }
}
