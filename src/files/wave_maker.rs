//! Wave makers: reading their motions, and checking that walls do not collide.

use std::{f64::consts::PI, path::Path};

use glam::DVec3;

use super::{
    absorption,
    document::Document,
    motion_spec::{MotionSpec, check_speed},
    motion_table::{WAYS, table},
    regular_waves, seas,
    spec::WaveMakerSpec,
};
use swell_domain::{
    bounds::Bounds,
    motion::{Motion, Phases, SeaParameters},
};
use swell_scene::{SceneError, Shot, WaveMaker, waves, words::shown};

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
        let motion = motion(doc, &place, around.base_dir, &spec.motion, around.gravity)?;
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

/// Builds the motion of the table at `path`.
pub(super) fn motion(
    doc: &Document<'_>,
    path: &str,
    base_dir: &Path,
    spec: &MotionSpec,
    gravity: DVec3,
) -> Result<Motion> {
    match *spec {
        MotionSpec::Still => Ok(Motion::Still),
        MotionSpec::ConstantVelocity { velocity, until } => {
            Ok(Motion::ConstantVelocity { velocity, until })
        }
        MotionSpec::Sine {
            stroke,
            period,
            ramp,
        } => {
            check_speed(PI * stroke / period)
                .map_err(|problem| doc.fault_of_plain(path, problem))?;
            Ok(Motion::Sine {
                stroke,
                period,
                ramp: ramp.unwrap_or(period),
            })
        }
        MotionSpec::Solitary { height, depth } => {
            if height > depth {
                let problem = format!(
                    "a wave of {} m on {} m of water",
                    shown(height),
                    shown(depth)
                );
                return Err(doc.fault_of(&format!("{path}.height"), problem));
            }
            if gravity.length() == 0.0 {
                let problem = "a solitary wave needs gravity";
                return Err(doc.fault_of(&format!("{path}.kind"), problem));
            }
            Ok(Motion::Solitary {
                height,
                depth,
                gravity: gravity.length(),
            })
        }
        MotionSpec::Stokes {
            height,
            period,
            depth,
            ramp,
        } => {
            let water = [height, period, depth, gravity.length()];
            regular_waves::stokes(doc, path, waves::regular(water, ramp))
        }
        MotionSpec::Cnoidal {
            height,
            period,
            depth,
            ramp,
        } => {
            let water = [height, period, depth, gravity.length()];
            regular_waves::cnoidal(doc, path, waves::regular(water, ramp))
        }
        MotionSpec::Sea {
            significant_height,
            seed,
            spectrum,
            peak_enhancement,
            peak_period,
            shortest_period,
            depth,
            ramp,
            second_order,
        } => {
            let water = [peak_period, depth, gravity.length()];
            let phases = Phases::Random {
                significant_height,
                seed,
            };
            let left_out = [shortest_period, ramp];
            let shape = seas::shape(doc, path, spectrum, peak_enhancement)?;
            let asked = seas::asked(shape, water, left_out, phases);
            let asked = SeaParameters {
                second_order,
                ..asked
            };
            seas::build(doc, path, asked)
        }
        MotionSpec::Focused {
            height,
            at,
            time,
            spectrum,
            peak_enhancement,
            peak_period,
            shortest_period,
            depth,
            ramp,
            second_order,
        } => {
            let water = [peak_period, depth, gravity.length()];
            let phases = Phases::Focused { height, at, time };
            let left_out = [shortest_period, ramp];
            let shape = seas::shape(doc, path, spectrum, peak_enhancement)?;
            let asked = seas::asked(shape, water, left_out, phases);
            let asked = SeaParameters {
                second_order,
                ..asked
            };
            seas::build(doc, path, asked)
        }
        MotionSpec::Table {
            ref file,
            ref points,
        } => table(doc, path, base_dir, (file, points), WAYS),
    }
}
