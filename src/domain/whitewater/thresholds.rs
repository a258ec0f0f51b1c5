//! Thresholds between which a potential rises from 0 to 1, and their calibration for a shot.

use serde::{Deserialize, Serialize};

use super::SUPPORT;

/// Speed of colliding water above which air is entrained, m/s: about 1 m/s for plunging jets and
/// for breakers (Chanson 1996, "Air bubble entrainment in free-surface turbulent shear flows",
/// section 2.3).
const INCEPTION: f64 = 1.0;
/// Quantile of the moving particles at the lower threshold, if it exceeds the floor.
const LEAST: f64 = 0.9;
/// Quantile of the moving particles at the upper threshold.
const GREATEST: f64 = 0.995;
/// Smallest ratio of the upper threshold to the floor of the lower one.
const SPAN: f64 = 4.0;
/// Σ (1 − n·n') W at the top of the sharpest crest of a steady wave, which has 120° (Stokes 1880):
/// the normals of its flanks are 30° off its own, a surface has π (h/d)² particles within h, and
/// the mean weight is 1/3.
const CREST: f64 = std::f64::consts::PI * SUPPORT * SUPPORT / 3.0 * (1.0 - 0.866_025_403_784_438_6);

/// Quantities at one water particle that cause whitewater.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Potentials {
    /// Trapped air, Σ |v_ij| (1 − v̂_ij · x̂_ij) W, m/s: water that collides with water.
    pub trapped_air: f64,
    /// Wave crest, Σ (1 − n̂_i · n̂_j) W over a convex surface where it moves outward.
    pub wave_crest: f64,
    /// Specific kinetic energy v²/2, J/kg.
    pub energy: f64,
    /// Share of water around the particle: 1 deep inside.
    pub share: f64,
}

/// Lower and upper threshold between which each potential rises from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Thresholds {
    /// Thresholds of trapped air, m/s.
    pub trapped_air: [f64; 2],
    /// Thresholds of wave crests, dimensionless.
    pub wave_crest: [f64; 2],
    /// Thresholds of energy, J/kg.
    pub energy: [f64; 2],
}

/// [`Potentials::trapped_air`] of a particle half a spacing behind a front of water that meets
/// water at rest at [`INCEPTION`]: 2π (h/d)³ ∫ (1 − r) (3 r²/2 − s r − s²/2) dr from s = d/2h to 1.
fn trapped_at_inception() -> f64 {
    let s = 0.5 / SUPPORT;
    let up_to = |r: f64| {
        r * (r * (0.5 * r - 0.5 * s - 0.375 * r * r + s * r / 3.0 + 0.25 * s * s) - 0.5 * s * s)
    };
    std::f64::consts::TAU * SUPPORT.powi(3) * (up_to(1.0) - up_to(s)) * INCEPTION
}

impl Thresholds {
    /// Calibrates the thresholds of a shot from the potentials of its particles: the lower one at
    /// the top tenth of the moving particles, but not below the physical floor. A calm shot thus
    /// has no whitewater, and a wild one has it where it is wildest.
    pub fn calibrate(potentials: &[Potentials]) -> Self {
        let floor = 0.5 * INCEPTION * INCEPTION;
        let moving: Vec<&Potentials> = potentials.iter().filter(|p| p.energy >= floor).collect();
        let between = |floor: f64, of: fn(&Potentials) -> f64| {
            let mut values: Vec<f64> = moving.iter().map(|p| of(p)).collect();
            values.sort_unstable_by(f64::total_cmp);
            let quantile = |part: f64| {
                let at = (part * values.len() as f64) as usize;
                values.get(at.min(values.len().saturating_sub(1))).copied()
            };
            let least = quantile(LEAST).unwrap_or(0.0).max(floor);
            let greatest = quantile(GREATEST).unwrap_or(0.0).max(SPAN * floor);
            // Both are written to a file that people read.
            [least, greatest.max(1.5 * least)].map(rounded)
        };
        Self {
            trapped_air: between(trapped_at_inception(), |p| p.trapped_air),
            wave_crest: between(CREST, |p| p.wave_crest),
            energy: [floor, energy(&moving, floor)],
        }
    }
}

/// Upper threshold of energy: that of the fastest tenth of the moving particles. A higher quantile
/// would be set by lone falling drops, which are faster than any water that traps air.
fn energy(moving: &[&Potentials], floor: f64) -> f64 {
    let mut energies: Vec<f64> = moving.iter().map(|p| p.energy).collect();
    energies.sort_unstable_by(f64::total_cmp);
    let fast = energies.get((LEAST * energies.len() as f64) as usize);
    rounded(fast.copied().unwrap_or(0.0).max(SPAN * floor))
}

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

    fn of_speed(speed: f64, trapped_air: f64) -> Potentials {
        Potentials {
            trapped_air,
            wave_crest: 0.1 * trapped_air,
            energy: 0.5 * speed * speed,
            share: 1.0,
        }
    }

    #[test]
    fn calm_shots_keep_the_floors_and_wild_ones_rise_above() {
        // 0.5 m/s is below the inception of air entrainment, whatever the potential.
        let calm = vec![of_speed(0.5, 40.0); 100];
        let floors = Thresholds::calibrate(&calm);
        assert_eq!(floors, Thresholds::calibrate(&[]));
        assert_eq!(floors.trapped_air, [3.76, 15.0]);
        assert_eq!(floors.wave_crest, [0.561, 2.24]);
        assert_eq!(floors.energy, [0.5, 2.0]);
        let wild: Vec<_> = (0..1000).map(|k| of_speed(4.0, f64::from(k))).collect();
        let thresholds = Thresholds::calibrate(&wild);
        assert_eq!(thresholds.trapped_air, [900.0, 1350.0]);
        assert_eq!(thresholds.energy, [0.5, 8.0]);
    }

    /// Checks the floor against a lattice sum: water below a plane moves up at 1 m/s towards water
    /// at rest above it. The sum for a particle in the last layer over its neighbours at rest on
    /// the other side is within 5 % of the integral.
    #[test]
    fn the_floor_is_two_fronts_that_meet() {
        let mut sum = 0.0;
        let reach = SUPPORT.ceil() as i32;
        for x in -reach..=reach {
            for y in -reach..=reach {
                for z in 1..=reach {
                    let r = f64::from(x * x + y * y + z * z).sqrt();
                    // v_ij = +z; x_ij points from the other particle to this one: −z.
                    let cosine = -f64::from(z) / r;
                    sum += (1.0 - cosine) * (1.0 - r / SUPPORT).max(0.0);
                }
            }
        }
        let floor = trapped_at_inception();
        assert!((sum / floor - 1.0).abs() < 0.05, "{sum} {floor}");
    }

    #[test]
    fn potentials_grow_between_their_thresholds() {
        let grown = [1.0, 2.0, 3.0, 4.0, 9.0].map(|x| grown(x, [2.0, 4.0]));
        assert_eq!(grown, [0.0, 0.0, 0.5, 1.0, 1.0]);
        assert_eq!(
            [0.012345, 1.2345, 98765.0].map(rounded),
            [0.0123, 1.23, 98800.0]
        );
    }
}
