//! Solids as obstacles for water that enters.

use glam::DVec3;

use super::super::{pose::Pose, signed_distance::SignedDistance};

/// Static and moving solids.
#[derive(Clone, Copy)]
pub struct Solids<'a> {
    /// Distance to the union of the static solids; `None` if there are none.
    pub still: Option<&'a SignedDistance>,
    /// Distance to each moving solid, in its pose at the start. That to a solid whose shape changes
    /// is of one time only: such a solid does not come into the volume of an emitter.
    pub moving: &'a [&'a SignedDistance],
    /// Pose of a moving solid, given by its index, at a time in seconds.
    pub pose: &'a (dyn Fn(usize, f64) -> Pose + Sync),
}

impl<'a> Solids<'a> {
    /// Builds the solids of a scene in which none moves.
    pub fn still(still: Option<&'a SignedDistance>) -> Self {
        Self {
            still,
            moving: &[],
            pose: &|_, _| Pose::START,
        }
    }

    /// Returns whether there are no solids.
    pub(super) fn is_empty(&self) -> bool {
        self.still.is_none() && self.moving.is_empty()
    }

    /// Distance to the nearest solid at a time, metres, negative inside; infinite without solids.
    pub(super) fn distance(&self, p: DVec3, seconds: f64) -> f64 {
        let all = self.all(seconds);
        all.fold(f64::INFINITY, |least, (field, pose)| {
            least.min(field.sample(pose.back(p)))
        })
    }

    /// Gradient of that distance, which points away from the nearest solid.
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
        let moving = moving.iter().copied().enumerate();
        let moving = moving.map(move |(index, field)| (field, pose(index, seconds)));
        still
            .into_iter()
            .map(|field| (field, Pose::START))
            .chain(moving)
    }
}
