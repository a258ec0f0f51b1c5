//! Gaps that close within the substep, and water that contracts on straight paths.

use glam::DVec3;
use swell_reference::flip::{
    MOST, OpenSpace, Unprojected, WHOLE, bend_paths as reference_bend_paths,
    close_gaps as reference_close_gaps, find_contraction as reference_find_contraction,
};
use swell_scene::flip::Surface;
use swell_solve::flip::buffers;

use super::{FlipState, elements::Elements, rows::*};
use crate::{
    comparison::{Io, PassResult},
    table::{each, pair},
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

/// Sum of the bounds on the products of slopes in a cell.
fn bound(water: &Unprojected<'_>, of: &[DVec3], e: usize) -> f64 {
    let minors = water.minors(of, e as u32);
    minors.iter().map(|minor| minor.1).sum()
}

/// Returns whether rounding decides if a cell, or one about it, is whole.
fn near_cut(elements: &Elements, space: &OpenSpace, cut: f64, e: usize) -> bool {
    let near = |e: usize| f64::from((space.volume[e] - WHOLE).abs() <= cut);
    elements.largest_about(e, near) > 0.0
}

/// Compares the pass, from the kinds, densities and velocities on the device.
pub(super) fn bend_paths(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (elements, step, space) = (state.elements(), state.step(), state.space());
    let faces = elements.faces(&io.before)?;
    let water = Unprojected {
        model: &state.model,
        step: &step,
        bricks: &elements.bricks,
        space,
        density: state.density(),
        faces: &faces,
    };
    let reference = reference_bend_paths(&water);
    let found = elements.scalars(&io.after, buffers::PATH_BEND)?;
    let cut = CUT.of([state.place()]);
    let part = water.rate().powi(2) / MOST;
    io.table.each(&BEND, elements.active(), |e| {
        let sizes = match water.strains(e as u32) {
            true => [&faces.velocity, &faces.change].map(|of| bound(&water, of, e)),
            false => [0.0; 2],
        };
        let sizes = [part, sizes[0], sizes[1]];
        (!near_cut(elements, space, cut, e)).then(|| pair(e, found[e], reference[e], sizes))
    });
    state.bend = found;
    Ok(())
}

/// Compares the pass, from the kinds, densities, velocities and fluxes on the device.
pub(super) fn find_contraction(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (elements, step, space) = (state.elements(), state.step(), state.space());
    let faces = elements.faces(&io.before)?;
    let water = Unprojected {
        model: &state.model,
        step: &step,
        bricks: &elements.bricks,
        space,
        density: state.density(),
        faces: &faces,
    };
    let contraction = reference_find_contraction(&water);
    let before = elements.scalars(&io.before, buffers::SOLID_FLUX)?;
    let flux = elements.scalars(&io.after, buffers::SOLID_FLUX)?;
    let cut = CUT.of([state.place()]);
    io.table.each(&CONTRACTION, elements.active(), |e| {
        let minors = match water.strains(e as u32) {
            true => bound(&water, &faces.change, e),
            false => 0.0,
        };
        let exact = before[e] - contraction[e];
        let sizes = [water.rate(), minors, before[e].abs().max(exact.abs())];
        (!near_cut(elements, space, cut, e)).then(|| pair(e, flux[e], exact, sizes))
    });
    let mut alone = Vec::new();
    if state.scene.is_worked_on() {
        alone = elements.scalars(&io.after, buffers::contraction(elements.stride))?;
        io.table.each(&CONTRACTION_ALONE, elements.active(), |e| {
            let sizes = [flux[e].abs().max(before[e].abs())];
            pair(e, alone[e], flux[e] - before[e], sizes)
        });
    }
    state.space = Some(OpenSpace {
        solid_flux: flux,
        ..space.clone()
    });
    state.contraction = alone;
    Ok(())
}
