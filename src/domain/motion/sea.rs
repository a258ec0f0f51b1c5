//! Irregular seas and wave packets that a wall makes: a sum of sines whose amplitudes follow from
//! linear theory of a piston, optionally with the second-order correction at their sum and
//! difference frequencies.

use std::{f64::consts::TAU, sync::Arc};

use super::{
    Spectrum,
    complex::Complex,
    pairs::Pairs,
    piston_height_ratio,
    sines::{Sine, Sines},
    wave_number,
};
use crate::sampling::uniform;

/// Number of lines below and at the peak's frequency: the sea repeats after this many peak periods.
const LINES: u32 = 200;

/// Frequency of the longest waves relative to the peak; below it a spectrum has 2e-9 of its energy.
const LEAST_RATIO: f64 = 0.5;

/// Longest groups, in peak periods, that the second-order correction moves the wall for. The motion
/// for a group grows with the group's length, and is constant over any shorter shot: it would only
/// shift the wall inward.
const SLOWEST_GROUP: u32 = 40;

/// Parameters of the waves, as in a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SeaParameters {
    /// Distribution of energy over frequencies.
    pub spectrum: Spectrum,
    /// Peak period, seconds.
    pub peak_period: f64,
    /// Peak enhancement factor γ of JONSWAP and TMA.
    pub peak_enhancement: f64,
    /// Period of the shortest waves that are generated, seconds.
    pub shortest_period: f64,
    /// Depth of still water, metres.
    pub depth: f64,
    /// Acceleration of gravity, m/s², positive.
    pub gravity: f64,
    /// Time until the motion's full size, seconds.
    pub ramp: f64,
    /// Phases of the waves.
    pub phases: Phases,
    /// Whether the wall is corrected so that it generates no free waves of sum and
    /// difference frequencies (Schäffer 1996). The kh of the shortest waves is then at
    /// most [`DEEPEST`](super::DEEPEST).
    pub second_order: bool,
}

/// How the phases of a spectrum's waves are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Phases {
    /// A sea with random phases. Each wave has the energy of the spectrum, whatever the seed.
    Random {
        /// Four times the standard deviation of the elevation, metres.
        significant_height: f64,
        /// Different seeds give different seas of the same spectrum.
        seed: u32,
    },
    /// One packet whose crests meet: the most probable shape of a sea around a high crest (Lindgren
    /// 1970; Tromans et al. 1991).
    Focused {
        /// Height of the crest above still water by linear theory, metres.
        height: f64,
        /// Distance of the focus from the domain's face, metres.
        at: f64,
        /// Time of the focus, seconds.
        time: f64,
    },
}

/// One wave of the sum.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wave {
    /// Amplitude of the wall's displacement, metres.
    amplitude: f64,
    /// Angular frequency, rad/s.
    frequency: f64,
    /// Wavenumber, rad/m.
    number: f64,
    /// Phase of the wall's displacement at time 0, radians.
    phase: f64,
}

/// Wall motion for a sea: r(t) (X + Σ Aᵢ sin(ωᵢ t + φᵢ)) with the ramp r; the mean position X keeps
/// the wall within the domain.
#[derive(Clone, Debug, PartialEq)]
pub struct Sea {
    asked: SeaParameters,
    waves: Vec<Wave>,
    /// Second-order solution, if requested.
    pairs: Option<Arc<Pairs>>,
    /// X is the wall's mean position.
    pub(super) sines: Sines,
}

impl Sea {
    /// Computes the wall's motion for these waves. In linear theory, a wall with speed u cos(ωt)
    /// makes waves in phase with it whose height is H/S times its stroke (Dean and Dalrymple
    /// 1991, §6).
    pub fn new(asked: SeaParameters) -> Self {
        let peak = asked.peak_period.recip();
        let step = peak / f64::from(LINES);
        let first = (LEAST_RATIO * f64::from(LINES)) as u32;
        let last = (f64::from(LINES) * asked.peak_period / asked.shortest_period).round() as u32;
        let water = (asked.depth, asked.gravity);
        let lines: Vec<(f64, f64)> = (first..=last)
            .map(|i| {
                let f = step * f64::from(i);
                let density = asked
                    .spectrum
                    .density(f, peak, asked.peak_enhancement, water);
                (f, density)
            })
            .collect();
        let total: f64 = lines.iter().map(|line| line.1).sum();
        let waves = lines.iter().enumerate().map(|(i, &(f, density))| {
            let frequency = TAU * f;
            let number = wave_number(frequency, asked.depth, asked.gravity);
            // Amplitude of the elevation: Σ a²/2 = H²/16, or Σ a = the crest.
            let (elevation, phase) = match asked.phases {
                Phases::Random {
                    significant_height,
                    seed,
                } => (
                    significant_height * (density / (8.0 * total)).sqrt(),
                    TAU * uniform(u64::from(seed) << 32 | i as u64),
                ),
                Phases::Focused { height, at, time } => {
                    (height * density / total, number * at - frequency * time)
                }
            };
            Wave {
                amplitude: elevation / piston_height_ratio(number, asked.depth),
                frequency,
                number,
                phase,
            }
        });
        let waves: Vec<Wave> = waves.collect();
        let pairs = asked.second_order.then(|| {
            let ends = [first as usize, last as usize];
            let water = [asked.depth, asked.gravity];
            Arc::new(Pairs::new(ends, TAU * step, water))
        });
        let sines = Sines {
            lines: Vec::new(),
            mean: 0.0,
            ramp: asked.ramp,
            whole: f64::from(LINES) * asked.peak_period,
        };
        let mut sea = Self {
            waves,
            pairs,
            sines,
            asked,
        };
        sea.find_mean();
        sea
    }

    /// Returns the parameters that this motion was derived from.
    pub fn asked(&self) -> &SeaParameters {
        &self.asked
    }

    /// Returns the elevation at `distance` from the domain's face after the ramp, metres, by linear
    /// theory; the ramp's effect on waves that are still under way is ignored. With the second
    /// order, includes the bound waves of each pair, about the mean level.
    pub fn elevation(&self, distance: f64, t: f64) -> f64 {
        let way = distance - self.sines.mean;
        let of = |wave: &Wave| {
            let phase = wave.frequency * t - wave.number * way + self.phase(wave);
            let ratio = piston_height_ratio(wave.number, self.asked.depth);
            (ratio * wave.amplitude, phase)
        };
        let waves = self.waves.iter().map(of);
        let Some(pairs) = &self.pairs else {
            return waves.map(|(size, phase)| size * phase.cos()).sum();
        };
        let waves = waves.map(|(size, phase)| Complex::polar(size, phase));
        let waves: Vec<Complex> = waves.collect();
        let first: f64 = waves.iter().map(|wave| wave.re).sum();
        first + pairs.bound(&waves)
    }

    /// Returns the speed of the shortest waves' energy, m/s: their group velocity in linear theory.
    pub fn least_group_speed(&self) -> f64 {
        let wave = self.waves[self.waves.len() - 1];
        let kh = wave.number * self.asked.depth;
        let n = 0.5 + kh / (2.0 * kh).min(300.0).sinh();
        n * wave.frequency / wave.number
    }

    /// Returns the length of the shortest waves, metres.
    pub fn least_wave_length(&self) -> f64 {
        TAU / self.waves[self.waves.len() - 1].number
    }

    /// A packet's focus is at a distance from the domain's face, but its waves start from the
    /// wall's mean position.
    fn phase(&self, wave: &Wave) -> f64 {
        match self.asked.phases {
            Phases::Random { .. } => wave.phase,
            Phases::Focused { .. } => wave.phase - wave.number * self.sines.mean,
        }
    }

    /// Finds the least mean position from which the wall never leaves the domain. For packets,
    /// whose phases depend on it, the result may be slightly larger.
    fn find_mean(&mut self) {
        loop {
            self.sines.lines = self.lines();
            let least = self.sines.least();
            if self.sines.mean + least >= 0.0 {
                return;
            }
            self.sines.mean = match self.asked.phases {
                Phases::Random { .. } => -least,
                Phases::Focused { .. } => -1.05 * least,
            };
        }
    }

    /// The wall's displacement as sines: one per wave, or with the second order one per frequency.
    fn lines(&self) -> Vec<Sine> {
        let of = |wave: &Wave| Sine {
            amplitude: wave.amplitude,
            frequency: wave.frequency,
            phase: self.phase(wave),
        };
        let lines = self.waves.iter().map(of);
        let Some(pairs) = &self.pairs else {
            return lines.collect();
        };
        // A sin φ is the real part of −i A exp(iφ).
        let quarter = 0.25 * TAU;
        let ways = lines.map(|line| Complex::polar(line.amplitude, line.phase - quarter));
        let ways: Vec<Complex> = ways.collect();
        let step = TAU / self.sines.whole;
        let all = pairs
            .corrected(&ways, (LINES / SLOWEST_GROUP) as usize)
            .into_iter()
            .enumerate();
        all.filter(|(_, way)| way.size() > 0.0)
            .map(|(line, way)| Sine {
                amplitude: way.size(),
                frequency: step * line as f64,
                phase: way.angle() + quarter,
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(phases: Phases) -> SeaParameters {
        SeaParameters {
            spectrum: Spectrum::Jonswap,
            peak_period: 1.6,
            peak_enhancement: 3.3,
            shortest_period: 0.6,
            depth: 0.8,
            gravity: 9.81,
            ramp: 3.2,
            phases,
            second_order: false,
        }
    }

    fn sea(seed: u32) -> Sea {
        Sea::new(asked(Phases::Random {
            significant_height: 0.1,
            seed,
        }))
    }

    /// Frequency, Hz, and energy ½ a² of the elevation, m², that the wall's displacement
    /// generates by linear theory: a Fourier transform of 200 peak periods, each line by
    /// H/S = 2 (cosh 2kh − 1) / (sinh 2kh + 2kh) with k bisected from ω² = g k tanh kh.
    fn made(sea: &Sea) -> Vec<(f64, f64)> {
        let (whole, depth) = (200.0 * 1.6, 0.8);
        let samples = 2048;
        let ways: Vec<f64> = (0..samples)
            .map(|i| {
                sea.sines
                    .state(100.0 + whole * f64::from(i) / f64::from(samples))
                    .0
            })
            .collect();
        let line = |n: u32| {
            let (mut re, mut im) = (0.0, 0.0);
            for (i, way) in ways.iter().enumerate() {
                let (sin, cos) = (TAU * f64::from(n) * i as f64 / f64::from(samples)).sin_cos();
                re += way * cos;
                im += way * sin;
            }
            let amplitude = 2.0 * re.hypot(im) / f64::from(samples);
            let frequency = f64::from(n) / whole;
            let (mut low, mut high) = (1e-6, 1e3);
            for _ in 0..100 {
                let k: f64 = 0.5 * (low + high);
                match 9.81 * k * (k * depth).tanh() < (TAU * frequency).powi(2) {
                    true => low = k,
                    false => high = k,
                }
            }
            let twice = 2.0 * low * depth;
            let ratio = 2.0 * (twice.cosh() - 1.0) / (twice.sinh() + twice);
            (frequency, 0.5 * (ratio * amplitude).powi(2))
        };
        (1..1000).map(line).collect()
    }

    fn significant_height(lines: &[(f64, f64)]) -> f64 {
        4.0 * lines.iter().map(|line| line.1).sum::<f64>().sqrt()
    }

    /// The wall's displacement is a sum of lines with whole numbers of periods, so that its
    /// transform gives them to rounding; the peak is one of the lines.
    #[test]
    fn two_hundred_periods_have_the_height_and_the_peak_that_were_asked_for() {
        for seed in [0, 7] {
            let lines = made(&sea(seed));
            let height = significant_height(&lines);
            assert!((height / 0.1 - 1.0).abs() < 1e-9, "{height}");
            let peak = lines.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0;
            assert!((peak * 1.6 - 1.0).abs() < 1e-9, "{peak}");
            // JONSWAP's density relative to its peak: (f/fp)⁻⁵ exp(−5/4 ((f/fp)⁻⁴ − 1)) γ^(exp(−½
            // ((f/fp − 1)/σ)²) − 1).
            let of = |ratio: f64| lines[(200.0 * ratio).round() as usize - 1].1;
            for (ratio, width) in [(0.9f64, 0.07f64), (1.2, 0.09)] {
                let expected = ratio.powi(-5)
                    * (-1.25 * (ratio.powi(-4) - 1.0)).exp()
                    * 3.3f64.powf((-0.5 * ((ratio - 1.0) / width).powi(2)).exp() - 1.0);
                let found = of(ratio) / of(1.0);
                assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
            }
        }
        // Negative control: amplitudes that are 6 % too large.
        let mut spoiled = sea(0);
        for wave in &mut spoiled.waves {
            wave.amplitude *= 1.06;
        }
        spoiled.sines.lines = spoiled.lines();
        assert!((significant_height(&made(&spoiled)) / 0.1 - 1.0).abs() > 0.05);
        assert!(sea(0).waves != sea(7).waves);
    }

    /// Long waves on shallow water travel as they are made, η(x, t) = (h/c) v(t − x/c) with the
    /// wall's speed v.
    #[test]
    fn in_shallow_water_the_elevation_is_the_walls_own_speed_on_its_way() {
        let depth = 0.01;
        let sea = Sea::new(SeaParameters {
            peak_period: 60.0,
            shortest_period: 30.0,
            ramp: 60.0,
            depth,
            ..asked(Phases::Random {
                significant_height: 1e-3,
                seed: 3,
            })
        });
        let celerity = (9.81 * depth).sqrt();
        for (x, t) in [(0.0, 100.0), (2.0, 131.0), (5.0, 170.0), (9.0, 263.0)] {
            let way = x - sea.sines.mean;
            let expected = depth / celerity * sea.sines.state(t - way / celerity).1;
            // Dispersion changes the celerity by (kh)²/6, 7e-6: over 9 m a phase of 1e-4, and as
            // much of the height.
            let off = (sea.elevation(x, t) - expected).abs();
            assert!(off < 1e-6, "{x} {t}: {off} of {expected}");
        }
    }

    #[test]
    fn a_packets_crests_meet_where_and_when_they_are_asked_to() {
        let sea = Sea::new(asked(Phases::Focused {
            height: 0.15,
            at: 6.0,
            time: 14.0,
        }));
        assert!((sea.elevation(6.0, 14.0) - 0.15).abs() < 1e-12);
        for i in 0..200 {
            let t = 4.0 + 0.1 * f64::from(i);
            let (here, there) = (sea.elevation(6.0, t), sea.elevation(4.5, t));
            assert!(here.abs() <= 0.15 + 1e-12 && there.abs() < 0.15, "{t}");
        }
        // Four periods before and after, little of it is left.
        for t in [7.6, 20.4] {
            assert!(
                sea.elevation(6.0, t).abs() < 0.03,
                "{}",
                sea.elevation(6.0, t)
            );
        }
    }

    /// The mean position is far less than the sum of the amplitudes, as random waves hardly ever
    /// align: a wall farther in would shorten the flume.
    #[test]
    fn a_wall_stands_no_farther_in_than_its_way_asks() {
        let sea = sea(1);
        let whole = 200.0 * 1.6;
        let least = (0..40_000).map(|i| sea.sines.state(10.0 + whole * f64::from(i) / 4e4).0);
        let least = least.fold(f64::INFINITY, f64::min);
        assert!(
            least >= 0.0 && least < 0.03 * sea.sines.mean,
            "{least} {}",
            sea.sines.mean
        );
        assert!(sea.sines.mean < 0.5 * sea.sines.most(0));
    }

    /// With the bound waves, the crest of a packet is higher and the troughs beside it are
    /// shallower. For regular waves of its height and peak the difference is
    /// k a² / 4 · (3 − tanh²) / tanh³ = 12 mm, less the set-down; in a spectrum of this width it is
    /// smaller.
    #[test]
    fn the_second_order_makes_crests_higher_and_troughs_less_deep() {
        let packet = Phases::Focused {
            height: 0.1,
            at: 6.0,
            time: 14.0,
        };
        let [first, second] = [false, true].map(|second_order| {
            Sea::new(SeaParameters {
                second_order,
                ..asked(packet)
            })
        });
        let ends = |sea: &Sea| {
            let at = |i: u32| sea.elevation(6.0, 13.0 + 0.02 * f64::from(i));
            let all = (0..=100).map(at);
            all.fold([0.0f64; 2], |[low, high], y| [low.min(y), high.max(y)])
        };
        let ([low, high], [second_low, second_high]) = (ends(&first), ends(&second));
        assert!((high - 0.1).abs() < 1e-12);
        let risen = second_high - high;
        assert!((0.006..0.012).contains(&risen), "{risen}");
        assert!(second_low > low + 0.002, "{second_low} {low}");
    }

    /// To second order the wall stays within the domain and hardly farther in, keeps the waves of
    /// first order, and makes no group slower than forty peak periods.
    #[test]
    fn the_second_order_keeps_the_wall_in_place() {
        let first = sea(1);
        let second = Sea::new(SeaParameters {
            second_order: true,
            ..first.asked.clone()
        });
        let whole = 200.0 * 1.6;
        let ways = (0..40_000).map(|i| second.sines.state(10.0 + whole * f64::from(i) / 4e4).0);
        let least = ways.fold(f64::INFINITY, f64::min);
        assert!((0.0..0.03 * second.sines.mean).contains(&least), "{least}");
        let farther = second.sines.mean / first.sines.mean;
        assert!((0.9..1.2).contains(&farther), "{farther}");
        let step = TAU / whole;
        let slowest = second.sines.lines[0].frequency / step;
        assert!((slowest - 5.0).abs() < 1e-9, "{slowest}");
        let line = |sea: &Sea, n: f64| {
            let mut lines = sea.sines.lines.iter();
            let found = lines.find(|line| (line.frequency / step - n).abs() < 1e-6);
            found.map_or(0.0, |line| line.amplitude)
        };
        // The peak's own line, and twice its frequency, of which the first order has little.
        assert!((line(&second, 200.0) / line(&first, 200.0) - 1.0).abs() < 0.05);
        assert!(line(&first, 20.0) == 0.0 && line(&second, 20.0) > 1e-5);
        assert!(line(&first, 700.0) == 0.0 && line(&second, 700.0) > 1e-6);
    }
}
