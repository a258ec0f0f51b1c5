//! Force fields: accelerations that a scene prescribes in a room, for a time.

use std::{borrow::Cow, sync::Arc};

use glam::DVec3;

use super::{
    frame::{FrameMotion, Inertia},
    sources::{Shape, Window},
};

/// Largest exponent of [`Law::falloff`].
pub const MAX_FALLOFF: u32 = 2;

/// How the acceleration of a vortex or an attraction depends on the distance r from its axis or
/// point: `strength · r / core` up to the core radius, `strength · (core / r)^falloff` beyond. It
/// is continuous, and nowhere larger than the strength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// Acceleration at the core radius, m/s².
    pub strength: f64,
    /// Core radius, metres.
    pub core: f64,
    /// Exponent, 0 to [`MAX_FALLOFF`].
    pub falloff: u32,
}

impl Law {
    /// Returns the acceleration at the distance `r`, divided by `r`, 1/s².
    fn over_distance(&self, r: f64) -> f64 {
        let outer = r.max(self.core);
        self.strength * (self.core / outer).powi(self.falloff as i32) / outer
    }
}

/// Kind of a force field.
#[derive(Clone, Debug, PartialEq)]
pub enum ForceKind {
    /// The same acceleration everywhere, m/s².
    Acceleration(DVec3),
    /// Acceleration around an axis, counter-clockwise as seen against its direction.
    Vortex {
        /// A point of the axis, metres.
        at: DVec3,
        /// Direction of the axis, of unit length.
        axis: DVec3,
        /// Acceleration by the distance from the axis.
        law: Law,
    },
    /// Acceleration towards a point; away from it where the strength is negative.
    Attract {
        /// The point, metres.
        at: DVec3,
        /// Acceleration by the distance from the point.
        law: Law,
    },
    /// What the motion of the domain does, but for Coriolis's acceleration: the mean over a step,
    /// from the motion.
    Frame(Arc<FrameMotion>, Inertia),
}

impl ForceKind {
    /// Names in scenes, in the order of the kinds' numbers in shaders; the motion of the domain has
    /// keys of its own.
    pub const NAMES: [&str; 3] = ["acceleration", "vortex", "attract"];

    /// Returns the kind's number in shaders.
    pub fn number(&self) -> usize {
        match self {
            Self::Acceleration(_) => 0,
            Self::Vortex { .. } => 1,
            Self::Attract { .. } => 2,
            Self::Frame(..) => 3,
        }
    }

    /// Returns the acceleration at `p`, m/s².
    pub fn at(&self, p: DVec3) -> DVec3 {
        match self {
            Self::Acceleration(acceleration) => *acceleration,
            &Self::Vortex { at, axis, law } => {
                let around = axis.cross(p - at);
                law.over_distance(around.length()) * around
            }
            &Self::Attract { at, law } => {
                let way = at - p;
                law.over_distance(way.length()) * way
            }
            Self::Frame(_, inertia) => inertia.at(p),
        }
    }

    /// Returns the kind with the mean over a (start, length), seconds, of what changes in time.
    pub fn over(&self, span: (f64, f64)) -> Cow<'_, Self> {
        match self {
            Self::Frame(motion, _) => {
                Cow::Owned(Self::Frame(Arc::clone(motion), motion.inertia(span)))
            }
            _ => Cow::Borrowed(self),
        }
    }

    /// Returns the largest acceleration anywhere in the domain, in this step for its motion, m/s².
    pub fn most(&self) -> f64 {
        match self {
            Self::Acceleration(acceleration) => acceleration.length(),
            Self::Vortex { law, .. } | Self::Attract { law, .. } => law.strength.abs(),
            Self::Frame(motion, now) => now.at_pivot.length() + now.slope() * motion.reach,
        }
    }

    /// Returns the largest acceleration anywhere in the domain between two times, seconds; m/s².
    pub fn most_in(&self, start: f64, end: f64) -> f64 {
        match self {
            Self::Frame(motion, _) => motion.most(start, end),
            _ => self.most(),
        }
    }

    /// Moves the field by `way`, metres.
    pub fn carry(&mut self, way: DVec3) {
        match self {
            Self::Acceleration(_) => {}
            Self::Vortex { at, .. } | Self::Attract { at, .. } => *at += way,
            Self::Frame(motion, _) => Arc::make_mut(motion).carry(way),
        }
    }
}

/// What a force field accelerates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Medium {
    /// The water of the solvers.
    Water,
    /// Drops of whitewater in the air.
    Whitewater,
}

impl Medium {
    /// Names in scenes.
    pub const NAMED: [(&'static str, Self); 2] =
        [("water", Self::Water), ("whitewater", Self::Whitewater)];
}

/// A force field.
#[derive(Clone, Debug, PartialEq)]
pub struct Force {
    /// Kind and strength.
    pub kind: ForceKind,
    /// Room in which it acts; `None` is everywhere.
    pub room: Option<Arc<Shape>>,
    /// Depth in the room at which it reaches its full strength, metres; it grows linearly from the
    /// surface of the room. 0 is a sharp edge.
    pub fade: f64,
    /// Time in which it acts.
    pub window: Window,
    /// What it accelerates.
    pub on: Vec<Medium>,
}

impl Force {
    /// Returns the fraction of the full strength at `p`, 0 to 1.
    pub fn part(&self, p: DVec3) -> f64 {
        let Some(room) = &self.room else {
            return 1.0;
        };
        match (room.depth(p), self.fade) {
            (depth, _) if depth <= 0.0 => 0.0,
            (_, 0.0) => 1.0,
            (depth, fade) => (depth / fade).min(1.0),
        }
    }
}

/// Force fields over a step in time.
#[derive(Clone, Debug, Default)]
pub struct ForceField<'a> {
    /// The forces that act during the step, each with its kind over the step and the fraction of
    /// the step in which it acts.
    acting: Vec<(&'a Force, Cow<'a, ForceKind>, f64)>,
}

impl<'a> ForceField<'a> {
    /// Takes the forces that act on `medium` in the `length` seconds from `start`.
    pub fn new(
        forces: impl IntoIterator<Item = &'a Force>,
        medium: Medium,
        (start, length): (f64, f64),
    ) -> Self {
        let all = forces.into_iter();
        let all = all.filter(|force| force.on.contains(&medium));
        let shares = all.map(|force| {
            let kind = force.kind.over((start, length));
            (force, kind, force.window.share(start, length))
        });
        Self {
            acting: shares.filter(|(.., share)| *share > 0.0).collect(),
        }
    }

    /// Returns the mean acceleration at `p` over the step, m/s².
    pub fn at(&self, p: DVec3) -> DVec3 {
        let terms = self.acting.iter();
        terms
            .map(|(force, kind, share)| share * force.part(p) * kind.at(p))
            .sum()
    }

    /// Iterates over the forces, each with its kind over the step and the fraction of the step in
    /// which it acts.
    pub fn acting(&self) -> impl Iterator<Item = &(&'a Force, Cow<'a, ForceKind>, f64)> {
        self.acting.iter()
    }

    /// Bounds the acceleration anywhere, m/s².
    pub fn most(&self) -> f64 {
        let terms = self.acting.iter();
        terms.map(|(_, kind, share)| share * kind.most()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bounds::Bounds;

    fn law(falloff: u32) -> Law {
        Law {
            strength: 3.0,
            core: 0.5,
            falloff,
        }
    }

    #[test]
    fn a_vortex_pushes_around_its_axis_and_an_attraction_to_its_point() {
        let at = DVec3::new(1.0, 2.0, 3.0);
        for (falloff, far) in [(0, 3.0), (1, 1.5), (2, 0.75)] {
            let law = law(falloff);
            let vortex = ForceKind::Vortex {
                at,
                axis: DVec3::Y,
                law,
            };
            let attract = ForceKind::Attract { at, law };
            // At half of the core, at the core, and at twice of it; the height does not matter to
            // the vortex.
            for (r, size) in [(0.25, 1.5), (0.5, 3.0), (1.0, far)] {
                let p = at + DVec3::new(r, 0.0, 0.0);
                let around = vortex.at(p + DVec3::new(0.0, 7.0, 0.0));
                // Counter-clockwise from above: from +x to -z.
                assert!((around - DVec3::new(0.0, 0.0, -size)).length() < 1e-12);
                let towards = attract.at(p);
                assert!((towards - DVec3::new(-size, 0.0, 0.0)).length() < 1e-12);
            }
            assert_eq!([vortex.at(at), attract.at(at)], [DVec3::ZERO; 2]);
            assert_eq!(vortex.most(), 3.0);
        }
    }

    #[test]
    fn strength_fades_in_from_the_surface_of_the_room() {
        let room = Bounds {
            min: DVec3::ZERO,
            max: DVec3::splat(2.0),
        };
        let mut force = Force {
            kind: ForceKind::Acceleration(DVec3::X),
            room: Some(Arc::new(Shape::from(room))),
            fade: 0.5,
            window: Window::default(),
            on: vec![Medium::Water],
        };
        let part = |force: &Force, x: f64| force.part(DVec3::new(x, 1.0, 1.0));
        for (x, expected) in [(-0.1, 0.0), (0.25, 0.5), (0.5, 1.0), (1.9, 0.2), (2.1, 0.0)] {
            assert!((part(&force, x) - expected).abs() < 1e-12, "{x}");
        }
        force.fade = 0.0;
        assert_eq!([0.01, 1.99].map(|x| part(&force, x)), [1.0; 2]);
        force.room = None;
        assert_eq!(part(&force, 1e6), 1.0);
    }

    #[test]
    fn a_step_counts_by_what_of_it_lies_in_the_window() {
        let force = |from, until, medium| Force {
            kind: ForceKind::Acceleration(2.0 * DVec3::X),
            room: None,
            fade: 0.0,
            window: Window { from, until },
            on: vec![medium],
        };
        let all = [
            force(1.0, Some(2.0), Medium::Water),
            force(1.75, None, Medium::Water),
            force(0.0, None, Medium::Whitewater),
        ];
        let at = |start, length| {
            let field = ForceField::new(&all, Medium::Water, (start, length));
            assert_eq!(field.most(), field.at(DVec3::ZERO).x);
            field.most()
        };
        assert_eq!(at(0.0, 1.0), 0.0);
        assert_eq!(at(0.5, 1.0), 1.0);
        // Half of the step for the first, three quarters for the second.
        assert_eq!(at(1.5, 1.0), 1.0 + 1.5);
        assert_eq!(at(2.0, 1.0), 2.0);
    }
}
