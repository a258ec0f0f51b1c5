//! What is measured of a run.

/// How the numbers of a run's frames come to one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Over {
    /// The one farthest from the pass mark.
    Worst,
    /// The last frame's.
    Last,
}

/// A number a frame. Where a length is meant without a unit, it is that of the resolution: the particle spacing with
/// PBF, the cell size with FLIP.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Particles outside of the domain.
    Escaped,
    /// Particles fewer, or more, than at the start, and ids that are not those of the start.
    Lost,
    /// Values of position and velocity that are not finite.
    NotFinite,
    /// Largest speed, m/s.
    Speed,
    /// Largest displacement in a substep of the frame, over the one to which particles are slowed.
    SpeedOverCap,
    /// Least distance of two particles, in particle spacings.
    LeastSpacing,
    /// How far the highest particle is above the highest of the start, in particle spacings.
    Climb,
    /// What the mean height has lost, over that of the start.
    Sinking,
    /// Farthest from the parabola of symplectic Euler's substeps, over the way that the particle has come.
    BallisticError,
    /// Highest that a particle has risen above its lowest place so far, over what it had fallen until there.
    Rebound,
    /// |V/V0 − 1| of what the level set about the particles encloses, V0 that of the particles.
    VolumeDrift,
    /// |V/V0 − 1| of the water that fills its cells of two spacings: those that water or walls surround, over what their
    /// particles hold. Unlike the level set it does not see how rough the surface is.
    FilledVolume,
    /// Energy over that of the start, less 1; heights count from the domain's floor.
    EnergyGain,
    /// Energy above the least so far, over that of the start.
    EnergyRise,
    /// Farthest that a probe of pressure is from ρ g depth, over that; depth is below the surface of the start.
    PressureError,
    /// The same of each probe's mean over time.
    MeanPressureError,
    /// Mean of max(0, ρ/ρ0 − 1).
    Compression,
    /// Its maximum.
    LargestCompression,
    /// Largest relative residual of a projection.
    Residual,
    /// Pressure solves that ended above their tolerance.
    Missed,
    /// Bodies of water that no air touches.
    Pockets,
    /// Largest |mean of ∇·u| over such a body, 1/s.
    Incompatible,
    /// Cells of water without an open face.
    Dropped,
    /// Iterations of the frame.
    Iterations,
    /// Substeps of the frame.
    Substeps,
    /// Times that a particle was slowed, over particles and substeps.
    Capped,
    /// Particles behind a wall that moves.
    Behind,
    /// How deep a particle is in a solid, in units of the resolution.
    InSolid,
    /// Particles in a box.
    InRegion,
    /// Farthest that a particle is from where the other run has it, in units of the resolution.
    Difference,
    /// Root mean square difference from the other run over its own displacement.
    DisplacementError,
    /// Iterations so far over those of the other run.
    IterationsRatio,
    /// Largest difference of a probe of elevation from the other run's, in units of the resolution.
    GaugeDifference,
    /// Difference of the probes of elevation between the second and third run over that between first and second, both
    /// root mean square over the frames so far.
    GaugeConvergence,
}

/// Name, words and unit for a table, what it needs.
pub struct About {
    /// As studies name it.
    pub name: &'static str,
    /// In words, with its unit.
    pub title: &'static str,
    /// Other runs that it needs beside the case's own.
    pub others: usize,
    /// Whether it needs a box.
    pub takes_region: bool,
    /// Whether it can be held against a later state than the start.
    pub takes_since: bool,
    /// How frames come to one.
    pub over: Over,
}

impl Quantity {
    /// All, in order.
    pub const ALL: [Self; 34] = [
        Self::Escaped,
        Self::Lost,
        Self::NotFinite,
        Self::Speed,
        Self::SpeedOverCap,
        Self::LeastSpacing,
        Self::Climb,
        Self::Sinking,
        Self::BallisticError,
        Self::Rebound,
        Self::VolumeDrift,
        Self::FilledVolume,
        Self::EnergyGain,
        Self::EnergyRise,
        Self::PressureError,
        Self::MeanPressureError,
        Self::Compression,
        Self::LargestCompression,
        Self::Residual,
        Self::Missed,
        Self::Pockets,
        Self::Incompatible,
        Self::Dropped,
        Self::Iterations,
        Self::Substeps,
        Self::Capped,
        Self::Behind,
        Self::InSolid,
        Self::InRegion,
        Self::Difference,
        Self::DisplacementError,
        Self::IterationsRatio,
        Self::GaugeDifference,
        Self::GaugeConvergence,
    ];

    /// What every run is measured for, with 0 as mark.
    pub const ALWAYS: [Self; 3] = [Self::Escaped, Self::Lost, Self::NotFinite];

    /// As studies name it.
    pub fn name(self) -> &'static str {
        self.about().name
    }

    /// Of each.
    pub fn about(self) -> About {
        let plain = |name, title| About {
            name,
            title,
            others: 0,
            takes_region: false,
            takes_since: false,
            over: Over::Worst,
        };
        let of_pair = |name, title| About {
            others: 1,
            ..plain(name, title)
        };
        let drifting = |name, title| About {
            takes_since: true,
            ..plain(name, title)
        };
        let last = |about: About| About {
            over: Over::Last,
            ..about
        };
        match self {
            Self::Escaped => plain("escaped", "particles outside of the domain"),
            Self::Lost => plain("lost", "particles lost or doubled"),
            Self::NotFinite => plain("not_finite", "values that are not finite"),
            Self::Speed => plain("speed", "largest speed, m/s"),
            Self::SpeedOverCap => plain("speed_over_cap", "largest speed over the cap"),
            Self::LeastSpacing => plain("least_spacing", "least distance of two particles, d"),
            Self::Climb => plain("climb", "highest particle above the start's, d"),
            Self::Sinking => drifting("sinking", "mean height lost, of the start's"),
            Self::BallisticError => plain("ballistic_error", "off the parabola, of the way"),
            Self::Rebound => plain("rebound", "rise from the lowest place, of the fall to it"),
            Self::VolumeDrift => drifting("volume_drift", "volume in the level set, off V0"),
            Self::FilledVolume => drifting("filled_volume", "volume of filled cells, off V0"),
            Self::EnergyGain => plain("energy_gain", "energy above the start's, of it"),
            Self::EnergyRise => plain(
                "energy_rise",
                "energy above the least so far, of the start's",
            ),
            Self::PressureError => plain("pressure_error", "pressure, off ρ g depth"),
            Self::MeanPressureError => {
                last(plain("mean_pressure_error", "mean pressure, off ρ g depth"))
            }
            Self::Compression => plain("compression", "mean of max(0, ρ/ρ0 − 1)"),
            Self::LargestCompression => plain("largest_compression", "largest ρ/ρ0 − 1"),
            Self::Residual => plain("residual", "residual of the projection"),
            Self::Missed => plain("missed", "pressure solves above their tolerance"),
            Self::Pockets => plain("pockets", "bodies of water that no air touches"),
            Self::Incompatible => plain("incompatible", "mean ∇·u of such a body, 1/s"),
            Self::Dropped => plain("dropped", "cells of water without an open face"),
            Self::Iterations => plain("iterations", "iterations a frame"),
            Self::Substeps => plain("substeps", "substeps a frame"),
            Self::Capped => plain("capped", "slowed, of particles and substeps"),
            Self::Behind => plain("behind", "particles behind a moving wall"),
            Self::InSolid => plain("in_solid", "deepest within a solid, d or Δx"),
            Self::InRegion => About {
                takes_region: true,
                ..plain("in_region", "particles in a box")
            },
            Self::Difference => About {
                takes_region: true,
                ..of_pair("difference", "off the other run, d or Δx")
            },
            Self::DisplacementError => {
                of_pair("displacement_error", "displacement, off the other run's")
            }
            Self::IterationsRatio => last(of_pair(
                "iterations_ratio",
                "iterations over the other run's",
            )),
            Self::GaugeDifference => of_pair(
                "gauge_difference",
                "elevation, off the other run's, d or Δx",
            ),
            Self::GaugeConvergence => last(About {
                others: 2,
                ..plain(
                    "gauge_convergence",
                    "difference of the finer pair over the coarser's",
                )
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_stands_once_in_order() {
        for (place, quantity) in Quantity::ALL.into_iter().enumerate() {
            assert_eq!(quantity as usize, place);
            let same = Quantity::ALL.iter().filter(|q| q.name() == quantity.name());
            assert_eq!(same.count(), 1, "{}", quantity.name());
        }
    }
}
