//! What a new cache records besides its frames.

use std::{fs, path::PathBuf};

use swell_cache::{Asset, GridRecord, Manifest, body_records};
use swell_domain::keep::Keep;
use swell_scene::{Scene, grids::Grids};

use super::{BakeError, BakePlan};
use crate::{device::Identity, probes};

/// The manifest of a bake on this device.
pub(super) fn manifest(plan: &BakePlan<'_>, device: &Identity) -> Manifest {
    let scene = plan.scene;
    Manifest {
        format_version: Manifest::FORMAT_VERSION,
        program: swell_domain::PROGRAM.into(),
        program_version: swell_domain::VERSION.into(),
        shaders: device.shaders.clone(),
        shot: scene.shot.name.clone(),
        scene_hash: swell_files::physics_hash(scene),
        solver: scene.solver.method().name().into(),
        device: device.name.clone(),
        driver: device.driver.clone(),
        backend: device.backend.clone(),
        frames_per_second: scene.shot.frames_per_second,
        particle_spacing: scene.particle_spacing(),
        rest_density: scene.water.rest_density,
        origin: scene.origin.to_array(),
        attributes: plan.start.particles.attributes.keys().cloned().collect(),
        grids: scene.grids.map(|grids| grid_record(scene, &grids)),
        keep: scene.keep.filter(|keep| *keep != Keep::All),
        compression: scene.compression,
        probes: probes::records(scene),
        bodies: body_records(body_names(scene)),
        parent: plan.parent.clone(),
        warnings: plan.warnings.clone(),
        start_particles: 0,
        files: Vec::new(),
    }
}

/// Names of the scene's bodies: those of their mesh files.
fn body_names(scene: &Scene) -> impl Iterator<Item = String> {
    let bodies = (scene.moving_solids.iter()).filter(|solid| !solid.is_prescribed());
    bodies.map(|body| body.placed.name())
}

/// The scene's grids as the manifest records them.
pub(super) fn grid_record(scene: &Scene, grids: &Grids) -> GridRecord {
    GridRecord {
        surface: grids.surface,
        velocity: grids.velocity,
        voxel_size: grids.voxel_size,
        origin: scene.domain.min.to_array(),
        precision: grids.precision,
    }
}

/// Reads the scene's mesh files for the cache and checks that they have not changed.
pub(super) fn assets(scene: &Scene) -> Result<Vec<Asset>, BakeError> {
    let read = |(file, hash): (PathBuf, String)| {
        let fault = |what: String| BakeError::Asset {
            file: file.clone(),
            what,
        };
        let bytes = fs::read(&file).map_err(|error| fault(error.to_string()))?;
        if blake3::hash(&bytes).to_hex().as_str() != hash {
            return Err(fault("changed since the scene was loaded".into()));
        }
        let path = swell_scene::asset_path(&file, &hash);
        Ok(Asset {
            name: path.trim_start_matches("assets/").to_owned(),
            bytes,
        })
    };
    scene.mesh_files().into_iter().map(read).collect()
}
