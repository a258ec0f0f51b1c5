//! The scene's forces on faces and on isolated droplets, and their work.

use glam::DVec3;

use crate::{
    comparison::{Comparison, Io, PassResult, comparison, names},
    forces::{Bounded, EDGE, PUSH},
    table::{entries, pair},
};
use swell_compare::rounding::U;
use swell_domain::{bricks::CELLS, frame::change_by_turn};
use swell_reference::flip::{Faces, GridTransfer, push_drops, push_faces, work_by_cells};
use swell_solve::{effects::forces::FORCE_WORK, flip::buffers};

use super::{FlipState, elements};

entries! {
    "effects/turn_sorted" {
        TURNED = "velocity turned by Coriolis's acceleration", "m/s": [v: "|v|"]
            16.0 * U * v, "two cross products and their factors, which are rounded";
        TURNED_DROPS = "velocity with which drops move", "m/s": [v: "|v|"]
            16.0 * U * v, "the same";
    }
    "effects/push_faces" {
        FACES = "velocity at faces", "m/s": [push: "Δt times " PUSH, change: "|a| Δt", v: "|v|"]
            push + 4.0 * U * change + 2.0 * U * v, "a product, and a sum", tie EDGE;
    }
    "effects/push_drops" {
        DROPS = "velocity", "m/s": [push: "Δt times " PUSH, change: "|a| Δt", v: "|v|"]
            push + 4.0 * U * change + 2.0 * U * v, "a product, and a sum", tie EDGE;
        CARRIED = "velocity of the grid", "m/s":
            [push: "Δt times " PUSH, change: "|a| Δt", v: "|v|"]
            push + 4.0 * U * change + 2.0 * U * v, "of a drop the same", tie EDGE;
    }
    "effects/work_by_cells" {
        WORK = "shares of the work", "m²/s²": [pushes: "Σ |v| Δt times " PUSH,
            sizes: "Σ |a| Δt |v| of particles", count: "the most particles of a cell"]
            pushes + (96.0 + count) * U * sizes, "products, and sums over cells and drops",
            tie EDGE;
    }
}

pub(super) const COMPARISONS: &[Comparison<FlipState>] = &[
    comparison(
        "effects/turn_sorted",
        || names![buffers::SORTED_VELOCITY, buffers::CARRIED],
        turned,
    ),
    comparison("effects/push_faces", elements::faces_kept, faces),
    comparison(
        "effects/push_drops",
        || names![buffers::SORTED_VELOCITY, buffers::CARRIED],
        drops,
    ),
    comparison("effects/work_by_cells", || names![FORCE_WORK], work),
];

/// Compares the particles' velocities before the transfer to the grid, and after that from it.
fn turned(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (n, step) = (state.n, state.step());
    let Some(turn) = state.model.half_turn(&step) else {
        return Ok(());
    };
    let before = io.before.vectors(buffers::SORTED_VELOCITY, n)?;
    let found = io.after.vectors(buffers::SORTED_VELOCITY, n)?;
    io.table.each(&TURNED, 0..n, |i| {
        let exact = before[i] + change_by_turn(turn, before[i]);
        Some(pair(i, found[i], exact, [before[i].length()]))
    });
    let Some(given) = &mut state.given else {
        state.carry_velocities(found);
        return Ok(());
    };
    let kept = io.before.vectors(buffers::CARRIED, n)?;
    let carried = io.after.vectors(buffers::CARRIED, n)?;
    // What is no droplet moves as before.
    io.table.each(&TURNED_DROPS, 0..n, |i| {
        let turned = before[i] + change_by_turn(turn, before[i]);
        let (exact, v) = match given.is_drop[i] {
            true => (turned, before[i].length()),
            false => (kept[i], 0.0),
        };
        Some(pair(i, carried[i], exact, [v]))
    });
    given.velocity = found;
    given.carried = carried;
    Ok(())
}

fn faces(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (elements, step) = (state.elements(), state.step());
    let before = elements.planes(&io.before, buffers::FACE_VELOCITY)?;
    let found = elements.planes(&io.after, buffers::FACE_VELOCITY)?;
    let (model, bricks) = (&state.model, &elements.bricks);
    let reference = push_faces(model, &step, bricks, state.space(), &before);
    let bounded = Bounded::of(&model.scene, model.forces(&step));
    io.table.each(&FACES, elements.active(), |e| {
        let mut magnitudes = [0.0; 3];
        for axis in 0..3 {
            let place = model.face_center(bricks, e as u32, axis);
            let error = bounded.error(place)?;
            magnitudes[0] += step.kick * error;
            magnitudes[1] += step.kick * bounded.at(place).length();
        }
        magnitudes[2] = before[e].length() + reference[e].length();
        Some(pair(e, found[e], reference[e], magnitudes))
    });
    Ok(())
}

/// Compares all particles: those that are no droplets have to stay as they are.
fn drops(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let Some(given) = state.given.take() else {
        return Ok(());
    };
    let (n, step) = (state.n, state.step());
    let mut reference = GridTransfer {
        velocity: io.before.vectors(buffers::SORTED_VELOCITY, n)?,
        carried: io.before.vectors(buffers::CARRIED, n)?,
        ..given
    };
    let position = &state.sorted().cloud.position;
    push_drops(&state.model, &step, position, &mut reference);
    let velocity = io.after.vectors(buffers::SORTED_VELOCITY, n)?;
    let carried = io.after.vectors(buffers::CARRIED, n)?;
    let bounded = Bounded::of(&state.model.scene, state.model.forces(&step));
    let magnitudes = |i: usize, v: DVec3| -> Option<[f64; 3]> {
        if !reference.is_drop[i] {
            return Some([0.0; 3]);
        }
        let change = step.kick * bounded.at(position[i]).length();
        let push = step.kick * bounded.error(position[i])?;
        Some([push, change, v.length() + change])
    };
    io.table.each(&DROPS, 0..n, |i| {
        let exact = reference.velocity[i];
        Some(pair(i, velocity[i], exact, magnitudes(i, exact)?))
    });
    io.table.each(&CARRIED, 0..n, |i| {
        let exact = reference.carried[i];
        Some(pair(i, carried[i], exact, magnitudes(i, exact)?))
    });
    state.given = Some(GridTransfer {
        velocity,
        carried,
        ..reference
    });
    Ok(())
}

fn work(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let Some(given) = &state.given else {
        return Ok(());
    };
    let (elements, step, sorted) = (state.elements(), state.step(), state.sorted());
    let faces = elements.faces(&io.before)?;
    let (model, bricks) = (&state.model, &elements.bricks);
    let seen = (&faces, state.space());
    let reference = work_by_cells(model, &step, bricks, sorted, seen, given);
    let bounded = Bounded::of(&model.scene, model.forces(&step));
    let sizes = |e: usize| {
        let particles = sorted.of(e as u32);
        let mut sum = [0.0; 2];
        for i in particles.clone() {
            let is_drop = given.is_drop[i];
            let most = step.kick * bounded.most();
            // A drop's mean velocity has the changes by gravity and forces in it.
            let v = match is_drop {
                true => given.velocity[i].length() + step.velocity_step.length() + 2.0 * most,
                false => speed(&faces, elements, e),
            };
            let place = sorted.cloud.position[i];
            sum[0] += v * step.kick * error_about(&bounded, state, e, place, is_drop)?;
            sum[1] += v * most;
        }
        Some((sum, particles.len()))
    };
    let wet = elements.wet();
    let found = io.after.get(FORCE_WORK, wet.len() / 64)?;
    io.table.each(&WORK, 0..found.len(), |group| {
        let first = wet.start + 64 * group;
        let mut magnitudes = [0.0; 3];
        for e in first..first + 64 {
            let ([pushes, work], count) = sizes(e)?;
            magnitudes[0] += pushes;
            magnitudes[1] += work;
            magnitudes[2] = f64::max(magnitudes[2], count as f64);
        }
        let from = first - CELLS as usize;
        let exact: f64 = reference[from..from + 64].iter().sum();
        Some(pair(group, found[group], exact, magnitudes))
    });
    Ok(())
}

/// Returns a bound on the velocity at the six faces of a cell, m/s, summed over the axes.
fn speed(faces: &Faces, elements: &elements::Elements, element: usize) -> f64 {
    elements.largest_about(element, |e| {
        let [v, change] = [faces.velocity[e], faces.change[e]].map(|v| v.abs().element_sum());
        v + 0.5 * change
    })
}

/// Returns the largest [`PUSH`] that enters the work on a particle of a cell: of a drop at its
/// position, else at the cell's faces; `None` at the edge of a room.
fn error_about(
    bounded: &Bounded<'_>,
    state: &FlipState,
    element: usize,
    place: DVec3,
    is_drop: bool,
) -> Option<f64> {
    if is_drop {
        return bounded.error(place);
    }
    let (model, bricks) = (&state.model, &state.elements().bricks);
    let mut most = 0.0f64;
    for axis in 0..3 {
        let low = model.face_center(bricks, element as u32, axis);
        for place in [low, low + model.cell_size() * DVec3::AXES[axis]] {
            most = most.max(bounded.error(place)?);
        }
    }
    Some(most)
}
