//! Prepares a scene for the picture of a frame.

use super::RenderJobError;
use swell_domain::{
    body::BodyState,
    bounds::Bounds,
    mesh_file::{MeshError, MeshFormat, parts::MeshParts, read_bytes},
    particles::Particles,
    pose::Pose,
};
use swell_render::{RenderScene, SolidParts};
use swell_scene::{PlacedMesh, Scene, Wall, look::Look};

/// The scene at a frame, with the parts that the look needs.
///
/// # Errors
/// If the look names materials: a mesh file that has changed since the scene was read, or that has
/// invalid texture coordinates.
pub(super) fn render_scene(
    scene: &Scene,
    look: &Look,
    frame: u32,
    state: &Particles,
) -> Result<RenderScene, RenderJobError> {
    let time = f64::from(frame) / scene.shot.frames_per_second;
    let moving = scene.moving_solids.iter().map(|solid| {
        let way = solid.pose(&state.bodies, time).affine();
        solid.placed.mesh.transformed(&way)
    });
    let solids = scene.solids.iter().map(|solid| solid.mesh.clone());
    let parts = match look.materials() {
        Some(_) => solid_parts(scene, &state.bodies, time)?,
        None => Vec::new(),
    };
    Ok(RenderScene {
        origin: scene.origin,
        domain: scene.domain,
        solids: solids.chain(moving).collect(),
        parts,
        particle_spacing: scene.particle_spacing(),
        frames_per_second: scene.shot.frames_per_second,
        gravity: scene.water.gravity,
        wave_makers: plates(scene, &scene.walls(&state.walls, time)),
        waves: scene.effects.waves(scene.water.gravity),
    })
}

/// Parts of each solid, read again from its file because a scene keeps only the mesh.
fn solid_parts(
    scene: &Scene,
    bodies: &[BodyState],
    time: f64,
) -> Result<Vec<SolidParts>, MeshError> {
    let still = scene.solids.iter().map(|solid| (solid, Pose::START));
    let moving = scene.moving_solids.iter();
    let moving = moving.map(|solid| (&solid.placed, solid.pose(bodies, time)));
    let parts = still.chain(moving).map(|(placed, pose)| {
        let bytes = read_bytes(&placed.file)?;
        if blake3::hash(&bytes).to_hex().as_str() != placed.file_hash {
            return Err(MeshError::Malformed {
                file: placed.file.clone(),
                detail: "it has changed since the scene was read".to_owned(),
            });
        }
        let mut parts = MeshParts::from_bytes(&bytes, MeshFormat::of(&placed.file)?, &placed.file)?;
        let way = placed.placement.world_from_file();
        if way.matrix3.determinant() < 0.0 {
            parts.turn();
        }
        Ok(SolidParts {
            name: placed.name(),
            parts,
            pose,
        })
    });
    parts.collect()
}

/// The scene's wave makers, and how far inward of the domain's side each one is, metres.
fn plates(scene: &Scene, walls: &Bounds) -> Vec<(Wall, f64)> {
    let size = scene.domain.size();
    let makers = scene.wave_makers.iter().map(|maker| maker.wall);
    makers
        .map(|wall| match wall.is_max {
            true => (wall, size[wall.axis] - walls.max[wall.axis]),
            false => (wall, walls.min[wall.axis]),
        })
        .collect()
}

/// Names of the scene's solids, in the order of [`render_scene`]: those of their mesh files,
/// without extension.
pub(super) fn solid_names(scene: &Scene) -> Vec<String> {
    let moving = scene.moving_solids.iter().map(|solid| &solid.placed);
    let placed = scene.solids.iter().chain(moving);
    placed.map(PlacedMesh::name).collect()
}
