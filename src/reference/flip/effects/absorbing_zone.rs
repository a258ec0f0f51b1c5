//! Absorbing zones: faces in one lose a part of the velocity that particles gave them.

use glam::DVec3;

use super::{Water, led_faces};
use crate::{reference::Timings, scene::effects::absorbing_zone::Settings};

pub(super) fn apply(
    settings: &Settings,
    water: Water<'_>,
    velocity: &mut Vec<DVec3>,
    timings: &mut Timings,
) {
    *velocity = timings.time("effects/absorb_faces", || {
        led_faces(settings.zone(), water, velocity, |_| DVec3::ZERO)
    });
}
