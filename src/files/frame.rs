//! The motion of the domain: reading it from a scene, and writing it.

use std::path::Path;

use glam::DVec3;

use swell_domain::{
    bounds::Bounds,
    frame::{FrameMotion, FrameTurn},
};
use swell_scene::{Scene, SceneError, Shot, forces::MovingFrame};

use super::{
    document::Document,
    keys::{DomainSpec, WallMotionSpec},
    motion,
    motion_table::{ANGLES, Allowed, BOTH_WAYS},
    speed::check_speed,
};

/// Least length of a direction vector; only its direction matters.
const LEAST_DIRECTION: f64 = 1e-6;

type Result<T> = std::result::Result<T, SceneError>;

/// Builds the motion of a domain; `None` for one at rest.
pub(super) fn build(
    doc: &Document<'_>,
    base_dir: &Path,
    spec: &DomainSpec,
    (domain, gravity): (&Bounds, DVec3),
) -> Result<Option<MovingFrame>> {
    let direction = |key: &str, of: [f64; 3]| {
        let found = DVec3::from_array(of);
        match found.length() < LEAST_DIRECTION {
            true => Err(doc.fault_of(&format!("domain.{key}"), "no direction")),
            false => Ok(found),
        }
    };
    let motion = |key: &str, spec: &WallMotionSpec, allowed: Allowed| {
        let by = (gravity.length(), allowed);
        motion::build(doc, &format!("domain.{key}"), base_dir, spec, by)
    };
    let slide = match (spec.direction, &spec.motion) {
        (Some(way), Some(moves)) => Some((
            direction("direction", way)?,
            motion("motion", &moves.into(), BOTH_WAYS)?,
        )),
        _ => None,
    };
    let turn = match (spec.pivot, spec.axis, &spec.turn) {
        (Some(pivot), Some(axis), Some(turns)) => Some(FrameTurn {
            pivot: DVec3::from_array(pivot),
            axis: direction("axis", axis)?,
            motion: motion("turn", &turns.into(), ANGLES)?,
        }),
        _ => None,
    };
    if slide.is_none() && turn.is_none() {
        return Ok(None);
    }
    let pivot = turn.as_ref().map_or(DVec3::ZERO, |turn| turn.pivot);
    let farthest = (domain.min - pivot).abs().max((domain.max - pivot).abs());
    Ok(Some(MovingFrame::new(FrameMotion {
        slide,
        turn,
        gravity,
        reach: farthest.length(),
    })))
}

/// Refuses what does not know that the domain moves.
pub(super) fn check(doc: &Document<'_>, scene: &Scene) -> Result<()> {
    let Some(motion) = scene.frame.as_ref().map(MovingFrame::motion) else {
        return Ok(());
    };
    let key = match motion.slide.is_some() {
        true => "domain.motion",
        false => "domain.turn",
    };
    let fastest = motion.peak_speed(0.0, scene.shot.duration());
    check_speed(fastest).map_err(|problem| doc.fault_of_plain(key, problem))?;
    let band = scene.solver.flip().is_some_and(|flip| flip.band.is_some());
    let others = [
        (scene.has_bodies(), "[[body]]"),
        (band, "solver.flip.band"),
        (scene.is_periodic(), "domain.periodic"),
    ];
    let Some((_, other)) = others.iter().find(|(is_there, _)| *is_there) else {
        return Ok(());
    };
    let problem = format!("the domain moves, and {other} does not feel that");
    Err(doc.fault_of_plain(key, problem))
}

/// Returns the largest acceleration by the motion of the domain in a shot, m/s².
pub(super) fn most(motion: &FrameMotion, shot: &Shot) -> f64 {
    let frames = (0..shot.frames).map(|frame| motion.most(shot.time(frame), shot.time(frame + 1)));
    frames.fold(0.0, f64::max)
}

/// Returns what a file says of the motion; the rest of the domain is zero.
pub(super) fn written(scene: &Scene) -> DomainSpec {
    let motion = scene.frame.as_ref().map(MovingFrame::motion);
    let slide = motion.and_then(|it| it.slide.as_ref());
    let turn = motion.and_then(|it| it.turn.as_ref());
    DomainSpec {
        min: [0.0; 3],
        max: [0.0; 3],
        walls: None,
        no_slip: None,
        direction: slide.map(|(direction, _)| direction.to_array()),
        motion: slide.map(|(_, motion)| WallMotionSpec::from(motion).into()),
        pivot: turn.map(|turn| (turn.pivot + scene.origin).to_array()),
        axis: turn.map(|turn| turn.axis.to_array()),
        turn: turn.map(|turn| WallMotionSpec::from(&turn.motion).into()),
        periodic: None,
    }
}
