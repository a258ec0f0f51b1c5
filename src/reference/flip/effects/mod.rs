//! What each effect does to velocities at faces: a file an effect.

use glam::DVec3;

use super::{
    Centers, Model, Room, Sorted, Step,
    grid::{corner, per_cell},
};
use crate::Timings;
use swell_domain::bricks::Bricks;
use swell_scene::effects::{Effects, with_effects, zone::Zone};

/// What an effect knows beside the velocities.
#[derive(Clone, Copy)]
pub struct Water<'a> {
    /// Settings.
    pub model: &'a Model,
    /// The substep.
    pub step: &'a Step<'a>,
    /// Where the elements lie.
    pub bricks: &'a Bricks,
    /// What of the cells is water.
    pub room: &'a Room,
    /// What cell centres know of it.
    pub centers: &'a Centers,
    /// Velocities at faces before gravity, m/s.
    pub old: &'a [DVec3],
}

/// Velocities at faces after a zone led them towards `wanted`, which is asked for at places in metres from the domain's least
/// corner, from those before gravity on; m/s, shapes (elements).
pub fn led_faces(
    zone: Zone<'_>,
    water: Water<'_>,
    velocity: &[DVec3],
    wanted: impl Fn(DVec3) -> DVec3 + Sync,
) -> Vec<DVec3> {
    let Water { model, bricks, .. } = water;
    let size = model.scene.domain.size();
    per_cell(bricks, |element| {
        let e = element as usize;
        let change = |axis: usize| {
            let place = corner(bricks, element) + 0.5 - 0.5 * DVec3::AXES[axis];
            let place = place * model.cell_size();
            match zone.led(size, place, water.step.length) {
                0.0 => 0.0,
                part => part * (wanted(place) - water.old[e])[axis],
            }
        };
        let change = DVec3::new(change(0), change(1), change(2));
        let is_open = water.room.open[e].cmpgt(DVec3::ZERO);
        velocity[e] + DVec3::select(is_open, change, DVec3::ZERO)
    })
}

/// What an effect on the sorted particles knows beside them.
#[derive(Clone, Copy)]
pub struct Flying<'a> {
    /// Settings.
    pub model: &'a Model,
    /// The substep.
    pub step: &'a Step<'a>,
    /// Where the elements lie.
    pub bricks: &'a Bricks,
    /// What solids leave of the cells.
    pub kind: &'a [u32],
}

/// What an effect's settings do, with times by pass.
trait Acts {
    /// To the sorted particles, before the grid is given their velocities.
    fn on_particles(&self, _: Flying<'_>, _: &mut Sorted, _: &mut Timings) {}

    /// To the velocities at the faces, m/s, before the projection.
    fn on_faces(&self, _: Water<'_>, _velocity: &mut Vec<DVec3>, _: &mut Timings) {}

    /// To the velocities at the faces, m/s, between two projections; whether it needed more iterations than it may take.
    fn between_projections(
        &self,
        _: Water<'_>,
        _velocity: &mut Vec<DVec3>,
        _: &mut Timings,
    ) -> bool {
        false
    }
}

macro_rules! twins {
    ($($name:ident),+ $(,)?) => {
        $(pub mod $name;)+

        /// Runs the effects that a scene names on the sorted particles.
        pub(super) fn on_particles(
            named: &Effects,
            flying: Flying<'_>,
            sorted: &mut Sorted,
            timings: &mut Timings,
        ) {
            $(
                if let Some(settings) = &named.$name {
                    settings.on_particles(flying, sorted, timings);
                }
            )+
        }

        /// Runs the effects that a scene names between two projections on the velocities at the faces, m/s; whether one needed more
        /// iterations than it may take.
        pub(super) fn between_projections(
            named: &Effects,
            water: Water<'_>,
            velocity: &mut Vec<DVec3>,
            timings: &mut Timings,
        ) -> bool {
            let mut is_short = false;
            $(
                if let Some(settings) = &named.$name {
                    is_short |= settings.between_projections(water, velocity, timings);
                }
            )+
            is_short
        }

        /// Runs the effects that a scene names on the velocities at the faces, m/s.
        pub(super) fn on_faces(
            named: &Effects,
            water: Water<'_>,
            velocity: &mut Vec<DVec3>,
            timings: &mut Timings,
        ) {
            $(
                if let Some(settings) = &named.$name {
                    settings.on_faces(water, velocity, timings);
                }
            )+
        }
    };
}

with_effects!(twins);
