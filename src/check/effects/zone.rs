//! Zones that relax velocities, on particles and on faces: code shared by absorbing and generation
//! zones.

use glam::DVec3;

use crate::{
    comparison::{Io, PassResult, State},
    flip::FlipState,
    pbf::PbfState,
    table::{CheckEntry, pair},
};
use swell_compare::{rounding::U, tolerance::bounds};
use swell_reference::{
    flip::{
        Centers,
        effects::{FaceInputs, led_faces},
    },
    pbf::effects::led_particles,
};
use swell_scene::effects::zone::Zone;
use swell_solve::{flip, pbf};

bounds! {
    // r Δt w² changes by 2 r Δt w times the change of the relative depth w. For the fraction x / (1
    // + x) that gives 2 √(r Δt) √x / (1 + x)², whose maximum is 0.65 √(r Δt), at x = 1/3; and no
    // more than 2 r Δt.
    pub(super) PART = [most: "r Δt at the wall",
        ratio: "the domain's longest side over the zone's length"]
        U * ((2.0 * most).min(0.65 * most.sqrt()) * (6.0 * ratio + 4.0) + 8.0 * most.min(1.0)),
        "of the part of the way that water is led, by where a place is";
}

/// Returns [`PART`] for a step of `step` seconds in a domain of `size`.
pub(super) fn part(zone: Zone<'_>, size: DVec3, step: f64) -> f64 {
    PART.of([zone.rate * step, size.max_element() / zone.length])
}

/// Compares particles that a zone moved towards `wanted`; `magnitudes` takes the speed before.
pub(super) fn particles<const N: usize>(
    state: &PbfState,
    io: &mut Io<'_>,
    zone: Zone<'_>,
    entry: &'static CheckEntry<N>,
    wanted: impl Fn(DVec3) -> DVec3 + Send + Sync,
    magnitudes: impl Fn(f64) -> [f64; N] + Send + Sync,
) -> PassResult {
    let n = state.particles();
    let places = io.before.vectors(pbf::buffers::POSITION, n)?;
    let velocity = io.before.vectors(pbf::buffers::VELOCITY, n)?;
    let is_drop = state.drops(&io.before)?;
    let step = (state.scene.domain.size(), state.substep.time_step);
    let reference = led_particles(zone, step, (&places, &is_drop), &velocity, wanted);
    let found = io.after.vectors(pbf::buffers::VELOCITY, n)?;
    let current = state.scene.water.current.length();
    io.table.each(entry, 0..n, |i| {
        let before = velocity[i].length() + current;
        pair(i, found[i], reference[i], magnitudes(before))
    });
    Ok(())
}

/// Compares faces that a zone moved towards `wanted`; `magnitudes` takes the speeds before gravity
/// and before the zone.
pub(super) fn faces<const N: usize>(
    state: &FlipState,
    io: &mut Io<'_>,
    zone: Zone<'_>,
    entry: &'static CheckEntry<N>,
    wanted: impl Fn(DVec3) -> DVec3 + Send + Sync,
    magnitudes: impl Fn([f64; 2]) -> [f64; N] + Send + Sync,
) -> PassResult {
    let (elements, step) = (state.elements(), state.step());
    let old = elements.planes(&io.before, flip::buffers::FACE_CHANGE)?;
    let before = elements.planes(&io.before, flip::buffers::FACE_VELOCITY)?;
    let found = elements.planes(&io.after, flip::buffers::FACE_VELOCITY)?;
    let water = FaceInputs {
        model: &state.model,
        step: &step,
        bricks: &elements.bricks,
        space: state.space(),
        // Zones do not read them.
        centers: &Centers::default(),
        old: &old,
    };
    let reference = led_faces(zone, water, &before, wanted);
    let current = state.scene.water.current.length();
    io.table.each(entry, elements.active(), |e| {
        let sizes = [old[e].length() + current, before[e].length()];
        pair(e, found[e], reference[e], magnitudes(sizes))
    });
    Ok(())
}
