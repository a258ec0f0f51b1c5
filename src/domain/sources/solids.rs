//! Solids as water that enters meets them.

use glam::DVec3;

use super::super::{pose::Pose, signed_distance::SignedDistance};

/// Solids that stand and solids that move.
#[derive(Clone, Copy)]
pub struct Solids<'a> {
    /// The union of those that stand; `None` where none does.
    pub still: Option<&'a SignedDistance>,
    /// Each of those that move, where it stood at the start.
    pub moving: &'a [SignedDistance],
    /// Where one of those is, by its index, at a time in seconds.
    pub pose: &'a (dyn Fn(usize, f64) -> Pose + Sync),
}

impl<'a> Solids<'a> {
    /// Those that stand alone.
    pub fn still(still: Option<&'a SignedDistance>) -> Self {
        Self {
            still,
            moving: &[],
            pose: &|_, _| Pose::START,
        }
    }

    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.still.is_none() && self.moving.is_empty()
    }

    /// To the nearest at a time, metres, negative within; infinite where there is none.
    pub(super) fn distance(&self, p: DVec3, seconds: f64) -> f64 {
        let all = self.all(seconds);
        all.fold(f64::INFINITY, |least, (field, pose)| {
            least.min(field.sample(pose.back(p)))
        })
    }

    /// Of that distance, pointing away from the nearest solid.
    pub(super) fn gradient(&self, p: DVec3, seconds: f64) -> DVec3 {
        let all = self.all(seconds);
        let nearest = all.min_by(|(a, at_a), (b, at_b)| {
            let [a, b] = [a.sample(at_a.back(p)), b.sample(at_b.back(p))];
            a.total_cmp(&b)
        });
        nearest.map_or(DVec3::ZERO, |(field, pose)| {
            pose.turn * field.gradient(pose.back(p))
        })
    }

    fn all(&self, seconds: f64) -> impl Iterator<Item = (&'a SignedDistance, Pose)> {
        let Self {
            still,
            moving,
            pose,
        } = *self;
        let moving = moving.iter().enumerate();
        let moving = moving.map(move |(index, field)| (field, pose(index, seconds)));
        still
            .into_iter()
            .map(|field| (field, Pose::START))
            .chain(moving)
    }
}
