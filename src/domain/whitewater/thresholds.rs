//! Thresholds between which a potential grows from nothing to all, and how a shot calibrates them.

use serde::{Deserialize, Serialize};

use super::SUPPORT;

/// Speed at which water that meets water begins to carry air under, m/s: about 1 m/s for plunging jets and for breakers (Chanson
/// 1996, "Air bubble entrainment in free-surface turbulent shear flows", section 2.3).
const INCEPTION: f64 = 1.0;
/// Part of the moving particles below the least threshold where a shot asks for more than the floors.
const LEAST: f64 = 0.9;
/// Part of them below the greatest one.
const GREATEST: f64 = 0.995;
/// Between the thresholds at least, as a factor.
const SPAN: f64 = 4.0;
/// Σ (1 − n·n') W at the top of the sharpest crest that a wave keeps, which is one of 120° (Stokes 1880): the normals of its flanks
/// are 30° off its own, a surface has π (h/d)² particles within h, and each weighs 1/3 in the mean.
const CREST: f64 = std::f64::consts::PI * SUPPORT * SUPPORT / 3.0 * (1.0 - 0.866_025_403_784_438_6);

/// What at one water particle makes whitewater.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Potentials {
    /// Σ |v_ij| (1 − v̂_ij · x̂_ij) W, m/s: water that meets water.
    pub trapped_air: f64,
    /// Σ (1 − n̂_i · n̂_j) W over a surface that bends away, where it moves outward.
    pub wave_crest: f64,
    /// v²/2, J/kg.
    pub energy: f64,
    /// Of water about it: 1 deep inside.
    pub share: f64,
}

/// From where to where each potential grows from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Thresholds {
    /// m/s.
    pub trapped_air: [f64; 2],
    /// Without a unit.
    pub wave_crest: [f64; 2],
    /// J/kg.
    pub energy: [f64; 2],
}

/// Sum of [`Potentials::trapped_air`] where a front of water meets water at rest at [`INCEPTION`], of a particle half a spacing
/// behind the front: 2π (h/d)³ ∫ (1 − r) (3 r²/2 − s r − s²/2) dr from s = d/2h to 1.
fn trapped_at_inception() -> f64 {
    let s = 0.5 / SUPPORT;
    let up_to = |r: f64| {
        r * (r * (0.5 * r - 0.5 * s - 0.375 * r * r + s * r / 3.0 + 0.25 * s * s) - 0.5 * s * s)
    };
    std::f64::consts::TAU * SUPPORT.powi(3) * (up_to(1.0) - up_to(s)) * INCEPTION
}

impl Thresholds {
    /// Those of a shot, from the potentials of its particles: where the moving tenth begins, and no lower than where nature does.
    /// So a calm shot has no whitewater, and a wild one has it where it is wildest.
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
            // Both are written into a file that people read.
            [least, greatest.max(1.5 * least)].map(rounded)
        };
        Self {
            trapped_air: between(trapped_at_inception(), |p| p.trapped_air),
            wave_crest: between(CREST, |p| p.wave_crest),
            energy: [floor, energy(&moving, floor)],
        }
    }
}

/// Energy from which on there is no want of it: that of the fastest tenth, as lone drops that fall are faster than any water that
/// traps air.
fn energy(moving: &[&Potentials], floor: f64) -> f64 {
    let mut energies: Vec<f64> = moving.iter().map(|p| p.energy).collect();
    energies.sort_unstable_by(f64::total_cmp);
    let fast = energies.get((LEAST * energies.len() as f64) as usize);
    rounded(fast.copied().unwrap_or(0.0).max(SPAN * floor))
}

/// Three digits.
fn rounded(value: f64) -> f64 {
    let scale = 10f64.powi(2 - value.log10().floor() as i32);
    (value * scale).round() / scale
}

/// Φ: 0 up to the least threshold, 1 from the greatest on (Ihmsen 2012, eq. 1).
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
        // Half a metre a second: below what carries air under, however much of it there is.
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

    /// The sum that the floor stands for, over a lattice: water below a plane moves up at 1 m/s towards water at rest above it. One
    /// particle in the last layer, its neighbours at rest on the other side; the lattice's sum is within 5 % of the integral.
    #[test]
    fn the_floor_is_two_fronts_that_meet() {
        let mut sum = 0.0;
        let reach = SUPPORT.ceil() as i32;
        for x in -reach..=reach {
            for y in -reach..=reach {
                for z in 1..=reach {
                    let r = f64::from(x * x + y * y + z * z).sqrt();
                    // v_ij = +z, x_ij points from the other to this one: −z.
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
