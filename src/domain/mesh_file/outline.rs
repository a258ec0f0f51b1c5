//! How the faces of a file become triangles, for other files with the same faces.

use std::sync::Arc;

use glam::DVec3;

use super::{Joined, Raw, TriangleMesh, Welded, place};

/// Faces of a mesh file, and the triangles that they became.
#[derive(Clone, Debug)]
pub struct Outline(Arc<Faces>);

#[derive(Debug)]
struct Faces {
    corners: Vec<u64>,
    ends: Vec<usize>,
    triangles: Vec<[u32; 3]>,
    /// For each vertex of the mesh, a corner at it; `None` where triangles were split.
    sources: Option<Vec<u32>>,
    /// Corners that are in a triangle, and the vertex there.
    vertices: Vec<(u32, u32)>,
}

impl Outline {
    pub(super) fn of(raw: Raw, welded: &Welded) -> Self {
        let triangles = welded.mesh.triangles.clone();
        let pairs = welded
            .corners
            .iter()
            .flatten()
            .zip(triangles.iter().flatten());
        let vertices: Vec<(u32, u32)> = pairs.map(|(&corner, &vertex)| (corner, vertex)).collect();
        let mut sources = vec![None; welded.mesh.vertices.len()];
        for &(corner, vertex) in &vertices {
            let is_of_file = (corner as usize) < welded.in_file;
            sources[vertex as usize] = is_of_file.then_some(corner);
        }
        let is_split = !welded.between.is_empty();
        Self(Arc::new(Faces {
            corners: raw.corners,
            ends: raw.ends,
            triangles,
            sources: sources
                .into_iter()
                .collect::<Option<_>>()
                .filter(|_| !is_split),
            vertices,
        }))
    }

    /// Returns the mesh of a file with the same faces; `None` where they are not the same, or where
    /// corners that were at one position are not any more.
    pub(super) fn mesh(&self, raw: &Raw) -> Option<TriangleMesh> {
        let Faces {
            corners,
            ends,
            triangles,
            sources,
            vertices,
        } = &*self.0;
        if (corners, ends) != (&raw.corners, &raw.ends) {
            return None;
        }
        let at = |corner: u32| place(raw, 0, raw.corners[corner as usize]).ok();
        let places = sources.as_ref()?.iter().map(|&corner| at(corner));
        let places: Vec<DVec3> = places.collect::<Option<_>>()?;
        let joined = Joined::of(raw);
        let key = |x: DVec3| joined.key(x);
        let is_joined = |&(corner, vertex): &(u32, u32)| {
            at(corner).is_some_and(|x| key(x) == key(places[vertex as usize]))
        };
        vertices.iter().all(is_joined).then(|| TriangleMesh {
            vertices: places,
            triangles: triangles.clone(),
        })
    }
}
