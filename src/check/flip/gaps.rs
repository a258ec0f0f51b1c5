//! Gaps that close within the substep.

use swell_reference::flip::{Gaps, OpenSpace, close_gaps as reference_close_gaps};
use swell_scene::flip::Surface;
use swell_solve::flip::buffers;

use super::{FlipState, rows::*};
use crate::{
    comparison::{Io, PassResult},
    table::{each, pair},
};

/// Compares the pass, from the kinds, densities, velocities and fluxes on the device.
pub(super) fn close_gaps(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (elements, step, space) = (state.elements(), state.step(), state.space());
    let faces = elements.faces(&io.before)?;
    let gaps = Gaps {
        model: &state.model,
        step: &step,
        bricks: &elements.bricks,
        space,
        density: state.density(),
        velocity: &faces.velocity,
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
