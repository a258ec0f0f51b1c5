//! Forces of scenes.
use std::sync::Arc;

use glam::DVec3;
use swell::{
    domain::{
        bounds::Bounds,
        forces::{Force, ForceKind, Law, Medium},
        mesh::TriangleMesh,
        sources::{Shape, Window},
    },
    scene::{forces::PlacedForce, sources::Region},
};

use super::placed;

/// A force on water and whitewater, everywhere and always.
pub fn everywhere(kind: ForceKind) -> PlacedForce {
    PlacedForce {
        region: None,
        force: Force {
            kind,
            room: None,
            fade: 0.0,
            window: Window::default(),
            on: Medium::NAMED.map(|named| named.1).to_vec(),
        },
    }
}

pub fn push(acceleration: DVec3) -> PlacedForce {
    everywhere(ForceKind::Acceleration(acceleration))
}

pub fn vortex(at: DVec3, axis: DVec3, law: Law) -> PlacedForce {
    everywhere(ForceKind::Vortex { at, axis, law })
}

pub fn attract(at: DVec3, law: Law) -> PlacedForce {
    everywhere(ForceKind::Attract { at, law })
}

pub fn law(strength: f64, core: f64, falloff: u32) -> Law {
    Law {
        strength,
        core,
        falloff,
    }
}

/// The same force in a box only.
pub fn in_box(mut placed: PlacedForce, bounds: Bounds, fade: f64) -> PlacedForce {
    placed.region = Some(Region::Block(bounds));
    placed.force.room = Some(Arc::new(Shape::from(bounds)));
    placed.force.fade = fade;
    placed
}

/// The same force in a mesh only, for particles `spacing` metres apart.
pub fn in_mesh(mut force: PlacedForce, mesh: TriangleMesh, spacing: f64, fade: f64) -> PlacedForce {
    let region = Region::Mesh(placed(mesh));
    force.force.room = Some(region.force_room(spacing).unwrap());
    force.region = Some(region);
    force.force.fade = fade;
    force
}
