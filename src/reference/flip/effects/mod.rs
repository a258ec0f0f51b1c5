//! Reference passes of the effects on FLIP, one file per effect.

use glam::DVec3;

use super::{
    Centers, FlipSubstep, Model, OpenSpace, Sorted,
    grid::{corner, per_cell},
};
use crate::Timings;
use swell_domain::bricks::Bricks;
use swell_scene::effects::{Effects, with_effects, zone::Zone};

/// Inputs of an effect on faces, besides the velocities.
#[derive(Clone, Copy)]
pub struct FaceInputs<'a> {
    /// Scene and grid.
    pub model: &'a Model,
    /// Parameters of the substep.
    pub step: &'a FlipSubstep<'a>,
    /// Layout of the elements.
    pub bricks: &'a Bricks,
    /// Open space and cell kinds.
    pub space: &'a OpenSpace,
    /// Densities and surface distances at cell centres.
    pub centers: &'a Centers,
    /// Velocities at faces before gravity, m/s.
    pub old: &'a [DVec3],
}

/// Returns the face velocities after a zone moved them, from those before gravity, towards
/// `wanted`, which takes positions in metres from the domain's minimum corner; m/s, shapes
/// (elements).
pub fn led_faces(
    zone: Zone<'_>,
    water: FaceInputs<'_>,
    velocity: &[DVec3],
    wanted: impl Fn(DVec3) -> DVec3 + Sync,
) -> Vec<DVec3> {
    let FaceInputs { model, bricks, .. } = water;
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
        let is_open = water.space.open[e].cmpgt(DVec3::ZERO);
        velocity[e] + DVec3::select(is_open, change, DVec3::ZERO)
    })
}

/// Inputs of an effect on the sorted particles, besides the particles.
#[derive(Clone, Copy)]
pub struct Flying<'a> {
    /// Scene and grid.
    pub model: &'a Model,
    /// Parameters of the substep.
    pub step: &'a FlipSubstep<'a>,
    /// Layout of the elements.
    pub bricks: &'a Bricks,
    /// Kinds of the cells, as far as solids determine them.
    pub kind: &'a [u32],
}

/// Reference passes of an effect, timed by pass.
trait Acts {
    /// Acts on the sorted particles before the transfer to the grid.
    fn on_particles(&self, _: Flying<'_>, _: &mut Sorted, _: &mut Timings) {}

    /// Acts on the face velocities, m/s, before the projection.
    fn on_faces(&self, _: FaceInputs<'_>, _velocity: &mut Vec<DVec3>, _: &mut Timings) {}

    /// Acts on the face velocities, m/s, between two projections; returns whether it needs more
    /// iterations than the settings allow.
    fn between_projections(
        &self,
        _: FaceInputs<'_>,
        _velocity: &mut Vec<DVec3>,
        _: &mut Timings,
    ) -> bool {
        false
    }
}

macro_rules! twins {
    ($($name:ident),+ $(,)?) => {
        $(pub mod $name;)+

        /// Applies the scene's effects to the sorted particles.
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

        /// Applies the scene's effects between two projections to the face velocities, m/s; returns
        /// whether one needs more iterations than the settings allow.
        pub(super) fn between_projections(
            named: &Effects,
            water: FaceInputs<'_>,
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

        /// Applies the scene's effects to the face velocities, m/s.
        pub(super) fn on_faces(
            named: &Effects,
            water: FaceInputs<'_>,
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
