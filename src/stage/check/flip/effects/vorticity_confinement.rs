//! Vorticity confinement on the grid.

use glam::{DVec3, Vec4};

use super::Checker;
use crate::{
    compare::{check::fields, rounding::U},
    gpu::recording::Moment,
    reference::flip::{grid_confinement, grid_curl},
    scene::effects::vorticity_confinement::Settings,
    solve::{SolveError, trace::Traced},
    stage::check::flip::{Layout, pair, pair_of},
};

fields! {
    CURL = "effects/grid_curl", "vorticity", "1/s",
        "differences of means of two faces over two cells: 30 u of the largest speed about over Δx";
    LENGTH = "effects/grid_curl", "its length", "1/s", "that of the vorticity + 12 u |ω|";
    VELOCITY = "effects/grid_confinement", "velocity at faces", "m/s",
        "8 times what the twin answers when each vorticity grows or shrinks by 20 u, + 60 u of the push + 2 u |v|; a tie where \
         that turns it: its direction is noise";
}

pub(super) fn compare(
    settings: &Settings,
    checker: &mut Checker<'_>,
    traced: Traced<'_>,
) -> Result<(), SolveError> {
    match (traced.moment, traced.pass) {
        (Moment::After, "effects/grid_curl") => curl(checker, traced),
        (Moment::Before, "effects/grid_confinement") => {
            checker.old = checker.planes(traced, "face_velocity")?;
            Ok(())
        }
        (Moment::After, "effects/grid_confinement") => confinement(settings, checker, traced),
        _ => Ok(()),
    }
}

/// The largest over a cell and the 26 about it.
fn about(checker: &Checker<'_>, element: usize, of: impl Fn(usize) -> f64) -> f64 {
    let Layout { bricks, .. } = checker.layout();
    (0..27)
        .map(|k| {
            let offset = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
            of(bricks.near(element as u32, offset) as usize)
        })
        .fold(0.0, f64::max)
}

fn vorticity(checker: &Checker<'_>, traced: Traced<'_>) -> Result<Vec<[f32; 4]>, SolveError> {
    checker.cells(traced, "vorticity")
}

fn wide(value: &[f32; 4]) -> DVec3 {
    Vec4::from_array(*value).as_dvec4().truncate()
}

fn curl(checker: &mut Checker<'_>, traced: Traced<'_>) -> Result<(), SolveError> {
    let velocity = checker.planes(traced, "face_velocity")?;
    let found = vorticity(checker, traced)?;
    let Layout { bricks, .. } = checker.layout();
    let twin = grid_curl(&checker.model, bricks, checker.room(), &velocity);
    let size = checker.model.cell_size();
    let (mut curls, mut lengths) = (Vec::new(), Vec::new());
    for e in checker.active() {
        // Two cells off as well: twice the reach of one neighbourhood.
        let speed = about(checker, e, |e| about(checker, e, |e| velocity[e].length()));
        let tolerance = 30.0 * U * speed / size;
        curls.push(pair(e, wide(&found[e]), twin[e], tolerance));
        let exact = twin[e].length();
        let tolerance = tolerance + 12.0 * U * exact;
        lengths.push(pair_of(e, f64::from(found[e][3]), exact, tolerance));
    }
    checker.table.add(&CURL, &curls, 0);
    checker.table.add(&LENGTH, &lengths, 0);
    Ok(())
}

fn confinement(
    settings: &Settings,
    checker: &mut Checker<'_>,
    traced: Traced<'_>,
) -> Result<(), SolveError> {
    let omega: Vec<DVec3> = vorticity(checker, traced)?.iter().map(wide).collect();
    let found = checker.planes(traced, "face_velocity")?;
    let Layout { bricks, .. } = checker.layout();
    let step = checker.step();
    let (model, room) = (&checker.model, checker.room());
    let strength = settings.strength;
    let twin = |omega: &[DVec3]| {
        grid_confinement(model, &step, bricks, room, strength, omega, &checker.old)
    };
    let exact = twin(&omega);
    // Magnitudes err by 12 u and the slope's differences pass that on: what the twin answers when they do.
    let grown = |sign: f64| -> Vec<DVec3> {
        let by = |(e, w): (usize, &DVec3)| {
            let hash = (e as u32 + 1).wrapping_mul(0x9e37_79b9) >> 31;
            let side = if hash == 0 { sign } else { -sign };
            *w * (1.0 + side * 20.0 * U)
        };
        omega.iter().enumerate().map(by).collect()
    };
    let others = [1.0, -1.0].map(|sign| twin(&grown(sign)));
    let scale = step.length * strength * model.cell_size();
    let mut ties = 0;
    let mut pairs = Vec::new();
    for e in checker.active() {
        let force = scale * about(checker, e, |e| omega[e].length());
        let moved = others.iter().map(|other| other[e].distance(exact[e]));
        let moved = moved.fold(0.0, f64::max);
        let pushed = exact[e].distance(checker.old[e]);
        // The direction turned, or went: noise.
        if moved > 0.05 * force && moved > 0.0 {
            ties += 1;
            continue;
        }
        let tolerance = 8.0 * moved + 60.0 * U * (pushed + force) + 2.0 * U * exact[e].length();
        pairs.push(pair(e, found[e], exact[e], tolerance));
    }
    checker.table.add(&VELOCITY, &pairs, ties);
    Ok(())
}
