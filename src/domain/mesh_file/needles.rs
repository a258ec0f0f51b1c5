//! Removes triangles without area, whose three corners are collinear: they bound nothing, but
//! dropping one opens its edges.
//!
//! A needle's middle corner is inserted into the longest edge of the neighbour there, which becomes
//! two triangles. The outline of both together is unchanged, so a closed mesh stays closed.

use std::{
    cmp::Ordering,
    collections::{BinaryHeap, HashMap},
};

use super::Welded;

/// Average number of splits per needle before the remaining needles are simply dropped: rounding
/// could cause an endless loop.
const MOST_SPLITS: usize = 64;

/// A corner between two others, of a triangle that was split.
#[derive(Clone, Copy, Debug)]
pub(super) struct Between {
    /// Corners on either side, each of the file or of this kind.
    pub(super) ends: [u32; 2],
    /// Position between the first and the second, 0 to 1.
    pub(super) part: f64,
}

/// A needle in the queue, longest first: its neighbour then has no longer needle, and the pieces
/// are shorter.
struct Needle {
    length: f64,
    triangle: usize,
}

impl Ord for Needle {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_length = self.length.total_cmp(&other.length);
        by_length.then_with(|| other.triangle.cmp(&self.triangle))
    }
}

impl PartialOrd for Needle {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Needle {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Needle {}

/// Removes all triangles without area from `welded`. Each triangle must have three
/// different vertices.
pub(super) fn dissolve(welded: &mut Welded) {
    let flat: Vec<usize> = (0..welded.mesh.triangles.len())
        .filter(|&t| is_flat(welded, t))
        .collect();
    if flat.is_empty() {
        return;
    }
    let mut work = Work {
        is_left: vec![true; welded.mesh.triangles.len()],
        by_edge: HashMap::new(),
        needles: BinaryHeap::new(),
        welded,
    };
    for t in 0..work.is_left.len() {
        work.enter(t);
    }
    let most = MOST_SPLITS * flat.len();
    for t in flat {
        work.push(t);
    }
    for _ in 0..most {
        let Some(Needle { triangle, .. }) = work.needles.pop() else {
            break;
        };
        if work.is_left[triangle] {
            work.split_beside(triangle);
        }
    }
    for Needle { triangle, .. } in std::mem::take(&mut work.needles) {
        work.is_left[triangle] = false;
    }
    let is_left = work.is_left;
    let mut left = is_left.iter().copied();
    welded.mesh.triangles.retain(|_| left.next() == Some(true));
    let mut left = is_left.iter().copied();
    welded.corners.retain(|_| left.next() == Some(true));
}

fn is_flat(welded: &Welded, t: usize) -> bool {
    welded.mesh.area_vector(t).length_squared() == 0.0
}

struct Work<'a> {
    welded: &'a mut Welded,
    is_left: Vec<bool>,
    /// Triangles by their directed edges.
    by_edge: HashMap<[u32; 2], Vec<usize>>,
    needles: BinaryHeap<Needle>,
}

impl Work<'_> {
    fn enter(&mut self, t: usize) {
        let [a, b, c] = self.welded.mesh.triangles[t];
        for edge in [[a, b], [b, c], [c, a]] {
            self.by_edge.entry(edge).or_default().push(t);
        }
    }

    fn leave(&mut self, t: usize) {
        self.is_left[t] = false;
        let [a, b, c] = self.welded.mesh.triangles[t];
        for edge in [[a, b], [b, c], [c, a]] {
            if let Some(users) = self.by_edge.get_mut(&edge) {
                users.retain(|user| *user != t);
            }
        }
    }

    /// The triangle's vertices and corners, rotated so that the first edge starts at `first`.
    fn from(&self, t: usize, first: u32) -> ([u32; 3], [u32; 3]) {
        let (mut vertices, mut corners) = (self.welded.mesh.triangles[t], self.welded.corners[t]);
        let turn = vertices
            .iter()
            .position(|v| *v == first)
            .unwrap_or_default();
        vertices.rotate_left(turn);
        corners.rotate_left(turn);
        (vertices, corners)
    }

    /// First vertex of the longest edge, and its length.
    fn longest(&self, t: usize) -> (u32, f64) {
        let mesh = &self.welded.mesh;
        let [a, b, c] = mesh.triangles[t];
        let length = |from: u32, to: u32| {
            let [from, to] = [from, to].map(|v| mesh.vertices[v as usize]);
            from.distance(to)
        };
        let edges = [(a, length(a, b)), (b, length(b, c)), (c, length(c, a))];
        let longest = edges.into_iter().max_by(|x, y| x.1.total_cmp(&y.1));
        longest.unwrap_or((a, 0.0))
    }

    fn push(&mut self, triangle: usize) {
        let (_, length) = self.longest(triangle);
        self.needles.push(Needle { length, triangle });
    }

    /// Removes the needle and inserts its middle corner into the triangle beyond its longest edge;
    /// a needle at the border of an open mesh is only removed.
    fn split_beside(&mut self, needle: usize) {
        let ([b, a, m], _) = self.from(needle, self.longest(needle).0);
        self.leave(needle);
        let beyond = self.by_edge.get(&[a, b]).and_then(|users| users.first());
        let Some(&beyond) = beyond else {
            return;
        };
        let ([.., c], [corner_a, corner_b, corner_c]) = self.from(beyond, a);
        self.leave(beyond);
        if c == m {
            // The neighbour is the needle's own back: together they bound nothing.
            return;
        }
        let place = |v: u32| self.welded.mesh.vertices[v as usize];
        let (whole, begun) = (place(b) - place(a), place(m) - place(a));
        let between = Between {
            ends: [corner_a, corner_b],
            part: (begun.dot(whole) / whole.length_squared()).clamp(0.0, 1.0),
        };
        let corner_m = (self.welded.in_file + self.welded.between.len()) as u32;
        self.welded.between.push(between);
        for (vertices, corners) in [
            ([a, m, c], [corner_a, corner_m, corner_c]),
            ([m, b, c], [corner_m, corner_b, corner_c]),
        ] {
            let t = self.is_left.len();
            self.welded.mesh.triangles.push(vertices);
            self.welded.corners.push(corners);
            self.is_left.push(true);
            self.enter(t);
            if is_flat(self.welded, t) {
                self.push(t);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{
        mesh::TriangleMesh,
        mesh_file::{MeshFormat, tests::parse},
    };

    /// A unit cube whose top has extra corners along one edge, fanned about one of its ends by
    /// another program.
    fn fanned() -> String {
        let corners = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0 1 0\nv 1 1 0\nv 1 1 1\nv 0 1 1\n\
                       v 0.25 1 0\nv 0.5 1 0\nv 0.75 1 0\n";
        // The top is a fan about corner 5, whose first edge contains 9, 10 and 11; the side below
        // it is fanned from the other end.
        let top = "f 5 10 9\nf 5 11 10\nf 5 6 11\nf 5 7 6\nf 5 8 7\n";
        let side = "f 1 5 9\nf 1 9 10\nf 1 10 11\nf 1 11 6\nf 1 6 2\n";
        let rest = "f 1 2 3 4\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
        format!("{corners}{top}{side}{rest}")
    }

    #[test]
    fn a_closed_mesh_with_triangles_without_area_stays_closed() {
        let text = fanned();
        let mesh = parse(MeshFormat::Obj, text.as_bytes()).expect("a mesh");
        assert_eq!(mesh.open_edges(), []);
        assert_eq!(mesh.vertices.len(), 11);
        assert!((0..mesh.triangles.len()).all(|t| mesh.area_vector(t).length() > 0.0));
        // Up to 18 terms, each rounded.
        assert!((mesh.signed_volume() - 1.0).abs() < 18.0 * f64::EPSILON);
        assert!((mesh.area() - 6.0).abs() < 18.0 * f64::EPSILON);
        // Negative control: without the needles the mesh is open.
        let cut = ["f 5 10 9\n", "f 5 11 10\n", "f 5 6 11\n"];
        let open = cut
            .iter()
            .fold(text, |text, needle| text.replace(needle, ""));
        let open = parse(MeshFormat::Obj, open.as_bytes()).expect("a mesh");
        assert!(!open.open_edges().is_empty());
    }

    #[test]
    fn needles_alone_bound_nothing_and_at_a_border_they_go() {
        let line = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\n";
        let obj = |faces: &str| parse(MeshFormat::Obj, format!("{line}{faces}").as_bytes());
        let message = obj("f 1 2 3\nf 3 2 1\n").expect_err("nothing");
        assert!(message.ends_with("no triangle has an area"), "{message}");
        let sheet: TriangleMesh = obj("f 1 3 4\nf 2 3 1\n").expect("a sheet");
        assert_eq!(sheet.triangles.len(), 2);
        assert_eq!((sheet.area(), sheet.open_edges().len()), (1.0, 4));
    }
}
