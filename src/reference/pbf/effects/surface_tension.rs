//! Surface tension for PBF: nothing on particles, because its projection applies it on the grid.

use glam::DVec3;

use super::Inputs;
use crate::Timings;
use swell_scene::effects::surface_tension::Settings;

pub(super) fn apply(
    _: &Settings,
    _: Inputs<'_>,
    velocity: &[DVec3],
    _: &mut Timings,
) -> Vec<DVec3> {
    velocity.to_vec()
}
