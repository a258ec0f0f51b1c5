//! The surfaces of a scene's solids, refined, in the order of the scene: static solids first, then
//! moving ones.

use glam::DVec3;

use super::WetError;
use swell_domain::{
    body::BodyState,
    mesh::TriangleMesh,
    wet::{MOST_VERTICES, RefinedSurface},
};
use swell_export::surface::surface_ply;
use swell_scene::{Scene, moving_solid::MovingSolid};

/// The refined surface of a solid.
pub(super) struct Surface<'a> {
    /// Name of the solid.
    pub(super) name: String,
    pub(super) refined: RefinedSurface,
    /// Vertices in the placement of the scene, relative to its origin, metres.
    placed: Vec<DVec3>,
    /// What moves it; `None` for a static solid.
    moving: Option<&'a MovingSolid>,
}

/// Refines the surfaces of all solids of a scene until no edge is longer than `edge` metres.
///
/// # Errors
/// A scene without solids, surfaces with too many vertices, a solid whose triangles change.
pub(super) fn surfaces(scene: &Scene, edge: f64) -> Result<Vec<Surface<'_>>, WetError> {
    let still = scene.solids.iter().map(|it| (it.name(), &it.mesh, None));
    let moving = scene.drawn_movers();
    let moving = moving.map(|it| (it.name(), first_mesh(it), Some(it)));
    let mut left = MOST_VERTICES;
    let mut all = Vec::new();
    for (name, mesh, moving) in still.chain(moving) {
        let changes = moving.and_then(|it: &MovingSolid| it.sequence.as_ref());
        if changes.is_some_and(|it| it.shape.breaks().next().is_some()) {
            return Err(WetError::Triangles(name));
        }
        let refined = RefinedSurface::of(mesh, edge, left).map_err(|source| WetError::TooFine {
            solid: name.clone(),
            source,
        })?;
        left -= refined.len();
        let placed = refined.vertices(&mesh.vertices);
        all.push(Surface {
            name,
            refined,
            placed,
            moving,
        });
    }
    match all.is_empty() {
        true => Err(WetError::NoSolids),
        false => Ok(all),
    }
}

/// The mesh whose triangles the solid always has.
fn first_mesh(solid: &MovingSolid) -> &TriangleMesh {
    match &solid.sequence {
        Some(sequence) => &sequence.shape.meshes()[0],
        None => &solid.placed.mesh,
    }
}

impl Surface<'_> {
    /// Name of its file among the stream's assets; `index` is its position in the scene.
    pub(super) fn file(&self, index: usize) -> String {
        format!("wet/{index:03}-{}.ply", self.name)
    }

    /// Bytes of its file, for a scene with this origin.
    pub(super) fn bytes(&self, origin: DVec3) -> Vec<u8> {
        let mesh = TriangleMesh {
            vertices: self.placed.clone(),
            triangles: self.refined.triangles.clone(),
        };
        let software = format!("{} {}", swell_domain::PROGRAM, swell_domain::VERSION);
        surface_ply(&mesh, &self.refined.parents, origin, &software)
    }

    /// Appends the vertices at `time` seconds, relative to the scene's origin.
    pub(super) fn add_vertices(&self, bodies: &[BodyState], time: f64, all: &mut Vec<[f32; 3]>) {
        let narrow = |p: DVec3| p.as_vec3().to_array();
        let Some(moving) = self.moving else {
            return all.extend(self.placed.iter().map(|&p| narrow(p)));
        };
        if let Some(sequence) = &moving.sequence {
            let vertices = sequence.shape.mesh(time).vertices;
            return all.extend(self.refined.vertices(&vertices).into_iter().map(narrow));
        }
        let way = moving.pose(bodies, time).affine();
        all.extend(self.placed.iter().map(|&p| narrow(way.transform_point3(p))));
    }

    /// Appends the area around each vertex, m²: a third of its triangles', as placed.
    pub(super) fn add_areas(&self, all: &mut Vec<f64>) {
        let first = all.len();
        all.resize(first + self.placed.len(), 0.0);
        for triangle in &self.refined.triangles {
            let [a, b, c] = triangle.map(|vertex| self.placed[vertex as usize]);
            let third = (b - a).cross(c - a).length() / 6.0;
            for &vertex in triangle {
                all[first + vertex as usize] += third;
            }
        }
    }
}
