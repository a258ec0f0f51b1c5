//! Periodic axes of the domain, and what cannot be combined with them.

use glam::DVec3;

use super::{axis::Axis, document::Document};
use swell_domain::{bounds::Bounds, bricks::EDGE};
use swell_scene::{
    SceneError, Solver, WaveMaker,
    moving_solid::MovingSolid,
    projection::PROJECTION_CELL,
    words::{shown, shown_all},
};

const KEY: &str = "domain.periodic";

/// Least number of PBF's neighbour cells along a period: with fewer, a particle would see both
/// another particle and its image.
const LEAST_CELLS: f64 = 3.0;

/// Tolerance for a period to be a whole number of spacings or cells, relative to one: rounding of
/// decimal fractions.
const ROUNDING: f64 = 1e-6;

/// Sine of the angle to a periodic axis below which a solid counts as moving across it.
const ACROSS: f64 = 1e-9;

/// Reads `domain.periodic` into one flag per axis.
pub(super) fn read(doc: &Document<'_>, axes: &[Axis]) -> Result<[bool; 3], SceneError> {
    let mut periodic = [false; 3];
    for axis in axes {
        if std::mem::replace(&mut periodic[*axis as usize], true) {
            let problem = format!("{:?} is listed twice", axis.name());
            return Err(doc.fault_of(KEY, problem));
        }
    }
    Ok(periodic)
}

/// Rejects periods that are not a whole number of the solver's cells or lattice spacings.
pub(super) fn check_solver(
    doc: &Document<'_>,
    periodic: [bool; 3],
    domain: &Bounds,
    solver: &Solver,
) -> Result<(), SceneError> {
    for axis in Axis::of(periodic) {
        let length = domain.size()[axis as usize];
        let refuse = |problem: String| {
            let period = format!("the period along {} is {} m", axis.name(), shown(length));
            Err(doc.fault_of_plain(KEY, format!("{period}: {problem}")))
        };
        match solver {
            Solver::Flip(flip) => {
                let (size, edge) = (flip.cell_size, f64::from(EDGE));
                if !is_whole(length / size / edge, edge) {
                    return refuse(format!(
                        "{:.3} cells of {} m, and FLIP asks for a multiple of {EDGE} of them",
                        length / size,
                        shown(size)
                    ));
                }
            }
            Solver::Pbf(pbf) => {
                let spacing = pbf.particle_spacing;
                if !is_whole(length / spacing, 1.0) {
                    return refuse(format!(
                        "{:.3} particle spacings of {} m, and PBF asks for a whole number",
                        length / spacing,
                        shown(spacing)
                    ));
                }
                let support = spacing * pbf.support_ratio;
                if length / support < LEAST_CELLS * (1.0 - ROUNDING) {
                    return refuse(format!(
                        "{:.3} support radii of {} m, and PBF asks for at least {LEAST_CELLS}",
                        length / support,
                        shown(support)
                    ));
                }
                let (cell, edge) = (PROJECTION_CELL * spacing, f64::from(EDGE));
                if pbf.grid_projection && !is_whole(length / cell / edge, edge) {
                    return refuse(format!(
                        "{:.3} particle spacings of {} m, and PBF with grid_projection asks for a \
                         multiple of {} (without, for a whole number)",
                        length / spacing,
                        shown(spacing),
                        PROJECTION_CELL * edge
                    ));
                }
            }
        }
    }
    Ok(())
}

/// Whether `count` is a whole number of at least one, up to the rounding tolerance
/// of one of `parts`.
fn is_whole(count: f64, parts: f64) -> bool {
    count.round() >= 1.0 && (count - count.round()).abs() * parts < ROUNDING
}

/// Rejects gravity along a periodic axis: nothing supports the water, and its potential
/// energy is undefined.
pub(super) fn check_gravity(
    doc: &Document<'_>,
    periodic: [bool; 3],
    gravity: DVec3,
) -> Result<(), SceneError> {
    let along = Axis::of(periodic).into_iter();
    let Some(axis) = along.clone().find(|axis| gravity[*axis as usize] != 0.0) else {
        return Ok(());
    };
    let problem = format!(
        "gravity is {} m/s², and along {} nothing holds the water up: it would fall for ever",
        shown_all(&gravity.to_array()),
        axis.name()
    );
    Err(doc.fault_of_plain(KEY, problem))
}

/// Rejects a current along an axis that has walls.
pub(super) fn check_current(
    doc: &Document<'_>,
    periodic: [bool; 3],
    current: DVec3,
) -> Result<(), SceneError> {
    let Some(axis) = (0..3).find(|&axis| current[axis] != 0.0 && !(periodic[axis] && axis != 1))
    else {
        return Ok(());
    };
    let problem = match axis {
        1 => "it has to be level, and along y it is not 0".to_owned(),
        _ => {
            let name = Axis::NAMED[axis].0;
            format!("walls bound the domain along {name}: {KEY} has to name {name}")
        }
    };
    Err(doc.fault_of("water.current", problem))
}

/// Rejects wave makers on periodic axes, which have no walls.
pub(super) fn check_makers(
    doc: &Document<'_>,
    periodic: [bool; 3],
    makers: &[WaveMaker],
) -> Result<(), SceneError> {
    let Some(index) = makers.iter().position(|maker| periodic[maker.wall.axis]) else {
        return Ok(());
    };
    let wall = makers[index].wall;
    let problem = format!(
        "there is no wall {}: {KEY} joins the domain's ends along {}",
        wall.name(),
        Axis::NAMED[wall.axis].0
    );
    Err(doc.fault_of_plain(&format!("wave_maker[{index}].wall"), problem))
}

/// Rejects solids that move along a periodic axis, because they would have to re-enter at the other
/// end, and solids that turn about another axis, because their images would not stay in place.
pub(super) fn check_solids(
    doc: &Document<'_>,
    periodic: [bool; 3],
    solids: &[MovingSolid],
    index_of: impl Fn(usize) -> usize,
) -> Result<(), SceneError> {
    for axis in Axis::of(periodic) {
        for (found, solid) in solids.iter().enumerate() {
            let slide = solid.slide.as_ref();
            let slides =
                slide.is_some_and(|it| it.direction.normalize()[axis as usize].abs() > ACROSS);
            let turn = solid.turn.as_ref();
            let leans =
                turn.is_some_and(|it| it.axis.normalize()[axis as usize].abs() < 1.0 - ACROSS);
            let (key, does) = match (slides, leans) {
                _ if solid.track.is_some() => ("track", "may move along"),
                _ if solid.sequence.is_some() => ("sequence", "may move along"),
                (true, _) => ("direction", "moves along"),
                (_, true) => ("axis", "turns about another axis than"),
                _ => continue,
            };
            let problem = format!("the solid {does} {}, which {KEY} names", axis.name());
            let path = format!("solid[{}].{key}", index_of(found));
            return Err(doc.fault_of_plain(&path, problem));
        }
    }
    Ok(())
}
