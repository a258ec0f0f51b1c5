//! Fuzzes OpenVDB files: any bytes give an error, or a mesh of finite vertices with valid indices.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use swell::domain::{mesh::TriangleMesh, mesh_file::MeshFormat, vdb};

fuzz_target!(|bytes: &[u8]| {
    let _ = vdb::grids(bytes);
    if let Ok(mesh) = TriangleMesh::from_bytes(bytes, MeshFormat::Vdb, Path::new("mesh")) {
        assert!(mesh.vertices.iter().all(|v| v.is_finite()));
        let count = mesh.vertices.len() as u32;
        assert!(mesh.triangles.iter().flatten().all(|&v| v < count));
        let _ = mesh.check_inside();
    }
});
