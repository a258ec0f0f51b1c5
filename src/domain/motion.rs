//! Wave-maker motion, and the linear theory that says what a piston makes.
//!
//! A displacement is measured from the domain's face, positive inward, metres; it is 0 at the
//! start and never negative, so that no water is ever behind the wall.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Kλ/d of the solitary piston: how far off the crest is when it starts. At 6 the wall's speed
/// jumps by sech²(6) = 2.5e-5 of its peak, under a tenth of a millimetre a second in a metre of
/// water, which counts as rest.
const SOLITARY_LEAD: f64 = 6.0;

/// Displacement of a wave-maker over time.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// Moves from the first moment, stops dead.
    ConstantVelocity {
        /// m/s, not negative.
        velocity: f64,
        /// Seconds after which it stands; `None`: never.
        until: Option<f64>,
    },
    /// x = stroke/2 · (1 − cos 2πt/period), grown from rest by a smooth ramp.
    Sine {
        /// Distance from the innermost to the outermost position, metres.
        stroke: f64,
        /// Seconds.
        period: f64,
        /// Seconds until the full stroke; 0 starts with it (still from rest, as 1 − cos is).
        ramp: f64,
    },
    /// One solitary wave (Goring 1978).
    Solitary {
        /// Crest above still water, metres.
        height: f64,
        /// Still water, metres.
        depth: f64,
        /// m/s², positive.
        gravity: f64,
    },
    /// Through given points by a monotone cubic (Fritsch and Carlson 1980), at rest before the
    /// first and after the last; it never leaves the range of the two points around it.
    Table {
        /// (seconds, metres), times rising.
        points: Vec<[f64; 2]>,
    },
}

impl Motion {
    /// Metres inward from the domain's face at time `t`, seconds.
    pub fn displacement(&self, t: f64) -> f64 {
        self.state(t).0
    }

    /// Metres per second inward at time `t`: the derivative of [`Self::displacement`].
    pub fn velocity(&self, t: f64) -> f64 {
        self.state(t).1
    }

    /// Displacement and velocity.
    fn state(&self, t: f64) -> (f64, f64) {
        if t <= 0.0 {
            return (0.0, 0.0);
        }
        match *self {
            Self::ConstantVelocity { velocity, until } => match until {
                Some(end) if t >= end => (velocity * end, 0.0),
                _ => (velocity * t, velocity),
            },
            Self::Sine {
                stroke,
                period,
                ramp,
            } => {
                let (amount, amount_rate) = smooth_ramp(t, ramp);
                let omega = TAU / period;
                let (sin, cos) = (omega * t).sin_cos();
                let half = 0.5 * stroke;
                (
                    amount * half * (1.0 - cos),
                    half * (amount_rate * (1.0 - cos) + amount * omega * sin),
                )
            }
            Self::Solitary {
                height,
                depth,
                gravity,
            } => Goring::new(height, depth, gravity).state(t),
            Self::Table { ref points } => table_state(points, t),
        }
    }

    /// An upper bound on |velocity| within `[t0, t1]`, m/s; tight as the interval shrinks.
    pub fn peak_speed(&self, t0: f64, t1: f64) -> f64 {
        if t1 <= 0.0 {
            return 0.0;
        }
        let t0 = t0.max(0.0);
        match *self {
            Self::ConstantVelocity { velocity, until } => match until {
                Some(end) if t0 >= end => 0.0,
                _ => velocity.abs(),
            },
            Self::Sine {
                stroke,
                period,
                ramp,
            } => {
                // Interval arithmetic on half · (r'(1 − cos ωt) + r ω sin ωt).
                let omega = TAU / period;
                let (amount_low, rate_start) = smooth_ramp(t0, ramp);
                let (amount_high, rate_end) = smooth_ramp(t1, ramp);
                // The ramp's rate rises to its middle and falls again.
                let (_, rate_high) = smooth_ramp((0.5 * ramp).clamp(t0, t1), ramp);
                let rate_low = rate_start.min(rate_end);
                let (cos_low, cos_high) = cos_range(omega * t0, omega * t1);
                let (sin_low, sin_high) = cos_range(omega * t0 - FRAC_PI_2, omega * t1 - FRAC_PI_2);
                let upper = rate_high * (1.0 - cos_low)
                    + omega * (amount_high * sin_high).max(amount_low * sin_high);
                let lower = rate_low * (1.0 - cos_high)
                    + omega * (amount_high * sin_low).min(amount_low * sin_low);
                0.5 * stroke * upper.max(-lower)
            }
            Self::Solitary {
                height,
                depth,
                gravity,
            } => {
                let goring = Goring::new(height, depth, gravity);
                let peak = goring.crest_time();
                goring.state(peak.clamp(t0, t1)).1
            }
            Self::Table { ref points } => points
                .windows(2)
                .enumerate()
                .filter(|(_, pair)| pair[0][0] <= t1 && pair[1][0] >= t0)
                .map(|(i, _)| Segment::new(points, i).peak_speed())
                .fold(0.0, f64::max),
        }
    }

    /// An upper bound on the displacement within `[0, t]`, metres.
    pub fn peak_displacement(&self, t: f64) -> f64 {
        match *self {
            // These never turn back.
            Self::ConstantVelocity { .. } | Self::Solitary { .. } => self.displacement(t),
            Self::Sine {
                stroke,
                period,
                ramp,
            } => {
                if t < 0.5 * period {
                    self.displacement(t)
                } else {
                    stroke * smooth_ramp(t, ramp).0
                }
            }
            Self::Table { ref points } => points
                .iter()
                .filter(|p| p[0] <= t)
                .map(|p| p[1])
                .fold(self.displacement(t), f64::max),
        }
    }
}

/// Least and greatest cosine over `[a, b]`.
fn cos_range(a: f64, b: f64) -> (f64, f64) {
    let holds = |phase: f64| ((b - phase) / TAU).floor() >= ((a - phase) / TAU).ceil();
    let (at_a, at_b) = (a.cos(), b.cos());
    (
        if holds(PI) { -1.0 } else { at_a.min(at_b) },
        if holds(0.0) { 1.0 } else { at_a.max(at_b) },
    )
}

/// 6u⁵ − 15u⁴ + 10u³ with u = t/ramp, and its derivative: from rest to one without a jump in
/// velocity or acceleration.
fn smooth_ramp(t: f64, ramp: f64) -> (f64, f64) {
    if t >= ramp {
        return (1.0, 0.0);
    }
    let u = (t / ramp).max(0.0);
    let amount = u * u * u * (u * (6.0 * u - 15.0) + 10.0);
    let rate = 30.0 * u * u * (u - 1.0).powi(2) / ramp;
    (amount, rate)
}

/// Goring's piston: X = (H/K)[tanh χ + tanh(Kλ/d)], χ = (K/d)(ct − X − λ), K = √(3H/4d).
struct Goring {
    height: f64,
    depth: f64,
    /// K.
    wave_number: f64,
    /// c = √(g(d + H)), m/s.
    celerity: f64,
}

impl Goring {
    fn new(height: f64, depth: f64, gravity: f64) -> Self {
        Self {
            height,
            depth,
            wave_number: (0.75 * height / depth).sqrt(),
            celerity: (gravity * (depth + height)).sqrt(),
        }
    }

    fn chi(&self, t: f64, x: f64) -> f64 {
        self.wave_number / self.depth * (self.celerity * t - x) - SOLITARY_LEAD
    }

    /// Displacement by Newton's method within a bracket, and velocity
    /// X' = cH sech²χ / (d + H sech²χ), which follows by deriving the implicit equation.
    fn state(&self, t: f64) -> (f64, f64) {
        let scale = self.height / self.wave_number;
        let lead = SOLITARY_LEAD.tanh();
        let (mut low, mut high) = (0.0, scale * (1.0 + lead));
        let mut x = 0.5 * high;
        // The residual rises with X: Newton converges quadratically, bisection keeps it inside.
        for _ in 0..60 {
            let tanh = self.chi(t, x).tanh();
            let residual = x - scale * (tanh + lead);
            if residual > 0.0 {
                high = x;
            } else {
                low = x;
            }
            let slope = 1.0 + self.height / self.depth * (1.0 - tanh * tanh);
            let newton = x - residual / slope;
            let next = if newton > low && newton < high {
                newton
            } else {
                0.5 * (low + high)
            };
            let step = (next - x).abs();
            x = next;
            if step <= 1e-15 * scale {
                break;
            }
        }
        let sech_squared = self.chi(t, x).cosh().powi(-2);
        let push = self.height * sech_squared;
        (x.max(0.0), self.celerity * push / (self.depth + push))
    }

    /// When χ = 0, where the wall is fastest.
    fn crest_time(&self) -> f64 {
        let x = self.height / self.wave_number * SOLITARY_LEAD.tanh();
        (SOLITARY_LEAD * self.depth / self.wave_number + x) / self.celerity
    }
}

/// One cubic between two points of a table.
struct Segment {
    start: [f64; 2],
    /// Seconds.
    duration: f64,
    /// Metres.
    rise: f64,
    /// m/s at both ends.
    slopes: [f64; 2],
}

impl Segment {
    fn new(points: &[[f64; 2]], index: usize) -> Self {
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

    /// The velocity is a parabola: greatest at an end or at its vertex.
    fn peak_speed(&self) -> f64 {
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

/// Slope at a point: 0 at the ends and at turns, else the weighted harmonic mean of the
/// neighbouring chords, which keeps the cubic monotone (Fritsch and Butland 1984).
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

fn table_state(points: &[[f64; 2]], t: f64) -> (f64, f64) {
    let next = points.partition_point(|p| p[0] <= t);
    if next == 0 {
        return (points.first().map_or(0.0, |p| p[1]), 0.0);
    }
    if next == points.len() {
        return (points[next - 1][1], 0.0);
    }
    Segment::new(points, next - 1).state(t)
}

/// The wavenumber k in rad/m of a wave of `angular_frequency` (rad/s) on water of `depth` metres:
/// ω² = g k tanh kh.
pub fn wave_number(angular_frequency: f64, depth: f64, gravity: f64) -> f64 {
    let deep = angular_frequency.powi(2) / gravity;
    // Guo 2002, within 0.75 % at any depth; Newton takes it to round-off.
    let y = deep * depth;
    let mut kh = y * (1.0 - (-y.powf(1.25)).exp()).powf(-0.4);
    for _ in 0..20 {
        let tanh = kh.tanh();
        let residual = kh * tanh - y;
        let step = residual / (tanh + kh * (1.0 - tanh * tanh));
        kh -= step;
        if step.abs() <= 1e-15 * kh {
            break;
        }
    }
    kh / depth
}

/// Wave height over piston stroke far from the piston, in linear theory:
/// H/S = 2 (cosh 2kh − 1) / (sinh 2kh + 2kh).
pub fn piston_height_ratio(wave_number: f64, depth: f64) -> f64 {
    let twice = 2.0 * wave_number * depth;
    // Both grow as exp: in deep water the ratio is 2 and cosh overflows.
    if twice > 300.0 {
        return 2.0;
    }
    2.0 * (twice.cosh() - 1.0) / (twice.sinh() + twice)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motions() -> Vec<Motion> {
        vec![
            Motion::ConstantVelocity {
                velocity: 2.0,
                until: Some(1.5),
            },
            Motion::ConstantVelocity {
                velocity: 0.7,
                until: None,
            },
            Motion::Sine {
                stroke: 1.5,
                period: 3.0,
                ramp: 4.0,
            },
            Motion::Sine {
                stroke: 1.5,
                period: 0.8,
                ramp: 0.0,
            },
            Motion::Solitary {
                height: 0.3,
                depth: 1.0,
                gravity: 9.81,
            },
            Motion::Table {
                points: vec![[0.0, 0.0], [0.5, 0.2], [0.9, 2.0], [2.0, 2.0], [5.0, 0.5]],
            },
        ]
    }

    #[test]
    fn velocity_is_the_derivative_of_displacement() {
        // Central differences are off by step²/6 · x''' ≤ 1e-10/6 · 500 m/s³ (a ramped sine with
        // ω = 8 rad/s), and by round-off 1e-16 · 3 m / 1e-5 s.
        let step = 1e-5;
        for motion in motions() {
            for i in 0..900 {
                let t = 0.003 + 0.01 * f64::from(i);
                let difference =
                    (motion.displacement(t + step) - motion.displacement(t - step)) / (2.0 * step);
                let error = (difference - motion.velocity(t)).abs();
                assert!(error < 2e-8, "{motion:?} at {t}: {error}");
            }
        }
    }

    #[test]
    fn motions_start_from_zero_and_never_leave_the_domain() {
        for motion in motions() {
            assert_eq!(motion.displacement(0.0), 0.0, "{motion:?}");
            for i in 0..2000 {
                let t = 0.005 * f64::from(i);
                let x = motion.displacement(t);
                assert!(
                    x >= 0.0 && x <= motion.peak_displacement(t) + 1e-15,
                    "{motion:?} {t}"
                );
            }
        }
    }

    #[test]
    fn peak_speed_bounds_every_interval_and_is_tight_on_short_ones() {
        for motion in motions() {
            for i in 0..200 {
                let t0 = 0.037 * f64::from(i);
                for length in [1e-4, 0.05, 1.0] {
                    let bound = motion.peak_speed(t0, t0 + length);
                    let seen = (0..=50)
                        .map(|k| motion.velocity(t0 + length * f64::from(k) / 50.0).abs())
                        .fold(0.0, f64::max);
                    assert!(seen <= bound * (1.0 + 1e-12), "{motion:?} {t0} {length}");
                    let is_smooth = !matches!(motion, Motion::Table { .. });
                    if length < 1e-3 && is_smooth {
                        // Within 1e-4 s the velocity changes by at most x'' · 1e-4 s, 8 mm/s; a
                        // constant velocity jumps once.
                        let jumps = matches!(motion, Motion::ConstantVelocity { .. });
                        assert!(
                            jumps || bound <= seen + 8e-3,
                            "{motion:?} {t0} {bound} {seen}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn the_solitary_piston_obeys_gorings_equation_and_starts_at_rest() {
        let (height, depth, gravity) = (0.3, 1.0, 9.81);
        let motion = Motion::Solitary {
            height,
            depth,
            gravity,
        };
        let goring = Goring::new(height, depth, gravity);
        let scale = height / goring.wave_number;
        for i in 1..100 {
            let t = 0.08 * f64::from(i);
            let x = motion.displacement(t);
            let implicit = scale * (goring.chi(t, x).tanh() + SOLITARY_LEAD.tanh());
            assert!((x - implicit).abs() < 1e-14, "{t}");
        }
        assert!(motion.velocity(1e-9) < 1e-4);
        // Full stroke (H/K)(1 + tanh(Kλ/d)), and at the crest u = cH/(d + H).
        let stroke = scale * (1.0 + SOLITARY_LEAD.tanh());
        assert!((motion.displacement(60.0) - stroke).abs() < 1e-12);
        let peak = goring.celerity * height / (depth + height);
        assert!((motion.velocity(goring.crest_time()) - peak).abs() < 1e-12);
    }

    /// Goring 1978 in closed form, without the code's own quantities: the stroke √(16 H d / 3), the wall's greatest speed
    /// c H / (d + H) with c = √(g (d + H)), and the time from a quarter of the stroke to three.
    #[test]
    fn the_solitary_piston_has_gorings_stroke_celerity_and_duration() {
        let (height, depth, gravity) = (0.3, 1.0, 9.81);
        let motion = Motion::Solitary {
            height,
            depth,
            gravity,
        };
        // It starts at χ = −6, where tanh is 1 − 1.2e-5.
        let stroke = (16.0_f64 * height * depth / 3.0).sqrt();
        let end = motion.displacement(60.0);
        assert!((end / stroke - 1.0).abs() < 1e-5, "{end} {stroke}");
        let celerity = (9.81_f64 * 1.3).sqrt();
        let fastest = (0..60_000)
            .map(|i| motion.velocity(1e-4 * f64::from(i)))
            .fold(0.0, f64::max);
        // At the crest the speed is flat: half a step of 1e-4 s takes 1e-8 of it.
        let expected = celerity * 0.3 / 1.3;
        assert!((fastest / expected - 1.0).abs() < 1e-7, "{fastest}");
        assert!((motion.peak_speed(0.0, 60.0) / expected - 1.0).abs() < 1e-12);
        // Bisected: when the wall has come that far.
        let when = |x: f64| {
            let (mut low, mut high) = (0.0, 60.0);
            for _ in 0..80 {
                let middle = 0.5 * (low + high);
                if motion.displacement(middle) < x {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            low
        };
        // tanh χ goes from −½ to ½: c Δt = ΔX + 2 artanh(½) d / K, and 2 artanh(½) = ln 3, d / K = S d / 2H.
        let took = when(0.75 * stroke) - when(0.25 * stroke);
        let expected = (0.5 * stroke + 3f64.ln() * stroke * depth / (2.0 * height)) / celerity;
        assert!((took / expected - 1.0).abs() < 1e-4, "{took} {expected}");
    }

    /// A sine between its ends: all of the stroke at half a period, half at a quarter, where the wall is fastest.
    #[test]
    fn a_sine_goes_the_whole_stroke_and_its_ramp_is_the_quintic() {
        let sine = |ramp| Motion::Sine {
            stroke: 1.2,
            period: 4.0,
            ramp,
        };
        let full = sine(0.0);
        for (t, x, v) in [
            (1.0, 0.6, 0.15 * TAU),
            (2.0, 1.2, 0.0),
            (3.0, 0.6, -0.15 * TAU),
            (4.0, 0.0, 0.0),
            (10.0, 1.2, 0.0),
        ] {
            assert!((full.displacement(t) - x).abs() < 1e-14, "{t}");
            assert!((full.velocity(t) - v).abs() < 1e-14, "{t}");
        }
        // 6u⁵ − 15u⁴ + 10u³ at a quarter is 106/1024, at a half one half, at three quarters 918/1024.
        let slow = sine(8.0);
        for (t, part) in [(2.0, 106.0 / 1024.0), (4.0, 0.5), (6.0, 918.0 / 1024.0)] {
            assert!(
                (slow.displacement(t) - part * full.displacement(t)).abs() < 1e-14,
                "{t}"
            );
        }
        assert_eq!(slow.displacement(9.0), full.displacement(9.0));
    }

    #[test]
    fn a_steady_wall_goes_its_speed_times_the_time_and_stands() {
        let motion = Motion::ConstantVelocity {
            velocity: 2.0,
            until: Some(1.5),
        };
        for (t, x, v) in [
            (0.5, 1.0, 2.0),
            (1.25, 2.5, 2.0),
            (1.5, 3.0, 0.0),
            (9.0, 3.0, 0.0),
        ] {
            assert_eq!((motion.displacement(t), motion.velocity(t)), (x, v));
        }
    }

    /// Fritsch and Butland 1984: chords of 1 and ½ m/s over 1 and 2 s have the weighted harmonic mean 9/13 m/s.
    #[test]
    fn a_table_has_fritsch_and_butlands_slopes() {
        let motion = Motion::Table {
            points: vec![[0.0, 0.0], [1.0, 1.0], [3.0, 2.0]],
        };
        assert!((motion.velocity(1.0) - 9.0 / 13.0).abs() < 1e-15);
        assert!((motion.velocity(1.0 - 1e-9) - 9.0 / 13.0).abs() < 1e-8);
        assert_eq!((motion.velocity(0.0), motion.velocity(3.0)), (0.0, 0.0));
        // Half-way a cubic of slopes 0 and m has come to ½ − m/8.
        let half = 0.5 - 9.0 / 13.0 / 8.0;
        assert!((motion.displacement(0.5) - half).abs() < 1e-15);
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

    #[test]
    fn linear_theory_has_its_shallow_and_deep_limits() {
        let gravity = 9.81;
        for (period, depth) in [(2.0, 1.0), (30.0, 0.5), (0.5, 10.0), (3.0, 1.0)] {
            let omega = TAU / period;
            let k = wave_number(omega, depth, gravity);
            let back = (gravity * k * (k * depth).tanh()).sqrt();
            assert!((back - omega).abs() < 1e-12 * omega, "{period} {depth}");
        }
        // Shallow: H/S → kh. Deep: → 2.
        assert!((piston_height_ratio(1e-3, 1.0) - 1e-3).abs() < 1e-8);
        assert!((piston_height_ratio(40.0, 1.0) - 2.0).abs() < 1e-12);
        assert_eq!(piston_height_ratio(1e6, 1.0), 2.0);
    }
}
