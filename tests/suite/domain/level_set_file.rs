//! OpenVDB level sets as meshes. OpenVDB 10.0.1 wrote the files in `files/` (`createLevelSetSphere`
//! of its Python module: radius 0.4 m about (1.0, 0.5, 0.5), voxels of 0.05 m, Blosc), the sheared
//! one with another transform.

use std::{collections::BTreeMap, f64::consts::PI, io::Cursor, path::Path};

use glam::DVec3;
use swell::domain::{
    mesh::TriangleMesh,
    mesh_file::{MeshError, MeshFormat},
    sparse_grid::{Leaf, VOXELS},
    vdb::level_set,
};

use crate::support::job::Job;

const SPHERE: &[u8] = include_bytes!("files/sphere.vdb");
const SHEARED: &[u8] = include_bytes!("files/sheared.vdb");
/// The same sphere by OpenVDB 12.0.0, voxels of 0.1 m, in half precision.
const HALF: &[u8] = include_bytes!("files/half.vdb");
const NONE: &[u8] = include_bytes!("files/no-level-set.vdb");

const RADIUS: f64 = 0.4;
const CENTRE: DVec3 = DVec3::new(1.0, 0.5, 0.5);
const VOXEL: f64 = 0.05;

fn read(bytes: &[u8]) -> Result<TriangleMesh, MeshError> {
    TriangleMesh::from_bytes(bytes, MeshFormat::Vdb, Path::new("a.vdb"))
}

/// Largest distance of a vertex from the sphere, m.
fn off(mesh: &TriangleMesh, centre: DVec3) -> f64 {
    let off = mesh
        .vertices
        .iter()
        .map(|v| ((*v - centre).length() - RADIUS).abs());
    off.fold(0.0, f64::max)
}

#[test]
fn a_level_set_of_openvdb_is_the_mesh_around_its_inside() {
    let mesh = read(SPHERE).unwrap();
    assert!(mesh.open_edges().is_empty());
    // Distances are linear along an edge except for 1/r: a chord is off by at most an eighth of its
    // square over the radius.
    let chord = VOXEL * VOXEL / (8.0 * RADIUS);
    assert!(off(&mesh, CENTRE) < chord, "{}", off(&mesh, CENTRE));
    // Triangles between vertices on the sphere lie inside it by a diagonal's chord at most, 3 · (√3
    // voxel)² / 8 r² of the volume.
    let ratio = mesh.signed_volume() / (4.0 / 3.0 * PI * RADIUS.powi(3));
    let bound = 9.0 * VOXEL * VOXEL / (8.0 * RADIUS * RADIUS);
    assert!((ratio - 1.0).abs() < bound, "{ratio}");
    // Negative control: a shift by half a voxel is detected.
    let moved = off(&mesh, CENTRE + DVec3::X * 0.5 * VOXEL);
    assert!(moved > 5.0 * chord, "{moved}");
}

/// Half precision has 11 bits: values are off by 2⁻¹² of a voxel, and so is the zero
/// between two of them.
#[test]
fn a_level_set_of_half_precision_is_read() {
    let mesh = read(HALF).unwrap();
    assert!(mesh.open_edges().is_empty());
    let voxel = 2.0 * VOXEL;
    let most = voxel * voxel / (8.0 * RADIUS) + voxel / 2048.0;
    assert!(off(&mesh, CENTRE) < most, "{}", off(&mesh, CENTRE));
    let moved = off(&mesh, CENTRE + DVec3::X * 0.5 * voxel);
    assert!(moved > 5.0 * most, "{moved}");
}

/// vdb-rs is a reader that shares nothing with ours. It does not read half precision of OpenVDB.
#[test]
fn voxels_are_those_that_vdb_rs_reads() {
    let ours = level_set(SPHERE).unwrap();
    let mut reader = vdb_rs::VdbReader::new(Cursor::new(SPHERE)).unwrap();
    let theirs = reader.read_grid::<f32>("ls_sphere").unwrap();
    let active = |leaf: &Leaf<f32>| {
        let active = (0..VOXELS).filter(|&element| leaf.is_active(element));
        let voxels = active.map(|element| (leaf.voxel(element), leaf.values[element]));
        voxels.collect::<Vec<_>>()
    };
    let ours: BTreeMap<_, _> = ours.leaves.iter().flat_map(active).collect();
    let theirs: BTreeMap<_, _> = theirs
        .iter()
        .map(|(at, value, _)| (at.to_array().map(|x| x as i32), value))
        .collect();
    assert!(ours == theirs && ours.len() == 4982, "{}", ours.len());
}

#[test]
fn what_is_no_level_set_is_refused() {
    let told = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
    let none = told(NONE);
    assert!(
        none.contains("no level set") && none.contains("density, v"),
        "{none}"
    );
    let sheared = told(SHEARED);
    assert!(
        sheared.contains("ls_sphere") && sheared.contains("AffineMap"),
        "{sheared}"
    );
    // The sphere is the first of its grids, and takes nearly all of the file.
    for file in [SPHERE, HALF] {
        for end in [0, 7, 40, 300, file.len() / 2] {
            let said = told(&file[..end]);
            assert!(said.contains("a.vdb"), "{end}: {said}");
        }
    }
    let mut spoilt = SPHERE.to_vec();
    spoilt[0] = b'X';
    assert!(told(&spoilt).contains("not an OpenVDB file"));
}

#[test]
fn water_and_solids_are_taken_from_a_level_set() {
    let job = Job::of(&[]);
    std::fs::write(job.path("ball.vdb"), SPHERE).unwrap();
    std::fs::write(job.path("none.vdb"), NONE).unwrap();
    std::fs::write(job.path("sheared.vdb"), SHEARED).unwrap();
    let scene = |lines: &str| {
        format!(
            "[shot]\nname = \"ball\"\nframes = 2\nframes_per_second = 24\n[domain]\n\
             min = [0.0, 0.0, 0.0]\nmax = [2.0, 1.0, 1.0]\n\
             {lines}[solver]\nmethod = \"pbf\"\n[solver.pbf]\nparticle_spacing = 0.05\n"
        )
    };
    let water = "[[water.mesh]]\nfile = \"ball.vdb\"\n";
    let block = "[[water.block]]\nmin = [0.0, 0.0, 0.0]\nmax = [2.0, 0.5, 1.0]\n";
    let solid = format!("{block}[[solid]]\nmesh = \"ball.vdb\"\n");
    for (name, lines) in [("water", water), ("block", block), ("solid", &solid)] {
        std::fs::write(job.path(&format!("{name}.toml")), scene(lines)).unwrap();
    }
    for name in ["none", "sheared"] {
        let lines = format!("[[water.mesh]]\nfile = \"{name}.vdb\"\n");
        std::fs::write(job.path(&format!("{name}.toml")), scene(&lines)).unwrap();
    }
    let particles = |name: &str| {
        let said = job.expect(
            0,
            &format!("bake {name}.toml --device cpu --frames 1-1 -o {name}"),
        );
        let count = said.split(" particles").next().unwrap();
        let count = count.rsplit(|c: char| !c.is_ascii_digit()).next().unwrap();
        count.parse::<f64>().unwrap()
    };
    let volume = 4.0 / 3.0 * PI * RADIUS.powi(3);
    let spacing = 0.05f64.powi(3);
    // Particles near the surface are in or out by half a spacing.
    let layer = 4.0 * PI * RADIUS.powi(2) * 0.025;
    let water = particles("water") * spacing;
    assert!((water - volume).abs() < layer, "{water} {volume}");
    // Half of the ball is in the water.
    let displaced = (particles("block") - particles("solid")) * spacing;
    assert!((displaced - 0.5 * volume).abs() < layer, "{displaced}");
    assert!(displaced > 0.2 * volume, "the control");
    let said = job.expect(2, "bake none.toml --device cpu -o none");
    assert!(
        said.contains("water.mesh") && said.contains("no level set"),
        "{said}"
    );
    // One clear line.
    let said = job.expect(2, "bake sheared.toml --device cpu -o sheared");
    assert!(
        said.lines().count() == 1 && said.contains("AffineMap"),
        "{said}"
    );
}
