//! Thresholds between which a potential rises from 0 to 1, and the scale of a shot, which sets the
//! rates that its settings leave open.

use serde::{Deserialize, Serialize};

use super::SUPPORT;

/// Speed at which water begins to entrain air, m/s: about 1 m/s for plunging jets and for breakers
/// (Chanson 1996, "Air bubble entrainment in free-surface turbulent shear flows", section 2.3;
/// Kiger and Duncan 2012, "Air-entrainment mechanisms in plunging jets and breaking waves").
const INCEPTION: f64 = 1.0;
/// Specific energy of water at [`INCEPTION`], J/kg.
const INCEPTION_ENERGY: f64 = 0.5 * INCEPTION * INCEPTION;
/// Ratio of the upper threshold of energy to the lower: from there on a speed of twice
/// [`INCEPTION`].
const SPAN: f64 = 4.0;
/// Σ (1 − n·n') W over a surface of π (h/d)² particles within h, with a mean weight of 1/3, where
/// all its normals are orthogonal to the particle's own: on the edge of a thin sheet.
const EDGE: f64 = std::f64::consts::PI * SUPPORT * SUPPORT / 3.0;
/// The same at the top of the sharpest crest of a steady wave, which has 120° (Stokes 1880): the
/// normals of its flanks are 30° off its own.
const CREST: f64 = EDGE * (1.0 - 0.866_025_403_784_438_6);

/// Closing speed, m/s, for Σ max(−v_ij · x̂_ij, 0) W: with it the sum of closing speed times d²
/// over all particles is the volume, m³/s, that water closes where it converges, ∫ S dV of a smooth
/// convergence at S, 1/s, and the area times the relative speed of two fronts that meet: 1 over
/// (4π/3) (h/d)³ (h/d) ∫ (1 − r) r³ dr.
pub const CLOSING: f64 = 15.0 / (std::f64::consts::PI * SUPPORT * SUPPORT * SUPPORT * SUPPORT);

/// Quantities at one water particle that cause whitewater.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Potentials {
    /// Trapped air, [`CLOSING`] Σ max(−v_ij · x̂_ij, 0) W at the surface, m/s: the speed at which
    /// water there meets water.
    pub trapped_air: f64,
    /// Wave crest, Σ (1 − n̂_i · n̂_j) W over a convex surface where it moves outward.
    pub wave_crest: f64,
    /// Specific kinetic energy v²/2, J/kg.
    pub energy: f64,
    /// Share of water around the particle: 1 deep inside.
    pub share: f64,
}

impl Potentials {
    /// Returns the convective acceleration at which water converges, S |v| with S the closing speed
    /// over the spacing, in units of gravity. On a linear wave of steepness ak it is at most (ak)²,
    /// whatever the spacing, so 0.2 at the limiting steepness of 0.44; on a front it grows as the
    /// spacing falls.
    pub fn steepness(&self, spacing: f64, gravity: f64) -> f64 {
        match self.trapped_air > 0.0 {
            true => self.trapped_air * (2.0 * self.energy).sqrt() / (spacing * gravity),
            false => 0.0,
        }
    }
}

/// Lower and upper threshold between which each potential rises from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Thresholds {
    /// Thresholds of [`Potentials::steepness`].
    pub trapped_air: [f64; 2],
    /// Thresholds of wave crests, dimensionless.
    pub wave_crest: [f64; 2],
    /// Thresholds of energy, J/kg.
    pub energy: [f64; 2],
}

impl Default for Thresholds {
    /// Returns the physical limits: water begins to break at half of the limiting steepness and
    /// surely breaks at it; crests from that of the sharpest steady wave to the edge of a sheet.
    fn default() -> Self {
        Self {
            trapped_air: [0.1, 0.2],
            wave_crest: [CREST, EDGE].map(rounded),
            energy: [INCEPTION_ENERGY, SPAN * INCEPTION_ENERGY],
        }
    }
}

/// Length and speed of a shot. Shots that are similar (Froude) have the same whitewater in these
/// units, and neither depends on the spacing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShotScale {
    /// Height that fast water could rise to, v²/2g, metres.
    pub head: f64,
    /// Speed of fast water, m/s.
    pub speed: f64,
}

impl ShotScale {
    /// Calibrates the scale on the specific energies e, J/kg, of a shot's water: on Σe³/Σe² of what
    /// moves. A small part of the water that is much faster than the rest, as the jet of a breaker,
    /// counts, and a lone drop does not. `extent` is the least extent of the domain, metres, which
    /// bounds the head.
    pub fn calibrate(energies: &[f64], gravity: f64, extent: f64) -> Self {
        let moving = energies.iter().filter(|&&energy| energy >= INCEPTION_ENERGY);
        let add = |[squares, cubes]: [f64; 2], e: &f64| [squares + e * e, cubes + e * e * e];
        let [squares, cubes] = moving.fold([0.0; 2], add);
        let fast = if squares > 0.0 { cubes / squares } else { 0.0 };
        let energy = fast.max(SPAN * INCEPTION_ENERGY);
        Self {
            head: rounded((energy / gravity).min(extent)),
            speed: rounded((2.0 * energy).sqrt()),
        }
    }

    /// Whitewater born of a cubic metre that water closes.
    pub fn trapped_air_rate(&self) -> f64 {
        rounded(AIR_IN_HEAD / self.head.powi(3))
    }

    /// Whitewater born a second of a cubic metre of water in crests.
    pub fn wave_crest_rate(&self) -> f64 {
        rounded(CREST_IN_HEAD * self.speed / self.head.powi(4))
    }

    /// Least and greatest radius of whitewater, metres.
    pub fn radius(&self) -> [f64; 2] {
        RADII.map(|part| rounded(part * self.head))
    }

    /// Foam on a square metre from which on it dies faster.
    pub fn crowd(&self) -> f64 {
        rounded(CROWD / self.head.powi(2))
    }
}

/// Whitewater born of a cube of one head that water closes.
const AIR_IN_HEAD: f64 = 35_000.0;
/// Whitewater born of a cube of one head of water in crests, in the time in which fast water moves
/// by it.
const CREST_IN_HEAD: f64 = 260_000.0;
/// Radii of whitewater, heads.
const RADII: [f64; 2] = [0.001_45, 0.004_75];
/// Foam on a square of one head from which on it dies faster.
const CROWD: f64 = 18_400.0;

/// Rounds to three significant digits.
fn rounded(value: f64) -> f64 {
    let scale = 10f64.powi(2 - value.log10().floor() as i32);
    (value * scale).round() / scale
}

/// Φ: 0 up to the lower threshold, 1 from the upper one on (Ihmsen 2012, eq. 1).
pub(super) fn grown(value: f64, [least, greatest]: [f64; 2]) -> f64 {
    ((value - least) / (greatest - least)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shots_scale_is_its_fast_water() {
        // 0.5 m/s is below the inception of air entrainment; a calm shot has the scale of it.
        let calm = ShotScale::calibrate(&[0.125; 100], 9.81, 10.0);
        assert_eq!(calm, ShotScale::calibrate(&[], 9.81, 10.0));
        assert_eq!((calm.head, calm.speed), (0.204, 2.0));
        // Water at rest beside it does not matter. Of even energies from 0.5 to 10.1 J/kg it is
        // 3/4 (10.1⁴ − 0.5⁴) / (10.1³ − 0.5³) = 7.57.
        let mut wild: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k) + 0.1).collect();
        let scale = ShotScale::calibrate(&wild, 9.81, 10.0);
        wild.extend([0.0; 5000]);
        assert_eq!(scale, ShotScale::calibrate(&wild, 9.81, 10.0));
        assert!((scale.head * 9.81 / 7.57 - 1.0).abs() < 0.01, "{scale:?}");
        // A jet that is a hundredth of what moves decides, a drop in a million does not.
        let mut jet = vec![1.0; 99_000];
        jet.extend([30.0; 1000]);
        let with_jet = ShotScale::calibrate(&jet, 9.81, 10.0);
        assert!(with_jet.head * 9.81 > 25.0, "{with_jet:?}");
        let mut drop = vec![10.0; 1_000_000];
        drop.push(100.0);
        let with_drop = ShotScale::calibrate(&drop, 9.81, 10.0);
        assert!((with_drop.head * 9.81 / 10.0 - 1.0).abs() < 0.01, "{with_drop:?}");
        // Without gravity the domain bounds it.
        assert_eq!(ShotScale::calibrate(&wild, 0.0, 3.0).head, 3.0);
    }

    /// A shot that is four times as large, and twice as fast, has as many particles, four times as
    /// wide: a cube of it 64 times the volume, in twice the time.
    #[test]
    fn similar_shots_have_as_much_whitewater() {
        let [small, large] = [2.0, 8.0].map(|energy| ShotScale::calibrate(&[energy], 10.0, 100.0));
        let same = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 0.01, "{a} {b}");
        same(small.trapped_air_rate(), 64.0 * large.trapped_air_rate());
        same(small.wave_crest_rate(), 128.0 * large.wave_crest_rate());
        same(small.crowd(), 16.0 * large.crowd());
        same(4.0 * small.radius()[1], large.radius()[1]);
    }

    /// Sums over the lattice at three spacings: two fronts that meet at V close the area times V,
    /// and a smooth convergence its rate times the volume, within the 3 % by which the lattice's
    /// sums differ from integrals.
    #[test]
    fn closing_speeds_add_up_to_the_closed_volume() {
        let reach = SUPPORT.ceil() as i32;
        let closing = |velocity: &dyn Fn(f64) -> f64, x: f64, d: f64| {
            let mut sum = 0.0;
            for i in -reach..=reach {
                for j in -reach..=reach {
                    for k in -reach..=reach {
                        let r = f64::from(i * i + j * j + k * k).sqrt();
                        if r > 0.0 {
                            let along = velocity(x) - velocity(x + f64::from(i) * d);
                            // From the neighbour to the particle.
                            let cosine = f64::from(-i) / r;
                            sum += (-along * cosine).max(0.0) * (1.0 - r / SUPPORT).max(0.0);
                        }
                    }
                }
            }
            CLOSING * sum
        };
        for d in [0.2, 0.1, 0.05] {
            let places = (-40..40).map(|k| (f64::from(k) + 0.5) * d);
            let fronts = |x: f64| if x < 0.0 { 1.5 } else { -1.5 };
            // A column of d² closes 3 m/s times d².
            let sum: f64 = places.map(|x| closing(&fronts, x, d)).sum();
            assert!((sum / 3.0 - 1.0).abs() < 0.03, "{d}: {sum}");
            let smooth = closing(&|x| -0.7 * x, 0.3, d) / d;
            assert!((smooth / 0.7 - 1.0).abs() < 0.03, "{d}: {smooth}");
        }
    }

    #[test]
    fn potentials_grow_between_their_thresholds() {
        let grown = [1.0, 2.0, 3.0, 4.0, 9.0].map(|x| grown(x, [2.0, 4.0]));
        assert_eq!(grown, [0.0, 0.0, 0.5, 1.0, 1.0]);
        let [least, edge] = Thresholds::default().wave_crest;
        assert_eq!([least, edge], [0.561, 4.19]);
        assert_eq!(
            [0.012345, 1.2345, 98765.0].map(rounded),
            [0.0123, 1.23, 98800.0]
        );
    }
}
