//! The scene's forces on particles, and their work.

use glam::{DVec3, Vec4};

use crate::{
    comparison::{Comparison, Io, PassResult, State, comparison, names},
    forces::{Bounded, EDGE, PUSH},
    table::{entries, pair},
};
use swell_compare::rounding::U;
use swell_domain::frame::change_by_turn;
use swell_reference::pbf::forces::{self, push_particles, work_on_particle};
use swell_solve::{
    effects::forces::{FORCE_IMPULSE, FORCE_WORK},
    pbf::buffers,
};

use super::PbfState;

entries! {
    "effects/turn_particles" {
        TURNED = "velocity turned by Coriolis's acceleration", "m/s": [v: "|v|"]
            16.0 * U * v, "two cross products and their factors, which are rounded";
    }
    "effects/push_particles" {
        VELOCITY = "velocity", "m/s": [push: "Δt times " PUSH, change: "|a| Δt", v: "|v|"]
            push + 4.0 * U * change + 2.0 * U * v, "a product, and a sum", tie EDGE;
        IMPULSE = "change of the velocity", "m/s": [push: "Δt times " PUSH, change: "|a| Δt"]
            push + 4.0 * U * change, "a product", tie EDGE;
        BEFORE = "change times the velocity before", "m²/s²":
            [push: "Δt times " PUSH, change: "|a| Δt", v: "|v| before"]
            (push + 8.0 * U * change) * v, "a dot product", tie EDGE;
    }
    "effects/work_by_particles" {
        WORK = "shares of the work", "m²/s²": [sizes: "Σ |a| Δt (|v| + |v before|)",
            before: "|the sum before|", after: "|the sum|"]
            72.0 * U * sizes + U * (before + after), "products, and 64 sums";
    }
}

pub(crate) const COMPARISONS: &[Comparison<PbfState>] = &[
    comparison(
        "effects/turn_particles",
        || names![buffers::VELOCITY],
        turned,
    ),
    comparison(
        "effects/push_particles",
        || names![buffers::VELOCITY],
        particles,
    ),
    comparison("effects/work_by_particles", || names![FORCE_WORK], work),
];

fn turned(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let n = state.particles();
    let Some(turn) = forces::half_turn(&state.scene, &state.substep) else {
        return Ok(());
    };
    let before = io.before.vectors(buffers::VELOCITY, n)?;
    let found = io.after.vectors(buffers::VELOCITY, n)?;
    io.table.each(&TURNED, 0..n, |i| {
        let exact = before[i] + change_by_turn(turn, before[i]);
        Some(pair(i, found[i], exact, [before[i].length()]))
    });
    Ok(())
}

fn particles(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let n = state.particles();
    let place = io.before.vectors(buffers::POSITION, n)?;
    let before = io.before.vectors(buffers::VELOCITY, n)?;
    let found = io.after.vectors(buffers::VELOCITY, n)?;
    let impulses = io.after.get(FORCE_IMPULSE, n)?;
    let reference = push_particles(&state.scene, &state.substep, &place, &before);
    let bounded = Bounded::of(&state.scene, forces::forces(&state.scene, &state.substep));
    let step = state.substep.time_step;
    let sizes = |i: usize| Some([step * bounded.error(place[i])?, reference[i].0.length()]);
    let impulse = |i: usize| Vec4::from_array(impulses[i]).as_dvec4();
    io.table.each(&VELOCITY, 0..n, |i| {
        let [push, change] = sizes(i)?;
        let exact = before[i] + reference[i].0;
        let size = before[i].length() + exact.length();
        Some(pair(i, found[i], exact, [push, change, size]))
    });
    io.table.each(&IMPULSE, 0..n, |i| {
        Some(pair(i, impulse(i).truncate(), reference[i].0, sizes(i)?))
    });
    io.table.each(&BEFORE, 0..n, |i| {
        let [push, change] = sizes(i)?;
        let magnitudes = [push, change, before[i].length()];
        Some(pair(i, impulse(i).w, reference[i].1, magnitudes))
    });
    Ok(())
}

/// Compares the sums, from the changes that the device kept.
fn work(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let n = state.particles();
    let groups = n.div_ceil(64);
    let order = io.before.get(buffers::ORDER, n)?;
    let velocity = io.before.vectors(buffers::VELOCITY, n)?;
    let impulses = io.before.get(FORCE_IMPULSE, n)?;
    let before = io.before.scalars(FORCE_WORK, groups)?;
    let after = io.after.scalars(FORCE_WORK, groups)?;
    let impulse = |i: usize| {
        let all = Vec4::from_array(impulses[order[i] as usize]).as_dvec4();
        (all.truncate(), all.w)
    };
    io.table.each(&WORK, 0..groups, |group| {
        let terms = 64 * group..(64 * group + 64).min(n);
        let term = |i: usize| work_on_particle(impulse(i), velocity[i]);
        let size = |i: usize| {
            let (change, with): (DVec3, f64) = impulse(i);
            change.length() * velocity[i].length() + with.abs()
        };
        let sum: f64 = terms.clone().map(term).sum();
        let sizes: f64 = terms.map(size).sum();
        let (before, after) = (before[group], after[group]);
        let magnitudes = [sizes, before.abs(), after.abs()];
        pair(group, after, before + sum, magnitudes)
    });
    Ok(())
}
