//! Surface tension, on the grid.

use glam::{DVec2, DVec3};

use crate::{
    comparison::{Comparison, Io, NONE, PassResult, comparison, names},
    flip::FlipState,
    pbf::PbfState,
    table::{CheckEntry, each, entries, pair},
};
use swell_compare::{rounding::U, tolerance::bounds};
use swell_domain::poisson::Cells;
use swell_gpu::buffer::Buf;
use swell_reference::flip::effects::surface_tension as passes;
use swell_scene::flip::Surface;
use swell_solve::{
    effects::surface_tension::{BETWEEN, CURVATURE, SHARE},
    flip,
};

bounds! {
    SLOPE = [most: "the largest share about"]
        8.0 * U * most, "a quarter of four differences and their sum";
    // A normal is a gradient over its length: a root takes 9 u, a quotient 5 u.
    NORMALS = [slope: "" SLOPE,
        inverse: "the mean of 1 / |∇s| at the corners, no less than 0.001 each"]
        4.0 * slope * inverse + 40.0 * U, "of the derivatives of normals, a mean of eight";
    BEND = [normals: "" NORMALS] 1.8 * normals, "three of them";
    SQUARES = [normals: "" NORMALS, squares: "|∇n|²"]
        1.8 * normals * (2.0 * squares.sqrt() + 1.8 * normals) + 12.0 * U * squares, "";
    OFF = [slope: "" SLOPE, steep: "|∇s|, no less than 0.001", off: "how far off the surface lies"]
        (U + (2.0 * slope + 12.0 * U * steep) * off) / steep + 8.0 * U * off, "";
    // θ is a quotient, and 1 − θ has the same error as θ.
    BETWEEN_CELLS = [share: "the larger weight over their sum", most: "the larger |κ Δx|"]
        U * (30.0 * share + 20.0) * most, "";
}

entries! {
    "effects/tension_share" {
        FIRST = "share", "": [share: "its own value"]
            30.0 * U * share, "27 sums of what is not negative";
    }
    "effects/tension_smooth" {
        SECOND = "share", "": [share: "its own value"]
            30.0 * U * share, "27 sums of what is not negative";
    }
    "effects/tension_smooth_again" {
        THIRD = "share", "": [share: "its own value"]
            30.0 * U * share, "27 sums of what is not negative";
    }
    "effects/tension_curvature" {
        BENT = "curvature", "1/Δx": [bend: "" BEND, squares: "" SQUARES, off: "" OFF,
            way: "cells that it is carried", turned: "|∇n|²",
            size: "|−∇·n| and the way times |∇n|²"]
            bend * (1.0 + turned) + squares * (way + bend) + off * turned + 8.0 * U * size, "";
        STEEP = "slope", "1/Δx": [slope: "" SLOPE, steep: "its own value"]
            2.0 * slope + 12.0 * U * steep, "";
    }
    "effects/tension_push" {
        PUSHED = "velocity at faces", "m/s": [kappa: "" BETWEEN_CELLS, scale: "Δt σ / (ρ θ Δx²)",
            push: "|the push|", v: "|v|"]
            scale * kappa + 40.0 * U * push + 2.0 * U * v, "of three faces";
    }
}

pub(super) const PBF: &[Comparison<PbfState>] = &[];

pub(super) const FLIP: &[Comparison<FlipState>] = &[
    comparison("effects/tension_share", NONE, first),
    comparison("effects/tension_smooth", NONE, |state, io| {
        smoothed(state, io, [SHARE, BETWEEN], &SECOND)
    }),
    comparison("effects/tension_smooth_again", NONE, |state, io| {
        smoothed(state, io, [BETWEEN, SHARE], &THIRD)
    }),
    comparison("effects/tension_curvature", NONE, curvature),
    comparison(
        "effects/tension_push",
        || names![flip::buffers::FACE_VELOCITY],
        push,
    ),
];

fn first(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let elements = state.elements();
    let kind = &state.space().kind;
    let reference = passes::first_share(&state.model, &elements.bricks, kind, state.density());
    let found = io.after.scalars(SHARE, elements.cells)?;
    io.table.each(&FIRST, elements.active(), |e| {
        pair(e, found[e], reference[e], [reference[e]])
    });
    Ok(())
}

fn smoothed(
    state: &mut FlipState,
    io: &mut Io<'_>,
    [from, to]: [Buf<f32>; 2],
    entry: &'static CheckEntry<1>,
) -> PassResult {
    let elements = state.elements();
    let kind = &state.space().kind;
    let share = io.before.scalars(from, elements.cells)?;
    let reference = passes::smooth(&state.model, &elements.bricks, kind, &share);
    let found = io.after.scalars(to, elements.cells)?;
    io.table.each(entry, elements.active(), |e| {
        pair(e, found[e], reference[e], [reference[e]])
    });
    Ok(())
}

fn curvature(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let elements = state.elements();
    let (model, bricks, kind) = (&state.model, &elements.bricks, &state.space().kind);
    let share = io.before.scalars(SHARE, elements.cells)?;
    let found = pairs(&io.after.get(CURVATURE, elements.cells)?);
    let about = |e: usize| {
        let bent = passes::bent(model, bricks, kind, &share, e as u32)?;
        let slope = SLOPE.of([elements.largest_about(e, |e| share[e])]);
        Some((bent, slope))
    };
    let all = each(elements.active(), about);
    let first = elements.active().start;
    io.table.each(&BENT, elements.active(), |e| {
        let Some((bent, slope)) = &all[e - first] else {
            return pair(e, found[e].x, 0.0, [0.0; 6]);
        };
        let inverse = |corner: &DVec3| 1.0 / corner.length().max(passes::LEAST_SLOPE);
        let inverse = bent.corners.iter().map(inverse).sum::<f64>() / 8.0;
        let normals = NORMALS.of([*slope, inverse]);
        let way = bent.off.abs() + passes::SHIFT * bent.bend.abs();
        let magnitudes = [
            BEND.of([normals]),
            SQUARES.of([normals, bent.squares]),
            OFF.of([*slope, bent.steep.max(passes::LEAST_SLOPE), bent.off.abs()]),
            way,
            bent.squares,
            bent.bend.abs() + way * bent.squares,
        ];
        pair(e, found[e].x, bent.curvature(), magnitudes)
    });
    io.table.each(&STEEP, elements.active(), |e| {
        let (steep, slope) =
            (all[e - first].as_ref()).map_or((0.0, 0.0), |(bent, slope)| (bent.steep, *slope));
        pair(e, found[e].y, steep, [slope, steep])
    });
    Ok(())
}

fn pairs(values: &[[f32; 2]]) -> Vec<DVec2> {
    let wide = |&[x, y]: &[f32; 2]| DVec2::new(x.into(), y.into());
    values.iter().map(wide).collect()
}

fn push(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let Some(settings) = &state.scene.effects.surface_tension else {
        return Ok(());
    };
    let (elements, step) = (state.elements(), state.step());
    let (model, bricks, space) = (&state.model, &elements.bricks, state.space());
    let curvature = pairs(&io.before.get(CURVATURE, elements.cells)?);
    let distance = match model.settings().surface {
        Surface::GhostFluid => Some(elements.scalars(&io.before, flip::buffers::LIQUID_DISTANCE)?),
        Surface::Voxel => None,
    };
    let before = elements.planes(&io.before, flip::buffers::FACE_VELOCITY)?;
    let found = elements.planes(&io.after, flip::buffers::FACE_VELOCITY)?;
    let tension = settings.coefficient / state.scene.water.rest_density;
    let given = (model, tension, step.kick);
    let reference = passes::push(
        given,
        bricks,
        space,
        distance.as_deref(),
        &curvature,
        &before,
    );
    let cells = Cells {
        bricks,
        kind: &space.kind,
        open: &[],
        distance: distance.as_deref(),
    };
    let over = step.kick * tension / model.cell_size().powi(2);
    io.table.each(&PUSHED, elements.active(), |e| {
        let (mut kappa, mut scale) = (0.0f64, 0.0f64);
        for [water, air] in (0..3).filter_map(|axis| passes::sides(bricks, space, e as u32, axis)) {
            let theta = cells.theta(water, air);
            let (_, weight) = passes::between(&curvature, theta, water, air);
            let [inside, outside] = [water, air].map(|e| curvature[e as usize]);
            let share = inside.y.max(outside.y) / weight.max(passes::LEAST_WEIGHT);
            let most = inside.x.abs().max(outside.x.abs());
            kappa = kappa.max(BETWEEN_CELLS.of([share, most]));
            scale += over / theta;
        }
        let push = reference[e].distance(before[e]);
        pair(
            e,
            found[e],
            reference[e],
            [kappa, scale, push, reference[e].length()],
        )
    });
    Ok(())
}
