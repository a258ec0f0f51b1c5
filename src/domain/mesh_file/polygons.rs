//! Triangulates polygons over all their corners: each edge of a polygon stays the edge of one
//! triangle, so closed meshes stay closed.
//!
//! A quad is cut along one of its diagonals, a polygon with more corners by a constrained Delaunay
//! triangulation (spade), whose predicates are exact. Ear clipping that skips corners on a straight
//! edge would open the mesh there.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation as _};

/// Ratio of a polygon's area to its squared extent below which it has no normal: rounding of
/// collinear corners.
const FLAT: f64 = 1e-12;

/// Fraction of a quad's area by which its second diagonal must be better, so that rounding does not
/// choose between those of a rectangle.
const BETTER: f64 = 1e-9;

/// Fraction of its extent by which the corners of a flat polygon may be off its plane: more than
/// the rounding of 32-bit floats.
const BENT: f64 = 1e-6;

/// Error for an outline that does not bound a surface: it crosses or overlaps itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Crossing;

/// Triangulates a polygon. Triangles are indices into `corners`, in the polygon's direction.
///
/// The result does not depend on which corner comes first. Collinear corners give triangles
/// without area.
///
/// # Errors
/// [`Crossing`]; a fan about a corner then has the same outline.
pub(super) fn triangles(corners: &[DVec3]) -> Result<Vec<[usize; 3]>, Crossing> {
    if corners.len() == 3 {
        return Ok(vec![[0, 1, 2]]);
    }
    let start = first_corner(corners);
    let turned = |k: usize| (k + start) % corners.len();
    let places: Vec<DVec3> = (0..corners.len()).map(|k| corners[turned(k)]).collect();
    let cut = match normal(&places) {
        Some(_) if let [a, b, c, d] = places[..] => quad([a, b, c, d])?,
        Some(normal) => polygon(&places, normal)?,
        None if are_on_a_line(&places) => about_first(places.len()),
        None => return Err(Crossing),
    };
    Ok(cut.into_iter().map(|t| t.map(turned)).collect())
}

/// A fan about the corner that [`triangles`] starts from.
pub(super) fn fan(corners: &[DVec3]) -> Vec<[usize; 3]> {
    let start = first_corner(corners);
    let turned = |k: usize| (k + start) % corners.len();
    let fan = about_first(corners.len()).into_iter();
    fan.map(|t| t.map(turned)).collect()
}

fn about_first(count: usize) -> Vec<[usize; 3]> {
    (1..count - 1).map(|k| [0, k, k + 1]).collect()
}

/// Start of the lexicographically least rotation of the corners, which does not depend on where the
/// file begins. Takes linear time (Booth 1980, with two candidates).
fn first_corner(corners: &[DVec3]) -> usize {
    let count = corners.len();
    let order = |i: usize, j: usize| {
        // Treats zeros of either sign as equal.
        let [a, b] = [i, j].map(|k| (corners[k % count] + 0.0).to_array());
        let axes = a.iter().zip(&b).map(|(a, b)| a.total_cmp(b));
        axes.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
    };
    let (mut i, mut j, mut same) = (0, 1, 0);
    while i < count && j < count && same < count {
        match order(i + same, j + same) {
            std::cmp::Ordering::Equal => same += 1,
            unlike => {
                match unlike.is_gt() {
                    true => i += same + 1,
                    false => j += same + 1,
                }
                j += usize::from(i == j);
                same = 0;
            }
        }
    }
    i.min(j)
}

/// Twice the area vector (Newell's method); `None` for a polygon without area.
fn normal(places: &[DVec3]) -> Option<DVec3> {
    let about = |k: usize| places[k] - places[0];
    let sum: DVec3 = (1..places.len() - 1)
        .map(|k| about(k).cross(about(k + 1)))
        .sum();
    (sum.length() > FLAT * extent_squared(places)).then_some(sum)
}

fn extent_squared(places: &[DVec3]) -> f64 {
    let away = places.iter().map(|p| p.distance_squared(places[0]));
    away.fold(0.0, f64::max)
}

fn are_on_a_line(places: &[DVec3]) -> bool {
    let far = |a: &&DVec3, b: &&DVec3| {
        let [a, b] = [a, b].map(|p| p.distance_squared(places[0]));
        a.total_cmp(&b)
    };
    let along = places
        .iter()
        .max_by(far)
        .map_or(DVec3::ZERO, |p| *p - places[0]);
    let least = FLAT * along.length_squared();
    places
        .iter()
        .all(|p| along.cross(*p - places[0]).length() <= least)
}

/// Cuts along the diagonal whose smaller triangle is larger; areas are signed by the quad's
/// own normal.
fn quad(p: [DVec3; 4]) -> Result<Vec<[usize; 3]>, Crossing> {
    let normal = (p[2] - p[0]).cross(p[3] - p[1]);
    let area = |[a, b, c]: [usize; 3]| normal.dot((p[b] - p[a]).cross(p[c] - p[a]));
    let least = |cut: &[[usize; 3]; 2]| area(cut[0]).min(area(cut[1]));
    let cuts = [[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]];
    let [first, second] = [least(&cuts[0]), least(&cuts[1])];
    let room = BETTER * normal.length_squared();
    if first.max(second) < -room {
        return Err(Crossing);
    }
    Ok(cuts[usize::from(second > first + room)].to_vec())
}

type Cdt = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// Projection of a polygon's corners to a plane.
///
/// A flat polygon is projected along the axis nearest to its normal, which is exact for collinear
/// corners. A bent one is projected along its normal: along an axis, the part seen edge-on would
/// overlap the rest, or vanish.
fn view(places: &[DVec3], normal: DVec3) -> impl Fn(DVec3) -> DVec2 {
    let unit = normal.normalize();
    let off = places.iter().map(|p| unit.dot(*p - places[0]).abs());
    let is_flat = off.fold(0.0, f64::max) <= BENT * extent_squared(places).sqrt();
    let [u, v] = if is_flat {
        let axis = normal.abs().max_position();
        let [u, v] = [1, 2].map(|k| DVec3::AXES[(axis + k) % 3]);
        if normal[axis] < 0.0 { [v, u] } else { [u, v] }
    } else {
        let u = unit.any_orthonormal_vector();
        [u, unit.cross(u)]
    };
    move |p| DVec2::new(u.dot(p), v.dot(p))
}

/// Triangulates the region that the outline winds around once in the projection of [`view`].
fn polygon(places: &[DVec3], normal: DVec3) -> Result<Vec<[usize; 3]>, Crossing> {
    let seen = view(places, normal);
    let mut cdt = Cdt::new();
    let mut corner_of = HashMap::new();
    let mut handles = Vec::with_capacity(places.len());
    for (k, p) in places.iter().enumerate() {
        let at = seen(*p).to_array().map(settled);
        let handle = cdt.insert(Point2::from(at)).map_err(|_| Crossing)?;
        // Different corners that coincide only in this projection.
        if places[*corner_of.entry(handle).or_insert(k)] != *p {
            return Err(Crossing);
        }
        handles.push(handle);
    }
    // Net number of times that the outline follows each directed edge of the triangulation.
    let mut along = HashMap::<_, i32>::new();
    let mut cut = Vec::new();
    for (k, &from) in handles.iter().enumerate() {
        let to = handles[(k + 1) % handles.len()];
        if from == to {
            // A corner that the file repeats.
            continue;
        }
        let edges = cdt.try_add_constraint(from, to);
        if edges.is_empty() {
            return Err(Crossing);
        }
        let ends = edges.iter().map(|edge| cdt.directed_edge(*edge).vertices());
        let ends: Vec<_> = ends.map(|it| it.map(|end| end.fix())).collect();
        // Corners on the edge: triangles without area connect it to its pieces.
        let between: Vec<_> = ends[1..].iter().map(|[begin, _]| *begin).collect();
        let mut next = to;
        for &at in between.iter().rev() {
            cut.push([from, next, at].map(|handle| corner_of[&handle]));
            next = at;
        }
        for [a, b] in ends {
            *along.entry([a, b]).or_default() += 1;
            *along.entry([b, a]).or_default() -= 1;
        }
    }
    let mut winding = vec![None; cdt.num_all_faces()];
    winding[cdt.outer_face().fix().index()] = Some(0);
    let mut border: Vec<_> = cdt.convex_hull().map(|edge| edge.fix()).collect();
    while let Some(edge) = border.pop() {
        let edge = cdt.directed_edge(edge);
        let Some(here) = winding[edge.face().fix().index()] else {
            continue;
        };
        let there = edge.rev().face();
        let ends = edge.vertices().map(|end| end.fix());
        // The winding number to the left of an edge is one more than to the right.
        let expected = here - along.get(&ends).copied().unwrap_or_default();
        let slot = &mut winding[there.fix().index()];
        if slot.is_some() || there.is_outer() {
            continue;
        }
        *slot = Some(expected);
        if let Some(inner) = there.as_inner() {
            border.extend(inner.adjacent_edges().map(|edge| edge.fix()));
        }
    }
    for face in cdt.inner_faces() {
        match winding[face.fix().index()] {
            Some(1) => cut.push(face.vertices().map(|corner| corner_of[&corner.fix()])),
            Some(0) => {}
            _ => return Err(Crossing),
        }
    }
    Ok(cut)
}

/// Replaces coordinates too small for spade by zero.
fn settled(x: f64) -> f64 {
    if x.abs() < spade::MIN_ALLOWED_VALUE {
        return 0.0;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(corners: &[[f64; 2]]) -> Vec<DVec3> {
        corners
            .iter()
            .map(|[x, y]| DVec3::new(*x, *y, 0.5))
            .collect()
    }

    fn area(corners: &[DVec3], cut: &[[usize; 3]]) -> f64 {
        let of = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|k| corners[k]);
            0.5 * (b - a).cross(c - a).length()
        };
        cut.iter().map(of).sum()
    }

    /// Directed edges that no opposite one cancels.
    fn outline(cut: &[[usize; 3]]) -> Vec<[usize; 2]> {
        let edges = cut.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut net = HashMap::<[usize; 2], i32>::new();
        for [a, b] in edges {
            *net.entry([a, b]).or_default() += 1;
            *net.entry([b, a]).or_default() -= 1;
        }
        let mut left: Vec<_> = net.into_iter().filter(|(_, n)| *n > 0).collect();
        left.sort_unstable();
        left.into_iter().map(|(edge, _)| edge).collect()
    }

    /// Each polygon keeps its outline and area, wherever it begins and whichever way it faces.
    #[test]
    fn a_polygon_keeps_its_outline_and_area_wherever_it_begins() {
        let polygons: [(&str, &[[f64; 2]], f64); 6] = [
            ("rectangle", &[[0., 0.], [2., 0.], [2., 1.], [0., 1.]], 2.0),
            ("dart", &[[0., 0.], [2., 0.], [0.4, 0.4], [0., 2.]], 0.8),
            (
                "triangle with a corner on an edge",
                &[[0., 0.], [0.3, 0.], [1., 0.], [0., 1.]],
                0.5,
            ),
            (
                "L",
                &[[0., 0.], [3., 0.], [3., 1.], [1., 1.], [1., 2.], [0., 2.]],
                4.0,
            ),
            (
                "U with corners on its edges",
                &[
                    [0., 0.],
                    [0.5, 0.],
                    [3., 0.],
                    [3., 2.],
                    [2., 2.],
                    [2., 1.],
                    [1.5, 1.],
                    [1., 1.],
                    [1., 2.],
                    [0., 2.],
                    [0., 1.3],
                ],
                5.0,
            ),
            (
                "frame with a bridge to its hole",
                &[
                    [0., 0.],
                    [3., 0.],
                    [3., 3.],
                    [0., 3.],
                    [0., 0.],
                    [1., 1.],
                    [1., 2.],
                    [2., 2.],
                    [2., 1.],
                    [1., 1.],
                ],
                8.0,
            ),
        ];
        for (name, polygon, expected) in polygons {
            let count = polygon.len();
            let tilt = glam::DQuat::from_rotation_x(0.7) * glam::DQuat::from_rotation_y(2.0);
            for (turn, is_reversed) in (0..count).flat_map(|turn| [(turn, false), (turn, true)]) {
                let mut corners = flat(polygon);
                corners.rotate_left(turn);
                if is_reversed {
                    corners.reverse();
                }
                for corners in [corners.clone(), corners.iter().map(|p| tilt * *p).collect()] {
                    let cut = triangles(&corners).expect(name);
                    assert_eq!(cut.len(), count - 2, "{name}");
                    let found = area(&corners, &cut);
                    // 24 roundings of a few square metres each.
                    assert!((found - expected).abs() < 1e-14, "{name}: {found}");
                    // Coincident corners count as one: compare positions.
                    let at = |k: usize| corners[k].to_array().map(f64::to_bits);
                    let first = |k: usize| (0..count).find(|&j| at(j) == at(k)).unwrap_or(k);
                    let merged: Vec<_> = cut.iter().map(|t| t.map(first)).collect();
                    let ring: Vec<_> = (0..count)
                        .map(|k| [first(k), first((k + 1) % count)])
                        .collect();
                    let mut own: Vec<_> = ring
                        .iter()
                        .filter(|[a, b]| !ring.contains(&[*b, *a]))
                        .copied()
                        .collect();
                    own.sort_unstable();
                    assert_eq!(outline(&merged), own, "{name}");
                }
            }
        }
    }

    #[test]
    fn the_corner_that_comes_first_changes_no_triangle() {
        // The saddle's two diagonals bound different solids.
        let saddle = [[0., 0., 0.], [1., 0., 1.], [1., 1., 0.], [0., 1., 1.]];
        let saddle: Vec<_> = saddle.into_iter().map(DVec3::from_array).collect();
        let bay = flat(&[[0., 0.], [3., 0.], [3., 1.], [1., 1.], [1., 2.], [0., 2.]]);
        for corners in [saddle, bay] {
            let places = |turn: usize| {
                let mut corners = corners.clone();
                corners.rotate_left(turn);
                let cut = triangles(&corners).expect("no crossing");
                cut.into_iter()
                    .map(|t| t.map(|k| corners[k]))
                    .collect::<Vec<_>>()
            };
            for turn in 1..corners.len() {
                assert_eq!(places(turn), places(0));
            }
            // Negative control: fans about the file's first corner differ.
            let about = |turn: usize| -> Vec<[DVec3; 3]> {
                let mut corners = corners.clone();
                corners.rotate_left(turn);
                let fan = about_first(corners.len()).into_iter();
                fan.map(|t| t.map(|k| corners[k])).collect()
            };
            assert_ne!(about(1), about(0));
        }
    }

    #[test]
    fn outlines_that_cross_are_refused_and_lines_are_not() {
        let crossing: [&[[f64; 2]]; 4] = [
            // A bow tie without net area, one with some, a star, and a ring that is
            // traversed twice.
            &[[0., 0.], [1., 1.], [1., 0.], [0., 1.]],
            &[[0., 0.], [2., 2.], [2., 0.], [0., 1.]],
            &[[0., 1.], [1., -1.], [-1., 0.3], [1., 0.3], [-1., -1.]],
            &[[0., 0.], [3., 0.], [3., 3.], [0., 0.], [3., 0.], [3., 3.]],
        ];
        for corners in crossing.map(flat) {
            assert_eq!(triangles(&corners), Err(Crossing));
            assert_eq!(fan(&corners).len(), corners.len() - 2);
        }
        let line = flat(&[[0., 0.], [1., 0.], [2., 0.], [0.5, 0.]]);
        let cut = triangles(&line).expect("a line");
        assert_eq!((cut.len(), area(&line, &cut)), (2, 0.0));
    }

    /// A face over the edge of a box, whose top and side have equal area: neither is lost, wherever
    /// the face begins, even if the top overhangs.
    #[test]
    fn a_polygon_over_an_edge_is_both_of_its_parts() {
        for overhang in [0.0, 0.05, 0.1] {
            let bent = [
                [0.0, 1.0, 0.0],
                [1.0, 1.0, 0.0],
                [1.0, 1.0, 1.0 + overhang],
                [1.0, 0.0, 1.0],
                [0.0, 0.0, 1.0],
                [0.0, 1.0, 1.0 + overhang],
            ]
            .map(DVec3::from_array);
            let truth = (1.0 + overhang) + 1.0_f64.hypot(overhang);
            for start in 0..bent.len() {
                let mut corners = bent.to_vec();
                corners.rotate_left(start);
                for _ in 0..2 {
                    let found = area(&corners, &triangles(&corners).expect("no crossing"));
                    assert!(
                        (found / truth - 1.0).abs() < 1e-12,
                        "{overhang}: {found} for {truth}"
                    );
                    corners.reverse();
                }
            }
        }
    }

    /// A file that repeats corners costs no more than others: quadratic time would take hours.
    #[test]
    fn repeated_corners_cost_no_more_than_others() {
        let places = [DVec3::X, DVec3::Y];
        for kinds in [1, 2] {
            let corners: Vec<DVec3> = (0..1_000_000).map(|k| places[k % kinds]).collect();
            assert_eq!(first_corner(&corners), kinds - 1);
        }
    }
}
