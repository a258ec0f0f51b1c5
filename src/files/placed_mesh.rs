//! Reads the mesh of a table, and places it.

use std::path::Path;

use glam::DVec3;

use super::{document::Document, keys::MeshSpec};
use swell_domain::mesh_file::{self, Digits, Loaded, MeshError, MeshFormat, Outline};
use swell_scene::{
    PlacedMesh, Placement, SceneError,
    words::{chain, shown},
};

/// Largest distance between adjacent coordinates of a mesh file, particle spacings; a larger one
/// degrades the shape.
const MOST_STEP: f64 = 0.01;

type Result<T> = std::result::Result<T, SceneError>;

/// Reads the mesh of the table at `path`, whose file is in the key `name`, for particles
/// `spacing` metres apart.
pub(super) fn placed_mesh(
    doc: &Document<'_>,
    base_dir: &Path,
    path: &str,
    name: &str,
    spec: (&MeshSpec, f64),
) -> Result<PlacedMesh> {
    let keys = [name, "blake3"].map(|name| format!("{path}.{name}"));
    let (placed, _) = placed_mesh_like(doc, base_dir, (&keys[0], &keys[1]), spec, None)?;
    Ok(placed)
}

/// Reads a mesh as [`placed_mesh`] does, whose file and hash are in these keys, with the triangles
/// of an outline where its faces have the same corners; also returns its own outline.
pub(super) fn placed_mesh_like(
    doc: &Document<'_>,
    base_dir: &Path,
    (key, hash_key): (&str, &str),
    (spec, spacing): (&MeshSpec, f64),
    outline: Option<&Outline>,
) -> Result<(PlacedMesh, Outline)> {
    let fail = |problem: String| doc.fault_of(key, problem);
    let file = doc.find(base_dir, key, &spec.file)?;
    let read = || {
        let format = MeshFormat::of(&file)?;
        let bytes = mesh_file::read_bytes(&file)?;
        Ok((Loaded::like(&bytes, format, &file, outline)?, bytes))
    };
    let ((loaded, outline), bytes) = read().map_err(|error: MeshError| fail(chain(&error)))?;
    let file_hash = blake3::hash(&bytes).to_hex().to_string();
    if spec.blake3.as_ref().is_some_and(|hash| *hash != file_hash) {
        let problem = format!("{} has BLAKE3 {file_hash}", file.display());
        return Err(doc.fault_of(hash_key, problem));
    }
    let placement = Placement {
        translate: DVec3::from_array(spec.translate),
        rotate_degrees: DVec3::from_array(spec.rotate_degrees),
        scale: spec.scale.into(),
    };
    let coarse = coarse(&loaded, &placement, spacing);
    let rounding = placement.rounding(loaded.rounding());
    let mesh = loaded.mesh.transformed(&placement.world_from_file());
    let holes = mesh
        .check_inside()
        .map_err(|error| fail(format!("{}: {error}", file.display())))?;
    let placed = PlacedMesh {
        file,
        file_hash,
        placement,
        mesh,
        holes,
        rounding: rounding.min(DVec3::splat(MOST_STEP * spacing)),
        faults: [loaded.crossing, coarse].into_iter().flatten().collect(),
    };
    Ok((placed, outline))
}

/// Warns if the coordinates are so far from zero that 32-bit floats do not resolve particles.
fn coarse(loaded: &Loaded, placement: &Placement, spacing: f64) -> Option<String> {
    let reach = placement.rounding(2.0 * loaded.rounding());
    let step = reach.max_element();
    (loaded.digits == Digits::Single && step > MOST_STEP * spacing).then(|| {
        format!(
            "32-bit floats near its coordinate {} are {step:.2e} m apart, more than {MOST_STEP} of \
             the particle spacing of {} m; save it near its own origin and move it with translate, \
             or save it as text with all digits, such as OBJ",
            shown(loaded.farthest()),
            shown(spacing)
        )
    })
}
