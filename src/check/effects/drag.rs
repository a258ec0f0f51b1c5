//! Air drag, by density and by cells.

use glam::DVec3;

use crate::{
    comparison::{Comparison, Io, PassResult, State, comparison, names},
    flip::FlipState,
    pbf::{PbfState, bounds::Bounds},
    table::{entries, pair},
};
use swell_compare::{rounding::U, tolerance::bounds};
use swell_domain::{
    air::{self, exposure},
    {flip::PLANE_SHARE as OF_CELLS, pbf::PLANE_SHARE as OF_DENSITY},
};
use swell_reference::{
    flip::effects::drag::{drag_by_cells, share},
    pbf::{effects::drag::drag_by_density, passes::measure_density},
};
use swell_scene::effects::drag::Settings;
use swell_solve::{flip, pbf};

bounds! {
    // (w + g Δt) / (1 + x) with x = e Δt r(w). Errors of x: the exposure's, and that of the power
    // in r, with an exponent below 18, by the accuracy that WGSL requires of log2 and exp2.
    BLOWN = [off: "what the exposure errs by", exposure: "its own value",
        reach: "Δt times the rate of a lone drop",
        slack: "what that answers when |v − wind| rounds", against: "|v − wind| + |g| Δt",
        wind: "|wind|"]
        (quotient((off + 150.0 * U * exposure) * reach + exposure * slack, exposure * reach)
            + 8.0 * U) * against + 4.0 * U * wind, "";
}

entries! {
    "effects/drag_by_density" {
        VELOCITY = "velocity", "m/s": [blown: "" BLOWN] blown, "";
    }
    "effects/drag_by_cells" {
        SORTED = "velocity", "m/s": [blown: "" BLOWN] blown, "";
    }
}

pub(super) const PBF: &[Comparison<PbfState>] = &[comparison(
    "effects/drag_by_density",
    || names![pbf::buffers::VELOCITY],
    by_density,
)];

pub(super) const FLIP: &[Comparison<FlipState>] = &[comparison(
    "effects/drag_by_cells",
    || names![flip::buffers::SORTED_VELOCITY],
    by_cells,
)];

/// Returns the error of 1 / (1 + x) for an error `off` of x.
fn quotient(off: f64, x: f64) -> f64 {
    off / ((1.0 + x) * (1.0 + (x - off).max(0.0)))
}

/// Returns [`BLOWN`] of a velocity before drag, for an error `off` of the exposure.
fn blown(
    settings: &Settings,
    seconds: f64,
    [off, exposure]: [f64; 2],
    [v, fall]: [DVec3; 2],
) -> f64 {
    let wind = settings.wind();
    let against = v.distance(wind);
    let reach = |speed: f64| seconds * air::resistance(settings.drop_radius, speed);
    let sizes = v.length() + 2.0 * fall.length() + wind.length();
    let slack = reach(against + 2.0 * U * sizes) - reach(against);
    let most = against + fall.length();
    BLOWN.of([off, exposure, reach(against), slack, most, wind.length()])
}

fn by_density(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let Some(settings) = state.scene.effects.drag.clone() else {
        return Ok(());
    };
    let n = state.particles();
    let (points, velocity) = (
        state.moved(io)?,
        io.before.vectors(pbf::buffers::VELOCITY, n)?,
    );
    let neighbors = state.visited(io, &points)?;
    let inputs = state.inputs(&points, &neighbors);
    let reference = drag_by_density(&settings, inputs, &velocity);
    let density = measure_density(inputs);
    let seconds = inputs.substep.time_step;
    let fall = seconds * state.scene.water.gravity;
    let own = inputs.model.calibration.density_scale;
    let found = io.after.vectors(pbf::buffers::VELOCITY, n)?;
    io.table.each(&VELOCITY, 0..n, |i| {
        let error = Bounds(inputs).density(i, density[i]) / ((1.0 - own) * OF_DENSITY) + 4.0 * U;
        let exposure = exposure((density[i] - own) / (1.0 - own), OF_DENSITY);
        let both = [velocity[i] - fall, fall];
        let blown = blown(&settings, seconds, [error, exposure], both);
        pair(i, found[i], reference[i], [blown])
    });
    Ok(())
}

fn by_cells(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let Some(settings) = state.scene.effects.drag.clone() else {
        return Ok(());
    };
    let kind = io
        .before
        .get(flip::buffers::CELL_KIND, state.elements().cells)?;
    let before = io
        .before
        .vectors(flip::buffers::SORTED_VELOCITY, state.particles())?;
    let step = state.step();
    let bricks = &state.elements().bricks;
    let sorted = state.sorted();
    let share = |element| share(&state.model, bricks, &kind, sorted, element);
    let reference = drag_by_cells(&settings, &step, sorted, share);
    let found = io
        .after
        .vectors(flip::buffers::SORTED_VELOCITY, state.particles())?;
    // From exact counts: a product, a sum, two quotients and a difference.
    let error = 8.0 * U / OF_CELLS;
    io.table.each(&SORTED, 0..found.len(), |i| {
        let both = [before[i], step.velocity_step];
        let exposure = exposure(share(sorted.cell[i]), OF_CELLS);
        pair(
            i,
            found[i],
            reference[i],
            [blown(&settings, step.kick, [error, exposure], both)],
        )
    });
    state.carry_velocities(found);
    Ok(())
}
