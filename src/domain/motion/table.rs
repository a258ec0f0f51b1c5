//! Motion through given points: a monotone cubic (Fritsch and Carlson 1980).

/// The cubic between two points of a table.
pub(super) struct Segment {
    start: [f64; 2],
    /// Duration, seconds.
    duration: f64,
    /// Change of the displacement, metres.
    rise: f64,
    /// Velocities at both ends, m/s.
    slopes: [f64; 2],
}

impl Segment {
    pub(super) fn new(points: &[[f64; 2]], index: usize) -> Self {
        let [a, b] = [points[index], points[index + 1]];
        Self {
            start: a,
            duration: b[0] - a[0],
            rise: b[1] - a[1],
            slopes: [slope(points, index), slope(points, index + 1)],
        }
    }

    fn state(&self, t: f64) -> (f64, f64) {
        let u = (t - self.start[0]) / self.duration;
        let [m0, m1] = self.slopes;
        let bend = m0 + m1 - 2.0 * self.rise / self.duration;
        let lift = 3.0 * self.rise / self.duration - 2.0 * m0 - m1;
        let x = self.start[1] + self.duration * u * (m0 + u * (lift + u * bend));
        (x, m0 + u * (2.0 * lift + 3.0 * u * bend))
    }

    /// The velocity is a parabola: its maximum is at an end or at the vertex.
    pub(super) fn peak_speed(&self) -> f64 {
        let [m0, m1] = self.slopes;
        let bend = m0 + m1 - 2.0 * self.rise / self.duration;
        let lift = 3.0 * self.rise / self.duration - 2.0 * m0 - m1;
        let vertex = -lift / (3.0 * bend);
        let at_vertex = if vertex > 0.0 && vertex < 1.0 {
            self.state(self.start[0] + vertex * self.duration).1.abs()
        } else {
            0.0
        };
        m0.abs().max(m1.abs()).max(at_vertex)
    }
}

/// Slope at a point: 0 at the ends and at turning points, otherwise the weighted harmonic mean of
/// the neighbouring chords, which keeps the cubic monotone (Fritsch and Butland 1984).
fn slope(points: &[[f64; 2]], index: usize) -> f64 {
    if index == 0 || index + 1 == points.len() {
        return 0.0;
    }
    let [a, b, c] = [points[index - 1], points[index], points[index + 1]];
    let (before, after) = (b[0] - a[0], c[0] - b[0]);
    let (chord_before, chord_after) = ((b[1] - a[1]) / before, (c[1] - b[1]) / after);
    if chord_before * chord_after <= 0.0 {
        return 0.0;
    }
    let (w_before, w_after) = (2.0 * after + before, after + 2.0 * before);
    (w_before + w_after) / (w_before / chord_before + w_after / chord_after)
}

/// Ratio of the final deceleration to the largest acceleration elsewhere in a table above which the
/// end counts as abrupt.
const STOP: f64 = 2.0;

/// Smallest significant ratio of the final velocity to the change of velocity over the last two
/// chords: points that are too far apart do not determine it.
const COARSE: f64 = 1.2;

/// Returns the velocity with which a motion through `points` ends, in their unit per second, if it
/// does not come to rest there. That is the case if the velocity extrapolated from the last three
/// points exceeds a tenth of the fastest chord, and the last segment decelerates more than twice as
/// hard as any other but the first accelerates or decelerates. `None` for two points, which are
/// joined from rest to rest.
pub fn abrupt_end(points: &[[f64; 2]]) -> Option<f64> {
    let [.., before, last] = points else {
        return None;
    };
    let chords: Vec<[f64; 2]> = points
        .windows(2)
        .map(|pair| [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]])
        .collect();
    let speeds: Vec<f64> = chords.iter().map(|[time, way]| way / time).collect();
    let [.., previous, ended] = speeds[..] else {
        return None;
    };
    let [time_before, time] = [chords[chords.len() - 2][0], last[0] - before[0]];
    // Extrapolates from the middles of the last two chords to the end.
    let bend = (ended - previous) * time / (time_before + time);
    let leads_to = ended + bend;
    let fastest = speeds.iter().map(|speed| speed.abs()).fold(0.0, f64::max);
    if leads_to * ended <= 0.0 || leads_to.abs() <= (COARSE * bend.abs()).max(0.1 * fastest) {
        return None;
    }
    let slopes: Vec<f64> = (0..points.len())
        .map(|index| slope(points, index))
        .collect();
    let harder = |index: usize| (slopes[index + 1] - slopes[index]).abs() / chords[index][0];
    let end = chords.len() - 1;
    let elsewhere = (1..end).map(harder).fold(0.0, f64::max);
    (harder(end) > STOP * elsewhere).then_some(leads_to)
}

/// Displacement and velocity: at rest before the first point and after the last.
pub(super) fn state(points: &[[f64; 2]], t: f64) -> (f64, f64) {
    let next = points.partition_point(|p| p[0] <= t);
    if next == 0 {
        return (points.first().map_or(0.0, |p| p[1]), 0.0);
    }
    if next == points.len() {
        return (points[next - 1][1], 0.0);
    }
    Segment::new(points, next - 1).state(t)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::{super::Motion, abrupt_end};

    /// Fritsch and Butland 1984: chords of 1 and ½ m/s over 1 and 2 s have the weighted harmonic
    /// mean 9/13 m/s.
    #[test]
    fn a_table_has_fritsch_and_butlands_slopes() {
        let motion = Motion::Table {
            points: vec![[0.0, 0.0], [1.0, 1.0], [3.0, 2.0]],
        };
        assert!((motion.velocity(1.0) - 9.0 / 13.0).abs() < 1e-15);
        assert!((motion.velocity(1.0 - 1e-9) - 9.0 / 13.0).abs() < 1e-8);
        assert_eq!((motion.velocity(0.0), motion.velocity(3.0)), (0.0, 0.0));
        // Half-way, a cubic with slopes 0 and m is at ½ − m/8.
        let half = 0.5 - 9.0 / 13.0 / 8.0;
        assert!((motion.displacement(0.5) - half).abs() < 1e-15);
    }

    /// Samples of known motions: one that comes to rest has no abrupt end, however coarse; one that
    /// is cut off has.
    #[test]
    fn a_motion_that_is_cut_off_is_told_from_one_that_comes_to_rest() {
        let sampled = |count: u32, end: f64, x: &dyn Fn(f64) -> f64| -> Vec<[f64; 2]> {
            let time = |k: u32| end * f64::from(k) / f64::from(count);
            (0..=count).map(|k| [time(k), x(time(k))]).collect()
        };
        // Half a period takes π s, and the largest velocity is 0.5 m/s.
        let cosine = |t: f64| 0.5 * (1.0 - t.cos());
        for halves in 1..4u32 {
            for count in [3, 4, 5, 8, 20, 200] {
                let points = sampled(halves * count, f64::from(halves) * PI, &cosine);
                assert_eq!(abrupt_end(&points), None, "{halves}, {count}");
            }
        }
        for count in [40, 200] {
            for end in [0.3 * TAU, 0.7 * TAU, 1.25 * TAU] {
                let found = abrupt_end(&sampled(count, end, &cosine));
                let error = (found.unwrap_or(0.0) - 0.5 * end.sin()).abs();
                // The slope of a parabola through three points is off by dt² / 3 of the third
                // derivative at their end, which is at most a half; a tenth of that is allowed for
                // higher orders.
                let bound = 1.1 * (end / f64::from(count)).powi(2) / 6.0;
                assert!(error < bound, "{count}, {end}: {found:?}");
            }
        }
        // A steady motion, and one that ends moving back; two points are joined from rest to rest.
        assert_eq!(abrupt_end(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]), Some(1.0));
        assert_eq!(abrupt_end(&[[0.0, 0.0], [1.0, 1.0], [2.0, 1.0]]), None);
        assert_eq!(abrupt_end(&[[0.0, 0.0], [1.0, 1.0]]), None);
    }

    #[test]
    fn a_table_passes_its_points_without_overshoot() {
        let points = vec![[0.0, 0.0], [0.5, 0.2], [0.9, 2.0], [2.0, 2.0], [5.0, 0.5]];
        let motion = Motion::Table {
            points: points.clone(),
        };
        for [t, x] in &points {
            assert!((motion.displacement(*t) - x).abs() < 1e-15);
        }
        for i in 0..400 {
            assert!(motion.displacement(0.02 * f64::from(i)) <= 2.0);
        }
        assert_eq!(motion.displacement(9.0), 0.5);
        assert_eq!(motion.velocity(9.0), 0.0);
    }
}
