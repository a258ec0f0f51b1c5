//! Viscosity: in Pa s on the grid; XSPH on particles. For FLIP, XSPH increases the PIC fraction and
//! has no pass.

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
    rounding::{KERNEL, U},
    tolerance::bounds,
};
use swell_reference::{
    flip::Centers,
    flip::effects::{
        FaceInputs,
        viscosity::{ViscousCell, viscosity_relax, viscosity_weigh},
    },
    pbf::effects::viscosity::{viscosity_apply, viscosity_gather},
};
use swell_solve::{
    effects::viscosity::{CHANGE as VISCOSITY_CHANGE, EARLIER, FROM, GAINS, START, STEP, TO, WORD},
    flip, pbf,
    pressure::buffers as pressure,
};

bounds! {
    // Divided by the diagonal, a stress is at most 6 times the largest speed, and the pull towards
    // the initial velocity 2 times: each term is rounded fewer than 30 times in differences,
    // weights, sums and the quotient.
    ITERATED = [gain: "g", speed: "the largest |v| about", kept: "m times the last change"]
        U * (30.0 * 8.0 * gain * speed + 3.0 * kept), "stresses over the diagonal";
}

entries! {
    "effects/viscosity_gather" {
        CHANGE = "change of velocity", "m/s": [scale: "c times the kernel's scale",
            sums: "with w = |Δv| " KERNEL]
            scale * sums, "";
    }
    "effects/viscosity_apply" {
        VELOCITY = "velocity", "m/s": [v: "|v|"] U * v, "one sum";
    }
    "effects/viscosity_weigh" {
        WORDS = "faces and edges", "": [] 0.0, "whole numbers";
        KEPT = "velocity at the start", "m/s": [] 0.0, "a copy";
        KEPT_PRESSURE = "pressure before", "Pa": [] 0.0, "a copy";
    }
    "effects/viscosity_relax" {
        RELAXED = "velocity at faces", "m/s": [error: "" ITERATED, v: "|v|"] error + U * v, "a sum";
        STEPPED = "change of it", "m/s": [error: "" ITERATED] error, "";
    }
    "effects/viscosity_pressure" {
        PRESSURE = "pressure", "Pa": [p: "|p|"] U * p, "one sum";
    }
}

pub(super) const PBF: &[Comparison<PbfState>] = &[
    comparison("effects/viscosity_gather", NONE, gather),
    comparison(
        "effects/viscosity_apply",
        || names![pbf::buffers::VELOCITY],
        apply,
    ),
];

pub(super) const FLIP: &[Comparison<FlipState>] = &[
    comparison("effects/viscosity_weigh", NONE, weigh),
    Comparison {
        is_due: |state, io| Ok(state.is_due(io, 0)),
        ..comparison("effects/viscosity_relax", || names![STEP], relax)
    },
    comparison(
        "effects/viscosity_pressure",
        || names![pressure::PRESSURE],
        add_pressure,
    ),
];

fn weigh(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let elements = state.elements();
    let active = elements.active();
    let step = state.step();
    let cells = viscosity_weigh(FaceInputs {
        model: &state.model,
        step: &step,
        bricks: &elements.bricks,
        space: state.space(),
        // The solve reads neither.
        centers: &Centers::default(),
        old: &[],
    });
    let words: Vec<u32> = cells.iter().map(ViscousCell::word).collect();
    let found = io.after.get(WORD, elements.cells)?;
    (io.table).add_exact(&WORDS, &found[active.clone()], &words[active.clone()]);
    let velocity = elements.planes(&io.after, flip::buffers::FACE_VELOCITY)?;
    let kept = elements.planes(&io.after, START)?;
    io.table
        .each(&KEPT, active.clone(), |e| pair(e, kept[e], velocity[e], []));
    let pressure = io.after.scalars(pressure::PRESSURE, elements.cells)?;
    let kept = io.after.scalars(EARLIER, elements.cells)?;
    io.table.each(&KEPT_PRESSURE, active, |e| {
        pair(e, kept[e], pressure[e], [])
    });
    Ok(())
}

fn relax(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let elements = state.elements();
    let [reach, gain, momentum, _] = io.before.window(&GAINS)?.map(f64::from);
    let velocity = elements.planes(&io.before, FROM)?;
    let change = elements.planes(&io.before, STEP)?;
    let start = elements.planes(&io.before, START)?;
    let words = io.before.get(WORD, elements.cells)?;
    let cells: Vec<ViscousCell> = words.into_iter().map(ViscousCell::of_word).collect();
    let (to, step) = viscosity_relax(
        (&elements.bricks, &cells),
        [reach, gain, momentum],
        &start,
        (&velocity, &change),
    );
    let found = elements.planes(&io.after, TO)?;
    let changed = elements.planes(&io.after, STEP)?;
    let error = |e: usize| {
        let speed = elements.largest_about(e, |e| velocity[e].length().max(start[e].length()));
        // The first iteration does not read it.
        let last = if momentum == 0.0 {
            0.0
        } else {
            change[e].length()
        };
        ITERATED.of([gain, speed, momentum * last])
    };
    let errors = each(elements.active(), error);
    let error = |e: usize| errors[e - elements.active().start];
    io.table.each(&RELAXED, elements.active(), |e| {
        pair(e, found[e], to[e], [error(e), to[e].length()])
    });
    io.table.each(&STEPPED, elements.active(), |e| {
        pair(e, changed[e], step[e], [error(e)])
    });
    Ok(())
}

fn add_pressure(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let elements = state.elements();
    let before = io.before.scalars(pressure::PRESSURE, elements.cells)?;
    let earlier = io.before.scalars(EARLIER, elements.cells)?;
    let found = io.after.scalars(pressure::PRESSURE, elements.cells)?;
    io.table.each(&PRESSURE, elements.active(), |e| {
        let sum = before[e] + earlier[e];
        pair(e, found[e], sum, [sum.abs()])
    });
    Ok(())
}

fn gather(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let settings = state.scene.effects.viscosity.as_ref();
    let Some(xsph) = settings.and_then(|settings| settings.xsph) else {
        return Ok(());
    };
    let n = state.particles();
    let (points, velocity) = (
        state.moved(io)?,
        io.before.vectors(pbf::buffers::VELOCITY, n)?,
    );
    let neighbors = state.visited(io, &points)?;
    let inputs = state.inputs(&points, &neighbors);
    let reference = viscosity_gather(inputs, xsph, &velocity);
    let scale = xsph * inputs.model.calibration.density_scale;
    let found = io.after.vectors(VISCOSITY_CHANGE, n)?;
    io.table.each(&CHANGE, 0..n, |i| {
        let sums = Bounds(inputs).sums(i, relative_speed(&velocity, i));
        pair(i, found[i], reference[i], [scale, sums.kernel()])
    });
    Ok(())
}

fn apply(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let n = state.particles();
    let change = io.before.vectors(VISCOSITY_CHANGE, n)?;
    let reference = viscosity_apply(&change, &io.before.vectors(pbf::buffers::VELOCITY, n)?);
    let found = io.after.vectors(pbf::buffers::VELOCITY, n)?;
    io.table.each(&VELOCITY, 0..n, |i| {
        pair(i, found[i], reference[i], [reference[i].length()])
    });
    Ok(())
}
