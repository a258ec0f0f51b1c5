//! Generation zones, on particles and on faces.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::{
    comparison::{Comparison, Io, PassResult, comparison, names},
    flip::FlipState,
    pbf::PbfState,
    table::entries,
};
use swell_compare::{rounding::U, tolerance::bounds};
use swell_domain::open_waves::OpenWaves;
use swell_solve::{flip, pbf};

use super::zone::{self, PART};

bounds! {
    // Errors: a phase's by the rounding of as many turns as fit into the domain's length; WGSL's
    // sines 2⁻¹¹ between −π and π (WGSL §15.7.4); exp(−a) (3 + 2a) ULP plus the rounding of a,
    // where a exp(−a) is at most 0.4.
    WAVE = [speed: "Σ|u| of the waves", turns: "the most turns of one along the domain",
        count: "waves"]
        speed * (2f64.powi(-11) * 2.0 + U * (TAU * 6.0 * (turns + 1.0) + 24.0 + count)),
        "of the waves' velocity";
}

entries! {
    "effects/generate_particles" {
        VELOCITY = "velocity", "m/s": [part: "" PART, most: "r Δt / (1 + r Δt) at the wall",
            wave: "" WAVE, speed: "Σ|u| of the waves", v: "|v| before and the current's"]
            part * (v + speed) + most * wave + 6.0 * U * (v + most * speed), "a product, and a sum";
    }
    "effects/generate_faces" {
        FACES = "velocity at faces", "m/s": [part: "" PART, most: "r Δt / (1 + r Δt) at the wall",
            wave: "" WAVE, speed: "Σ|u| of the waves",
            old: "|v| before gravity and the current's", v: "|v|"]
            part * (old + speed) + most * wave + 6.0 * U * (most * (old + speed) + v),
            "a product, and a sum";
    }
}

pub(super) const PBF: &[Comparison<PbfState>] = &[comparison(
    "effects/generate_particles",
    || names![pbf::buffers::VELOCITY],
    particles,
)];

pub(super) const FLIP: &[Comparison<FlipState>] = &[comparison(
    "effects/generate_faces",
    || names![flip::buffers::FACE_VELOCITY, flip::buffers::FACE_CHANGE],
    faces,
)];

/// Returns the largest fraction by which a step moves a velocity towards the target, [`WAVE`], and
/// Σ|u|, m/s.
fn sizes(waves: &OpenWaves, rate: f64, size: DVec3, step: f64) -> [f64; 3] {
    let speed = waves.most_speed();
    let turns = |line: &swell_domain::open_waves::WaveComponent| line.number.length() / TAU;
    let most = waves.lines.iter().map(turns).fold(0.0, f64::max);
    let wave = WAVE.of([speed, most * size.length(), waves.lines.len() as f64]);
    [rate * step / (1.0 + rate * step), wave, speed]
}

fn particles(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let Some(settings) = &state.scene.effects.generation_zone else {
        return Ok(());
    };
    let (waves, zone) = (
        settings.incoming(state.scene.water.gravity),
        settings.zone(),
    );
    let size = state.scene.domain.size();
    let (step, time) = (state.substep.time_step, state.substep.time);
    let part = zone::part(zone, size, step);
    let [most, wave, speed] = sizes(&waves, zone.rate, size, step);
    let current = state.scene.water.current;
    let wanted = |place| current + waves.velocity(place, time);
    let magnitudes = |v| [part, most, wave, speed, v];
    zone::particles(state, io, zone, &VELOCITY, wanted, magnitudes)
}

fn faces(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let Some(settings) = &state.scene.effects.generation_zone else {
        return Ok(());
    };
    let (waves, zone) = (
        settings.incoming(state.scene.water.gravity),
        settings.zone(),
    );
    let size = state.scene.domain.size();
    let (step, time) = (state.step().length, state.step().start);
    let part = zone::part(zone, size, step);
    let [most, wave, speed] = sizes(&waves, zone.rate, size, step);
    let current = state.scene.water.current;
    let wanted = |place| current + waves.velocity(place, time);
    let magnitudes = |[old, v]: [f64; 2]| [part, most, wave, speed, old, v];
    zone::faces(state, io, zone, &FACES, wanted, magnitudes)
}
