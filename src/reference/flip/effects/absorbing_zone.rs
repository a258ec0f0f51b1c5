//! Absorbing zones: faces in one lose a part of the velocity that particles gave them.

use glam::DVec3;

use super::Water;
use crate::{
    domain::bricks::Bricks,
    reference::{
        Timings,
        flip::{
            Model, Room, Step,
            grid::{corner, per_cell},
        },
    },
    scene::effects::absorbing_zone::Settings,
};

/// The velocities at faces after the zone's absorption; `old` are those before gravity, both m/s. Shapes (elements).
pub fn absorb_faces(
    settings: &Settings,
    (model, step): (&Model, &Step<'_>),
    bricks: &Bricks,
    room: &Room,
    old: &[DVec3],
    velocity: &[DVec3],
) -> Vec<DVec3> {
    let size = model.scene.domain.size();
    per_cell(bricks, |element| {
        let e = element as usize;
        let part = |axis: usize| {
            let place = corner(bricks, element) + 0.5 - 0.5 * DVec3::AXES[axis];
            settings.absorbed(size, place * model.cell_size(), step.length)
        };
        let lost = DVec3::new(part(0), part(1), part(2)) * old[e];
        let is_open = room.open[e].cmpgt(DVec3::ZERO);
        velocity[e] - DVec3::select(is_open, lost, DVec3::ZERO)
    })
}

pub(super) fn apply(
    settings: &Settings,
    water: Water<'_>,
    velocity: &mut Vec<DVec3>,
    timings: &mut Timings,
) {
    let step = (water.model, water.step);
    *velocity = timings.time("effects/absorb_faces", || {
        absorb_faces(
            settings,
            step,
            water.bricks,
            water.room,
            water.old,
            velocity,
        )
    });
}
