//! Poses of a solid over time.

use glam::{DQuat, DVec3};

use super::{Scene, words::shown};
use swell_domain::{mesh::TriangleMesh, pose::Pose};

/// Times closer than this are the same, seconds.
const APART: f64 = 1e-6;

/// Poses of a solid at some times; between them it moves linearly and rotates along the shorter arc
/// at constant rate.
#[derive(Clone, Debug)]
pub struct Track {
    /// Time in seconds, ascending from 0, position of the reference point relative to the scene's
    /// origin in metres, and rotation; the first rotation is the identity.
    poses: Vec<(f64, DVec3, DQuat)>,
    /// Distance from the reference point to the farthest vertex, metres.
    reach: f64,
    /// Set if the file moves the solid only before or after the shot.
    missed: Option<Missed>,
    /// Warning that the file's frame rate differs from the shot's.
    other_rate: Option<String>,
}

/// Key times of a file whose solid is static over the whole shot, in frames of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Missed {
    /// First and last key.
    pub moves: [f64; 2],
    /// Frame 0 and the last frame of the shot.
    pub shot: [f64; 2],
}

/// Compares the poses only: warnings about the file are not part of a scene and are not
/// written out with it.
impl PartialEq for Track {
    fn eq(&self, other: &Self) -> bool {
        (&self.poses, self.reach) == (&other.poses, other.reach)
    }
}

impl Track {
    /// Creates the track of a solid whose initial placement is `mesh`, from poses: time in seconds,
    /// ascending from 0, position of the reference point in metres, and rotation (at first the
    /// identity).
    ///
    /// # Errors
    /// A description of the first fault of the poses.
    pub fn new(poses: Vec<(f64, DVec3, DQuat)>, mesh: &TriangleMesh) -> Result<Self, String> {
        let [(start, rest, _), ..] = poses[..] else {
            return Err("no poses".to_owned());
        };
        if start != 0.0 {
            return Err(format!("the first pose is at {} s, not at 0", shown(start)));
        }
        let is_finite =
            |(t, x, q): &(f64, DVec3, DQuat)| t.is_finite() && x.is_finite() && q.is_finite();
        if let Some(k) = poses.iter().position(|pose| !is_finite(pose)) {
            return Err(format!("pose {k} has a number that is not finite"));
        }
        let unit = |(_, _, q): &(f64, DVec3, DQuat)| (q.length() - 1.0).abs() < 1e-6;
        if let Some(k) = poses.iter().position(|pose| !unit(pose)) {
            return Err(format!(
                "the quaternion of pose {k} is not a unit quaternion"
            ));
        }
        if let Some(k) = poses
            .windows(2)
            .position(|pair| pair[1].0 - pair[0].0 < APART)
        {
            let (after, before) = (poses[k + 1].0, poses[k].0);
            return Err(format!(
                "the time of pose {}, {} s, is not a microsecond after {} s",
                k + 1,
                shown(after),
                shown(before)
            ));
        }
        let away = mesh.vertices.iter().map(|x| x.distance(rest));
        Ok(Self {
            reach: away.fold(0.0, f64::max),
            poses,
            missed: None,
            other_rate: None,
        })
    }

    /// Returns the track with warnings about the file that it was read from.
    #[must_use]
    pub fn with_warnings(self, missed: Option<Missed>, other_rate: Option<String>) -> Self {
        Self {
            missed,
            other_rate,
            ..self
        }
    }

    /// Returns the pose at time `t`, seconds.
    pub fn pose(&self, t: f64) -> Pose {
        let rest = self.poses[0].1;
        let next = self.poses.partition_point(|(time, ..)| *time <= t);
        let (centre, turn) = match (next.checked_sub(1), self.poses.get(next)) {
            (None, _) => (rest, DQuat::IDENTITY),
            (Some(last), None) => (self.poses[last].1, self.poses[last].2),
            (Some(before), Some((after, there, turned))) => {
                let (time, here, turn) = self.poses[before];
                let part = (t - time) / (after - time);
                (here.lerp(*there, part), turn.slerp(*turned, part))
            }
        };
        Pose { rest, centre, turn }
    }

    /// Bounds the speed of the solid's points within `[t0, t1]`, m/s.
    pub fn peak_speed(&self, t0: f64, t1: f64) -> f64 {
        let pairs = self.poses.windows(2);
        let pairs = pairs.filter(|pair| pair[0].0 <= t1 && pair[1].0 >= t0);
        let speed = |pair: &[(f64, DVec3, DQuat)]| {
            let angle = pair[0].2.angle_between(pair[1].2);
            (pair[0].1.distance(pair[1].1) + self.reach * angle) / (pair[1].0 - pair[0].0)
        };
        pairs.map(speed).fold(0.0, f64::max)
    }

    /// Returns the positions of the reference point and the distance to the farthest vertex.
    pub fn places(&self) -> (impl Iterator<Item = DVec3> + '_, f64) {
        (self.poses.iter().map(|(_, centre, _)| *centre), self.reach)
    }

    /// Moves all poses by `way`, metres.
    pub(super) fn carry(&mut self, way: DVec3) {
        for (_, centre, _) in &mut self.poses {
            *centre += way;
        }
    }

    /// Returns rows of time, position and quaternion (x, y, z, w) in world coordinates.
    pub fn written(&self, origin: DVec3) -> Vec<[f64; 8]> {
        let row = |(t, x, q): &(f64, DVec3, DQuat)| {
            let x = *x + origin;
            [*t, x.x, x.y, x.z, q.x, q.y, q.z, q.w]
        };
        self.poses.iter().map(row).collect()
    }
}

impl Scene {
    /// Warnings for solids that a file moves only before or after the shot, or at
    /// another frame rate.
    pub(super) fn lint_tracks(&self) -> Vec<String> {
        let tracks = || self.moving_solids.iter().filter_map(|it| it.track.as_ref());
        let rates = tracks().filter_map(|track| track.other_rate.clone());
        let told = tracks().filter_map(|track| track.missed).map(|Missed { moves, shot }| {
            let ([begin, end], [from, to]) = (moves.map(shown), shot.map(shown));
            format!(
                "solid.track.start: the file moves a solid over frames {begin} to {end}, and the \
                 shot has frames {from} to {to} of it, so that the solid stands still; start = \
                 {begin} makes the first of its frames frame 1"
            )
        });
        rates.chain(told).collect()
    }
}
