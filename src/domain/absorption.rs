//! Active absorption: a wave maker that also absorbs the waves that reach it (Milgram 1970;
//! reviewed by Schäffer and Klopman 2000).

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::{
    absorber::AbsorberState,
    bounds::Bounds,
    motion::{Motion, piston_elevation},
    particles::Particles,
    probe::{self, SUPPORT},
};

/// Memory of a wall, in periods: the time constant with which it forgets the mean water level
/// beside it and its displacement from its prescribed path. Slower changes are not absorbed. At the
/// period itself each of the two costs 1/(2π · 8) = 2 % of the response, a quarter of a period out
/// of phase.
const MEMORY: f64 = 8.0;

/// Largest level that counts, as a fraction of the depth: a splash up the wall is not a wave.
const HIGHEST: f64 = 0.5;

/// Largest number of columns of water that a level is averaged over.
const COLUMNS: f64 = 32.0;

/// Largest allowed product of `gain` and the seconds between two updates. A moving wall raises the
/// water beside it at about its own speed (the local, evanescent waves), and the next update takes
/// that for an incoming wave: at a product of 1 the motion grows.
pub const MOST_GAIN: f64 = 0.5;

/// What a wall is asked to absorb.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AbsorberParameters {
    /// Distance of the wall from the domain's face at the start, and the farthest it may leave its
    /// prescribed path, metres.
    pub room: f64,
    /// Depth of the water at rest, metres.
    pub depth: f64,
    /// Period of the waves that the wall absorbs best, seconds.
    pub period: f64,
    /// Acceleration of gravity, m/s².
    pub gravity: f64,
}

/// Absorption law of a wall: its inward velocity is −`gain` times the level beside it, delayed by
/// `lag`.
#[derive(Clone, Debug, PartialEq)]
pub struct Absorption {
    asked: AbsorberParameters,
    /// Wall velocity per level, 1/s.
    gain: f64,
    /// Delay of the response, seconds.
    lag: f64,
}

impl Absorption {
    /// Derives gain and lag from the linear theory of a piston at the requested period.
    ///
    /// A still wall reflects an incoming wave of amplitude a, so that the level at the wall is 2a.
    /// A wall velocity U radiates a wave of amplitude c₀ U/ω and raises the water at the wall by
    /// (c₀ − i Σcⱼ) U/ω ([`piston_elevation`]). Nothing is reflected where U = −a ω/c₀. The level
    /// is then η = a (1 + i Σcⱼ/c₀), so that U = −ω/(c₀ + i Σcⱼ) η: the modulus is the gain, the
    /// phase the lag.
    pub fn new(asked: AbsorberParameters) -> Self {
        let frequency = TAU / asked.period;
        let [progressive, local] = piston_elevation(frequency, asked.depth, asked.gravity);
        Self {
            asked,
            gain: frequency / progressive.hypot(local),
            lag: local.atan2(progressive) / frequency,
        }
    }

    /// Returns the request that this law was derived from.
    pub fn asked(&self) -> &AbsorberParameters {
        &self.asked
    }

    /// Returns the wall's velocity per level that it responds to, 1/s.
    pub fn gain(&self) -> f64 {
        self.gain
    }

    /// Level beside the wall due to the waves that the wall itself makes, metres, by linear theory
    /// at the requested period: (c₀ − i Σcⱼ) U/ω.
    fn own_level(&self, motion: &Motion, t: f64) -> f64 {
        motion.velocity(t - self.lag) / self.gain
    }

    /// Computes the absorber state for `seconds` from time `now` on. `level` is the water level
    /// beside the wall, metres above still water; `None` if there is no water.
    ///
    /// The velocity changes linearly over `seconds` to the one that the predicted level asks for;
    /// the prediction extrapolates the last two levels linearly. The displacement stays within the
    /// wall's `room`.
    pub fn next_state(
        &self,
        motion: &Motion,
        before: Option<&AbsorberState>,
        (now, seconds): (f64, f64),
        level: Option<f64>,
    ) -> AbsorberState {
        let over = level.map(|level| {
            let most = HIGHEST * self.asked.depth;
            (level - self.own_level(motion, now)).clamp(-most, most)
        });
        let Some(before) = before else {
            return AbsorberState {
                start: now,
                displacement: 0.0,
                velocity: 0.0,
                acceleration: 0.0,
                level: over,
                mean: over.unwrap_or_default(),
            };
        };
        let AbsorberParameters { period, room, .. } = self.asked;
        let memory = MEMORY * period;
        let (mean, foreseen) = match (before.level, over) {
            (Some(last), Some(level)) => {
                let mean = before.mean - (level - before.mean) * (-seconds / memory).exp_m1();
                let rate = (level - last) / seconds;
                (mean, level - mean + (seconds - self.lag) * rate)
            }
            // The first water to arrive is the mean that later waves are measured from.
            (None, Some(level)) => (level, 0.0),
            (_, None) => (before.mean, 0.0),
        };
        let (displacement, velocity) = before.state(now);
        let wanted = -self.gain * foreseen - displacement / memory;
        // Displacement after slowing down again over as many seconds.
        let coming = displacement + 0.5 * velocity * seconds;
        let wanted = wanted.clamp((-room - coming) / seconds, (room - coming) / seconds);
        AbsorberState {
            start: now,
            displacement,
            velocity,
            acceleration: (wanted - velocity) / seconds,
            level: over,
            mean,
        }
    }
}

/// Returns the mean water level along a wall, half a particle spacing off it, in metres above the
/// world's y = 0; `None` if there is no water there.
///
/// `walls` are the box's faces in the frame of the particles. `axis` (x or z) and `is_max` select
/// the face that is the wall.
pub fn level_along(
    particles: &Particles,
    spacing: f64,
    walls: &Bounds,
    (axis, is_max): (usize, bool),
) -> Option<f64> {
    let along = 2 - axis;
    let (face, inward) = match is_max {
        true => (walls.max[axis], -1.0),
        false => (walls.min[axis], 1.0),
    };
    let at = face + inward * 0.5 * spacing;
    let reach = (SUPPORT + 1.0) * spacing;
    let is_near = |x: &&[f32; 3]| (f64::from(x[axis]) - at).abs() < reach;
    let near = Particles {
        position: particles.position.iter().filter(is_near).copied().collect(),
        ..Particles::default()
    };
    let size = walls.max[along] - walls.min[along];
    let count = (size / (2.0 * spacing)).floor().clamp(1.0, COLUMNS);
    let columns = (0..count as u32).map(|k| {
        let mut place = DVec3::ZERO;
        place[axis] = at;
        place[along] = walls.min[along] + size * (f64::from(k) + 0.5) / count;
        probe::elevation(&near, spacing, walls, DVec2::new(place.x, place.z))
    });
    let wet: Vec<f64> = columns.flatten().collect();
    (!wet.is_empty()).then(|| wet.iter().sum::<f64>() / wet.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::super::motion::wave_number;
    use super::*;

    const DEPTH: f64 = 1.0;
    const GRAVITY: f64 = 9.81;
    const SECONDS: f64 = 1.0 / 48.0;

    fn asked(period: f64) -> AbsorberParameters {
        AbsorberParameters {
            room: 10.0,
            depth: DEPTH,
            period,
            gravity: GRAVITY,
        }
    }

    fn absorption(period: f64) -> Absorption {
        Absorption::new(asked(period))
    }

    /// Period, seconds, of waves with this kh.
    fn period(kh: f64) -> f64 {
        TAU / (GRAVITY / DEPTH * kh * kh.tanh()).sqrt()
    }

    /// Inward wall velocity in response to a level of cos ωt: its cosine and sine components,
    /// averaged over the last of many periods.
    fn response(wall: &Absorption, period: f64) -> [f64; 2] {
        let frequency = TAU / period;
        let (settled, measured) = ((40.0 * wall.asked.period / SECONDS) as u32, 20_000);
        let mut before = None;
        let (mut with_cos, mut with_sin) = (0.0, 0.0);
        for k in 0..settled + measured {
            let now = f64::from(k) * SECONDS;
            // The wave ramps up from rest, as water does.
            let level = 1e-3 * (frequency * now).cos() * (now / wall.asked.period).min(1.0);
            let answer =
                wall.next_state(&Motion::Still, before.as_ref(), (now, SECONDS), Some(level));
            for part in 0..8 {
                let t = now + SECONDS * (f64::from(part) + 0.5) / 8.0;
                if k >= settled {
                    let (_, velocity) = answer.state(t);
                    with_cos += velocity * (frequency * t).cos();
                    with_sin += velocity * (frequency * t).sin();
                }
            }
            before = Some(answer);
        }
        [with_cos, with_sin].map(|sum| sum * 2.0 / (8.0 * f64::from(measured)) / 1e-3)
    }

    /// Reflected amplitude of waves with this kh, by linear theory, from the wall's response to a
    /// level. In complex amplitudes of e^iωt: the wall's velocity is U = −F η, the level
    /// η = 2a + Z U with Z = (c₀ − i Σcⱼ)/ω, and a + c₀ U/ω is reflected.
    fn reflection(wall: &Absorption, kh: f64) -> f64 {
        let frequency = TAU / period(kh);
        let [progressive, local] = piston_elevation(frequency, DEPTH, GRAVITY);
        // V cos ωt + W sin ωt is the real part of (V − iW) e^iωt.
        let [with_cos, with_sin] = response(wall, period(kh));
        let f = [-with_cos, with_sin];
        let [zr, zi] = [progressive / frequency, -local / frequency];
        // 1 + F Z.
        let below = [1.0 + f[0] * zr - f[1] * zi, f[0] * zi + f[1] * zr];
        let size = below[0].powi(2) + below[1].powi(2);
        let ratio = [
            (f[0] * below[0] + f[1] * below[1]) / size,
            (f[1] * below[0] - f[0] * below[1]) / size,
        ];
        let scale = 2.0 * progressive / frequency;
        (1.0 - scale * ratio[0]).hypot(scale * ratio[1])
    }

    #[test]
    fn waves_of_its_period_are_taken_in_and_others_for_the_most_part() {
        for (kh, most) in [(0.5, 0.03), (1.0, 0.03), (2.0, 0.03), (3.0, 0.04)] {
            let found = reflection(&absorption(period(kh)), kh);
            assert!(found < most, "{kh}: {found}");
        }
        let wall = absorption(period(1.0));
        for (kh, most) in [(0.5, 0.06), (0.7, 0.04), (1.5, 0.08), (2.0, 0.13)] {
            let found = reflection(&wall, kh);
            assert!(found < most, "{kh}: {found}");
        }
        // Negative control: half of the gain, from a depth four times that of the water.
        let other = Absorption::new(AbsorberParameters {
            depth: 4.0 * DEPTH,
            ..asked(period(0.5))
        });
        let found = reflection(&other, 0.5);
        assert!(found > 0.15, "{found}");
    }

    /// A wall does not respond to the level of the waves that it makes itself: by linear theory,
    /// (c₀ − i Σcⱼ) times its motion.
    #[test]
    fn its_own_waves_are_none_that_come_to_it() {
        let period = period(1.5);
        let wall = absorption(period);
        let motion = Motion::Sine {
            stroke: 0.02,
            period,
            ramp: 0.0,
        };
        let frequency = TAU / period;
        let [progressive, local] = piston_elevation(frequency, DEPTH, GRAVITY);
        let furthest = |scale: f64| {
            let (mut before, mut furthest) = (None, 0.0f64);
            for k in 0..2000 {
                // After the ramp.
                let now = 10.0 * period + f64::from(k) * SECONDS;
                // One part is in phase with the velocity, the other with the displacement from
                // the mean.
                let way = motion.displacement(now) - 0.01;
                let level = progressive * motion.velocity(now) / frequency + local * way;
                let level = Some(scale * level);
                let answer = wall.next_state(&motion, before.as_ref(), (now, SECONDS), level);
                furthest = furthest.max(answer.displacement.abs());
                before = Some(answer);
            }
            furthest
        };
        // The stroke is 20 mm.
        assert!(furthest(1.0) < 1e-12, "{}", furthest(1.0));
        assert!(furthest(1.3) > 1e-3, "{}", furthest(1.3));
    }

    #[test]
    fn it_goes_on_without_a_jump_and_keeps_to_its_room() {
        let wall = Absorption::new(AbsorberParameters {
            room: 0.05,
            ..asked(2.0)
        });
        let mut before: Option<AbsorberState> = None;
        let mut farthest = 0.0f64;
        for k in 0..3000 {
            let now = f64::from(k) * SECONDS;
            let level = (k > 10).then(|| 0.3 * (TAU * now / 2.0).sin());
            let answer = wall.next_state(&Motion::Still, before.as_ref(), (now, SECONDS), level);
            if let Some(before) = before {
                let (x, v) = before.state(now);
                assert!((x - answer.displacement).abs() < 1e-15);
                assert!((v - answer.velocity).abs() < 1e-12);
            }
            for part in 0..5 {
                let (x, v) = answer.state(now + SECONDS * f64::from(part) / 4.0);
                farthest = farthest.max(x.abs());
                assert!(v.abs() <= answer.peak_speed(now, now + SECONDS) + 1e-12);
            }
            before = Some(answer);
        }
        // The wall reaches the limit of its displacement; without the limit it would move 0.4 m.
        assert!((0.049..0.0501).contains(&farthest), "{farthest}");
    }

    /// A wall on dry ground is at rest: the first water to arrive is not a trough below a still
    /// level that never was.
    #[test]
    fn the_first_water_at_a_dry_wall_is_no_wave() {
        let wall = absorption(2.0);
        let run = |wet: f64, wave: f64| {
            let (mut before, mut fastest) = (None, 0.0f64);
            for k in 0..200 {
                let now = f64::from(k) * SECONDS;
                let level = (k >= 100).then_some(wet + if k >= 150 { wave } else { 0.0 });
                let answer =
                    wall.next_state(&Motion::Still, before.as_ref(), (now, SECONDS), level);
                fastest = fastest.max(answer.state(now + SECONDS).1.abs());
                before = Some(answer);
            }
            fastest
        };
        assert_eq!(run(-0.4, 0.0), 0.0);
        assert!(run(-0.4, 0.1) > 0.1);
    }

    /// Still water above or below the nominal level is not a wave.
    #[test]
    fn it_stands_where_the_water_does() {
        let wall = absorption(2.0);
        let run = |level: &dyn Fn(f64) -> f64| {
            let mut before: Option<AbsorberState> = None;
            for k in 0..4000 {
                let now = f64::from(k) * SECONDS;
                let level = Some(level(now));
                before =
                    Some(wall.next_state(&Motion::Still, before.as_ref(), (now, SECONDS), level));
            }
            before.unwrap().displacement.abs()
        };
        assert!(run(&|_| 0.01) == 0.0);
        // The wall forgets a step in the level: after as many memories, e^-5.2 of
        // 0.01 m × gain × memory is left.
        let at_once = 0.01 * wall.gain * MEMORY * wall.asked.period;
        let left = run(&|t| if t < 1.0 { 0.0 } else { 0.01 });
        assert!(left < 0.1 * at_once, "{left} of {at_once}");
        assert!(left > 0.0);
    }

    /// The level along a wall that has moved inward is the top of the block beside it, whatever the
    /// water does elsewhere.
    #[test]
    fn a_level_is_that_of_the_water_beside_the_wall() {
        let spacing = 0.1;
        let at = |i: u32| 0.1 * (f64::from(i) + 0.5);
        let mut water = Particles::default();
        for (i, j, k) in
            (0..20).flat_map(|i| (0..20).flat_map(move |j| (0..12).map(move |k| (i, j, k))))
        {
            // Twelve layers up to x = 1, sixteen beyond.
            if i >= 3 && j < if i < 10 { 12 } else { 16 } {
                let p = DVec3::new(at(i), at(j), at(k));
                water.position.push(p.as_vec3().to_array());
            }
        }
        let walls = Bounds {
            min: DVec3::new(0.3, 0.0, 0.0),
            max: DVec3::new(2.0, 3.0, 1.2),
        };
        let level = |axis, is_max| level_along(&water, spacing, &walls, (axis, is_max));
        assert!((level(0, false).unwrap() - 1.2).abs() < 0.01);
        assert!((level(0, true).unwrap() - 1.6).abs() < 0.01);
        let across = level(2, false).unwrap();
        assert!((1.3..1.5).contains(&across), "{across}");
        let dry = Bounds {
            max: DVec3::new(4.0, 3.0, 1.2),
            ..walls
        };
        assert_eq!(level_along(&water, spacing, &dry, (0, true)), None);
    }

    /// By hand for kh = 1: kⱼh = 2.883 and 6.158, cⱼ = 0.0497 and 0.0050, and c₀ = 0.982.
    #[test]
    fn the_gain_is_that_of_linear_theory() {
        let period = period(1.0);
        let k = wave_number(TAU / period, DEPTH, GRAVITY);
        assert!((k - 1.0).abs() < 1e-12);
        let [progressive, local] = piston_elevation(TAU / period, DEPTH, GRAVITY);
        assert!(
            (progressive - 0.982).abs() < 1e-3 && (0.054..0.062).contains(&local),
            "{local}"
        );
        // In shallow water the gain is √(g/h), without lag.
        let Absorption { gain, lag, .. } = absorption(60.0);
        assert!(
            (gain / (GRAVITY / DEPTH).sqrt() - 1.0).abs() < 1e-2,
            "{gain}"
        );
        assert!(lag < 0.01, "{lag}");
    }
}
