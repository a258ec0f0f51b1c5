//! Which triangles belong to closed bodies: of those, the sides that face away from an eye outside are never seen.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::uniform::Triangle;

/// How much farther than the nearest depth that is drawn an eye must be from a body's box, so that no corner of the picture cuts it open:
/// a corner 83° off the axis is 1 / cos 83° of that depth away.
const ROOM: f32 = 8.0;

/// Boxes about the closed bodies of a set whose triangles stand first.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Closed {
    /// Least and greatest corner, metres.
    boxes: Vec<[Vec3; 2]>,
    /// How many of the first triangles belong to them.
    triangles: u32,
}

impl Closed {
    /// Puts triangles of closed bodies first, the others behind them, each in their order.
    ///
    /// A body is what hangs together by edges in the same place. It is closed where each is gone along once one way and once the other,
    /// counter-clockwise seen from outside, which its volume tells.
    pub(super) fn put_first(triangles: &mut [Triangle]) -> Self {
        let corners = places(triangles);
        let edges = edges(&corners);
        let bodies = bodies(triangles.len(), &edges);
        let mut found = Self::default();
        let mut is_closed = vec![false; triangles.len()];
        for body in bodies {
            let is_whole = has_no_rim(&corners, &edges, &body) && volume(triangles, &body) > 0.0;
            if is_whole {
                found.boxes.push(box_about(triangles, &body));
                for &k in &body {
                    is_closed[k] = true;
                }
            }
        }
        let order: Vec<Triangle> = [true, false]
            .into_iter()
            .flat_map(|wanted| {
                let of = is_closed.iter().zip(&*triangles);
                of.filter_map(move |(closed, it)| (*closed == wanted).then_some(*it))
            })
            .collect();
        triangles.copy_from_slice(&order);
        found.triangles = is_closed.iter().filter(|closed| **closed).count() as u32;
        found
    }

    /// How many of the first triangles show only their faces to an eye, which draws nothing nearer than `near`: none where it is in a
    /// body's box, or so near to one that the picture may cut it open.
    pub(super) fn seen_from(&self, eye: Vec3, near: f32) -> u32 {
        let room = Vec3::splat(ROOM * near);
        let is_in =
            |[low, high]: &[Vec3; 2]| eye.cmpge(*low - room).all() && eye.cmple(*high + room).all();
        match self.boxes.iter().any(is_in) {
            true => 0,
            false => self.triangles,
        }
    }
}

/// Numbers of the places of each triangle's corners.
fn places(triangles: &[Triangle]) -> Vec<[usize; 3]> {
    let mut numbers = HashMap::new();
    let mut number = |p: [f32; 3]| {
        // Zeros of both signs are one place.
        let key = p.map(|x| (x + 0.0).to_bits());
        let next = numbers.len();
        *numbers.entry(key).or_insert(next)
    };
    (triangles.iter())
        .map(|it| [it.a, it.b, it.c].map(&mut number))
        .collect()
}

/// A side of a triangle, from the lesser place to the greater.
fn side(from: usize, to: usize) -> [usize; 2] {
    [from.min(to), from.max(to)]
}

/// Triangles at each edge, and whether they go along it from its lesser place to the greater.
fn edges(corners: &[[usize; 3]]) -> HashMap<[usize; 2], Vec<(usize, bool)>> {
    let mut edges: HashMap<[usize; 2], Vec<(usize, bool)>> = HashMap::new();
    for (k, &[a, b, c]) in corners.iter().enumerate() {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            let at = edges.entry(side(from, to)).or_default();
            at.push((k, from < to));
        }
    }
    edges
}

/// Triangles that hang together by edges, in the order of their first.
fn bodies(count: usize, edges: &HashMap<[usize; 2], Vec<(usize, bool)>>) -> Vec<Vec<usize>> {
    let mut parent: Vec<usize> = (0..count).collect();
    let root = |parent: &mut Vec<usize>, mut at: usize| {
        while parent[at] != at {
            parent[at] = parent[parent[at]];
            at = parent[at];
        }
        at
    };
    for at in edges.values() {
        for &(other, _) in &at[1..] {
            let (one, other) = (root(&mut parent, at[0].0), root(&mut parent, other));
            parent[one.max(other)] = one.min(other);
        }
    }
    let mut numbers = HashMap::new();
    let mut bodies: Vec<Vec<usize>> = Vec::new();
    for k in 0..count {
        let body = *numbers.entry(root(&mut parent, k)).or_insert(bodies.len());
        if body == bodies.len() {
            bodies.push(Vec::new());
        }
        bodies[body].push(k);
    }
    bodies
}

/// Whether two triangles meet at each edge of a body, and go along it in opposite ways.
fn has_no_rim(
    corners: &[[usize; 3]],
    edges: &HashMap<[usize; 2], Vec<(usize, bool)>>,
    body: &[usize],
) -> bool {
    body.iter().all(|&k| {
        let [a, b, c] = corners[k];
        [[a, b], [b, c], [c, a]].iter().all(|&[from, to]| {
            let at = edges.get(&side(from, to));
            at.is_some_and(|at| matches!(at[..], [(_, one), (_, other)] if one != other))
        })
    })
}

/// m³, negative where the normals point inward.
fn volume(triangles: &[Triangle], body: &[usize]) -> f64 {
    let about = Vec3::from(triangles[body[0]].a).as_dvec3();
    let corner = |p: [f32; 3]| DVec3::from(p.map(f64::from)) - about;
    body.iter()
        .map(|&k| {
            let it = &triangles[k];
            corner(it.a).dot(corner(it.b).cross(corner(it.c))) / 6.0
        })
        .sum()
}

fn box_about(triangles: &[Triangle], body: &[usize]) -> [Vec3; 2] {
    let corners = body.iter().flat_map(|&k| {
        let it = &triangles[k];
        [it.a, it.b, it.c].map(Vec3::from)
    });
    corners.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], p| {
        [low.min(p), high.max(p)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::opaque::box_triangles;

    fn cube(low: f64) -> Vec<Triangle> {
        let box_ = box_triangles(DVec3::splat(low), DVec3::splat(low + 1.0));
        let triangle = |corners: [DVec3; 3]| {
            let [a, b, c] = corners.map(|p| p.as_vec3().to_array());
            Triangle {
                a,
                b,
                c,
                material: low as u32,
                ..Triangle::default()
            }
        };
        box_.into_iter().map(triangle).collect()
    }

    #[test]
    fn closed_bodies_come_first() {
        // A lid that is off, then a whole box, and one that is inside out.
        let mut open = cube(2.0);
        open.pop();
        let mut inward = cube(8.0);
        for it in &mut inward {
            std::mem::swap(&mut it.b, &mut it.c);
        }
        let mut all = [open, cube(5.0), inward.clone()].concat();
        let found = Closed::put_first(&mut all);
        assert_eq!(found.triangles, 12);
        assert_eq!(found.boxes, [[Vec3::splat(5.0), Vec3::splat(6.0)]]);
        let materials: Vec<u32> = all.iter().map(|it| it.material).collect();
        assert_eq!(materials[..12], [5; 12]);
        assert_eq!(materials[12..23], [2; 11]);
        assert_eq!(materials[23..], [8; 12]);
        // Of two that touch at a corner each is a body of its own, also beside one that is inside out.
        let mut two = [cube(5.0), cube(6.0)].concat();
        let found = Closed::put_first(&mut two);
        assert_eq!((found.triangles, found.boxes.len()), (24, 2));
        let mut two = [cube(9.0), inward].concat();
        let found = Closed::put_first(&mut two);
        assert_eq!((found.triangles, two[0].material), (12, 9));
        // A face that is turned among others leaves edges that are gone along twice in one way.
        let mut turned = cube(5.0);
        let face = &mut turned[7];
        std::mem::swap(&mut face.b, &mut face.c);
        assert_eq!(Closed::put_first(&mut turned).triangles, 0);
        // Where more than two faces meet at an edge, both sides are drawn.
        let mut twice = [cube(5.0), cube(5.0)].concat();
        assert_eq!(Closed::put_first(&mut twice).triangles, 0);
    }

    #[test]
    fn an_eye_within_sees_both_sides() {
        let mut all = cube(5.0);
        let found = Closed::put_first(&mut all);
        let seen = |x: f32| found.seen_from(Vec3::new(x, 5.5, 5.5), 0.01);
        assert_eq!(
            [seen(4.0), seen(4.91), seen(5.5), seen(6.09)],
            [12, 12, 0, 12]
        );
        // So near that a corner of the picture may cut it open.
        assert_eq!([seen(4.93), seen(6.07)], [0, 0]);
        assert_eq!(Closed::default().seen_from(Vec3::ZERO, 0.01), 0);
    }
}
