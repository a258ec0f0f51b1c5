//! Warnings for tables that move nothing or stop abruptly, walls that pass through solids, and
//! strokes whose waves break.

use glam::DVec3;

use super::{
    super::{
        Scene, Shot, WaveMaker, forces::MovingFrame, waves::HIGHEST, waves::STEEPEST, words::shown,
    },
    Still,
};
use swell_domain::{
    bounds::Bounds,
    motion::{Motion, abrupt_end, piston_height_ratio},
};

/// Times closer than this are the same, seconds.
const APART: f64 = 1e-6;

/// Least number of points of a table whose whole numbers may be frames.
const LEAST_FRAMES: usize = 4;

impl Scene {
    /// Checks the motion tables of walls and solids.
    pub(super) fn lint_motions(&self, lints: &mut Vec<String>) {
        for (k, maker) in self.wave_makers.iter().enumerate() {
            let key = format!("wave_maker[{k}].motion");
            lints.extend(lint_table(&key, "m/s", &maker.motion, &self.shot));
        }
        if let Some(motion) = self.frame.as_ref().map(MovingFrame::motion) {
            let slide = motion
                .slide
                .iter()
                .map(|(_, slide)| ("motion", "m/s", slide));
            let turn = motion.turn.iter();
            let turn = turn.map(|turn| ("turn", "degrees a second", &turn.motion));
            for (key, unit, motion) in slide.chain(turn) {
                lints.extend(lint_table(
                    &format!("domain.{key}"),
                    unit,
                    motion,
                    &self.shot,
                ));
            }
        }
        for solid in &self.moving_solids {
            let name = solid.name();
            if let Some(slide) = &solid.slide {
                let key = format!("solid.motion of {name}");
                lints.extend(lint_table(&key, "m/s", &slide.motion, &self.shot));
            }
            if let Some(turn) = &solid.turn {
                let key = format!("solid.turn of {name}");
                lints.extend(lint_table(
                    &key,
                    "degrees a second",
                    &turn.motion,
                    &self.shot,
                ));
            }
        }
    }

    /// Warns about a wall that moves into static solids. Solids that extend behind its rest
    /// position, such as a floor, are ignored: the wall slides over them.
    pub(super) fn lint_way(&self, index: usize, maker: &WaveMaker, lints: &mut Vec<String>) {
        let wall = maker.wall;
        let spacing = self.particle_spacing();
        let farthest = maker.farthest(self.shot.duration());
        let (from, to) = (maker.room() + 0.5 * spacing, farthest);
        let (mut way, mut inward) = (self.domain, DVec3::ZERO);
        if wall.is_max {
            let face = self.domain.max[wall.axis];
            (way.min[wall.axis], way.max[wall.axis]) = (face - to, face - from);
            inward[wall.axis] = -1.0;
        } else {
            let face = self.domain.min[wall.axis];
            (way.min[wall.axis], way.max[wall.axis]) = (face + from, face + to);
            inward[wall.axis] = 1.0;
        }
        if from >= to {
            return;
        }
        for solid in &self.solids {
            let mesh = &solid.mesh;
            let outward = mesh.signed_volume().signum();
            let faces = (0..mesh.triangles.len())
                .filter(|&index| outward * mesh.area_vector(index).dot(inward) < 0.0);
            let met = faces.flat_map(|index| within(mesh.corners(index), &way));
            let Some(met) = Bounds::of_points(met) else {
                continue;
            };
            let mut across = met.size();
            across[wall.axis] = f64::INFINITY;
            if across.min_element() < spacing {
                continue;
            }
            let first = match wall.is_max {
                true => self.domain.max[wall.axis] - met.max[wall.axis],
                false => met.min[wall.axis] - self.domain.min[wall.axis],
            };
            lints.push(format!(
                "wave_maker[{index}].motion: the wall moves {} m inward, and from {} m on through \
                 the solid {}, which does not move",
                shown(farthest),
                shown((first * 1e3).round() / 1e3),
                solid.name()
            ));
        }
    }

    /// Warns about a sine whose waves exceed the breaking limit that `stokes` enforces.
    pub(super) fn lint_sine(
        &self,
        index: usize,
        maker: &WaveMaker,
        still: Option<Still>,
    ) -> Option<String> {
        let Motion::Sine { stroke, period, .. } = maker.motion else {
            return None;
        };
        let depth = still?.depth;
        let length = self.wave_length(period, depth);
        let number = std::f64::consts::TAU / length;
        let height = stroke * piston_height_ratio(number, depth);
        let steepest = STEEPEST * length * (number * depth).tanh();
        let (most, whose) = match HIGHEST * depth < steepest {
            true => (HIGHEST * depth, "McCowan 1894"),
            false => (steepest, "Miche 1944"),
        };
        (height > most).then(|| {
            format!(
                "wave_maker[{index}].motion: by linear theory a stroke of {} m makes \
                 waves {height:.3} m high; waves of {} s on {} m of water break from \
                 {most:.3} m on ({whose})",
                shown(stroke),
                shown(period),
                shown(depth)
            )
        })
    }
}

/// Warns about a table that has no effect within the shot, seems to be timed in frames, or
/// ends in mid-motion.
fn lint_table(key: &str, unit: &str, motion: &Motion, shot: &Shot) -> Option<String> {
    let Motion::Table { points } = motion else {
        return None;
    };
    let (duration, rate) = (shot.duration(), shot.frames_per_second);
    let mut moves = points.windows(2).filter(|pair| pair[0][1] != pair[1][1]);
    let Some(first) = moves.next() else {
        return Some(format!(
            "{key}: all points of its table are at {}, so that nothing moves",
            shown(points[0][1])
        ));
    };
    let [begins, ends] = [first[0][0], points[points.len() - 1][0]];
    let are_whole = points.iter().all(|[t, _]| t.fract() == 0.0);
    let in_frames = format!(
        "its times are seconds, and frame {} is at {} s",
        shown(ends),
        shown(ends / rate)
    );
    if begins > duration - APART {
        let remedy = match are_whole && points.len() >= LEAST_FRAMES {
            true => format!("; {in_frames}"),
            false => String::new(),
        };
        return Some(format!(
            "{key}: its table moves nothing before {} s, and the shot ends after {} s{remedy}",
            shown(begins),
            shown(duration)
        ));
    }
    let late = points.iter().filter(|[t, _]| *t > duration).count();
    let fits = ends <= f64::from(shot.frames) + 1.0;
    if are_whole && fits && points.len() >= LEAST_FRAMES && 2 * late > points.len() {
        return Some(format!(
            "{key}: {late} of {} points of its table, all at whole numbers, lie after the \
             shot's {} s; {in_frames}",
            points.len(),
            shown(duration)
        ));
    }
    let speed = abrupt_end(points)?;
    (ends < duration - shot.frame_seconds()).then(|| {
        format!(
            "{key}: its table ends in mid-motion: up to its last point, at {} s, it moves at {} \
             {unit}, and stops there within {} s",
            shown(ends),
            shown((speed * 1e3).round() / 1e3),
            shown(ends - points[points.len() - 2][0])
        )
    })
}

/// Returns the corners of a triangle clipped to a box (Sutherland and Hodgman 1974).
fn within(corners: [DVec3; 3], bounds: &Bounds) -> Vec<DVec3> {
    let mut polygon = corners.to_vec();
    for axis in 0..3 {
        for (side, limit) in [(1.0, bounds.min[axis]), (-1.0, bounds.max[axis])] {
            let off = |p: DVec3| side * (p[axis] - limit);
            let before = polygon.clone();
            polygon.clear();
            let follows = before.iter().cycle().skip(1);
            for (&a, &b) in before.iter().zip(follows) {
                let (of_a, of_b) = (off(a), off(b));
                if of_a >= 0.0 {
                    polygon.push(a);
                }
                if (of_a < 0.0) != (of_b < 0.0) {
                    polygon.push(a.lerp(b, of_a / (of_a - of_b)));
                }
            }
        }
    }
    polygon
}
