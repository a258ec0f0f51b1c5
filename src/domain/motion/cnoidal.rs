//! Piston motion for regular waves of permanent form in shallow water: cnoidal waves (Goring 1978;
//! Goring and Raichlen 1980).

use super::{
    elliptic::Elliptic,
    regular::{Cycle, RegularWaves, comes_within},
};

/// Least length of a cnoidal wave, in depths: at 8 the speed of a low wave is 2.5 % below
/// linear theory.
pub const LEAST_CNOIDAL_LENGTH: f64 = 8.0;

/// Largest −ln(1 − m). The crests are then 693 √(4h³ / 3H) apart.
const MOST_LOG: f64 = 690.0;

/// Reason why no cnoidal wave has a given height, period and depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoCnoidal {
    /// The wave would be shorter than [`LEAST_CNOIDAL_LENGTH`] depths, or no m between 0 and
    /// 1 fits.
    Short {
        /// Shortest period for which there is a wave, seconds.
        least_period: f64,
    },
    /// The crests are so far apart that 1 − m underflows: each is a solitary wave.
    Long {
        /// Longest period for which there is a wave, seconds.
        most_period: f64,
    },
}

/// Cnoidal waves, the permanent form of Korteweg and de Vries (1895).
///
/// η = H (cn²(2Kθ | m) − mean of cn²) about the still water, H L² / h³ = 16/3 m K² and c² = g h
/// (1 + H/h · (2 − m − 3 E/K) / m), which becomes g (h + H) for the solitary wave (Wiegel 1960;
/// Svendsen and Jonsson 1976). The wall moves with the water beside it: dξ/dt = c η / (h + η) at
/// x = ξ. With θ = (ct − ξ) / L this is dξ/dθ = L η / h, and so ξ = √(4 H h / 3m) Z(2Kθ | m)
/// about the mean position, with Jacobi's zeta function Z: implicit only in t, like Goring's
/// solitary wave.
#[derive(Clone, Debug, PartialEq)]
pub struct Cnoidal {
    waves: RegularWaves,
    functions: Elliptic,
    /// Wave length L, metres.
    length: f64,
    /// Phase speed c, m/s.
    celerity: f64,
    /// Amplitude of the wall, √(4 H h / 3m), metres.
    amplitude: f64,
    /// u = 2Kθ at which η falls through 0 and the wall is farthest in; it is farthest out at −u.
    farthest: f64,
    /// Mean position of the wall, metres.
    mean: f64,
}

impl Cnoidal {
    /// Computes the wall's motion for waves whose height is less than the depth.
    ///
    /// # Errors
    /// [`NoCnoidal`] if no cnoidal wave has this period.
    pub fn new(waves: RegularWaves) -> Result<Self, NoCnoidal> {
        let functions = fitting(&waves)?;
        let length = length(&waves, &functions);
        let amplitude = (4.0 * waves.height * waves.depth / (3.0 * functions.parameter)).sqrt();
        let level = functions.mean_of_squared_cn();
        // cn falls from 1 to 0 over a quarter period.
        let farthest = bisect([0.0, functions.quarter], |u| {
            functions.cn_and_zeta(u).0.powi(2) < level
        });
        Ok(Self {
            length,
            celerity: length / waves.period,
            amplitude,
            farthest,
            mean: amplitude * functions.cn_and_zeta(farthest).1,
            waves,
            functions,
        })
    }

    /// Returns the waves that this motion was derived from.
    pub fn waves(&self) -> &RegularWaves {
        &self.waves
    }

    /// Returns the wave length, metres.
    pub fn wave_length(&self) -> f64 {
        self.length
    }

    /// Returns the elevation at `distance` from the domain's face after the ramp, metres.
    pub fn elevation(&self, distance: f64, t: f64) -> f64 {
        let way = self.run(t) - (distance - self.mean);
        let theta = way / self.length;
        let u = 2.0 * self.functions.quarter * (theta - theta.round());
        self.level(self.functions.cn_and_zeta(u).0)
    }

    /// η, metres, from cn.
    fn level(&self, cn: f64) -> f64 {
        self.waves.height * (cn * cn - self.functions.mean_of_squared_cn())
    }

    /// Wall velocity c η / (h + η), m/s.
    fn velocity(&self, level: f64) -> f64 {
        self.celerity * level / (self.waves.depth + level)
    }

    /// Distance that waves have travelled, metres, measured from a crest at the wall's
    /// mean position.
    fn run(&self, t: f64) -> f64 {
        let start = self.farthest * self.length / (2.0 * self.functions.quarter) + self.mean;
        self.celerity * t - start
    }

    /// Phase as θ = n + u / 2K with |u| up to a quarter period: n, u, and cn and Z at u.
    fn phase(&self, t: f64) -> (f64, f64, (f64, f64)) {
        let run = self.run(t);
        let whole = (run / self.length).round();
        let run = run - whole * self.length;
        let per_u = self.length / (2.0 * self.functions.quarter);
        let (mut low, mut high) = (-self.functions.quarter, self.functions.quarter);
        let mut u = (run / per_u).clamp(low, high);
        // L θ + ξ increases with θ at a rate of 1 + η/h: Newton converges quadratically, and
        // bisection keeps it in the bracket.
        for _ in 0..60 {
            let (cn, zeta) = self.functions.cn_and_zeta(u);
            let residual = per_u * u + self.amplitude * zeta - run;
            if residual > 0.0 {
                high = u;
            } else {
                low = u;
            }
            let slope = per_u * (1.0 + self.level(cn) / self.waves.depth);
            let newton = u - residual / slope;
            let next = if newton > low && newton < high {
                newton
            } else {
                0.5 * (low + high)
            };
            let step = (next - u).abs();
            u = next;
            if step <= 1e-13 * self.functions.quarter {
                break;
            }
        }
        (whole, u, self.functions.cn_and_zeta(u))
    }
}

impl Cycle for Cnoidal {
    fn ramp(&self) -> f64 {
        self.waves.ramp
    }

    fn full(&self, t: f64) -> (f64, f64) {
        let (_, _, (cn, zeta)) = self.phase(t);
        let x = self.mean + self.amplitude * zeta;
        // 0 at the start but for rounding.
        (x.max(0.0), self.velocity(self.level(cn)))
    }

    fn velocities(&self, t0: f64, t1: f64) -> [f64; 2] {
        let ends = [t0, t1].map(|t| {
            let (whole, u, (cn, _)) = self.phase(t);
            (
                whole + u / (2.0 * self.functions.quarter),
                self.velocity(self.level(cn)),
            )
        });
        let within = ends.map(|end| end.0);
        let [a, b] = ends.map(|end| end.1);
        [
            match comes_within(0.5, within) {
                true => self.velocity(self.level(0.0)),
                false => a.min(b),
            },
            match comes_within(0.0, within) {
                true => self.velocity(self.level(1.0)),
                false => a.max(b),
            },
        ]
    }

    fn greatest(&self) -> (f64, f64) {
        let most = 2.0 * self.mean;
        let run = self.farthest * self.length / self.functions.quarter + most;
        (run / self.celerity, most)
    }
}

/// L = h √(16 m h / 3H) K, metres.
fn length(waves: &RegularWaves, functions: &Elliptic) -> f64 {
    let steepness = waves.height / waves.depth;
    waves.depth * (16.0 * functions.parameter / (3.0 * steepness)).sqrt() * functions.quarter
}

/// Period L / c, seconds; infinite where c² would be negative.
fn period(waves: &RegularWaves, functions: &Elliptic) -> f64 {
    let faster = 1.0 + waves.height / waves.depth * functions.speed_up();
    length(waves, functions) / (waves.gravity * waves.depth * faster.max(0.0)).sqrt()
}

/// Elliptic functions whose m gives the period. From [`LEAST_CNOIDAL_LENGTH`] on, the period
/// increases with m.
fn fitting(waves: &RegularWaves) -> Result<Elliptic, NoCnoidal> {
    // Searches over the logarithm of −ln(1 − m), as m is tiny for low waves and close to 1 for
    // long ones.
    let at = |log: f64| Elliptic::new(-(-log.exp()).exp_m1(), (-log.exp()).exp());
    let all = [1e-17f64.ln(), MOST_LOG.ln()];
    let shortest = bisect(all, |log| {
        length(waves, &at(log)) >= LEAST_CNOIDAL_LENGTH * waves.depth
    });
    let least_period = period(waves, &at(shortest));
    let most_period = period(waves, &at(all[1]));
    if waves.period < least_period {
        return Err(NoCnoidal::Short { least_period });
    }
    if waves.period > most_period {
        return Err(NoCnoidal::Long { most_period });
    }
    Ok(at(bisect([shortest, all[1]], |log| {
        period(waves, &at(log)) >= waves.period
    })))
}

/// Point from which a condition holds, to rounding: it must hold at the end and not at the start.
fn bisect([mut low, mut high]: [f64; 2], holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::{piston_height_ratio, solitary::Goring};
    use super::*;

    fn asked(height: f64, period: f64) -> RegularWaves {
        RegularWaves {
            height,
            period,
            depth: 1.0,
            gravity: 9.81,
            ramp: 0.0,
        }
    }

    fn cnoidal(height: f64, period: f64) -> Cnoidal {
        Cnoidal::new(asked(height, period)).expect("there is one")
    }

    /// The equation of motion itself (Goring 1978), with the elevation at the wall.
    #[test]
    fn the_wall_goes_with_the_water_beside_it() {
        let waves = cnoidal(0.3, 6.0);
        let off = |t: f64, at: f64| {
            let (_, velocity) = waves.state(t);
            let level = waves.elevation(at, t);
            (velocity - waves.celerity * level / (1.0 + level)).abs()
        };
        let mut spoiled = 0.0f64;
        for i in 1..200 {
            let t = 0.1 * f64::from(i);
            let there = off(t, waves.state(t).0);
            assert!(there < 1e-12, "{t}: {there}");
            spoiled = spoiled.max(off(t, waves.mean));
        }
        // Negative control: the elevation at the wall's mean position.
        assert!(spoiled > 0.05, "{spoiled}");
    }

    /// Steady waves of Korteweg and de Vries: h³/3 η'² = (η₁ − η)(η − η₂)(η − η₃) with the crest
    /// η₁, the trough η₂, and η₁ + η₂ + η₃ = h (c²/gh − 1) (Svendsen and Jonsson 1976), about a
    /// mean level of 0.
    #[test]
    fn the_elevation_is_a_wave_of_korteweg_and_de_vries_about_the_still_water() {
        for (height, period) in [(0.01, 3.2), (0.1, 4.0), (0.3, 6.0), (0.6, 20.0)] {
            let waves = cnoidal(height, period);
            let length = waves.wave_length();
            let level = |x: f64| waves.elevation(x, 0.7 * period);
            let samples = 4000;
            let levels = (0..samples).map(|i| level(length * f64::from(i) / f64::from(samples)));
            let levels: Vec<f64> = levels.collect();
            let crest = levels.iter().copied().fold(f64::MIN, f64::max);
            let trough = levels.iter().copied().fold(f64::MAX, f64::min);
            // Half a step from the crest the error is at most 1e-6 of the height.
            assert!(((crest - trough) / height - 1.0).abs() < 1e-4);
            let mean = levels.iter().sum::<f64>() / f64::from(samples);
            assert!(mean.abs() < 1e-12 * height, "{mean}");
            let off = |celerity: f64| {
                let third = celerity.powi(2) / 9.81 - 1.0 - crest - trough;
                let step = 1e-4 * length;
                let residual = |i: u32| {
                    let x = length * f64::from(i) / 100.0;
                    let slope = (level(x + step) - level(x - step)) / (2.0 * step);
                    let y = level(x);
                    let cubic = (crest - y) * (y - trough) * (y - third);
                    (slope * slope / 3.0 - cubic).abs()
                };
                let scale = height.powi(2) * (crest - third);
                (0..100).map(residual).fold(0.0, f64::max) / scale
            };
            let celerity = length / period;
            assert!(off(celerity) < 1e-3, "{height}: {}", off(celerity));
            // Negative control: a speed that is 2 % off.
            assert!(off(1.02 * celerity) > 4e-3, "{}", off(1.02 * celerity));
        }
    }

    /// The farther apart the crests, the closer each is to Goring's solitary wave: the difference
    /// falls as one over the period, like the trough's H/K.
    #[test]
    fn crests_far_apart_are_gorings_solitary_waves() {
        let off = |period: f64, height: f64| {
            let waves = cnoidal(0.3, period);
            let crest = 0.5 * waves.greatest().0;
            let goring = Goring::new(height, 1.0, 9.81);
            let middle = (waves.state(crest).0, goring.state(goring.crest_time()).0);
            let differ = |i: i32| {
                let t = 0.05 * f64::from(i);
                let (x, v) = waves.state(crest + t);
                let (y, w) = goring.state(goring.crest_time() + t);
                (x - middle.0 - y + middle.1).abs().max((v - w).abs())
            };
            (-30..=30).map(differ).fold(0.0, f64::max)
        };
        let far = [75.0, 150.0, 300.0].map(|period| off(period, 0.3));
        assert!(far[2] < 0.015, "{far:?}");
        for pair in far.windows(2) {
            let falls = pair[0] / pair[1];
            assert!((falls - 2.0).abs() < 0.1, "{far:?}");
        }
        // Negative control: for a solitary wave of another height the difference does not fall.
        let other = [150.0, 300.0].map(|period| off(period, 0.33));
        assert!(other[0] < 1.2 * other[1], "{other:?}");
    }

    /// Low waves: a piston's stroke agrees with linear theory. The length of low cnoidal waves is
    /// off by (kh)⁴/15.
    #[test]
    fn low_waves_have_the_stroke_of_linear_theory() {
        let off = |height: f64, period: f64| {
            let waves = cnoidal(height, period);
            let kh = asked(height, period).wave_number();
            let stroke = height / piston_height_ratio(kh, 1.0);
            (kh, (waves.greatest().1 / stroke - 1.0).abs())
        };
        for (height, period) in [(1e-9, 20.0), (1e-8, 10.0), (1e-7, 5.0)] {
            let (kh, off) = off(height, period);
            assert!(off < 0.1 * kh.powi(4) + 1e-4, "{period}: {off}");
        }
        // Negative control: high waves deviate from linear theory.
        assert!(off(0.3, 20.0).1 > 0.1);
        // The motion is a sine of the wave's frequency.
        let waves = cnoidal(1e-8, 10.0);
        for i in 0..50 {
            let t = 0.2 * f64::from(i);
            let sine = 0.5 * waves.greatest().1 * (1.0 - (TAU * t / 10.0).cos());
            assert!((waves.state(t).0 - sine).abs() < 1e-5 * waves.mean, "{t}");
        }
    }

    #[test]
    fn it_starts_at_rest_and_comes_again_each_period() {
        let waves = cnoidal(0.3, 6.0);
        let (x, v) = waves.state(0.0);
        assert!(x.abs() < 1e-15 && v.abs() < 1e-7, "{x} {v}");
        let (when, most) = waves.greatest();
        let seen = (0..6000).map(|i| waves.state(1e-3 * f64::from(i)).0);
        let seen = seen.fold(0.0, f64::max);
        assert!((seen - most).abs() < 1e-6 && seen <= most * (1.0 + 1e-14));
        assert!((waves.state(when).0 / most - 1.0).abs() < 1e-14);
        for i in 0..60 {
            let t = 0.1 * f64::from(i);
            let off = |period: f64| (waves.state(t + 7.0 * period).0 - waves.state(t).0).abs();
            assert!(off(6.0) < 1e-12, "{t}");
            assert!(i == 0 || off(6.01) > 1e-6, "{t}");
        }
    }

    #[test]
    fn waves_that_are_too_short_or_too_long_are_refused_with_the_period_that_fits() {
        let Err(NoCnoidal::Short { least_period }) = Cnoidal::new(asked(0.1, 2.0)) else {
            panic!("2 s on a metre of water");
        };
        assert!(Cnoidal::new(asked(0.1, 0.999 * least_period)).is_err());
        let waves = cnoidal(0.1, 1.001 * least_period);
        let length = waves.wave_length();
        assert!((LEAST_CNOIDAL_LENGTH..1.01 * LEAST_CNOIDAL_LENGTH).contains(&length));
        // Above the bound of KdV itself, T √(g/h) = 2π / √¾ for low waves.
        assert!(least_period * 9.81f64.sqrt() > TAU / 0.75f64.sqrt());
        let Err(NoCnoidal::Long { most_period }) = Cnoidal::new(asked(0.1, 1e4)) else {
            panic!("1e4 s on a metre of water");
        };
        assert!(Cnoidal::new(asked(0.1, 1.001 * most_period)).is_err());
        assert!(Cnoidal::new(asked(0.1, 0.999 * most_period)).is_ok());
    }
}
