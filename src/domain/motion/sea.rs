//! Seas and packets of waves that a wall makes: a sum of sines, each as high as linear theory asks of a piston, and where it is asked for
//! what the second order asks at their sums and differences.

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

/// Frequencies within the peak's own: the sea comes again after so many peak periods.
const LINES: u32 = 200;

/// The longest waves have this part of the peak's frequency; below it a spectrum has 2e-9 of its energy.
const LEAST_RATIO: f64 = 0.5;

/// Peak periods of the slowest groups that the second order moves the wall for. What it has to do for a group grows with the group's
/// length, and is the same for all of a shot that is shorter: it would only stand farther in.
const SLOWEST_GROUP: u32 = 40;

/// Waves as a scene asks for them.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// How the energy is spread.
    pub spectrum: Spectrum,
    /// Seconds.
    pub peak_period: f64,
    /// γ of JONSWAP and TMA.
    pub peak_enhancement: f64,
    /// Of the shortest waves that are made, seconds.
    pub shortest_period: f64,
    /// Still water, metres.
    pub depth: f64,
    /// m/s², positive.
    pub gravity: f64,
    /// Seconds until the motion's full size.
    pub ramp: f64,
    /// How waves come together.
    pub phases: Phases,
    /// Whether the wall makes no free waves of sum and difference frequencies (Schäffer 1996). Then kh of the shortest waves is at
    /// most [`DEEPEST`](super::DEEPEST).
    pub second_order: bool,
}

/// How the waves of a spectrum come together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Phases {
    /// A sea: by chance. Each wave has the energy that the spectrum gives it, whatever the seed.
    Random {
        /// Four times the root of the elevation's variance, metres.
        significant_height: f64,
        /// Other numbers make other seas of the same spectrum.
        seed: u32,
    },
    /// One packet whose crests meet: the most probable form of a sea about a high crest (Lindgren 1970; Tromans et al. 1991).
    Focused {
        /// The crest above still water by linear theory, metres.
        height: f64,
        /// From the domain's face, metres.
        at: f64,
        /// Seconds.
        time: f64,
    },
}

/// One of the waves.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wave {
    /// Of the wall's way, metres.
    amplitude: f64,
    /// rad/s.
    frequency: f64,
    /// rad/m.
    number: f64,
    /// Of the wall's way at time 0.
    phase: f64,
}

/// A wall's motion that makes them: r(t) (X + Σ Aᵢ sin(ωᵢ t + φᵢ)) with the ramp r, where X keeps it off the water's outside.
#[derive(Clone, Debug, PartialEq)]
pub struct Sea {
    asked: Asked,
    waves: Vec<Wave>,
    /// Where the second order is asked for.
    pairs: Option<Arc<Pairs>>,
    /// X is the wall's mean place.
    pub(super) sines: Sines,
}

impl Sea {
    /// The wall's motion for these waves. In linear theory a wall whose speed is u cos(ωt) makes waves that are in phase with it
    /// and H/S of its way high (Dean and Dalrymple 1991, §6).
    pub fn new(asked: Asked) -> Self {
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
            // Of the elevation: Σ a²/2 = H²/16, or Σ a = the crest.
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

    /// What was asked for.
    pub fn asked(&self) -> &Asked {
        &self.asked
    }

    /// Elevation by linear theory at a distance from the domain's face once the ramp is over, metres; waves that the ramp
    /// weakened are taken as if it had not. Where the second order is asked for, with the waves that are bound to each two, about the
    /// mean level.
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

    /// Speed at which the energy of the shortest waves goes, m/s: the group velocity of linear theory.
    pub fn least_group_speed(&self) -> f64 {
        let wave = self.waves[self.waves.len() - 1];
        let kh = wave.number * self.asked.depth;
        let n = 0.5 + kh / (2.0 * kh).min(300.0).sinh();
        n * wave.frequency / wave.number
    }

    /// Length of the shortest waves, metres.
    pub fn least_wave_length(&self) -> f64 {
        TAU / self.waves[self.waves.len() - 1].number
    }

    /// A packet meets at a distance from the domain's face, and its waves come from the wall's mean place.
    fn phase(&self, wave: &Wave) -> f64 {
        match self.asked.phases {
            Phases::Random { .. } => wave.phase,
            Phases::Focused { .. } => wave.phase - wave.number * self.sines.mean,
        }
    }

    /// The least mean place from which the wall never leaves the domain, or a little more: where it is, a packet's phases
    /// depend on it.
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

    /// The wall's way: wave by wave, to second order frequency by frequency.
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

    fn asked(phases: Phases) -> Asked {
        Asked {
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

    /// Frequency, Hz, and energy ½ a² of the elevation, m², that linear theory has the wall's way make: a Fourier transform of
    /// 200 peak periods, each line by H/S = 2 (cosh 2kh − 1) / (sinh 2kh + 2kh) with k bisected from ω² = g k tanh kh.
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

    /// The wall's way is a sum of lines with whole numbers of periods, so that its transform is theirs to rounding; the peak is
    /// the one of the lines.
    #[test]
    fn two_hundred_periods_have_the_height_and_the_peak_that_were_asked_for() {
        for seed in [0, 7] {
            let lines = made(&sea(seed));
            let height = significant_height(&lines);
            assert!((height / 0.1 - 1.0).abs() < 1e-9, "{height}");
            let peak = lines.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0;
            assert!((peak * 1.6 - 1.0).abs() < 1e-9, "{peak}");
            // JONSWAP's density over that of its peak: (f/fp)⁻⁵ exp(−5/4 ((f/fp)⁻⁴ − 1)) γ^(exp(−½ ((f/fp − 1)/σ)²) − 1).
            let of = |ratio: f64| lines[(200.0 * ratio).round() as usize - 1].1;
            for (ratio, width) in [(0.9f64, 0.07f64), (1.2, 0.09)] {
                let expected = ratio.powi(-5)
                    * (-1.25 * (ratio.powi(-4) - 1.0)).exp()
                    * 3.3f64.powf((-0.5 * ((ratio - 1.0) / width).powi(2)).exp() - 1.0);
                let found = of(ratio) / of(1.0);
                assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
            }
        }
        // Negative control: a wall of the same depth's longest waves alone, H/S = kh, would be far off.
        let mut spoiled = sea(0);
        for wave in &mut spoiled.waves {
            wave.amplitude *= 1.06;
        }
        spoiled.sines.lines = spoiled.lines();
        assert!((significant_height(&made(&spoiled)) / 0.1 - 1.0).abs() > 0.05);
        assert!(sea(0).waves != sea(7).waves);
    }

    /// Long waves on shallow water go as they are made, η(x, t) = (h/c) v(t − x/c) with v the wall's speed.
    #[test]
    fn in_shallow_water_the_elevation_is_the_walls_own_speed_on_its_way() {
        let depth = 0.01;
        let sea = Sea::new(Asked {
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
            // (kh)²/6 of the celerity, 7e-6, is what dispersion takes: over 9 m a phase of 1e-4, and as much of the height.
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
        // Four periods before and after there is little of it.
        for t in [7.6, 20.4] {
            assert!(
                sea.elevation(6.0, t).abs() < 0.03,
                "{}",
                sea.elevation(6.0, t)
            );
        }
    }

    /// Far less than the amplitudes' sum, as waves by chance hardly come together: a wall farther in would shorten the flume.
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

    /// The crest of a packet, with what is bound to its waves, is higher, and the troughs beside it are less deep: in regular waves of
    /// its height and peak by k a² / 4 · (3 − tanh²) / tanh³ = 12 mm, less the set-down, and in a spectrum of this width less.
    #[test]
    fn the_second_order_makes_crests_higher_and_troughs_less_deep() {
        let packet = Phases::Focused {
            height: 0.1,
            at: 6.0,
            time: 14.0,
        };
        let [first, second] = [false, true].map(|second_order| {
            Sea::new(Asked {
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

    /// A wall's way to second order stays within the domain and hardly farther in, has the waves of the first order, and no group
    /// slower than forty peak periods.
    #[test]
    fn the_second_order_keeps_the_wall_in_place() {
        let first = sea(1);
        let second = Sea::new(Asked {
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
        // The peak's own, and twice its frequency, of which the first order has little.
        assert!((line(&second, 200.0) / line(&first, 200.0) - 1.0).abs() < 0.05);
        assert!(line(&first, 20.0) == 0.0 && line(&second, 20.0) > 1e-5);
        assert!(line(&first, 700.0) == 0.0 && line(&second, 700.0) > 1e-6);
    }
}
