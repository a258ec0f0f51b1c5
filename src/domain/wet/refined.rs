//! A mesh whose triangles are divided until their edges are short.

use std::collections::HashMap;

use glam::DVec3;

use crate::mesh::TriangleMesh;

/// Largest number of vertices of all refined surfaces together.
pub const MOST_VERTICES: usize = 1 << 24;

/// A surface that would have more than [`MOST_VERTICES`] vertices.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("it has more than {MOST_VERTICES} vertices with edges of {edge} m: choose longer edges")]
pub struct TooFine {
    /// Longest edge, metres.
    pub edge: f64,
}

/// A mesh whose triangles are divided until no edge is longer than asked, at the midpoints of
/// edges. Whether an edge is divided depends on its length alone, so both triangles at it agree and
/// the surface has no cracks, also where the file has two vertices in one position.
#[derive(Clone, Debug, PartialEq)]
pub struct RefinedSurface {
    /// Number of vertices of the mesh, which come first.
    given: usize,
    /// For each further vertex, the two vertices before it that it is midway between.
    midpoints: Vec<[u32; 2]>,
    /// Triangles, those of one triangle of the mesh one after the other.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle, the triangle of the mesh that it is a part of.
    pub parents: Vec<u32>,
}

impl RefinedSurface {
    /// Divides the triangles of `mesh` until no edge is longer than `edge` metres.
    ///
    /// # Errors
    /// [`TooFine`] if more than `most` vertices are needed.
    pub fn of(mesh: &TriangleMesh, edge: f64, most: usize) -> Result<Self, TooFine> {
        let mut surface = Self {
            given: mesh.vertices.len(),
            midpoints: Vec::new(),
            triangles: mesh.triangles.clone(),
            parents: (0..mesh.triangles.len() as u32).collect(),
        };
        let mut points = mesh.vertices.clone();
        while surface.divide(&mut points, edge * edge) {
            if points.len() > most {
                return Err(TooFine { edge });
            }
        }
        match points.len() > most {
            true => Err(TooFine { edge }),
            false => Ok(surface),
        }
    }

    /// Returns the number of vertices.
    pub fn len(&self) -> usize {
        self.given + self.midpoints.len()
    }

    /// Returns whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the vertices where those of the mesh are `given`, in any pose or shape.
    ///
    /// # Panics
    /// If the mesh has another number of vertices.
    pub fn vertices(&self, given: &[DVec3]) -> Vec<DVec3> {
        assert_eq!(given.len(), self.given, "vertices of another mesh");
        let mut points = Vec::with_capacity(self.len());
        points.extend_from_slice(given);
        for &[a, b] in &self.midpoints {
            points.push(midpoint(points[a as usize], points[b as usize]));
        }
        points
    }

    /// Divides every edge that is too long once. Returns whether there was one.
    fn divide(&mut self, points: &mut Vec<DVec3>, longest_square: f64) -> bool {
        let mut made = HashMap::new();
        let mut triangles = Vec::with_capacity(self.triangles.len());
        let mut parents = Vec::with_capacity(self.parents.len());
        for (&triangle, &parent) in self.triangles.iter().zip(&self.parents) {
            let [a, b, c] = triangle;
            let middles = [[a, b], [b, c], [c, a]].map(|[from, to]| {
                let (x, y) = (points[from as usize], points[to as usize]);
                (x.distance_squared(y) > longest_square).then(|| {
                    let ends = [from.min(to), from.max(to)];
                    *made.entry(ends).or_insert_with(|| {
                        points.push(midpoint(x, y));
                        self.midpoints.push(ends);
                        points.len() as u32 - 1
                    })
                })
            });
            let parts = parts(triangle, middles, points);
            parents.extend(std::iter::repeat_n(parent, parts.len()));
            triangles.extend(parts);
        }
        (self.triangles, self.parents) = (triangles, parents);
        !made.is_empty()
    }
}

/// The same for both orders of its arguments.
fn midpoint(a: DVec3, b: DVec3) -> DVec3 {
    0.5 * (a + b)
}

/// Parts of a triangle with a new vertex on some of its edges ab, bc and ca, in its orientation.
fn parts([a, b, c]: [u32; 3], [ab, bc, ca]: [Option<u32>; 3], points: &[DVec3]) -> Vec<[u32; 3]> {
    // Two divided edges, at the corner `q` of the triangle pqr.
    let corner = |[p, q, r]: [u32; 3], pq: u32, qr: u32| {
        let length = |x: u32, y: u32| points[x as usize].distance_squared(points[y as usize]);
        // The quadrilateral p, pq, qr, r along its shorter diagonal.
        match length(p, qr) <= length(pq, r) {
            true => vec![[pq, q, qr], [p, pq, qr], [p, qr, r]],
            false => vec![[pq, q, qr], [p, pq, r], [pq, qr, r]],
        }
    };
    match (ab, bc, ca) {
        (None, None, None) => vec![[a, b, c]],
        (Some(m), None, None) => vec![[a, m, c], [m, b, c]],
        (None, Some(m), None) => vec![[b, m, a], [m, c, a]],
        (None, None, Some(m)) => vec![[c, m, b], [m, a, b]],
        (Some(ab), Some(bc), None) => corner([a, b, c], ab, bc),
        (None, Some(bc), Some(ca)) => corner([b, c, a], bc, ca),
        (Some(ab), None, Some(ca)) => corner([c, a, b], ca, ab),
        (Some(ab), Some(bc), Some(ca)) => {
            vec![[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use super::*;
    use crate::{bounds::Bounds, mesh::tests::box_mesh};

    fn slab() -> TriangleMesh {
        box_mesh(Bounds {
            min: DVec3::new(0.1, -0.2, 0.3),
            max: DVec3::new(1.4, 0.1, 5.0),
        })
    }

    fn refined(mesh: &TriangleMesh, edge: f64) -> (RefinedSurface, TriangleMesh) {
        let surface = RefinedSurface::of(mesh, edge, MOST_VERTICES).unwrap();
        let made = TriangleMesh {
            vertices: surface.vertices(&mesh.vertices),
            triangles: surface.triangles.clone(),
        };
        (surface, made)
    }

    /// Edges are short, the surface is closed, and area and volume are those of the mesh.
    #[test]
    fn a_refined_box_is_the_same_closed_box_with_short_edges() {
        let mesh = slab();
        let (surface, made) = refined(&mesh, 0.2);
        for &[a, b, c] in &made.triangles {
            for (x, y) in [(a, b), (b, c), (c, a)] {
                let length = made.vertices[x as usize].distance(made.vertices[y as usize]);
                assert!(length <= 0.2, "{length}");
            }
        }
        assert_eq!(made.open_edges(), []);
        assert!(made.triangles.len() > 1000 && made.triangles.len() < 10_000);
        assert!((made.area() / mesh.area() - 1.0).abs() < 1e-12);
        assert!((made.signed_volume() / mesh.signed_volume() - 1.0).abs() < 1e-12);
        // Each part lies in its parent's plane, on its side.
        for (index, &parent) in surface.parents.iter().enumerate() {
            let [part, whole] = [made.area_vector(index), mesh.area_vector(parent as usize)];
            assert!(part.normalize().dot(whole.normalize()) > 1.0 - 1e-9);
        }
        assert!(surface.parents.is_sorted());
        // Control: without one of its triangles it is open.
        let half = RefinedSurface {
            triangles: surface.triangles[1..].to_vec(),
            ..surface
        };
        let torn = TriangleMesh {
            vertices: half.vertices(&mesh.vertices),
            triangles: half.triangles,
        };
        assert_eq!(torn.open_edges().len(), 3);
    }

    /// Triangles that share no vertices, as in STL, are divided at the same points.
    #[test]
    fn vertices_in_one_position_leave_no_crack() {
        let mesh = slab();
        let apart = TriangleMesh {
            vertices: (0..mesh.triangles.len())
                .flat_map(|index| mesh.corners(index))
                .collect(),
            triangles: (0..mesh.triangles.len() as u32)
                .map(|index| [3 * index, 3 * index + 1, 3 * index + 2])
                .collect(),
        };
        let points = |mesh: &TriangleMesh| {
            let (_, made) = refined(mesh, 0.17);
            let bits = made.vertices.iter().map(|p| p.to_array().map(f64::to_bits));
            bits.collect::<std::collections::BTreeSet<_>>()
        };
        assert_eq!(points(&mesh), points(&apart));
        let (_, other) = refined(&mesh, 0.3);
        assert_ne!(points(&mesh).len(), other.vertices.len(), "control");
    }

    #[test]
    fn short_edges_stay_and_too_many_vertices_are_refused() {
        let mesh = slab();
        let (surface, made) = refined(&mesh, 10.0);
        assert_eq!(made, mesh);
        assert_eq!(surface.len(), 8);
        let refused = RefinedSurface::of(&mesh, 0.2, 500);
        assert_eq!(refused, Err(TooFine { edge: 0.2 }));
        assert!(RefinedSurface::of(&mesh, 10.0, 7).is_err());
    }

    /// A surface keeps its triangles where the mesh changes its shape.
    #[test]
    fn vertices_follow_the_mesh() {
        let mesh = slab();
        let (surface, made) = refined(&mesh, 0.4);
        let way = |p: &DVec3| DVec3::new(p.y, 2.0 * p.x, p.z + 0.5 * p.x);
        let moved = surface.vertices(&mesh.vertices.iter().map(way).collect::<Vec<_>>());
        for (before, after) in made.vertices.iter().zip(&moved) {
            assert!(way(before).distance(*after) < 1e-12);
        }
    }
}
