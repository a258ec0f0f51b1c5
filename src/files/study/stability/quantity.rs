//! Measured quantities of a stability run.

/// Reduction over the frames of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Over {
    /// The value farthest from the pass mark.
    Worst,
    /// The value of the last frame.
    Last,
}

/// A number per frame. Lengths without a unit are in units of the resolution: the particle spacing
/// with PBF, the cell size with FLIP.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Particles outside the domain.
    Escaped,
    /// Change of the number of particles, and ids that differ from those of the start.
    Lost,
    /// Non-finite components of position and velocity.
    NotFinite,
    /// Largest speed, m/s.
    Speed,
    /// Largest displacement per substep of the frame over the displacement cap.
    SpeedOverCap,
    /// Least distance between two particles, in particle spacings.
    LeastSpacing,
    /// Height of the highest particle above the highest one at the start, in particle spacings.
    Climb,
    /// Loss of the mean height, relative to that at the start.
    Sinking,
    /// Largest distance from the parabola of symplectic Euler's substeps, over the
    /// distance travelled.
    BallisticError,
    /// Largest rise of a particle above its lowest position so far, over its fall to that position.
    Rebound,
    /// |V/V0 − 1|, where V is enclosed by the level set of the particles and V0 is the volume
    /// of the particles.
    VolumeDrift,
    /// |V/V0 − 1| of filled cells of two spacings, those surrounded by water or walls, over
    /// the volume of their particles. Unlike the level set it is independent of the
    /// roughness of the surface.
    FilledVolume,
    /// Energy of water and bodies over that at the start, minus 1; heights are above the domain's
    /// floor.
    EnergyGain,
    /// Energy above its minimum so far, over that at the start.
    EnergyRise,
    /// Largest relative error of a pressure probe against ρ g depth, where depth is below the
    /// initial surface.
    PressureError,
    /// The same for each probe's mean over time.
    MeanPressureError,
    /// Mean of max(0, ρ/ρ0 − 1).
    Compression,
    /// Maximum of max(0, ρ/ρ0 − 1).
    LargestCompression,
    /// Largest relative residual of a projection.
    Residual,
    /// Number of pressure solves that ended above their tolerance.
    Missed,
    /// Number of bodies of water that touch no air.
    Pockets,
    /// Largest |mean ∇·u| over such a body, 1/s.
    Incompatible,
    /// Number of water cells without an open face.
    Dropped,
    /// Iterations per frame.
    Iterations,
    /// Substeps per frame.
    Substeps,
    /// Fraction of particle updates that were clamped to the displacement cap.
    Capped,
    /// Number of particles behind a moving wall.
    Behind,
    /// Largest depth of a particle within a solid, in units of the resolution.
    InSolid,
    /// Largest speed of any point of a body, m/s.
    BodySpeed,
    /// Bodies whose centre of mass is outside the domain or not a number.
    BodiesEscaped,
    /// Largest depth of a vertex of a body within another body, a solid or a wall, in units of
    /// the resolution.
    BodyOverlap,
    /// Number of particles in a box.
    InRegion,
    /// Largest distance between the positions of a particle in the two runs, in units
    /// of the resolution.
    Difference,
    /// RMS difference from the other run over its own displacement.
    DisplacementError,
    /// Iterations so far over those of the other run.
    IterationsRatio,
    /// Largest difference of an elevation probe between the runs, in units of the resolution.
    GaugeDifference,
    /// Difference of the elevation probes between the second and third run over that between the
    /// first and second, both RMS over the frames so far.
    GaugeConvergence,
}

/// Properties of a quantity.
pub struct About {
    /// Name used in studies.
    pub name: &'static str,
    /// Title with unit, for tables.
    pub title: &'static str,
    /// Number of other runs that it is compared with.
    pub others: usize,
    /// Whether it needs a box.
    pub takes_region: bool,
    /// Whether it can be compared with a later state than the start.
    pub takes_since: bool,
    /// Reduction over the frames.
    pub over: Over,
}

impl Quantity {
    /// All quantities, in the order of their discriminants.
    pub const ALL: [Self; 37] = [
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
        Self::BodySpeed,
        Self::BodiesEscaped,
        Self::BodyOverlap,
        Self::InRegion,
        Self::Difference,
        Self::DisplacementError,
        Self::IterationsRatio,
        Self::GaugeDifference,
        Self::GaugeConvergence,
    ];

    /// Quantities measured for every run, with a pass mark of 0.
    pub const ALWAYS: [Self; 3] = [Self::Escaped, Self::Lost, Self::NotFinite];

    /// Returns the name used in studies.
    pub fn name(self) -> &'static str {
        self.about().name
    }

    /// Returns the properties of the quantity.
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
            Self::BodySpeed => plain("body_speed", "fastest point of a body, m/s"),
            Self::BodiesEscaped => plain("bodies_escaped", "bodies outside of the domain"),
            Self::BodyOverlap => plain("body_overlap", "bodies within what they touch, d or Δx"),
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
