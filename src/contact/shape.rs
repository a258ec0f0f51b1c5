//! Shapes of meshes.

use glam::DVec3;
use rapier3d_f64::{
    geometry::{SharedShape, TriMeshFlags},
    math::Vector,
};
use swell_domain::mesh::TriangleMesh;

/// Volume of the convex hull, relative to that of the mesh, up to which a mesh is convex.
const CONVEX: f64 = 1.001;

/// Why a mesh cannot collide.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShapeError {
    /// It has no triangles.
    #[error("a mesh without triangles cannot collide")]
    Empty,
    /// It is a body's and encloses no volume.
    #[error("the mesh of a body encloses no volume")]
    Flat,
}

/// Returns the surface of a solid, which keeps bodies on its outer side.
pub(crate) fn of_solid(mesh: &TriangleMesh) -> Result<SharedShape, ShapeError> {
    let flags = TriMeshFlags::FIX_INTERNAL_EDGES | TriMeshFlags::ORIENTED;
    let vertices = mesh.vertices.iter().copied().map(vector).collect();
    SharedShape::trimesh_with_flags(vertices, mesh.triangles.clone(), flags)
        .map_err(|_| ShapeError::Empty)
}

/// Returns the shape of a body relative to `centre`: convex, or a compound of convex parts.
pub(crate) fn of_body(mesh: &TriangleMesh, centre: DVec3) -> Result<SharedShape, ShapeError> {
    if mesh.triangles.is_empty() {
        return Err(ShapeError::Empty);
    }
    let vertices: Vec<_> = mesh.vertices.iter().map(|&v| vector(v - centre)).collect();
    let hull = SharedShape::convex_hull(&vertices).ok_or(ShapeError::Flat)?;
    let volume = mesh.signed_volume();
    if volume <= 0.0 {
        return Err(ShapeError::Flat);
    }
    if hull.mass_properties(1.0).mass() <= CONVEX * volume {
        return Ok(hull);
    }
    Ok(SharedShape::convex_decomposition(
        &vertices,
        &mesh.triangles,
    ))
}

/// Returns the greatest distance of a vertex from `middle`, metres.
pub(crate) fn radius(mesh: &TriangleMesh, middle: DVec3) -> f64 {
    let squares = mesh.vertices.iter().map(|&v| (v - middle).length_squared());
    squares.fold(0.0, f64::max).sqrt()
}

pub(crate) fn vector(v: DVec3) -> Vector {
    Vector::from_array(v.to_array())
}
