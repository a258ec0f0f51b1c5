//! What of a scene stands in a picture of a frame.

use glam::DAffine3;

use crate::{
    domain::{bounds::Bounds, particles::Particles},
    render::RenderScene,
    scene::{PlacedMesh, Scene, Wall},
};

/// A scene as it stands at a frame.
pub(super) fn render_scene(scene: &Scene, frame: u32, state: &Particles) -> RenderScene {
    let time = f64::from(frame) / scene.shot.frames_per_second;
    let moving = scene.moving_solids.iter().map(|solid| {
        let way = DAffine3::from_translation(solid.displacement(time));
        solid.placed.mesh.transformed(&way)
    });
    let solids = scene.solids.iter().map(|solid| solid.mesh.clone());
    RenderScene {
        origin: scene.origin,
        domain: scene.domain,
        solids: solids.chain(moving).collect(),
        particle_spacing: scene.particle_spacing(),
        frames_per_second: scene.shot.frames_per_second,
        wave_makers: plates(scene, &scene.walls_after(state, time)),
        waves: scene.effects.waves(scene.water.gravity),
    }
}

/// The scene's wave makers, and how far inward each stands of the domain's side, metres.
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

/// What the scene's solids are called, in the order of [`render_scene`]: as their meshes' files, without the ending.
pub(super) fn solid_names(scene: &Scene) -> Vec<String> {
    let moving = scene.moving_solids.iter().map(|solid| &solid.placed);
    let placed = scene.solids.iter().chain(moving);
    placed.map(PlacedMesh::name).collect()
}
