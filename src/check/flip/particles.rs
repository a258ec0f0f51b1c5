//! Transfer from the grid to the particles, and their motion.

use glam::DVec3;

use crate::{
    comparison::{Io, PassResult},
    table::pair,
};
use swell_domain::{bricks::Bricks, parallel};
use swell_reference::flip::{
    GridTransfer, Moved, Paths, Solid, advect as reference_advect, aim as reference_aim,
    grid_to_particle as reference_grid_to_particle, push_apart as reference_push_apart,
};
use swell_solve::{SolveError, flip::buffers};

use super::{FlipState, elements::neighborhood, rows::*};

/// Returns the length over the axes of [`OF_FACES`] around a cell.
fn of_faces(bricks: &Bricks, values: &[DVec3], element: u32, place: f64) -> f64 {
    let (mut low, mut high) = (DVec3::splat(f64::INFINITY), DVec3::splat(f64::NEG_INFINITY));
    for offset in neighborhood() {
        let value = values[bricks.near(element, offset) as usize];
        (low, high) = (low.min(value), high.max(value));
    }
    let (range, most) = (high - low, low.abs().max(high.abs()));
    let error = |axis: usize| OF_FACES.of([place, range[axis], most[axis]]);
    DVec3::from_array([0, 1, 2].map(error)).length()
}

pub(super) fn grid_to_particle(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let elements = state.elements();
    let faces = elements.faces(&io.before)?;
    let shift = match state.model.settings().density_correction {
        true => Some(elements.planes(&io.before, buffers::face_displacement(elements.stride))?),
        false => None,
    };
    let (bricks, step, sorted) = (&elements.bricks, state.step(), state.sorted());
    let reference = reference_grid_to_particle(
        &state.model,
        &step,
        bricks,
        sorted,
        &faces,
        state.space(),
        shift.as_deref(),
    );
    let given = given(state, io, reference.is_drop.clone())?;
    let place = state.place();
    let of_cell = |element: usize| {
        let element = element as u32;
        let own = sorted.of(element);
        let mut errors = [0.0; 3];
        if !own.is_empty() {
            errors[0] = of_faces(bricks, &faces.velocity, element, place);
            errors[1] = of_faces(bricks, &faces.change, element, place);
            errors[2] = (shift.as_ref()).map_or(0.0, |of| of_faces(bricks, of, element, place));
        }
        own.map(move |i| (i, errors))
    };
    let errors = parallel::flat_map(elements.wet(), of_cell);
    let all = || errors.iter().copied();
    let fallen = step.velocity_step.length();
    let came = |i: usize| sorted.cloud.velocity[i].length() + fallen;
    let rubbed = match step.solids.is_empty() {
        true => 0.0,
        false => fallen * state.distance_error() / (0.25 * state.model.cell_size()),
    };
    io.table.add(
        &GIVEN,
        all().map(|(i, [velocity, change, _])| {
            let magnitudes = [velocity, change, came(i), rubbed];
            pair(i, given.velocity[i], reference.velocity[i], magnitudes)
        }),
    );
    io.table.add(
        &CARRIED,
        all().map(|(i, [velocity, ..])| {
            pair(
                i,
                given.carried[i],
                reference.carried[i],
                [velocity, came(i)],
            )
        }),
    );
    if !given.affine.is_empty() {
        let size = state.model.cell_size();
        let rows = all().flat_map(|one| [0, 1, 2].map(|row| (one, row)));
        io.table.add(
            &GIVEN_AFFINE,
            rows.map(|((i, [velocity, ..]), row)| {
                let [found, exact] = [&given, &reference].map(|of| of.affine[i].row(row));
                pair(i, found, exact, [velocity, size])
            }),
        );
    }
    if shift.is_some() {
        io.table.add(
            &SHIFT,
            all().map(|(i, [.., error])| {
                pair(i, given.displacement[i], reference.displacement[i], [error])
            }),
        );
    }
    state.given = Some(given);
    Ok(())
}

/// Compares the pass, from the values that the device transferred to the particles.
pub(super) fn aim(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let given = state.given.as_ref().expect("after flip/grid_to_particle");
    let before = io.before.vectors(buffers::SORTED_POSITION, state.n)?;
    let after = io.after.vectors(buffers::SORTED_POSITION, state.n)?;
    let step = state.step();
    let reference = reference_aim(&step, &before, given);
    io.table.each(&AIMED, 0..state.n, |i| {
        let way = step.length * (given.carried[i].length() + given.velocity[i].length());
        let pushed = given.displacement[i].length();
        pair(i, after[i], reference[i], [before[i].length(), way, pushed])
    });
    Ok(())
}

/// Reads the values that the device transferred to each particle; `is_drop` follows from the
/// device's cell kinds.
fn given(state: &FlipState, io: &Io<'_>, is_drop: Vec<bool>) -> Result<GridTransfer, SolveError> {
    let is_pushed = state.model.settings().density_correction || state.given_substep.is_some();
    let rows = if is_pushed { 2 * state.n } else { state.n };
    let mut carried = io.after.vectors(buffers::CARRIED, rows)?;
    let mut displacement = carried.split_off(state.n);
    displacement.resize(state.n, DVec3::ZERO);
    Ok(GridTransfer {
        velocity: io.after.vectors(buffers::SORTED_VELOCITY, state.n)?,
        affine: state.slopes(&io.after, buffers::AFFINE)?,
        carried,
        displacement,
        is_drop,
    })
}

/// Compares the displacements of the sorted particles, which the pass adds to `displacement`.
pub(super) fn push_apart(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let Some(before) = state.given.take() else {
        return Ok(());
    };
    let (elements, sorted, step) = (state.elements(), state.sorted(), state.step());
    let reference = reference_push_apart(
        &state.model,
        &step,
        &elements.bricks,
        sorted,
        &before.is_drop,
    );
    let found = given(state, io, before.is_drop.clone())?;
    let (apart, extent) = (
        state.model.settings().apart_from_walls(),
        state.scene.domain.size().max_element(),
    );
    let (period, kept) = (state.model.period(), state.model.settings().apart());
    io.table.each(&PUSHED, 0..state.n, |i| {
        let position = &sorted.cloud.position;
        let is_near = |j: usize| {
            let way = period.shortest(position[i] - position[j]);
            j != i && way.length() < 1.001 * kept
        };
        let about = neighborhood().map(|offset| {
            let there = sorted.of(elements.bricks.near(sorted.cell[i], offset));
            there.filter(|&j| is_near(j)).count()
        });
        let count = about.sum::<usize>() as f64;
        let exact = before.displacement[i] + reference[i];
        let period = period.0.max_element();
        pair(
            i,
            found.displacement[i],
            exact,
            [count, apart, period, extent, exact.length()],
        )
    });
    state.given = Some(found);
    Ok(())
}

pub(super) fn advect(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let Some(given) = state.given.take() else {
        return Ok(());
    };
    let (n, elements) = (state.n, state.elements());
    let velocity = elements.planes(&io.before, buffers::FACE_VELOCITY)?;
    let (step, sorted) = (state.step(), state.sorted());
    let paths = Paths {
        bricks: &elements.bricks,
        velocity: &velocity,
        cell: &sorted.cell,
        bend: &state.bend,
    };
    let start = &sorted.cloud.position;
    let go = |start: &[DVec3]| reference_advect(&state.model, &step, &paths, start, &given);
    let reference = go(start);
    let fastest = velocity.iter().map(|v| v.length()).fold(0.0, f64::max);
    let grid = state.distance_error();
    let reach = |x: &DVec3| START.of([x.length(), step.length, fastest, grid]);
    let answers: Vec<Moved> = DVec3::AXES
        .into_iter()
        .flat_map(|axis| [axis, -axis])
        .map(|side| {
            go(&start
                .iter()
                .map(|x| *x + side * reach(x))
                .collect::<Vec<_>>())
        })
        .collect();
    let period = state.model.period();
    let apart = |x: DVec3, y: DVec3| period.shortest(x - y).length();
    let answer = |of: &dyn Fn(&Moved) -> f64| -> f64 {
        let sides = answers.chunks(2);
        sides.map(|pair| of(&pair[0]).max(of(&pair[1]))).sum()
    };
    let position = io.after.vectors(buffers::POSITION, n)?;
    let velocity = io.after.vectors(buffers::VELOCITY, n)?;
    io.table.each(&MOVED, 0..n, |i| {
        let x = reference.position[i];
        let moved = answer(&|moved| apart(moved.position[i], x));
        // Rounding may put one of the two at the other end of a periodic axis.
        let found = period.image_by_rounding(position[i], x);
        let carried = f64::from(u8::from(period.is_at_joint(start[i], x)));
        pair(
            i,
            found,
            x,
            [moved, x.length() + 4.0 * carried * period.0.length()],
        )
    });
    // The rest of a velocity that a solid stops carries the rounding errors of both subtracted
    // terms.
    let among = f64::from(u8::from(!step.solids.is_empty()));
    let solids = step.solids.iter().map(Solid::fastest);
    let solids = solids.fold(0.0, f64::max);
    io.table.each(&ADVECTED, 0..n, |i| {
        let v = reference.velocity[i];
        let moved = answer(&|moved| moved.velocity[i].distance(v));
        let came = among * (given.velocity[i].length() + solids);
        pair(i, velocity[i], v, [moved, v.length() + came])
    });
    let before = io.before.one(buffers::COUNTERS)?;
    let after = io.after.one(buffers::COUNTERS)?;
    let slowed = f64::from(after.capped) - f64::from(before.capped);
    let exact = reference.capped as f64;
    let slack = answer(&|moved| (moved.capped as f64 - exact).abs());
    io.table.add(&SLOWED, [pair(0, slowed, exact, [slack])]);
    let ids = io.after.get(buffers::ID, n)?;
    io.table
        .add_exact(&MOVED_ID, &ids, &state.sorted().cloud.id);
    Ok(())
}
