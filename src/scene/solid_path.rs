//! Path of a moving solid about the time of a frame.

use super::moving_solid::MovingSolid;
use swell_domain::{body::BodyState, pose::Pose};

/// States of the bodies about a frame.
#[derive(Clone, Copy, Debug)]
pub struct BodiesAround<'a> {
    /// States at the frame before; `None` where they are not known.
    pub before: Option<&'a [BodyState]>,
    /// States at the frame.
    pub now: &'a [BodyState],
    /// States at the frame after; `None` where they are not known.
    pub after: Option<&'a [BodyState]>,
}

impl<'a> BodiesAround<'a> {
    /// States of a frame whose neighbours are not known.
    pub fn alone(now: &'a [BodyState]) -> Self {
        Self {
            before: None,
            now,
            after: None,
        }
    }
}

/// Path of a moving solid from the frame before to the frame after.
#[derive(Clone, Debug)]
pub struct SolidPath {
    solid: MovingSolid,
    /// A body's states at the frame before, at the frame and at the frame after.
    states: [Option<BodyState>; 3],
}

impl SolidPath {
    /// Creates the path of a solid: a prescribed one follows its motion, a body a curve through its
    /// states.
    pub fn new(solid: &MovingSolid, around: BodiesAround<'_>) -> Self {
        let state = |bodies: Option<&[BodyState]>| {
            let body = solid.body.as_ref()?;
            bodies.map(|bodies| body.state(bodies))
        };
        let BodiesAround { before, now, after } = around;
        Self {
            solid: solid.clone(),
            states: [before, Some(now), after].map(state),
        }
    }

    /// Returns the pose at time `t`, seconds. A body moves on from the frame's state without forces
    /// where the frame on that side is not known.
    pub fn pose(&self, t: f64) -> Pose {
        let (Some(it), [before, Some(now), after]) = (&self.solid.body, &self.states) else {
            return self.solid.pose(&[], t);
        };
        let ends = match t < now.time {
            true => before.as_ref().map(|before| [before, now]),
            false => after.as_ref().map(|after| [now, after]),
        };
        match ends {
            Some(ends) => it.body.pose_between(ends, t),
            None if t == now.time => it.body.pose(now),
            None => it.body.pose(&it.body.moved(now, t - now.time)),
        }
    }
}
