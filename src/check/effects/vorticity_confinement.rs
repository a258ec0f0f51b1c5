//! Vorticity confinement, on particles and on the grid.

use glam::DVec3;

use crate::{
    comparison::{Comparison, Io, NONE, PassResult, State, comparison, names},
    flip::FlipState,
    pbf::{
        PbfState,
        bounds::{Bounds, relative_speed},
    },
    table::{each, entries, pair},
};
use swell_compare::{
    rounding::{GRADIENT, U},
    tolerance::bounds,
};
use swell_reference::{
    flip::{grid_confinement, grid_curl},
    pbf::effects::vorticity_confinement::{vorticity_curl, vorticity_force},
};
use swell_solve::{
    effects::vorticity_confinement::{VORTICITY, VORTICITY_LENGTH},
    flip, pbf,
};

bounds! {
    ROTATION = [scale: "twice the gradient's scale, for the two products of a cross product",
        sums: "with w = |Δv| " GRADIENT] scale * sums, "";
    SLOPE = [scale: "the gradient's scale", sums: "with w = |Δ|ω|| " GRADIENT,
        both: "Σ (|ω| + |ω'|) s²"]
        scale * (sums + 12.0 * U * both), "";
    NO_SLOPE = [error: "" SLOPE] 1.01 * error, "the least slope that gives a direction";
    GRID_CURL = [speed: "the largest about", size: "Δx"]
        30.0 * U * speed / size, "differences of means of two faces over two cells";
    GROWN = [] 20.0 * U, "";
    TURNED = [force: "Δt ε Δx of the largest |ω| about"] 0.05 * force,
        "a direction that is noise, as the answers are farther apart than that";
}

entries! {
    "effects/vorticity_curl" {
        CURL = "vorticity", "1/s": [error: "" ROTATION] error, "";
        LENGTH = "its length", "1/s": [error: "" ROTATION, w: "|ω|"]
            error + 12.0 * U * w, "a root takes 9 u";
    }
    "effects/vorticity_force" {
        VELOCITY = "velocity", "m/s": [force: "Δt ε h |ω|", error: "" SLOPE,
            slope: "|∇|ω||, or ∞ where it gives no direction",
            rounding: "1 where it gives one, else 0", v: "|v|"]
            force * (2.0 * error / slope + 30.0 * U * rounding) + 2.0 * U * (v + force),
            "", tie NO_SLOPE;
    }
    "effects/grid_curl" {
        GRID_VORTICITY = "vorticity", "1/s": [error: "" GRID_CURL] error, "";
        GRID_LENGTH = "its length", "1/s": [error: "" GRID_CURL, w: "|ω|"] error + 12.0 * U * w, "";
    }
    "effects/grid_confinement" {
        GRID_VELOCITY = "velocity at faces", "m/s":
            [moved: "change of the reference when each |ω| is scaled by the factor " GROWN,
            push: "|the push| + Δt ε Δx of the largest |ω| about", v: "|v|"]
            8.0 * moved + 60.0 * U * push + 2.0 * U * v, "", tie TURNED;
    }
}

pub(super) const PBF: &[Comparison<PbfState>] = &[
    comparison("effects/vorticity_curl", NONE, curl),
    comparison(
        "effects/vorticity_force",
        || names![pbf::buffers::VELOCITY],
        force,
    ),
];

pub(super) const FLIP: &[Comparison<FlipState>] = &[
    comparison("effects/grid_curl", NONE, curl_on_grid),
    comparison(
        "effects/grid_confinement",
        || names![flip::buffers::FACE_VELOCITY],
        confine_on_grid,
    ),
];

fn curl(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let n = state.particles();
    let (points, velocity) = (
        state.moved(io)?,
        io.before.vectors(pbf::buffers::VELOCITY, n)?,
    );
    let neighbors = state.visited(io, &points)?;
    let inputs = state.inputs(&points, &neighbors);
    let reference = vorticity_curl(inputs, &velocity);
    let scale = 2.0 * inputs.model.calibration.gradient_scale;
    let lengths = io.after.scalars(VORTICITY_LENGTH, n)?;
    let vectors = io.after.vectors(VORTICITY, n)?;
    let errors = each(0..n, |i| {
        let sums = Bounds(inputs).sums(i, relative_speed(&velocity, i));
        ROTATION.of([scale, sums.gradient()])
    });
    io.table.each(&CURL, 0..n, |i| {
        pair(i, vectors[i], reference[i], [errors[i]])
    });
    io.table.each(&LENGTH, 0..n, |i| {
        let exact = reference[i].length();
        pair(i, lengths[i], exact, [errors[i], exact])
    });
    Ok(())
}

fn force(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let Some(settings) = state.scene.effects.vorticity_confinement.clone() else {
        return Ok(());
    };
    let n = state.particles();
    let (points, velocity) = (
        state.moved(io)?,
        io.before.vectors(pbf::buffers::VELOCITY, n)?,
    );
    let vorticity = io.before.vectors(VORTICITY, n)?;
    let neighbors = state.visited(io, &points)?;
    let inputs = state.inputs(&points, &neighbors);
    let reference = vorticity_force(inputs, settings.strength, &vorticity, &velocity);
    let strength: Vec<f64> = vorticity.iter().map(|w| w.length()).collect();
    let scale = inputs.model.calibration.gradient_scale;
    let h = inputs.model.calibration.support_radius;
    let found = io.after.vectors(pbf::buffers::VELOCITY, n)?;
    io.table.each(&VELOCITY, 0..n, |i| {
        let bounds = Bounds(inputs);
        let other = |j: usize| strength.get(j).copied();
        let change = |j: usize| other(j).map_or(0.0, |w| (w - strength[i]).abs());
        let both = |j: usize| other(j).map_or(0.0, |w| w + strength[i]);
        let sums = bounds.sums(i, change).gradient();
        let error = SLOPE.of([scale, sums, bounds.sums(i, both).s2]);
        let slope = slope(&bounds, &strength, i);
        // Below this the direction is noise, and the pass uses none.
        let threshold = 1e-5 * strength[i] / h;
        if (slope - threshold).abs() <= NO_SLOPE.of([error]) {
            return None;
        }
        let force = inputs.substep.time_step * settings.strength * h * strength[i];
        let (slope, rounding) = match slope < threshold {
            true => (f64::INFINITY, 0.0),
            false => (slope, 1.0),
        };
        let magnitudes = [force, error, slope, rounding, velocity[i].length()];
        Some(pair(i, found[i], reference[i], magnitudes))
    });
    Ok(())
}

/// Returns |∇|ω|| by differences, as in `vorticity_force`.
fn slope(bounds: &Bounds<'_>, strength: &[f64], i: usize) -> f64 {
    let inputs = bounds.0;
    let calibration = &inputs.model.calibration;
    let term = |&j: &u32| {
        let period = inputs.model.period();
        let d = period.shortest(inputs.points[i] - inputs.points[j as usize]);
        let r = d.length();
        let s = (1.0 - r / calibration.support_radius).max(0.0);
        let along = d * (calibration.gradient_scale * s * s / r.max(1e-15));
        along * (strength[j as usize] - strength[i])
    };
    let sum: DVec3 = inputs.neighbors.fluid(i).iter().map(term).sum();
    sum.length()
}

fn curl_on_grid(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let elements = state.elements();
    let velocity = elements.planes(&io.before, flip::buffers::FACE_VELOCITY)?;
    let lengths = io.after.scalars(VORTICITY_LENGTH, elements.cells)?;
    let vectors = io.after.vectors(VORTICITY, elements.cells)?;
    let reference = grid_curl(&state.model, &elements.bricks, state.space(), &velocity);
    let size = state.model.cell_size();
    let error = |e: usize| {
        // The pass also reads velocities two cells away: twice the reach of one neighbourhood.
        let about = |e: usize| elements.largest_about(e, |e| velocity[e].length());
        GRID_CURL.of([elements.largest_about(e, about), size])
    };
    let errors = each(elements.active(), error);
    let error = |e: usize| errors[e - elements.active().start];
    io.table.each(&GRID_VORTICITY, elements.active(), |e| {
        pair(e, vectors[e], reference[e], [error(e)])
    });
    io.table.each(&GRID_LENGTH, elements.active(), |e| {
        let exact = reference[e].length();
        pair(e, lengths[e], exact, [error(e), exact])
    });
    Ok(())
}

fn confine_on_grid(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let Some(settings) = &state.scene.effects.vorticity_confinement else {
        return Ok(());
    };
    let elements = state.elements();
    let omega = io.after.vectors(VORTICITY, elements.cells)?;
    let before = elements.planes(&io.before, flip::buffers::FACE_VELOCITY)?;
    let found = elements.planes(&io.after, flip::buffers::FACE_VELOCITY)?;
    let step = state.step();
    let (model, space, strength) = (&state.model, state.space(), settings.strength);
    let reference = |omega: &[DVec3]| {
        grid_confinement(
            model,
            &step,
            &elements.bricks,
            space,
            strength,
            omega,
            &before,
        )
    };
    let exact = reference(&omega);
    // Magnitudes err by 12 u, and differences pass that on: the bound is the reference's response
    // to such errors.
    let grown = |sign: f64| -> Vec<DVec3> {
        let by = |(e, w): (usize, &DVec3)| {
            let hash = (e as u32 + 1).wrapping_mul(0x9e37_79b9) >> 31;
            let side = if hash == 0 { sign } else { -sign };
            *w * (1.0 + side * GROWN.of([]))
        };
        omega.iter().enumerate().map(by).collect()
    };
    let others = [1.0, -1.0].map(|sign| reference(&grown(sign)));
    let scale = step.kick * strength * model.cell_size();
    io.table.each(&GRID_VELOCITY, elements.active(), |e| {
        let force = scale * elements.largest_about(e, |e| omega[e].length());
        let moved = others.iter().map(|other| other[e].distance(exact[e]));
        let moved = moved.fold(0.0, f64::max);
        let push = exact[e].distance(before[e]) + force;
        let is_noise = moved > TURNED.of([force]) && moved > 0.0;
        (!is_noise).then(|| pair(e, found[e], exact[e], [moved, push, exact[e].length()]))
    });
    Ok(())
}
