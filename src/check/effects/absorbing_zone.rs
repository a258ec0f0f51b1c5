//! Absorbing zones, on particles and on faces.

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
        VELOCITY = "velocity", "m/s": [part: "" PART, v: "|v| before and the current's"]
            (part + 6.0 * U) * v, "two products, and a sum";
    }
    "effects/absorb_faces" {
        FACES = "velocity at faces", "m/s": [part: "" PART,
            old: "|v| before gravity and the current's", v: "|v|"]
            (part + 7.0 * U) * old + 2.0 * U * v, "a product, and two differences";
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
    let current = state.scene.water.current;
    let wanted = |_| current;
    zone::particles(state, io, settings.zone(), &VELOCITY, wanted, |v| [part, v])
}

fn faces(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let Some(settings) = &state.scene.effects.absorbing_zone else {
        return Ok(());
    };
    let size = state.scene.domain.size();
    let part = zone::part(settings.zone(), size, state.step().length);
    let current = state.scene.water.current;
    let wanted = |_| current;
    let magnitudes = |[old, v]: [f64; 2]| [part, old, v];
    zone::faces(state, io, settings.zone(), &FACES, wanted, magnitudes)
}
