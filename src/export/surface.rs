//! Writes the surface of a solid as PLY.

use glam::DVec3;

use swell_domain::mesh::TriangleMesh;

/// Writes binary little-endian PLY: x y z (`double`), triangles, and for each triangle the index
/// `parent` of the triangle of the solid's own mesh that it is a part of.
///
/// # Panics
/// If there are not as many parents as triangles.
pub fn surface_ply(mesh: &TriangleMesh, parents: &[u32], corner: DVec3, software: &str) -> Vec<u8> {
    assert_eq!(mesh.triangles.len(), parents.len());
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\ncomment {software}\nelement vertex {}\n\
         property double x\nproperty double y\nproperty double z\nelement face {}\n\
         property list uchar int vertex_indices\nproperty int parent\nend_header\n",
        mesh.vertices.len(),
        mesh.triangles.len()
    )
    .into_bytes();
    for vertex in &mesh.vertices {
        for x in (*vertex + corner).to_array() {
            out.extend_from_slice(&x.to_le_bytes());
        }
    }
    for (triangle, parent) in mesh.triangles.iter().zip(parents) {
        out.push(3);
        for word in triangle.iter().chain([parent]) {
            out.extend_from_slice(&word.to_le_bytes());
        }
    }
    out
}
