//! From the prediction to the velocity update.

use glam::DVec3;

use crate::{
    comparison::{Io, PassResult},
    sort::{check_cells, check_slots},
    table::{each, pair},
};
use swell_domain::places::word;
use swell_reference::{
    neighbors::Neighbors,
    pbf::{
        Colour,
        passes::{self, Momentum},
    },
};
use swell_scene::Iteration;
use swell_solve::{params::Phase, pbf::buffers};

use super::{PbfState, State, bounds::Bounds, rows::*};

pub(super) fn predict(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let n = state.particles();
    state.take_samples(io)?;
    if state.is_over {
        // A frame's measurement begins with a prediction over a time step of 0.
        state.substep.time_step = 0.0;
        state.substep.wall_velocity = Default::default();
    }
    let x = io.before.vectors(buffers::POSITION, n)?;
    let v = io.before.vectors(buffers::VELOCITY, n)?;
    let is_drop = state.drops(&io.before)?;
    let goes_along = |i: usize| state.model.settings.grid_projection && !is_drop[i];
    let predicted = io.after.vectors(buffers::CORRECTED, n)?;
    let velocity = io.after.vectors(buffers::VELOCITY, n)?;
    let works = match state.scene.has_movers() {
        true => io.after.get(buffers::WALL_WORK, 2 * n)?,
        false => Vec::new(),
    };
    let none = Neighbors::listed(0, |_, _| [0; 2]);
    let bounds = Bounds(state.inputs(&[], &none));
    let (model, step) = (&state.model, state.substep.time_step);
    let one = |i: usize| {
        let (x, v) = (x[i], v[i]);
        let pushed = v + model.gravity * step;
        let is_slowed = step * pushed.length() > 0.99 * model.max_displacement();
        let speed = v.length() + model.gravity.length() * step;
        let free = PUSH_FREE.of([if is_slowed { 16.0 } else { 0.0 }, speed]);
        let error = WAY.of([x.length(), step, speed, free]);
        let cap = (model.max_displacement() / (step * pushed.length()).max(1e-30)).min(1.0);
        let confined = bounds.confine(x + step * cap * pushed, error);
        let stopped = match confined.is_touched && step > 0.0 {
            true => {
                let position = PREDICT_POSITION.tolerance.of(confined.magnitudes);
                STOPPED.of([error, position, x.length(), step])
            }
            false => 0.0,
        };
        let predict = match goes_along(i) {
            true => passes::predict_along,
            false => passes::predict_and_work,
        };
        let (at, then, work) = predict(model, &state.substep, x, v);
        // Rounding may put one of the two at the other end of a periodic axis.
        let found = (model.period()).image_by_rounding(predicted[i], at);
        let [error, moved, place, pushed] = confined.magnitudes;
        // A particle that is stopped at once on contact has another velocity when moved by a
        // rounding error.
        let answer = |(axis, side): (usize, f64)| {
            let (_, other, _) = predict(model, &state.substep, x + side * DVec3::AXES[axis], v);
            (other - then).length()
        };
        // Each coordinate errs independently: the changes add up.
        let moves = [error, confined.reach].into_iter().flat_map(|by| [-by, by]);
        let along = |axis| (moves.clone().map(|by| answer((axis, by)))).fold(0.0, f64::max);
        let jump = match goes_along(i) {
            true => (0..3).map(along).sum(),
            false => 0.0,
        };
        let magnitudes = [error, moved, place, pushed + state.carried(x, at)];
        let position = pair(i, found, at, magnitudes);
        let velocity = pair(
            i,
            velocity[i],
            then,
            [free, stopped.max(jump), v.length().max(then.length())],
        );
        let magnitudes = [
            state.wall_speed(),
            confined.push_error,
            x.length(),
            work.abs(),
            confined.work_error,
        ];
        let work = (works.get(n + i)).map(|&found| pair(i, found, work, magnitudes));
        (position, velocity, work)
    };
    let all = each(0..n, one);
    io.table
        .add(&PREDICT_POSITION, all.iter().map(|pairs| pairs.0));
    io.table
        .add(&PREDICT_VELOCITY, all.iter().map(|pairs| pairs.1));
    if !works.is_empty() {
        io.table.add(&PREDICT_WORK, all.iter().map(|pairs| pairs.2));
    }
    Ok(())
}

pub(super) fn assign_cells(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let n = state.particles();
    let cells = &state.model.cells;
    let points = io.before.vectors(buffers::CORRECTED, n)?;
    let exact: Vec<u32> = points.iter().map(|&x| cells.index(x) as u32).collect();
    let cell_of = io.after.get(buffers::CELL_OF, n)?;
    let places: Vec<DVec3> = points.iter().map(|&x| x / cells.edge).collect();
    check_cells(&CELL, &places, 1.0, &cell_of, &exact, io.table);
    let slot = io.after.get(buffers::SLOT_IN_CELL, n)?;
    let counts = io
        .after
        .get(buffers::CELL_START, cells.dims.iter().product())?;
    check_slots([&COUNTS, &SLOTS], &cell_of, &slot, &counts, io.table);
    Ok(())
}

pub(super) fn reorder(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let n = state.particles();
    let order = io.before.get(buffers::ORDER, n)?;
    let predicted = io.before.vectors(buffers::CORRECTED, n)?;
    let velocity = io.before.vectors(buffers::VELOCITY, n)?;
    let ids = io.before.get(buffers::ID, n)?;
    let at = |i: usize| order[i] as usize;
    let places = state.places(&io.after, n)?.0;
    for found in [places, io.after.vectors(buffers::START_POSITION, n)?] {
        io.table.each(&REORDER_POSITION, 0..n, |i| {
            pair(i, found[i], predicted[at(i)], [])
        });
    }
    let found = io.after.vectors(buffers::SORTED_VELOCITY, n)?;
    io.table.each(&REORDER_VELOCITY, 0..n, |i| {
        pair(i, found[i], velocity[at(i)], [])
    });
    let expected: Vec<u32> = (0..n).map(|i| ids[at(i)]).collect();
    io.table.add_exact(
        &REORDER_ID,
        &io.after.get(buffers::sorted_id(n), n)?,
        &expected,
    );
    if state.has_words() {
        let inverse = (1.0 / state.model.calibration.support_radius) as f32;
        let places = io.before.get(buffers::CORRECTED, n)?;
        state.lists.words = (0..n).map(|i| word(places[at(i)], inverse)).collect();
        let found = io.after.get(buffers::PLACE, n)?;
        io.table
            .add_exact(&REORDER_PLACE, &found, &state.lists.words);
    }
    if state.model.settings.grid_projection {
        let drops = io.before.scalars(buffers::IS_DROP, n)?;
        let found = io.after.scalars(buffers::IS_DROP, 2 * n)?.split_off(n);
        io.table
            .each(&REORDER_DROP, 0..n, |i| pair(i, found[i], drops[at(i)], []));
    }
    Ok(())
}

pub(super) fn compute_lambda(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let control = state.control(io)?;
    if control.is_some_and(|control| control.is_done == 1) {
        return Ok(());
    }
    let n = state.particles();
    let phase = io.before.window(&buffers::PHASES)?;
    let (points, mut reference) = state.stored(io)?;
    let neighbors = state.visited(io, &points)?;
    if !state.whole.has_start() {
        let near = state.listed(&points);
        state.whole.start(&points, n, near);
    }
    let inputs = state.inputs(&points, &neighbors);
    let mut dense = vec![0.0; n];
    passes::compute_lambda(inputs, Colour::All, &mut reference, &mut dense);
    let bounds = Bounds(inputs);
    let found = state.places(&io.after, n)?.1;
    let handled = handled(&phase);
    io.table.each(&OF_LAMBDA, 0..handled.len(), |k| {
        let i = handled[k];
        let error = bounds.lambda(i, &passes::row(inputs, i), reference[i]);
        pair(i, found[i], reference[i], [error])
    });
    if control.is_some() {
        let density = io.after.get(buffers::DENSITY, n)?;
        io.table.each(&DENSITY_OF_LAMBDA, 0..handled.len(), |k| {
            let i = handled[k];
            pair(i, density[i], dense[i], [bounds.density(i, dense[i])])
        });
    }
    Ok(())
}

pub(super) fn compute_delta(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    if (state.control(io)?).is_some_and(|control| control.is_done == 1) {
        return Ok(());
    }
    let n = state.particles();
    let phase = io.before.window(&buffers::PHASES)?;
    let (points, lambda) = state.stored(io)?;
    let neighbors = state.visited(io, &points)?;
    let before = &io.before.vectors(buffers::CORRECTED, n)?;
    let factor = f64::from(phase.acceleration);
    let is_chebyshev = state.scene.settings().iteration == Iteration::Chebyshev;
    let momentum = is_chebyshev.then_some(Momentum { factor, before });
    let inputs = state.inputs(&points, &neighbors);
    let plain = passes::compute_delta(inputs, Colour::All, None, &lambda);
    let reference = match momentum {
        Some(_) => passes::compute_delta(inputs, Colour::All, momentum, &lambda),
        None => plain.clone(),
    };
    let moved = io.after.vectors(buffers::CORRECTED, n)?;
    let works = match state.scene.has_movers() {
        true => Some([
            io.before.get(buffers::WALL_WORK, n)?,
            io.after.get(buffers::WALL_WORK, n)?,
        ]),
        false => None,
    };
    let bounds = Bounds(inputs);
    let (h, period) = (state.model.calibration.support_radius, state.model.period());
    let one = |i: usize| {
        // Rounding may decide whether particles that are almost at the same position count as
        // coincident, for which a hash decides the direction, and of several the last one visited
        // counts.
        let square = |j: u32| {
            let way = period.shortest(points[i] - points[j as usize]);
            way.length_squared()
        };
        let squares = || neighbors.all(i).map(square);
        let is_undecided = squares().any(|square| square > 0.0 && square < 2e-12 * h * h)
            || squares().filter(|&square| square == 0.0).count() > 1;
        // The bound starts from the correction before walls and solids push, because these deflect
        // its error.
        let to = reference[i].free;
        let step = STEP.of([bounds.delta(i, &lambda), (to - points[i]).length()]);
        let last = match momentum {
            Some(_) => points[i] - before[i],
            None => DVec3::ZERO,
        };
        // Whether the semi-iteration extrapolates is decided before it adds to the step.
        let along = (plain[i].free - points[i]).dot(last).abs();
        let is_across = along <= ACROSS.of([step, last.length()]);
        if is_undecided || (factor != 1.0 && is_across && last != DVec3::ZERO) {
            return None;
        }
        let x = points[i].length();
        let error = CORRECTED.of([MOMENTUM.of([factor, step, last.length()]), x]);
        let confined = bounds.confine(to, error);
        let moved = pair(i, moved[i], reference[i].position, confined.magnitudes);
        let work = works.as_ref().map(|[before, after]| {
            let [before, after] = [before, after].map(|work| f64::from(work[i]));
            let added = reference[i].work;
            let error = WORKED.of([factor, step, confined.push_error, x]);
            let sums = before.abs() + after.abs();
            let magnitudes = [
                state.boundary_speed(),
                error,
                sums,
                added.abs(),
                confined.work_error,
            ];
            pair(i, after, before + added, magnitudes)
        });
        Some((moved, work))
    };
    let handled = handled(&phase);
    let all = each(0..handled.len(), |k| one(handled[k]));
    io.table.add(
        &OF_DELTA,
        all.iter().map(|pairs| pairs.map(|pairs| pairs.0)),
    );
    if works.is_some() {
        let works = all.iter().map(|pairs| pairs.and_then(|pairs| pairs.1));
        io.table.add(&DELTA_WORK, works);
    }
    Ok(())
}

pub(super) fn exchange(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    if (state.control(io)?).is_some_and(|control| control.is_done == 1) {
        return Ok(());
    }
    let n = state.particles();
    let handled = handled(&io.before.window(&buffers::PHASES)?);
    let (before, came) = state.places(&io.before, n)?;
    let (after, left) = state.places(&io.after, n)?;
    let corrected = io.before.vectors(buffers::CORRECTED, n)?;
    io.table.each(&TAKEN_OVER, 0..handled.len(), |k| {
        let i = handled[k];
        pair(i, after[i], corrected[i], [])
    });
    io.table.each(&CARRIED, 0..handled.len(), |k| {
        let i = handled[k];
        pair(i, left[i], came[i], [])
    });
    if state.scene.settings().iteration == Iteration::Chebyshev {
        let kept = io.after.vectors(buffers::CORRECTED, n)?;
        io.table.each(&KEPT, 0..handled.len(), |k| {
            let i = handled[k];
            pair(i, kept[i], before[i], [])
        });
    }
    Ok(())
}

pub(super) fn update_velocity(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let n = state.particles();
    let ends = state.places(&io.before, n)?.0;
    let starts = io.before.vectors(buffers::START_POSITION, n)?;
    let velocities = io.before.vectors(buffers::SORTED_VELOCITY, n)?;
    let drops = match state.model.settings.grid_projection {
        true => io.before.scalars(buffers::IS_DROP, 2 * n)?.split_off(n),
        false => Vec::new(),
    };
    let position = io.after.vectors(buffers::POSITION, n)?;
    let velocity = io.after.vectors(buffers::VELOCITY, n)?;
    let (model, substep) = (&state.model, &state.substep);
    let (cap, step) = (model.max_displacement(), substep.time_step);
    let one = |i: usize| {
        let (end, v) = (ends[i], velocities[i]);
        let start = match drops.get(i) {
            Some(0.0) => end,
            _ => starts[i],
        };
        let (x, then, is_capped) = passes::update_velocity(model, substep, end, start, v);
        let way = (end - start).length() / step;
        let whole = (v + (end - start) / step).length();
        let is_near = (whole * step - cap).abs() <= NEAR_CAP.of([cap]);
        let slowed = if is_capped || is_near { 1.0 } else { 0.0 };
        let error = UPDATED.of([whole, way, slowed * whole]);
        let position = pair(
            i,
            model.period().image_by_rounding(position[i], x),
            x,
            [
                slowed * x.length() + state.carried(end, x),
                slowed * step,
                error,
            ],
        );
        let velocity = pair(i, velocity[i], then, [error]);
        (position, velocity, [is_capped, is_near])
    };
    let all = each(0..n, one);
    let count = |which: usize| all.iter().filter(|one| one.2[which]).count() as f64;
    io.table.add(&UPDATE_POSITION, all.iter().map(|one| one.0));
    io.table.add(&UPDATE_VELOCITY, all.iter().map(|one| one.1));
    let before = io.before.one(buffers::COUNTERS)?;
    let after = io.after.one(buffers::COUNTERS)?;
    let counted = f64::from(after.capped) - f64::from(before.capped);
    io.table
        .add(&CAPPED, [pair(0, counted, count(0), [count(1)])]);
    if state.scene.effects.look_at_neighbors() {
        let places = state.places(&io.after, n)?.0;
        let positions = io.after.vectors(buffers::POSITION, n)?;
        io.table.each(&UPDATE_PLACE, 0..n, |i| {
            pair(i, places[i], positions[i], [])
        });
    }
    let ids = io.before.get(buffers::sorted_id(n), n)?;
    io.table
        .add_exact(&UPDATE_ID, &io.after.get(buffers::ID, n)?, &ids);
    if !drops.is_empty() {
        let found = io.after.scalars(buffers::IS_DROP, n)?;
        io.table
            .each(&UPDATE_DROP, 0..n, |i| pair(i, found[i], drops[i], []));
    }
    state.whole.end(ends);
    state.is_over = true;
    Ok(())
}

pub(super) fn measure_density(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let n = state.particles();
    let mut points = state.places(&io.before, n)?.0;
    points.extend(&state.model.samples);
    let neighbors = state.search(&points);
    let inputs = state.inputs(&points, &neighbors);
    let reference = passes::measure_density(inputs);
    let density = io.after.get(buffers::DENSITY, n)?;
    let bounds = Bounds(inputs);
    io.table.each(&MEASURED, 0..n, |i| {
        pair(
            i,
            density[i],
            reference[i],
            [bounds.density(i, reference[i])],
        )
    });
    Ok(())
}

impl PbfState {
    /// Returns four periods, metres, if a periodic axis wrapped a particle between `before` and
    /// `after`, or rounding decides whether it did; else 0.
    fn carried(&self, before: DVec3, after: DVec3) -> f64 {
        let period = self.model.period();
        match period.is_at_joint(before, after) {
            true => 4.0 * period.0.length(),
            false => 0.0,
        }
    }
}

/// Returns the particles that a dispatch handles.
fn handled(phase: &Phase) -> Vec<usize> {
    let particle = |thread| phase.first + thread * phase.stride + phase.colour;
    (0..phase.count).map(|k| particle(k) as usize).collect()
}
