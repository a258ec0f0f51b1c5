//! Absorbing zones, on particles and on faces.

use glam::DVec3;

use crate::{
    comparison::{Comparison, Io, PassResult, comparison, names},
    flip::FlipState,
    pbf::PbfState,
    table::entries,
};
use swell_compare::rounding::U;
use swell_solve::{flip, pbf};

use super::zone::{self, PART};

entries! {
    "effects/absorb_particles" {
        VELOCITY = "velocity", "m/s": [part: "" PART, v: "|v| before"]
            (part + 4.0 * U) * v, "a product";
    }
    "effects/absorb_faces" {
        FACES = "velocity at faces", "m/s": [part: "" PART, old: "|v| before gravity", v: "|v|"]
            (part + 6.0 * U) * old + 2.0 * U * v, "a product, and a difference";
    }
}

pub(super) const PBF: &[Comparison<PbfState>] = &[comparison(
    "effects/absorb_particles",
    || names![pbf::buffers::VELOCITY],
    particles,
)];

pub(super) const FLIP: &[Comparison<FlipState>] = &[comparison(
    "effects/absorb_faces",
    || names![flip::buffers::FACE_VELOCITY, flip::buffers::FACE_CHANGE],
    faces,
)];

fn particles(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let Some(settings) = &state.scene.effects.absorbing_zone else {
        return Ok(());
    };
    let size = state.scene.domain.size();
    let part = zone::part(settings.zone(), size, state.substep.time_step);
    let none = |_| DVec3::ZERO;
    zone::particles(state, io, settings.zone(), &VELOCITY, none, |v| [part, v])
}

fn faces(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let Some(settings) = &state.scene.effects.absorbing_zone else {
        return Ok(());
    };
    let size = state.scene.domain.size();
    let part = zone::part(settings.zone(), size, state.step().length);
    let none = |_| DVec3::ZERO;
    let magnitudes = |[old, v]: [f64; 2]| [part, old, v];
    zone::faces(state, io, settings.zone(), &FACES, none, magnitudes)
}
