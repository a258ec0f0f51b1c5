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

/// Length of a shot, the cube root of its water's volume. Shots that are similar have the same
/// whitewater in it, and it does not depend on the spacing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShotScale {
    length: f64,
}

impl ShotScale {
    /// Returns the scale of a shot of this much water, m³.
    pub fn of_volume(volume: f64) -> Self {
        Self {
            length: volume.cbrt(),
        }
    }

    /// Whitewater born of a cubic metre that water closes.
    pub fn trapped_air_rate(&self) -> f64 {
        rounded(BORN_OF_AIR / self.length.powi(3))
    }

    /// Whitewater born a second of a cubic metre of water in crests.
    pub fn wave_crest_rate(&self) -> f64 {
        let speed = (STANDARD_GRAVITY * self.length).sqrt();
        rounded(BORN_OF_CRESTS * speed / self.length.powi(4))
    }

    /// Least and greatest radius of whitewater, metres.
    pub fn radius(&self) -> [f64; 2] {
        RADII.map(|part| rounded(part * self.length))
    }

    /// Foam on a square metre from which on it dies faster.
    pub fn crowd(&self) -> f64 {
        rounded(CROWD / self.length.powi(2))
    }
}

/// Whitewater born of a cube of one length that water closes. A matter of taste, as are the numbers
/// below: with them the quickstart has as much as with rates of a particle, 0.8 million.
const BORN_OF_AIR: f64 = 300_000.0;
/// Whitewater born of a cube of one length of water in crests, in the time in which a long wave in
/// as deep water moves by it.
const BORN_OF_CRESTS: f64 = 4_500_000.0;
/// Gravity that the speed of that wave follows from, m/s².
const STANDARD_GRAVITY: f64 = 9.81;
/// Radii of whitewater, lengths.
const RADII: [f64; 2] = [0.000_71, 0.0023];
/// Foam on a square of one length from which on it dies faster.
const CROWD: f64 = 76_000.0;

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

    /// Water that is four times as wide, and whose waves are twice as fast, has as many particles,
    /// four times as wide: a cube of it has 64 times the volume, in twice the time.
    #[test]
    fn similar_shots_have_as_much_whitewater() {
        let [small, large] = [8.0, 512.0].map(ShotScale::of_volume);
        // By half of the last of three digits.
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
