//! Wave makers: reading their motions, and checking that walls do not collide.

use std::path::Path;

use glam::DVec3;

use super::{
    absorption, document::Document, keys::WaveMakerSpec, motion, motion_table::WAYS, regular_waves,
    seas,
};
use swell_domain::{bounds::Bounds, motion::Motion};
use swell_scene::{SceneError, Shot, WaveMaker, words::shown};

type Result<T> = std::result::Result<T, SceneError>;

/// Parts of the scene that a motion is checked against.
pub(super) struct Surroundings<'a> {
    pub(super) base_dir: &'a Path,
    pub(super) domain: &'a Bounds,
    pub(super) gravity: DVec3,
    /// Least distance between two walls, or between a wall and the opposite face, metres.
    pub(super) least_gap: f64,
    /// Particle spacing, metres.
    pub(super) spacing: f64,
    pub(super) shot: &'a Shot,
}

/// Builds and checks all wave makers.
pub(super) fn build_all(
    doc: &Document<'_>,
    specs: &[WaveMakerSpec],
    around: &Surroundings<'_>,
) -> Result<Vec<WaveMaker>> {
    let mut makers = Vec::<WaveMaker>::new();
    for (index, spec) in specs.iter().enumerate() {
        let path = format!("wave_maker[{index}]");
        let place = format!("{path}.motion");
        if makers.iter().any(|m| m.wall == spec.wall) {
            let problem = format!("a second wave maker on the wall {}", spec.wall.name());
            return Err(doc.fault_of(&format!("{path}.wall"), problem));
        }
        let by = (around.gravity.length(), WAYS);
        let motion = motion::build(doc, &place, around.base_dir, &spec.motion, by)?;
        if let Motion::Sea(sea) = &motion {
            let rest = spec.absorption.as_ref().map_or(0.0, |it| it.room);
            let size = around.domain.size()[spec.wall.axis] - rest;
            seas::check(doc, &place, sea, (size, around.spacing))?;
        }
        regular_waves::check_length(doc, &place, &motion, around.spacing)?;
        let table = format!("{path}.absorption");
        let in_time = (around.gravity, around.shot.frame_seconds());
        let absorbs =
            |table_of| absorption::build(doc, &table, (table_of, spec.wall.axis), in_time);
        let absorption = spec.absorption.as_ref().map(absorbs).transpose()?;
        absorption::check_still(doc, &place, &motion, absorption.as_ref())?;
        let maker = WaveMaker {
            wall: spec.wall,
            motion,
            absorption,
        };
        check_room(doc, &place, &maker, &makers, around)?;
        makers.push(maker);
    }
    Ok(makers)
}

/// Checks that a wall crosses neither the domain nor the opposite wall.
fn check_room(
    doc: &Document<'_>,
    place: &str,
    maker: &WaveMaker,
    others: &[WaveMaker],
    around: &Surroundings<'_>,
) -> Result<()> {
    let wall = maker.wall;
    let size = around.domain.size()[wall.axis];
    let room = size - around.least_gap;
    let duration = around.shot.duration();
    let reach = maker.farthest(duration);
    let place = &match maker.room() {
        0.0 => place.to_owned(),
        _ => place.replace(".motion", ".absorption.room"),
    };
    if reach > room {
        let problem = format!(
            "the wall {} crosses the whole domain: within the {} s of the \
             shot it moves {} m of {} m",
            wall.name(),
            shown(duration),
            shown(reach),
            shown(size)
        );
        return Err(doc.fault_of(place, problem));
    }
    let opposite = others
        .iter()
        .find(|m| m.wall.axis == wall.axis && m.wall.is_max != wall.is_max);
    if let Some(opposite) = opposite
        && let Some(t) = meeting_time(maker, opposite, room, duration)
    {
        let problem = format!(
            "the walls {} and {} collide {t:.3} s into the shot",
            opposite.wall.name(),
            wall.name()
        );
        return Err(doc.fault_of(place, problem));
    }
    Ok(())
}

/// Returns a time by which two motions together use up `room`. Steps through the shot and compares
/// the gap with the distance that the walls can close at their peak speeds within a step, so no
/// meeting is missed.
fn meeting_time(a: &WaveMaker, b: &WaveMaker, room: f64, duration: f64) -> Option<f64> {
    const STEPS: u32 = 10_000;
    let step = duration / f64::from(STEPS);
    // Absorption may displace each wall by up to its allowance in addition.
    let room = room - 2.0 * (a.room() + b.room());
    let (a, b) = (&a.motion, &b.motion);
    (0..STEPS).map(|i| step * f64::from(i)).find(|&t| {
        let gap = room - a.displacement(t) - b.displacement(t);
        let closing = a.peak_speed(t, t + step) + b.peak_speed(t, t + step);
        gap < closing * step
    })
}
