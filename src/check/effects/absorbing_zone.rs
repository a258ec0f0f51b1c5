//! Absorbing zones, of particles and of faces.

use glam::DVec3;

use crate::{
    check::{
        engine::{Io, Outcome, State, Twin, names, twin, wide},
        flip::FlipState,
        pbf::PbfState,
        table::{entries, pair},
    },
    compare::{rounding::U, tolerance::bounds},
    reference::{
        flip::effects::absorbing_zone::absorb_faces, pbf::effects::absorbing_zone::absorb_particles,
    },
    scene::effects::absorbing_zone::Settings,
    solve::{flip, pbf},
};

bounds! {
    // r Δt w² changes by 2 r Δt w of the way w's own change. Of the part x / (1 + x) that is 2 √(r Δt) √x / (1 + x)², whose
    // greatest value is 0.65 √(r Δt), at x = 1/3; and no more than 2 r Δt.
    PART = [most: "r Δt at the wall", ratio: "the domain's longest side over the zone's length"]
        U * ((2.0 * most).min(0.65 * most.sqrt()) * (6.0 * ratio + 4.0) + 8.0 * most.min(1.0)), "of the part that is taken, by where a place is";
}

entries! {
    "effects/absorb_particles" {
        VELOCITY = "velocity", "m/s": [part: "" PART, v: "|v| before"] (part + 4.0 * U) * v, "a product";
    }
    "effects/absorb_faces" {
        FACES = "velocity at faces", "m/s": [part: "" PART, old: "|v| before gravity", v: "|v|"]
            (part + 6.0 * U) * old + 2.0 * U * v, "a product, and a difference";
    }
}

pub(super) const PBF: &[Twin<PbfState>] = &[twin(
    "effects/absorb_particles",
    || names![pbf::buffers::VELOCITY],
    particles,
)];

pub(super) const FLIP: &[Twin<FlipState>] = &[twin(
    "effects/absorb_faces",
    || names![flip::buffers::FACE_VELOCITY, flip::buffers::FACE_CHANGE],
    faces,
)];

fn part(settings: &Settings, size: DVec3, step: f64) -> f64 {
    PART.of([settings.rate() * step, size.max_element() / settings.length])
}

fn particles(state: &mut PbfState, io: &mut Io<'_>) -> Outcome {
    let Some(settings) = &state.scene.effects.absorbing_zone else {
        return Ok(());
    };
    let n = state.particles();
    let places = io.before.vectors(pbf::buffers::POSITION, n)?;
    let before = io.before.get(pbf::buffers::VELOCITY, n)?;
    let velocity = wide(&before);
    let is_drop: Vec<bool> = before.iter().map(|v| v[3] > 0.0).collect();
    let (size, step) = (state.scene.domain.size(), state.substep.time_step);
    let twin = absorb_particles(settings, (size, step), &places, &is_drop, &velocity);
    let part = part(settings, size, step);
    let found = io.after.vectors(pbf::buffers::VELOCITY, n)?;
    io.table.each(&VELOCITY, 0..n, |i| {
        pair(i, found[i], twin[i], [part, velocity[i].length()])
    });
    Ok(())
}

fn faces(state: &mut FlipState, io: &mut Io<'_>) -> Outcome {
    let Some(settings) = &state.scene.effects.absorbing_zone else {
        return Ok(());
    };
    let (elements, step) = (state.elements(), state.step());
    let old = elements.planes(&io.before, flip::buffers::FACE_CHANGE)?;
    let before = elements.planes(&io.before, flip::buffers::FACE_VELOCITY)?;
    let found = elements.planes(&io.after, flip::buffers::FACE_VELOCITY)?;
    let twin = absorb_faces(
        settings,
        (&state.model, &step),
        &elements.bricks,
        state.room(),
        &old,
        &before,
    );
    let part = part(settings, state.scene.domain.size(), step.length);
    io.table.each(&FACES, elements.active(), |e| {
        pair(
            e,
            found[e],
            twin[e],
            [part, old[e].length(), before[e].length()],
        )
    });
    Ok(())
}
