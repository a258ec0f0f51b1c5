//! What each effect does to velocities at faces: a file an effect.

use glam::DVec3;

use super::{Model, Room, Step};
use crate::{
    domain::bricks::Bricks,
    reference::Timings,
    scene::effects::{Effects, with_effects},
};

/// What an effect knows beside the velocities.
#[derive(Clone, Copy)]
pub(super) struct Water<'a> {
    /// Settings.
    pub(super) model: &'a Model,
    /// The substep.
    pub(super) step: &'a Step<'a>,
    /// Where the elements lie.
    pub(super) bricks: &'a Bricks,
    /// What of the cells is water.
    pub(super) room: &'a Room,
    /// Velocities at faces before gravity, m/s.
    pub(super) old: &'a [DVec3],
}

macro_rules! twins {
    ($($name:ident),+ $(,)?) => {
        $(pub mod $name;)+

        /// Runs the effects that a scene names on the velocities at the faces, m/s.
        pub(super) fn apply(
            named: &Effects,
            water: Water<'_>,
            velocity: &mut Vec<DVec3>,
            timings: &mut Timings,
        ) {
            $(
                if let Some(settings) = &named.$name {
                    $name::apply(settings, water, velocity, timings);
                }
            )+
        }
    };
}

with_effects!(twins);
