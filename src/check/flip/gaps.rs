//! Gaps that close within the substep, and water that contracts on straight paths.

use swell_gpu::buffer::Buf;
use swell_reference::flip::{
    Faces, FlipSubstep, MOST, OpenSpace, Unprojected, close_gaps as reference_close_gaps,
    find_contraction as reference_find_contraction,
};
use swell_scene::flip::Surface;
use swell_solve::{SolveError, flip::buffers};

use super::{FlipState, rows::*};
use crate::{
    comparison::{Io, PassResult},
    table::{CheckEntry, each, pair},
};

/// Compares the pass, from the kinds, densities, velocities and fluxes on the device.
pub(super) fn close_gaps(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (elements, step, space) = (state.elements(), state.step(), state.space());
    let faces = elements.faces(&io.before)?;
    let gaps = Unprojected {
        model: &state.model,
        step: &step,
        bricks: &elements.bricks,
        space,
        density: state.density(),
        faces: &faces,
    };
    let has_distance = state.model.settings().surface == Surface::GhostFluid;
    let mut distance = match has_distance {
        true => elements.scalars(&io.before, buffers::LIQUID_DISTANCE)?,
        false => vec![0.0; elements.cells],
    };
    let before = distance.clone();
    let reference = reference_close_gaps(&gaps, &mut distance);
    let error = OF_GAP.of([CUT.of([state.place()])]);
    let active = elements.active();
    // Rounding decides where the outcome changes when all thresholds are shifted by the error.
    let ties = each(active.clone(), |e| {
        let closes = |lean: f64| gaps.filled(e as u32, lean).is_some();
        let own = closes(0.0);
        closes(error) != own || closes(-error) != own
    });
    let is_tie = |e: usize| ties[e - active.start];
    let kind = io.after.get(buffers::CELL_KIND, elements.cells)?;
    let flux = elements.scalars(&io.after, buffers::SOLID_FLUX)?;
    io.table.each(&FILLING, active.clone(), |e| {
        (!is_tie(e)).then(|| pair(e, kind[e], f64::from(reference.kind[e]), []))
    });
    let rate = state.model.cell_size() / step.length;
    io.table.each(&FILLED, active.clone(), |e| {
        let sizes = [error, rate, reference.solid_flux[e].abs()];
        (!is_tie(e)).then(|| pair(e, flux[e], reference.solid_flux[e], sizes))
    });
    if has_distance {
        let found = elements.scalars(&io.after, buffers::LIQUID_DISTANCE)?;
        io.table.each(&FULL, active.clone(), |e| {
            let own = before[e];
            let [change, flow] = match gaps.is_hit(e as u32) {
                true => {
                    let terms = gaps.inflow(e as u32).map(|v| v.abs().element_sum());
                    let flow = terms.into_iter().sum::<f64>() / gaps.least_inflow();
                    [own - own.min(-state.model.cell_size()), flow]
                }
                false => [0.0; 2],
            };
            let sizes = [own.abs().max(distance[e].abs()), change, flow];
            (!is_tie(e)).then(|| pair(e, found[e], distance[e], sizes))
        });
    }
    state.space = Some(OpenSpace {
        kind,
        solid_flux: flux,
        ..reference
    });
    Ok(())
}

/// Returns what the passes around the projection find contraction in.
fn water<'a>(state: &'a FlipState, step: &'a FlipSubstep<'a>, faces: &'a Faces) -> Unprojected<'a> {
    Unprojected {
        model: &state.model,
        step,
        bricks: &state.elements().bricks,
        space: state.space(),
        density: state.density(),
        faces,
    }
}

/// Adds the parts of the midpoint rule in the slots to the table, but for those where rounding
/// decides which cells count. `bend` returns them by how much less of a cell has to be open, and
/// `terms` is the size of what contracts a cell.
fn add_bends(
    (state, io): (&FlipState, &mut Io<'_>),
    (entry, buffer): (&'static CheckEntry<1>, Buf<f32>),
    water: &Unprojected<'_>,
    bend: impl Fn(f64) -> Vec<f64>,
    terms: impl Fn(u32) -> f64 + Sync,
) -> Result<Vec<f64>, SolveError> {
    let slots = state.elements().bricks.slots();
    let found = io.after.scalars(buffer, slots)?;
    let cut = CUT.of([state.place()]);
    let (reference, sizes) = (bend(0.0), water.spread(cut, terms));
    let [more, fewer] = [cut, -cut].map(bend);
    io.table.each(entry, 1..slots, |slot| {
        let is_sure = more[slot] == fewer[slot];
        is_sure.then(|| pair(slot, found[slot], reference[slot], [sizes[slot] / MOST]))
    });
    Ok(found)
}

/// Compares the pass, from the kinds, densities and velocities on the device.
pub(super) fn find_strain(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (elements, step) = (state.elements(), state.step());
    let faces = elements.faces(&io.before)?;
    let water = water(state, &step, &faces);
    let straight = vec![0.0; elements.bricks.slots()];
    let terms = |e| water.contraction(&faces.change, &straight, e)[1];
    let row = (&STRAIN, buffers::STRAIN_BEND.retyped());
    let found = add_bends((state, io), row, &water, |lean| water.strain(lean), terms)?;
    state.strained = found;
    Ok(())
}

/// Compares the pass, from the densities, velocities and fluxes on the device.
pub(super) fn bend_paths(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (elements, step) = (state.elements(), state.step());
    let faces = elements.faces(&io.before)?;
    let water = water(state, &step, &faces);
    let (made_up, strained) = (&state.contraction, &state.strained);
    let terms = |e| {
        let of_velocity = water.contraction(&faces.velocity, strained, e)[1];
        of_velocity + (made_up[e as usize] * water.rate()).abs()
    };
    let bend = |lean| water.bend(made_up, strained, lean);
    let row = (&BEND, buffers::path_bend(elements.bricks.table.len()));
    let found = add_bends((state, io), row, &water, bend, terms)?;
    state.bend = found;
    Ok(())
}

/// Compares the pass, from the kinds, densities and velocities on the device.
pub(super) fn find_contraction(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (elements, step) = (state.elements(), state.step());
    let faces = elements.faces(&io.before)?;
    let water = water(state, &step, &faces);
    let reference = reference_find_contraction(&water, &state.strained);
    let found = elements.scalars(&io.after, buffers::contraction(elements.stride))?;
    let cut = CUT.of([state.place()]);
    io.table.each(&CONTRACTION, elements.active(), |e| {
        let is_sure = water.strains(e as u32, cut) == water.strains(e as u32, -cut);
        let terms = match reference[e] == 0.0 {
            true => 0.0,
            false => water.contraction(&faces.change, &state.strained, e as u32)[1],
        };
        let sizes = [terms / water.rate()];
        is_sure.then(|| pair(e, found[e], reference[e], sizes))
    });
    state.contraction = found;
    Ok(())
}
