//! Writes meshes as PLY and OBJ.

use std::fmt::Write as _;

use glam::DVec3;

use super::FileOrigin;
use swell_domain::water_mesh::WaterMesh;

/// A mesh and its position in the world.
#[derive(Clone, Copy, Debug)]
pub struct Placed<'a> {
    /// The mesh with its velocities and normals.
    pub water: &'a WaterMesh,
    /// World position of the mesh's origin, metres.
    pub corner: DVec3,
    /// Whether coordinates need 64 bits, because the scene has an origin of its own far from
    /// the world's.
    pub is_far: bool,
}

/// Writes binary little-endian PLY: x y z (`float`, or `double` for a scene far from the world's
/// origin), nx ny nz, vx vy vz in m/s, the mesh's attributes; triangles.
pub fn ply(placed: &Placed<'_>, source: &FileOrigin<'_>) -> Vec<u8> {
    let &Placed { water, corner, .. } = placed;
    let kind = if placed.is_far { "double" } else { "float" };
    let mut out = Vec::new();
    let FileOrigin {
        software,
        shot,
        frame,
    } = source;
    let columns = water.attributes.keys();
    let columns: String = columns
        .map(|name| format!("property float {name}\n"))
        .collect();
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment {software}\ncomment shot {shot}\n\
         comment frame {frame}\n\
         element vertex {}\nproperty {kind} x\nproperty {kind} y\nproperty {kind} z\n\
         property float nx\nproperty float ny\nproperty float nz\n\
         property float vx\nproperty float vy\nproperty float vz\n\
         {columns}element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        water.mesh.vertices.len(),
        water.mesh.triangles.len()
    );
    out.extend_from_slice(header.as_bytes());
    let rows = water.mesh.vertices.iter().zip(&water.normals);
    for (k, ((vertex, normal), velocity)) in rows.zip(&water.velocities).enumerate() {
        let place = *vertex + corner;
        match placed.is_far {
            true => place
                .to_array()
                .iter()
                .for_each(|x| out.extend_from_slice(&x.to_le_bytes())),
            false => put(&mut out, &place.as_vec3().to_array()),
        }
        put(&mut out, normal);
        put(&mut out, velocity);
        for column in water.attributes.values() {
            put(&mut out, &[column[k]]);
        }
    }
    for triangle in &water.mesh.triangles {
        out.push(3);
        for corner in triangle {
            out.extend_from_slice(&corner.to_le_bytes());
        }
    }
    out
}

fn put(out: &mut Vec<u8>, values: &[f32]) {
    for x in values {
        out.extend_from_slice(&x.to_le_bytes());
    }
}

/// Writes Wavefront OBJ with normals. The format cannot hold velocities or attributes.
pub fn obj(placed: &Placed<'_>, source: &FileOrigin<'_>) -> Vec<u8> {
    let &Placed { water, corner, .. } = placed;
    let FileOrigin {
        software,
        shot,
        frame,
    } = source;
    let mut out = format!("# {software}, shot {shot}, frame {frame}\no water\n");
    for vertex in &water.mesh.vertices {
        let place = *vertex + corner;
        // Writing to a String cannot fail, here and below.
        let _ = match placed.is_far {
            true => writeln!(out, "v {} {} {}", place.x, place.y, place.z),
            false => {
                let place = place.as_vec3();
                writeln!(out, "v {} {} {}", place.x, place.y, place.z)
            }
        };
    }
    for [x, y, z] in &water.normals {
        let _ = writeln!(out, "vn {x} {y} {z}");
    }
    for triangle in &water.mesh.triangles {
        let [a, b, c] = triangle.map(|v| v + 1);
        let _ = writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}");
    }
    out.into_bytes()
}
