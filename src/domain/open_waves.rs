//! Waves on open water: water velocity and surface elevation from wave theory, without a
//! wave maker.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::{
    motion::{RegularWaves, Spectrum, smooth_ramp, wave_number},
    sampling::uniform,
};

/// Number of waves in a sea. They have equal energies, so that their frequencies have no common
/// divisor and the sea does not repeat.
pub const LINES: u32 = 64;

/// Integration step over a spectrum, relative to the peak's frequency.
const STEP: f64 = 1e-3;

/// Frequency of the longest waves relative to the peak; below it a spectrum has 2e-9 of its energy.
const LEAST_RATIO: f64 = 0.5;

/// Parameters of a sea on open water.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenSea {
    /// Distribution of energy over frequencies.
    pub spectrum: Spectrum,
    /// Phases of the waves.
    pub meeting: Meeting,
    /// Peak period, seconds.
    pub peak_period: f64,
    /// Peak enhancement factor γ of JONSWAP and TMA.
    pub peak_enhancement: f64,
    /// Period of the shortest waves, seconds.
    pub shortest_period: f64,
    /// Depth of still water, metres.
    pub depth: f64,
    /// Acceleration of gravity, m/s², positive.
    pub gravity: f64,
    /// Time until the full height, seconds.
    pub ramp: f64,
    /// Exponent s of the directional spreading (cos ½(θ − θ₀))^2s (Longuet-Higgins, Cartwright and
    /// Smith 1963); `None` for long-crested waves in a single direction.
    pub spreading: Option<f64>,
}

/// How the phases of a spectrum's waves are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Meeting {
    /// A sea with random phases.
    Random {
        /// Four times the standard deviation of the elevation, metres.
        significant_height: f64,
        /// Different seeds give different seas of the same spectrum.
        seed: u32,
    },
    /// One packet whose crests meet: the most probable shape of a sea around a high crest
    /// (Lindgren 1970; Tromans et al. 1991), in which each wave contributes to the crest in
    /// proportion to its energy.
    Focused {
        /// Height of the crest above still water by linear theory, metres.
        height: f64,
        /// Position of the focus along x and z, metres.
        at: DVec2,
        /// Time of the focus, seconds.
        time: f64,
    },
}

/// One wave of the sum: elevation a cos θ with θ = k·x − ωt + φ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WaveComponent {
    /// Wave vector k along x and z, rad/m.
    pub number: DVec2,
    /// Angular frequency ω, rad/s.
    pub frequency: f64,
    /// Phase φ, radians.
    pub phase: f64,
    /// Amplitude a of the elevation, metres.
    pub elevation: f64,
    /// Amplitude of the horizontal velocity at the still level, m/s.
    pub speed: f64,
}

impl WaveComponent {
    /// A free wave of linear theory (Dean and Dalrymple 1991, §3): its velocity amplitude is
    /// aω / tanh kh.
    fn free(elevation: f64, frequency: f64, number: DVec2, phase: f64, depth: f64) -> Self {
        Self {
            number,
            frequency,
            phase,
            elevation,
            speed: elevation * frequency / (number.length() * depth).tanh(),
        }
    }

    /// θ at a position and a time.
    fn angle(&self, at: DVec2, t: f64) -> f64 {
        self.number.dot(at) - self.frequency * t + self.phase
    }
}

/// Waves on water of constant depth. Positions are metres from the domain's least corner, with x
/// and z horizontal and y upward. The domain's floor is that of the water, or cuts it.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenWaves {
    /// All waves of the sum.
    pub lines: Vec<WaveComponent>,
    /// Period of regular waves, seconds; `None` for a sea.
    pub period: Option<f64>,
    depth: f64,
    /// Height of still water above the domain's floor, metres.
    level: f64,
    ramp: f64,
}

impl OpenWaves {
    /// Builds regular waves to second order (Stokes 1847): a cos θ + a₂ cos 2θ with
    /// a₂ = k a² / 4 · (3 − T²) / T³, where T = tanh kh. The second harmonic has the velocity
    /// ¾ a² ω k cosh 2ky / sinh⁴ kh. `direction` is a unit vector along x and z.
    pub fn regular(waves: &RegularWaves, direction: DVec2) -> Self {
        let (k, frequency) = (waves.wave_number(), TAU / waves.period);
        let a = 0.5 * waves.height;
        let square = (k * waves.depth).tanh().powi(2);
        let first = WaveComponent::free(a, frequency, k * direction, 0.0, waves.depth);
        let second = WaveComponent {
            number: 2.0 * first.number,
            frequency: 2.0 * frequency,
            phase: 0.0,
            elevation: 0.25 * k * a * a * (3.0 - square) / square.powf(1.5),
            // cosh 2kh / sinh⁴ kh = (1 + T²) (1 − T²) / T⁴.
            speed: 0.75 * a * a * frequency * k * (1.0 - square * square) / square.powi(2),
        };
        Self {
            lines: vec![first, second],
            period: Some(waves.period),
            depth: waves.depth,
            level: waves.depth,
            ramp: waves.ramp,
        }
    }

    /// Builds a sea or a packet of [`LINES`] waves of equal energy. Their frequencies are the
    /// medians of as many equal parts of the spectrum's energy; each wave has one direction (single
    /// summation, Miles and Funke 1989) around `direction`, radians from x towards z.
    pub fn sea(asked: &OpenSea, direction: f64) -> Self {
        let (a, seed) = match asked.meeting {
            Meeting::Random {
                significant_height,
                seed,
            } => {
                let a = significant_height * (1.0 / (8.0 * f64::from(LINES))).sqrt();
                (a, seed)
            }
            Meeting::Focused { height, .. } => (height / f64::from(LINES), 0),
        };
        let chance = |line: usize, what: u64| {
            let seed = u64::from(seed) << 32 | what << 24;
            uniform(seed | line as u64)
        };
        let lines = frequencies(asked).into_iter().enumerate();
        let lines = lines.map(|(line, frequency)| {
            let off = asked.spreading.map_or(0.0, |s| spread(s, chance(line, 1)));
            let k = wave_number(frequency, asked.depth, asked.gravity);
            let number = k * DVec2::from_angle(direction + off);
            let phase = match asked.meeting {
                Meeting::Random { .. } => TAU * chance(line, 0),
                Meeting::Focused { at, time, .. } => frequency * time - number.dot(at),
            };
            WaveComponent::free(a, frequency, number, phase, asked.depth)
        });
        Self {
            lines: lines.collect(),
            period: None,
            depth: asked.depth,
            level: asked.depth,
            ramp: asked.ramp,
        }
    }

    /// Cuts the water at the domain's floor, `level` metres below still water.
    #[must_use]
    pub fn above(self, level: f64) -> Self {
        Self { level, ..self }
    }

    /// Returns the ramp's fraction of the full height at time `t`, seconds.
    pub fn grown(&self, t: f64) -> f64 {
        smooth_ramp(t, self.ramp).0
    }

    /// Returns the water velocity at a position, m/s. Above the still level it is that at the
    /// still level.
    pub fn velocity(&self, place: DVec3, t: f64) -> DVec3 {
        let at = DVec2::new(place.x, place.z);
        let of = |line: &WaveComponent| {
            let [cosh, sinh] = self.profile(line, place.y);
            let (sin, cos) = line.angle(at, t).sin_cos();
            let along = line.number / line.number.length() * (line.speed * cos * cosh);
            DVec3::new(along.x, line.speed * sin * sinh, along.y)
        };
        self.grown(t) * self.lines.iter().map(of).sum::<DVec3>()
    }

    /// Returns cosh kY / cosh kh and sinh kY / cosh kh, where Y is the height above the water's
    /// floor of `y`, at most that of still water.
    fn profile(&self, line: &WaveComponent, y: f64) -> [f64; 2] {
        let k = line.number.length();
        let below = y.clamp(0.0, self.level) - self.level;
        let up = (k * below).exp();
        let down = (-k * (below + 2.0 * self.depth)).exp();
        let whole = 1.0 + (-2.0 * k * self.depth).exp();
        [(up + down) / whole, (up - down) / whole]
    }

    /// Amplitude of the vertical displacement of the water of mean height `y`, metres: that of
    /// ∫ v dt.
    fn amplitude(&self, line: &WaveComponent, y: f64) -> f64 {
        let [_, sinh] = self.profile(line, y);
        line.speed / line.frequency * sinh
    }

    /// Returns an upper bound on how far water of mean height `y` is above or below it, metres.
    pub fn most_displacement(&self, y: f64) -> f64 {
        let amplitudes = self.lines.iter().map(|line| self.amplitude(line, y).abs());
        amplitudes.sum()
    }

    /// Returns waves whose elevation is how far water of mean height `y` is above it, without those
    /// that move it by less than `least` metres.
    #[must_use]
    pub fn layer(&self, y: f64, least: f64) -> Self {
        let lines = self.lines.iter().map(|line| WaveComponent {
            elevation: self.amplitude(line, y),
            ..*line
        });
        Self {
            lines: lines.filter(|line| line.elevation.abs() >= least).collect(),
            ..self.clone()
        }
    }

    /// Returns the surface elevation above still water at x and z, metres.
    pub fn elevation(&self, at: DVec2, t: f64) -> f64 {
        let of = |line: &WaveComponent| line.elevation * line.angle(at, t).cos();
        self.grown(t) * self.lines.iter().map(of).sum::<f64>()
    }

    /// Returns the slope of the surface at x and z along both.
    pub fn slope(&self, at: DVec2, t: f64) -> DVec2 {
        let of = |line: &WaveComponent| -line.elevation * line.angle(at, t).sin() * line.number;
        self.grown(t) * self.lines.iter().map(of).sum::<DVec2>()
    }

    /// Returns the time until the full height, seconds.
    pub fn ramp(&self) -> f64 {
        self.ramp
    }

    /// Returns the depth of still water, metres.
    pub fn depth(&self) -> f64 {
        self.depth
    }

    /// Returns the height of still water above the domain's floor, metres.
    pub fn level(&self) -> f64 {
        self.level
    }

    /// Returns the length of the shortest waves, metres.
    pub fn least_wave_length(&self) -> f64 {
        let numbers = self.lines.iter().map(|line| line.number.length());
        TAU / numbers.fold(0.0, f64::max)
    }

    /// Returns the smallest group velocity of the waves, m/s (Dean and Dalrymple 1991, eq. 4.82).
    pub fn least_group_speed(&self) -> f64 {
        let of = |line: &WaveComponent| {
            let k = line.number.length();
            let twice = 2.0 * k * self.depth;
            0.5 * line.frequency / k * (1.0 + twice / twice.min(300.0).sinh())
        };
        self.lines.iter().map(of).fold(f64::INFINITY, f64::min)
    }

    /// Returns an upper bound on the water's speed at the still level, m/s.
    pub fn most_speed(&self) -> f64 {
        self.lines.iter().map(|line| line.speed.abs()).sum()
    }
}

/// Angular frequencies of the waves, rad/s.
fn frequencies(asked: &OpenSea) -> Vec<f64> {
    let peak = asked.peak_period.recip();
    let count = ((asked.peak_period / asked.shortest_period - LEAST_RATIO) / STEP).ceil() as usize;
    let water = (asked.depth, asked.gravity);
    let at = |i: usize| peak * (LEAST_RATIO + STEP * (i as f64 + 0.5));
    let density = |i: usize| {
        let enhancement = asked.peak_enhancement;
        asked.spectrum.density(at(i), peak, enhancement, water)
    };
    let mut below = Vec::with_capacity(count);
    let mut sum = 0.0;
    for i in 0..count {
        sum += density(i);
        below.push(sum);
    }
    let middle = |line: u32| sum * (f64::from(line) + 0.5) / f64::from(LINES);
    let found = |line: u32| below.partition_point(|energy| *energy < middle(line));
    (0..LINES)
        .map(|line| TAU * at(found(line).min(count - 1)))
        .collect()
}

/// Quantile of the spreading (cos ½θ)^2s: the angle, radians from −π to π, below which the fraction
/// `part` lies.
fn spread(s: f64, part: f64) -> f64 {
    const PARTS: u32 = 4096;
    let angle = |i: u32| TAU * ((f64::from(i) + 0.5) / f64::from(PARTS) - 0.5);
    let density = |i: u32| (0.5 * angle(i)).cos().powf(2.0 * s);
    let whole: f64 = (0..PARTS).map(density).sum();
    let mut sum = 0.0;
    for i in 0..PARTS {
        sum += density(i);
        if sum >= part * whole {
            return angle(i);
        }
    }
    angle(PARTS - 1)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn regular(height: f64, period: f64, depth: f64) -> OpenWaves {
        let waves = RegularWaves {
            height,
            period,
            depth,
            gravity: 9.81,
            ramp: 0.0,
        };
        OpenWaves::regular(&waves, DVec2::from_angle(0.6))
    }

    fn asked(spreading: Option<f64>, seed: u32) -> OpenSea {
        OpenSea {
            spectrum: Spectrum::Jonswap,
            meeting: Meeting::Random {
                significant_height: 0.2,
                seed,
            },
            peak_period: 1.6,
            peak_enhancement: 3.3,
            shortest_period: 0.55,
            depth: 0.8,
            gravity: 9.81,
            ramp: 0.0,
            spreading,
        }
    }

    /// The kinematic surface condition η_t + u η_s = v holds up to third order in the steepness.
    #[test]
    fn regular_waves_keep_their_surface_to_second_order() {
        let residual = |height: f64, second: f64| {
            let mut waves = regular(height, 1.4, 0.5);
            waves.lines[1].elevation *= second;
            waves.lines[1].speed *= second;
            let (d, e) = (1e-4, DVec2::from_angle(0.6));
            let at = |s: f64, t: f64| waves.elevation(s * e, t);
            // Above the still level the fields are extended linearly.
            let velocity = |s: f64, y: f64, t: f64| {
                let still = waves.velocity(DVec3::new(s * e.x, 0.5, s * e.y), t);
                let below = waves.velocity(DVec3::new(s * e.x, 0.5 - d, s * e.y), t);
                still + (y - 0.5) / d * (still - below)
            };
            let mut worst = 0.0f64;
            for i in 0..40 {
                let (s, t) = (0.11 * f64::from(i), 0.37);
                let eta = at(s, t);
                let u = velocity(s, 0.5 + eta, t);
                let along = u.x * e.x + u.z * e.y;
                let eta_t = (at(s, t + d) - at(s, t - d)) / (2.0 * d);
                let eta_s = (at(s + d, t) - at(s - d, t)) / (2.0 * d);
                worst = worst.max((eta_t + along * eta_s - u.y).abs() / height);
            }
            worst
        };
        // A steepness four times as large has sixteen times the error, which is of second order per
        // unit of height squared.
        let (flat, steep) = (residual(0.01, 1.0), residual(0.04, 1.0));
        assert!((10.0..22.0).contains(&(steep / flat)), "{flat} {steep}");
        // Negative control: half of the second order is an error of first power.
        let (flat, steep) = (residual(0.01, 0.5), residual(0.04, 0.5));
        assert!((3.0..6.0).contains(&(steep / flat)), "{flat} {steep}");
    }

    #[test]
    fn velocities_have_neither_sources_nor_turns_and_none_through_the_floor() {
        let waves = OpenWaves::sea(&asked(Some(8.0), 3), 0.3);
        let d = 1e-4;
        for i in 0..50 {
            let f = f64::from(i);
            let place = DVec3::new(0.17 * f, 0.05 + 0.014 * f, 3.0 - 0.09 * f);
            let slope = |axis: usize| {
                let off = d * DVec3::AXES[axis];
                (waves.velocity(place + off, 2.0) - waves.velocity(place - off, 2.0)) / (2.0 * d)
            };
            let [x, y, z] = [slope(0), slope(1), slope(2)];
            // The third derivative is below 1e3 here; the error is d² of it.
            assert!((x.x + y.y + z.z).abs() < 1e-5, "{place}");
            let turn = DVec3::new(y.z - z.y, z.x - x.z, x.y - y.x);
            assert!(turn.length() < 1e-5, "{place} {turn}");
            let floor = waves.velocity(DVec3::new(place.x, 0.0, place.z), 2.0);
            assert!(floor.y.abs() < 1e-15);
        }
    }

    /// The surface rises as fast as the water there (the kinematic condition to first order).
    #[test]
    fn a_seas_level_rises_as_its_water_does() {
        let waves = OpenWaves::sea(&asked(Some(4.0), 1), 0.0);
        let d = 1e-5;
        for i in 0..40 {
            let (x, z, t) = (0.3 * f64::from(i), 0.1 * f64::from(i), 5.0);
            let at = DVec2::new(x, z);
            let rate = (waves.elevation(at, t + d) - waves.elevation(at, t - d)) / (2.0 * d);
            let rise = waves.velocity(DVec3::new(x, 0.8, z), t).y;
            assert!((rate - rise).abs() < 1e-6, "{rate} {rise}");
        }
    }

    #[test]
    fn a_sea_has_the_height_the_spectrum_and_the_directions_that_are_asked_for() {
        let sea = OpenWaves::sea(&asked(None, 0), 0.25 * PI);
        let energy: f64 = sea.lines.iter().map(|l| 0.5 * l.elevation.powi(2)).sum();
        assert!((4.0 * energy.sqrt() / 0.2 - 1.0).abs() < 1e-12);
        for line in &sea.lines {
            assert!((line.number.to_angle() - 0.25 * PI).abs() < 1e-12);
            let k = line.number.length();
            let deep = 9.81 * k * (k * 0.8).tanh();
            assert!((deep.sqrt() / line.frequency - 1.0).abs() < 1e-9);
        }
        // JONSWAP has 0.43 of its energy below 1.02 of the peak's frequency and 0.72 below 1.25, by
        // Simpson's rule on the formula itself.
        let jonswap = |x: f64| {
            let width: f64 = if x <= 1.0 { 0.07 } else { 0.09 };
            let raised = 3.3f64.powf((-0.5 * ((x - 1.0) / width).powi(2)).exp());
            x.powi(-5) * (-1.25 * x.powi(-4)).exp() * raised
        };
        let area = |to: f64| {
            let n = 4000;
            let h = (to - 0.5) / f64::from(n);
            let of = |i: i32| {
                let weight = match i {
                    0 => 1.0,
                    i if i == n => 1.0,
                    i if i % 2 == 1 => 4.0,
                    _ => 2.0,
                };
                weight * jonswap(0.5 + h * f64::from(i))
            };
            (0..=n).map(of).sum::<f64>() * h / 3.0
        };
        let most = 1.6 / 0.55;
        for ratio in [0.9, 1.0, 1.02, 1.25, 1.8] {
            let expected = area(ratio) / area(most);
            let below = |l: &&WaveComponent| l.frequency < TAU * ratio / 1.6;
            let found = sea.lines.iter().filter(below).count() as f64 / f64::from(LINES);
            // Each wave carries 1/64 of the energy.
            assert!(
                (found - expected).abs() < 1.0 / 64.0,
                "{ratio}: {found} {expected}"
            );
        }
        assert!(OpenWaves::sea(&asked(None, 0), 0.0) != OpenWaves::sea(&asked(None, 1), 0.0));
    }

    /// At the requested position and time the crest has the requested height, and it is nowhere
    /// higher; a quarter of the peak's period before, it is at most half as high.
    #[test]
    fn crests_of_a_packet_meet_where_they_are_asked_to() {
        for spreading in [None, Some(12.0)] {
            let (at, time) = (DVec2::new(6.0, 2.5), 21.0);
            let packet = OpenSea {
                meeting: Meeting::Focused {
                    height: 0.15,
                    at,
                    time,
                },
                ..asked(spreading, 0)
            };
            let waves = OpenWaves::sea(&packet, 0.4);
            assert!((waves.elevation(at, time) - 0.15).abs() < 1e-12);
            for i in 1..60 {
                let way = DVec2::from_angle(0.7 * f64::from(i)) * 0.1 * f64::from(i);
                assert!(waves.elevation(at + way, time) < 0.15, "{way}");
            }
            assert!(waves.elevation(at, time - 0.4) < 0.075);
            // Long before, the waves have not met yet.
            assert!(waves.elevation(at, time - 15.0).abs() < 0.075);
        }
    }

    /// For (cos ½θ)^2s the mean of cos θ is s / (s + 1) (Longuet-Higgins, Cartwright and
    /// Smith 1963).
    #[test]
    fn directions_are_spread_as_the_cosine_asks() {
        for s in [1.0, 5.0, 30.0] {
            let n = 2000;
            let part = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
            let mean = (0..n).map(|i| spread(s, part(i)).cos()).sum::<f64>() / f64::from(n);
            assert!((mean - s / (s + 1.0)).abs() < 1e-3, "{s}: {mean}");
            assert!(spread(s, 0.5).abs() < 1e-3);
        }
    }
}
