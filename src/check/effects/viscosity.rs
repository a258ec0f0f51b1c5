//! XSPH viscosity; with FLIP it is a further part of the velocity that is taken from the grid, and no pass.

use crate::{
    check::{
        engine::{Io, NONE, Outcome, State, Twin, names, twin},
        flip::FlipState,
        pbf::{
            PbfState,
            bounds::{Bounds, relative_speed},
        },
        table::{entries, pair},
    },
    compare::rounding::{KERNEL, U},
    reference::pbf::effects::viscosity::{viscosity_apply, viscosity_gather},
    solve::{effects::viscosity::CHANGE as VISCOSITY_CHANGE, pbf},
};

entries! {
    "effects/viscosity_gather" {
        CHANGE = "change of velocity", "m/s": [scale: "c times the kernel's scale", sums: "with w = |Δv| " KERNEL]
            scale * sums, "";
    }
    "effects/viscosity_apply" {
        VELOCITY = "velocity", "m/s": [v: "|v|"] U * v, "one sum";
    }
}

pub(super) const PBF: &[Twin<PbfState>] = &[
    twin("effects/viscosity_gather", NONE, gather),
    twin(
        "effects/viscosity_apply",
        || names![pbf::buffers::VELOCITY],
        apply,
    ),
];

pub(super) const FLIP: &[Twin<FlipState>] = &[];

fn gather(state: &mut PbfState, io: &mut Io<'_>) -> Outcome {
    let Some(settings) = state.scene.effects.viscosity.clone() else {
        return Ok(());
    };
    let n = state.particles();
    let (points, velocity) = (
        state.moved(io)?,
        io.vectors_before(pbf::buffers::VELOCITY, n)?,
    );
    let neighbors = state.visited(io, &points)?;
    let inputs = state.inputs(&points, &neighbors);
    let twin = viscosity_gather(inputs, settings.xsph, &velocity);
    let scale = settings.xsph * inputs.model.calibration.density_scale;
    let found = io.vectors(VISCOSITY_CHANGE, n)?;
    io.table.each(&CHANGE, 0..n, |i| {
        let sums = Bounds(inputs).sums(i, relative_speed(&velocity, i));
        pair(i, found[i], twin[i], [scale, sums.kernel()])
    });
    Ok(())
}

fn apply(state: &mut PbfState, io: &mut Io<'_>) -> Outcome {
    let n = state.particles();
    let change = io.vectors_before(VISCOSITY_CHANGE, n)?;
    let twin = viscosity_apply(&change, &io.vectors_before(pbf::buffers::VELOCITY, n)?);
    let found = io.vectors(pbf::buffers::VELOCITY, n)?;
    io.table.each(&VELOCITY, 0..n, |i| {
        pair(i, found[i], twin[i], [twin[i].length()])
    });
    Ok(())
}
