//! Limits of a baseline's aggregates on adapters without recorded hashes: a multiple of how far
//! bakes diverge that differ only in roundings, frame by frame.
//!
//! Trajectories diverge exponentially, so a limit for the last frame says little about the first
//! ones, which show a changed constant best. For the shipped scenes the bakes are those of
//! `tools/regress --limits`: gravity changed by one last place up and down and tilted by 10⁻⁷, the
//! scene at three other positions, and the f64 reference instead of the adapter. FLIP's kinetic
//! energy spreads by a relative 2·10⁻⁷ to 10⁻³; PBF's by 10⁻⁶ to 3·10⁻⁵ in the first frame, and by
//! up to 5 % to 30 % in later ones. A bake at a fourth position, which was not used for the limits,
//! stays within them in all scenes with both solvers. The effect of a change of 1 %, in multiples
//! of the limits: `solver.flip.pic_blend` 2 to 84 in every scene; `solver.pbf.relaxation` 4 to 280
//! in every scene; `effects.viscosity` 2 to 8 in three scenes with FLIP, 4 in one with PBF; the
//! strength of `effects.vorticity_confinement` stays below 1 with both.

use std::collections::BTreeMap;

use super::{frames::aggregate_error, limits::StatedLimit};
use swell_domain::aggregates::Aggregates;

/// Multiple of the spread that is allowed. A second adapter is as far from exact arithmetic as the
/// first, so the two may be twice as far from each other as one of them is from f64; the rest is a
/// margin for chaos, since the spread is the largest of only a few samples.
const SPREADS: f64 = 5.0;

/// Eight roundings of a 32-bit value: the accuracy of sums of such values if no bake shows
/// a spread.
const ROUNDINGS: f64 = 8.0 * f32::EPSILON as f64;

/// Largest difference of each aggregate, by name.
pub type Spread = BTreeMap<String, f64>;

/// Smallest distinguishable difference of each aggregate, whatever was measured: name, absolute,
/// relative, reason. `spacing` is the distance of particles at rest, metres; lengths and volumes
/// come from cubes two spacings wide, which hold 8 particles (see `study::measure`).
fn resolution(spacing: f64, particles: usize) -> [(&'static str, f64, f64, &'static str); 8] {
    let cube = (2.0 * spacing).powi(3);
    let drops = 8.0 / particles.max(1) as f64;
    [
        ("kinetic_energy", 0.0, ROUNDINGS, "8 roundings of 32 bits"),
        ("potential_energy", 0.0, ROUNDINGS, "8 roundings of 32 bits"),
        ("volume", 2.0 * cube, 0.0, "2 cubes of the measure"),
        (
            "crest_height",
            0.25 * spacing,
            0.0,
            "a particle more in a column's top cube",
        ),
        (
            "front",
            0.25 * spacing,
            0.0,
            "a particle more in a column's top cube",
        ),
        (
            "splash_height",
            0.01 * spacing,
            0.0,
            "a hundredth of a spacing: the next particle by height",
        ),
        ("airborne", drops, 0.0, "the 8 particles of a cube"),
        (
            "density_error",
            ROUNDINGS,
            0.0,
            "8 roundings of 32 bits of a relative density",
        ),
    ]
}

/// Returns, for each frame of `expected`, the largest |a − b| of each aggregate in this frame or an
/// earlier one over all `bakes`, which have the same frames. Values that only one side has are
/// ignored, as in the comparison with a baseline.
pub fn of(expected: &[Aggregates], bakes: &[Vec<Aggregates>]) -> Vec<Spread> {
    let names = Aggregates::NAMES.map(|(name, _)| name);
    let mut most = [0.0; Aggregates::NAMES.len()];
    let mut spread = |(index, expected): (usize, &Aggregates)| {
        let b = expected.values();
        for bake in bakes {
            let a = bake[index].values();
            for ((most, a), b) in most.iter_mut().zip(a).zip(b) {
                let error = aggregate_error(a, b);
                if error.is_finite() {
                    *most = error.max(*most);
                }
            }
        }
        let pairs = names.into_iter().zip(most);
        pairs
            .map(|(name, most)| (name.to_owned(), rounded_up(most)))
            .collect()
    };
    expected.iter().enumerate().map(&mut spread).collect()
}

/// Returns the limits for frames with these spreads.
pub fn tolerances(
    spreads: &[Spread],
    spacing: f64,
    particles: usize,
) -> BTreeMap<String, StatedLimit> {
    let units = BTreeMap::from(Aggregates::NAMES);
    let stated = |(name, absolute, relative, why): (&'static str, f64, f64, &str)| {
        let last = spreads.last().and_then(|spread| spread.get(name));
        let most = last.copied().unwrap_or(0.0);
        let unit = units.get(name).copied().unwrap_or_default();
        let most = match (most, unit) {
            (0.0, _) => "none".to_owned(),
            (most, "") => format!("{most:e}"),
            (most, unit) => format!("{most:e} {unit}"),
        };
        let reason = format!(
            "{SPREADS} times the frame's spread between bakes that differ in roundings alone (in \
             the last frame {most}), and what the measure cannot tell: {why}"
        );
        let limit = StatedLimit {
            absolute,
            relative,
            spreads: SPREADS,
            reason,
        };
        (name.to_owned(), limit)
    };
    resolution(spacing, particles)
        .into_iter()
        .map(stated)
        .collect()
}

/// Rounds up to three significant digits.
fn rounded_up(value: f64) -> f64 {
    if value == 0.0 {
        return 0.0;
    }
    let unit = 10f64.powi(value.log10().floor() as i32 - 2);
    let digits = (value / unit).ceil();
    // Through text: products of powers of ten leave spurious digits.
    format!("{digits}e{}", unit.log10().round())
        .parse()
        .unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(energy: f64, front: Option<f64>) -> Aggregates {
        Aggregates {
            kinetic_energy: energy,
            front,
            ..Aggregates::default()
        }
    }

    #[test]
    fn the_spread_is_the_largest_so_far() {
        let base = [
            frame(0.0, None),
            frame(10.0, Some(1.0)),
            frame(20.0, Some(2.0)),
        ];
        let bakes = [
            vec![
                frame(0.0, None),
                frame(10.5, None),
                frame(20.25, Some(2.125)),
            ],
            vec![
                frame(0.0, None),
                frame(9.75, Some(1.0625)),
                frame(20.0, Some(2.0)),
            ],
        ];
        let found = of(&base, &bakes);
        let energies: Vec<f64> = found
            .iter()
            .map(|spread| spread["kinetic_energy"])
            .collect();
        assert_eq!(energies, [0.0, 0.5, 0.5]);
        // A front on only one side is ignored.
        let fronts: Vec<f64> = found.iter().map(|spread| spread["front"]).collect();
        assert_eq!(fronts, [0.0, 0.0625, 0.125]);
        let limits = tolerances(&found, 0.1, 10);
        assert_eq!(limits.len(), Aggregates::NAMES.len());
        let energy = &limits["kinetic_energy"];
        assert_eq!((energy.spreads, energy.absolute), (SPREADS, 0.0));
        assert!(energy.reason.contains("5e-1 J"), "{}", energy.reason);
    }

    #[test]
    fn digits_are_cut_upwards() {
        for (value, expected) in [
            (0.0, 0.0),
            (0.5, 0.5),
            (1.0001, 1.01),
            (123.4, 124.0),
            (9.999e-9, 1e-8),
            (4.0e7, 4.0e7),
        ] {
            assert_eq!(rounded_up(value), expected, "{value}");
        }
    }
}
