use super::*;
use crate::whitewater::{LIFE, none};

const D: f64 = 0.1;
const SIZE: DVec3 = DVec3::new(2.0, 1.0, 1.2);
const CORNER: DVec3 = DVec3::new(-0.5, 0.25, 3.0);
/// Distance between foam particles, and their radius, metres.
const STEP: f64 = 0.05;
const RADIUS_M: f32 = 0.02;
/// Height of the pool's surface.
const TOP: f64 = 0.5;

fn room(period: DVec3) -> FoamBox {
    FoamBox {
        corner: CORNER,
        walls: Bounds {
            min: DVec3::ZERO,
            max: SIZE,
        },
        period: Period(period),
        spacing: D,
    }
}

/// Whitewater of one kind on a lattice over the part of a pool where `is_in`, at `heights` in turn.
fn foam(
    kind: WhitewaterKind,
    heights: &[f64],
    is_in: impl Fn(f64, f64) -> bool,
    age: impl Fn(DVec3) -> f64,
) -> Particles {
    let mut white = none();
    let cells = |length: f64| (length / STEP).round() as usize;
    for (i, k) in (0..cells(SIZE.x)).flat_map(|i| (0..cells(SIZE.z)).map(move |k| (i, k))) {
        let [x, z] = [i, k].map(|cell| STEP * (cell as f64 + 0.5));
        if !is_in(x, z) {
            continue;
        }
        let p = DVec3::new(x, TOP + heights[(i + k) % heights.len()], z);
        white.position.push((p + CORNER).as_vec3().to_array());
        white.velocity.push([0.0; 3]);
        white.id.push(white.id.len() as u32);
        let values = [
            (AGE, age(p) as f32),
            (KIND, kind.number()),
            (LIFE, 1.0),
            (RADIUS, RADIUS_M),
        ];
        for (name, value) in values {
            let column = white.attributes.entry(name.to_owned()).or_default();
            column.push(value);
        }
    }
    white
}

/// Points of the surface in a row along x, from wall to wall, in the middle of the pool.
fn row() -> Vec<DVec3> {
    (0..=40)
        .map(|k| DVec3::new(0.05 * f64::from(k), TOP, 0.6))
        .collect()
}

fn up(count: usize) -> Vec<[f32; 3]> {
    vec![[0.0, 1.0, 0.0]; count]
}

/// Bound on the relative error of a sum of the kernel over the lattice instead of its integral, by
/// Poisson's summation: Σ |Ŵ(2πR|k|/STEP)| over whole k ≠ 0, with the Hankel transform
/// Ŵ(q) = 48 J₃(q) / q³ and J₃² ≤ 2 / (π √(q² − 9)).
fn lattice_error() -> f64 {
    let per_step = 2.0 * PI * SUPPORT * D / STEP;
    let square = (-40..=40i32).flat_map(|i| (-40..=40i32).map(move |k| (i, k)));
    square
        .filter(|at| *at != (0, 0))
        .map(|(i, k)| {
            let q = per_step * f64::from(i * i + k * k).sqrt();
            48.0 * (2.0 / (PI * (q * q - 9.0).sqrt())).sqrt() / q.powi(3)
        })
        .sum()
}

/// Area of discs per area of the surface.
fn share() -> f64 {
    PI * f64::from(RADIUS_M).powi(2) / STEP.powi(2)
}

/// Largest relative error of −ln(1 − coverage), which is the area of discs per area.
fn worst(coverage: &[f32], wanted: f64) -> f64 {
    let error = |c: &f32| (-(-f64::from(*c)).ln_1p() / wanted - 1.0).abs();
    coverage.iter().map(error).fold(0.0, f64::max)
}

#[test]
fn discs_of_known_density_cover_what_random_discs_do() {
    let age = |p: DVec3| 2.0 + p.x;
    let everywhere = |_: f64, _: f64| true;
    // f32 rounds the coverage, and the radius, by 2⁻²⁴; the logarithm enlarges the former.
    let tolerance = lattice_error() + 8.0 * 2f64.powi(-24) / share();
    assert!(tolerance < 5e-3, "{tolerance}");
    let points = row();
    for period in [DVec3::ZERO, DVec3::new(SIZE.x, 0.0, 0.0)] {
        for heights in [&[0.0][..], &[0.09, -0.09, 0.0]] {
            let white = foam(WhitewaterKind::Foam, heights, everywhere, age);
            let [coverage, ages] = Foam::new(&white, &room(period)).at(&points, &up(points.len()));
            let error = worst(&coverage, share());
            assert!(error < tolerance, "{period} {heights:?}: {error}");
            // A linear function's mean is its value at the vertex, up to the lattice's error within
            // R; at an end it is reflected, or that of both ends.
            for (p, found) in points.iter().zip(&ages) {
                if p.x > 0.2 && p.x < SIZE.x - 0.2 {
                    let off = (f64::from(*found) - age(*p)).abs();
                    assert!(off < lattice_error() * SUPPORT * D + 1e-6, "{p}: {off}");
                }
            }
            // Negative controls: twice the foam, and later.
            let mut both = white;
            let more = foam(WhitewaterKind::Foam, heights, everywhere, |p| age(p) + 0.1);
            both.position.extend(&more.position);
            both.id.extend(&more.id);
            for (name, column) in &more.attributes {
                both.attributes
                    .entry(name.clone())
                    .or_default()
                    .extend(column);
            }
            let [coverage, later] = Foam::new(&both, &room(period)).at(&points, &up(points.len()));
            assert!(worst(&coverage, share()) > 100.0 * tolerance);
            assert!(later.iter().zip(&ages).all(|(a, b)| a - b > 0.04));
        }
    }
}

#[test]
fn foam_is_where_its_discs_are() {
    let half = |x: f64, _: f64| x < 1.0;
    let white = foam(WhitewaterKind::Foam, &[0.0], half, |_| 1.0);
    let points = row();
    let normals = up(points.len());
    let [coverage, ages] = Foam::new(&white, &room(DVec3::ZERO)).at(&points, &normals);
    for ((p, found), age) in points.iter().zip(&coverage).zip(&ages) {
        if p.x < 0.79 {
            assert!(worst(&[*found], share()) < 5e-3, "{p}: {found}");
        } else if p.x > 1.19 {
            assert_eq!([*found, *age], [0.0; 2], "{p}");
        }
    }
    assert!(coverage.is_sorted_by(|a, b| a >= b || worst(&[*b], share()) < 5e-3));
    // In a periodic box the foam at one end is beside the other.
    let joined = Foam::new(&white, &room(DVec3::new(SIZE.x, 0.0, 0.0))).at(&points, &normals);
    let ends = [0, 40].map(|end| worst(&joined[0][end..=end], 0.5 * share()));
    assert!(ends.iter().all(|error| *error < 5e-3), "{ends:?}");
    assert_eq!(coverage[40], 0.0);
    // Spray and bubbles are no foam.
    for kind in [WhitewaterKind::Spray, WhitewaterKind::Bubble] {
        let other = foam(kind, &[0.0], half, |_| 1.0);
        let found = Foam::new(&other, &room(DVec3::ZERO)).at(&points, &normals);
        assert_eq!(found, [vec![0.0; 41], vec![0.0; 41]]);
    }
    let none = Foam::new(&none(), &room(DVec3::ZERO)).at(&points, &normals);
    assert_eq!(none, [vec![0.0; 41], vec![0.0; 41]]);
}

/// Every disc and image, without a grid.
fn naive(foam: &Foam, place: DVec3, normal: DVec3) -> f64 {
    let weight = |disc: &Disc| {
        let d = disc.place - place;
        let off = d.dot(normal);
        let t = (d - off * normal).length() / foam.radius;
        let w = 3.0 / (PI * foam.radius.powi(2)) * (1.0 - t * t).max(0.0).powi(2);
        let across = (0..3).map(|axis| 1.0 - disc.mirrored[axis] * normal[axis].powi(2));
        disc.area * w * nearness(off.abs() / foam.radius) * across.product::<f64>()
    };
    1.0 - (-foam.discs.iter().map(weight).sum::<f64>()).exp()
}

#[test]
fn sums_by_cells_are_those_over_all_discs() {
    let heights = [0.0, 0.06, 0.13, -0.17, 0.21];
    let white = foam(WhitewaterKind::Foam, &heights, |x, z| x * z < 1.0, |_| 1.0);
    let foam = Foam::new(&white, &room(DVec3::ZERO));
    let places: Vec<DVec3> = (0..300)
        .map(|k| DVec3::new(0.37, 0.11, 0.23) * f64::from(k) % SIZE)
        .map(|p| DVec3::new(p.x, TOP - 0.1 + 0.2 * p.y, p.z))
        .collect();
    let normals: Vec<DVec3> = (0..300)
        .map(|k| DVec3::new(f64::from(k % 7) - 3.0, 2.0, f64::from(k % 5) - 2.0).normalize())
        .collect();
    let told: Vec<[f32; 3]> = normals.iter().map(|n| n.as_vec3().to_array()).collect();
    let [coverage, _] = foam.at(&places, &told);
    let mut met = 0;
    for ((place, normal), found) in places.iter().zip(&told).zip(&coverage) {
        let normal = DVec3::from(normal.map(f64::from));
        let wanted = naive(&foam, *place, normal);
        met += u32::from(wanted > 0.1);
        // Rounding to f32, and normals whose length is off by as much.
        assert!(
            (f64::from(*found) - wanted).abs() < 1e-6,
            "{place}: {found} {wanted}"
        );
    }
    assert!(met > 50, "{met}");
    // The same bytes on any number of threads.
    let pool = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let made = pool.build().unwrap();
        made.install(|| Foam::new(&white, &room(DVec3::ZERO)).at(&places, &told))
    };
    assert_eq!(pool(1), pool(5));
}

/// Foam that reaches a wall which was moved into the box covers as much beside it as elsewhere.
#[test]
fn a_wall_mirrors_foam_where_it_is() {
    let beyond = |x: f64, _: f64| x > 0.8;
    let white = foam(WhitewaterKind::Foam, &[0.0], beyond, |_| 1.0);
    let points: Vec<DVec3> = row().into_iter().filter(|p| p.x > 0.799).collect();
    let normals = up(points.len());
    let mut moved = room(DVec3::ZERO);
    moved.walls.min.x = 0.8;
    let [coverage, _] = Foam::new(&white, &moved).at(&points, &normals);
    assert!(worst(&coverage, share()) < 5e-3, "{coverage:?}");
    // Negative control: with the wall at the side of the box half of the kernel is empty.
    let [coverage, _] = Foam::new(&white, &room(DVec3::ZERO)).at(&points, &normals);
    assert!(worst(&coverage, share()) > 0.4, "{coverage:?}");
}

/// Water thinner than the kernel over a floor: the floor's images do not count as foam on it.
#[test]
fn a_floor_mirrors_nothing_onto_the_surface() {
    let white = foam(WhitewaterKind::Foam, &[0.05 - TOP], |_, _| true, |_| 1.0);
    let points: Vec<DVec3> = row().iter().map(|p| DVec3::new(p.x, 0.05, p.z)).collect();
    let foam = Foam::new(&white, &room(DVec3::ZERO));
    let [coverage, _] = foam.at(&points, &up(points.len()));
    assert!(worst(&coverage, share()) < 5e-3);
    // Negative control: the images are within reach.
    let images = foam.discs.iter().filter(|disc| disc.place.y < 0.0);
    assert!(images.count() > 100);
}
