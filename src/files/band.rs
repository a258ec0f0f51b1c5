//! What a band of particles can be combined with.

use super::document::Document;
use swell_domain::deep::FILLED;
use swell_scene::{Scene, SceneError, flip::Transfer, words::shown};

const KEY: &str = "solver.flip.band";

/// Tolerance for a length to be a whole number of cells: rounding of decimal fractions.
const ROUNDING: f64 = 1e-6;

/// Cells that a band is thicker than the largest displacement in a substep.
const MARGIN: f64 = 2.0;

/// Rejects scenes that a band does not support.
pub(super) fn check(doc: &Document<'_>, scene: &Scene) -> Result<(), SceneError> {
    let (Some(band), Some(flip)) = (scene.band(), scene.solver.flip()) else {
        return Ok(());
    };
    let least = flip.cfl + MARGIN;
    if f64::from(band.grid.band) < least {
        let problem = format!(
            "a band of {} cells is too thin for solver.flip.cfl = {}: water moves as far in a \
             substep, and a band has at least {} cells",
            band.grid.band,
            shown(flip.cfl),
            shown(least.ceil())
        );
        return Err(doc.fault_of(KEY, problem));
    }
    if band.grid.per_cell() != flip.particles_per_cell {
        let problem = format!(
            "{} particles in a cell are no lattice with a whole number along its edge",
            flip.particles_per_cell
        );
        return Err(doc.fault_of(KEY, problem));
    }
    let cells = scene.domain.size() / flip.cell_size;
    if (cells - cells.round()).abs().max_element() > ROUNDING {
        let problem = format!(
            "the domain has {:.3} × {:.3} × {:.3} cells of {} m, and a band needs whole ones",
            cells.x,
            cells.y,
            cells.z,
            shown(flip.cell_size)
        );
        return Err(doc.fault_of(KEY, problem));
    }
    if band.grid.ids() > u64::from(FILLED) {
        let problem = format!(
            "a domain of {:.3e} cells is too large for a band: the particles that stand for deep \
             cells have {FILLED} ids",
            cells.element_product()
        );
        return Err(doc.fault_of(KEY, problem));
    }
    let unsupported = [
        ("transfer = \"apic\"", flip.transfer == Transfer::Apic),
        (
            "[[solid]] and [[body]]",
            !scene.solids.is_empty() || scene.drawn_movers().next().is_some(),
        ),
        ("simulated_depth", !scene.moving_solids.is_empty()),
        ("[[wave_maker]]", !scene.wave_makers.is_empty()),
        ("[[emitter]]", !scene.emitters.is_empty()),
        ("[[drain]]", !scene.drains.is_empty()),
        ("[[force]]", !scene.forces.is_empty()),
    ];
    let other = unsupported.into_iter().find(|(_, is_asked)| *is_asked);
    let effect = scene
        .effects
        .beside_zones()
        .map(|name| format!("effects.{name}"));
    match other.map(|(what, _)| what.to_owned()).or(effect) {
        None => Ok(()),
        Some(what) => Err(doc.fault_of(KEY, format!("it does not support {what}"))),
    }
}
