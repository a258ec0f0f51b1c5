//! Finds the triangles that belong to closed bodies, whose back faces are never visible from
//! outside.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::uniform::Triangle;

/// Required distance between an eye and a body's box, in multiples of the near plane's distance, so
/// that no corner of the picture cuts the body open: a corner 83° off the axis is 1 / cos 83° times
/// that distance away.
const ROOM: f32 = 8.0;

/// Boxes of the closed bodies of a scene, whose triangles come first.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Closed {
    /// Least and greatest corners, metres.
    boxes: Vec<[Vec3; 2]>,
    /// Number of leading triangles that belong to closed bodies.
    triangles: u32,
    /// For each of these triangles the index of its box; empty where nothing moves.
    bodies: Vec<u32>,
}

impl Closed {
    /// Moves the triangles of closed bodies to the front and keeps the order within both groups.
    /// `movers` has, for each triangle, the number of its motion, and is sorted with them; it is
    /// empty where nothing moves. A body has one motion.
    ///
    /// A body is a set of triangles connected by edges, with corners matched by position. It is
    /// closed where each edge is traversed exactly once in both directions and its signed volume is
    /// positive, that is, its faces are counter-clockwise seen from outside.
    pub(super) fn put_first(triangles: &mut [Triangle], movers: &mut [u32]) -> Self {
        let corners = places(triangles, movers);
        let edges = edges(&corners);
        let bodies = bodies(triangles.len(), &edges);
        let mut found = Self::default();
        let mut body_of = vec![None; triangles.len()];
        for body in bodies {
            let is_whole = has_no_rim(&corners, &edges, &body) && volume(triangles, &body) > 0.0;
            if is_whole {
                for &k in &body {
                    body_of[k] = Some(found.boxes.len() as u32);
                }
                let of_body = body.iter().map(|&k| &triangles[k]);
                found.boxes.push(of_body.fold(NOTHING, with));
            }
        }
        sort(triangles, &body_of);
        if !movers.is_empty() {
            sort(movers, &body_of);
            found.bodies = body_of.iter().copied().flatten().collect();
        }
        found.triangles = body_of.iter().flatten().count() as u32;
        found
    }

    /// Fits the boxes to the present corners of moving triangles, in the order of
    /// [`Self::put_first`].
    pub(super) fn fit(&mut self, triangles: &[Triangle]) {
        self.boxes.fill(NOTHING);
        for (&body, triangle) in self.bodies.iter().zip(triangles) {
            let around = &mut self.boxes[body as usize];
            *around = with(*around, triangle);
        }
    }

    /// Returns the number of leading triangles of which only front faces are visible to an eye with
    /// its near plane at `near` metres; 0 where the eye is inside a body's box or so close that the
    /// picture may cut it open.
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

/// Moves the values of triangles in closed bodies to the front and keeps the order within both
/// groups.
fn sort<T: Copy>(values: &mut [T], body_of: &[Option<u32>]) {
    let order: Vec<T> = [true, false]
        .into_iter()
        .flat_map(|wanted| {
            let of = body_of.iter().zip(&*values);
            of.filter_map(move |(body, it)| (body.is_some() == wanted).then_some(*it))
        })
        .collect();
    values.copy_from_slice(&order);
}

/// Assigns an index to each distinct corner position of each motion.
fn places(triangles: &[Triangle], movers: &[u32]) -> Vec<[usize; 3]> {
    let mut numbers = HashMap::new();
    let mut number = |p: [f32; 3], mover: u32| {
        // Zeros of both signs are the same position.
        let key = (p.map(|x| (x + 0.0).to_bits()), mover);
        let next = numbers.len();
        *numbers.entry(key).or_insert(next)
    };
    let movers = movers.iter().copied().chain(std::iter::repeat(0));
    (triangles.iter().zip(movers))
        .map(|(it, mover)| [it.a, it.b, it.c].map(|p| number(p, mover)))
        .collect()
}

/// Edge with its end points in ascending order.
fn side(from: usize, to: usize) -> [usize; 2] {
    [from.min(to), from.max(to)]
}

/// Triangles at each edge, and whether each traverses the edge in ascending order.
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

/// Sets of triangles connected by edges, in the order of their first triangle.
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

/// Whether exactly two triangles meet at each edge of a body and traverse it in opposite
/// directions.
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

/// Signed volume of a body, m³; negative where normals point inward.
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

/// A box around nothing.
const NOTHING: [Vec3; 2] = [Vec3::INFINITY, Vec3::NEG_INFINITY];

/// Extends a box to a triangle.
fn with(around: [Vec3; 2], it: &Triangle) -> [Vec3; 2] {
    let corners = [it.a, it.b, it.c].map(Vec3::from);
    (corners.into_iter()).fold(around, |[low, high], p| [low.min(p), high.max(p)])
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
        // A box without a lid, a closed box, and one that is inside out.
        let mut open = cube(2.0);
        open.pop();
        let mut inward = cube(8.0);
        for it in &mut inward {
            std::mem::swap(&mut it.b, &mut it.c);
        }
        let mut all = [open, cube(5.0), inward.clone()].concat();
        let found = Closed::put_first(&mut all, &mut []);
        assert_eq!(found.triangles, 12);
        assert_eq!(found.boxes, [[Vec3::splat(5.0), Vec3::splat(6.0)]]);
        let materials: Vec<u32> = all.iter().map(|it| it.material).collect();
        assert_eq!(materials[..12], [5; 12]);
        assert_eq!(materials[12..23], [2; 11]);
        assert_eq!(materials[23..], [8; 12]);
        // Two boxes that touch at a corner are separate bodies, and so is a box beside one that is
        // inside out.
        let mut two = [cube(5.0), cube(6.0)].concat();
        let found = Closed::put_first(&mut two, &mut []);
        assert_eq!((found.triangles, found.boxes.len()), (24, 2));
        let mut two = [cube(9.0), inward].concat();
        let found = Closed::put_first(&mut two, &mut []);
        assert_eq!((found.triangles, two[0].material), (12, 9));
        // A flipped face leaves edges that are traversed twice in the same direction.
        let mut turned = cube(5.0);
        let face = &mut turned[7];
        std::mem::swap(&mut face.b, &mut face.c);
        assert_eq!(Closed::put_first(&mut turned, &mut []).triangles, 0);
        // Where more than two faces meet at an edge, both sides are drawn.
        let mut twice = [cube(5.0), cube(5.0)].concat();
        assert_eq!(Closed::put_first(&mut twice, &mut []).triangles, 0);
    }

    /// Two boxes that share a face, of which the second one moves away: without movers they are one
    /// body with edges of four faces.
    #[test]
    fn a_body_has_one_motion_and_its_box_follows() {
        let mut two = [cube(5.0), cube(6.0)].concat();
        for it in &mut two[12..] {
            for p in [&mut it.a, &mut it.b, &mut it.c] {
                *p = [p[0], p[1] - 1.0, p[2] - 1.0];
            }
        }
        let mut movers = [[0; 12], [1; 12]].concat();
        assert_eq!(Closed::put_first(&mut two.clone(), &mut []).triangles, 0);
        // An open face before them comes last, and what moves stays with its triangles.
        two.insert(0, cube(1.0)[0]);
        movers.insert(0, 0);
        let mut found = Closed::put_first(&mut two, &mut movers);
        assert_eq!(found.triangles, 24);
        assert_eq!(movers, [vec![0; 12], vec![1; 12], vec![0]].concat());
        let seen = |found: &Closed, x: f32| found.seen_from(Vec3::new(x, 5.5, 5.5), 0.01);
        assert_eq!([seen(&found, 6.5), seen(&found, 8.5)], [0, 24]);
        for (it, mover) in two.iter_mut().zip(&movers) {
            for p in [&mut it.a, &mut it.b, &mut it.c] {
                p[0] += 2.0 * *mover as f32;
            }
        }
        found.fit(&two);
        assert_eq!([seen(&found, 6.5), seen(&found, 8.5)], [24, 0]);
    }

    #[test]
    fn an_eye_within_sees_both_sides() {
        let mut all = cube(5.0);
        let found = Closed::put_first(&mut all, &mut []);
        let seen = |x: f32| found.seen_from(Vec3::new(x, 5.5, 5.5), 0.01);
        assert_eq!(
            [seen(4.0), seen(4.91), seen(5.5), seen(6.09)],
            [12, 12, 0, 12]
        );
        // So close that a corner of the picture may cut the body open.
        assert_eq!([seen(4.93), seen(6.07)], [0, 0]);
        assert_eq!(Closed::default().seen_from(Vec3::ZERO, 0.01), 0);
    }
}
