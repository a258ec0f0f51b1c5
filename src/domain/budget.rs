//! Limits that a bake must keep, and the report when it exceeds one.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A quantity that is monitored while a bake runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Watched {
    /// Values that are not finite numbers.
    NotFinite,
    /// Particles that are missing, duplicated or outside of the domain at a frame's end.
    Particles,
    /// Particles after a frame, including those that entered at its end.
    Count,
    /// Substeps that a frame requires.
    Substeps,
    /// Largest particle speed at a frame's end, m/s.
    Speed,
    /// Largest particle speed at a frame's end, m/s, limited by the state before the frame and what
    /// gravity and walls can add.
    SpeedJump,
    /// Mean of max(0, ρ/ρ0 − 1) at a frame's end.
    DensityErrorMean,
    /// 99th percentile of max(0, ρ/ρ0 − 1) at a frame's end.
    DensityErrorP99,
    /// Largest max(0, ρ/ρ0 − 1) at a frame's end.
    DensityErrorMax,
    /// Number of times that a particle was slowed to the displacement cap, divided by particles
    /// and substeps.
    Capped,
    /// Relative true residual of a projection.
    Residual,
    /// Largest |∇·u| Δt in a water cell after a projection.
    Divergence,
    /// |V/V0 − 1| at a frame's end, with V0 the volume at the start.
    Volume,
    /// Rise of the total energy within a frame beyond the work done on the water, relative to
    /// the total.
    Energy,
}

impl Watched {
    /// Each quantity, its name in reports, and its phrase in messages.
    const NAMED: [(Self, &'static str, &'static str); 14] = [
        (Self::NotFinite, "not_finite", "values that are not finite"),
        (
            Self::Particles,
            "particles_lost",
            "particles lost, doubled or outside",
        ),
        (
            Self::Count,
            "particles",
            "the count of particles with what entered",
        ),
        (Self::Substeps, "max_substeps", "substeps asked for"),
        (Self::Speed, "speed", "the largest speed, m/s,"),
        (Self::SpeedJump, "speed_jump", "the largest speed, m/s,"),
        (
            Self::DensityErrorMean,
            "density_error_mean",
            "the mean density error",
        ),
        (
            Self::DensityErrorP99,
            "density_error_p99",
            "the density error's 99th percentile",
        ),
        (
            Self::DensityErrorMax,
            "density_error_max",
            "the largest density error",
        ),
        (
            Self::Capped,
            "capped",
            "the part of particles slowed to the displacement cap",
        ),
        (
            Self::Residual,
            "residual",
            "the relative residual of the projection",
        ),
        (
            Self::Divergence,
            "divergence",
            "the largest |∇·u| Δt after the projection",
        ),
        (Self::Volume, "volume", "the volume's drift from the start"),
        (
            Self::Energy,
            "energy",
            "the energy's rise beyond the work done, of the total,",
        ),
    ];

    fn row(self) -> (Self, &'static str, &'static str) {
        // In the order of the variants; a test checks this.
        Self::NAMED[self as usize]
    }

    /// Returns the name used in reports and in `[budget]`.
    pub fn name(self) -> &'static str {
        self.row().1
    }
}

/// A limit that was exceeded. The state before the frame is kept.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub struct Breach {
    /// Output frame that could not be computed.
    pub frame: u32,
    /// Substep within the frame, from 1, if the breach was found in one.
    pub substep: Option<u32>,
    /// Quantity that exceeded its limit.
    pub watched: Watched,
    /// Measured value.
    pub measured: f64,
    /// Largest value allowed.
    pub limit: f64,
    /// A further sentence for the message.
    pub detail: Option<String>,
}

impl Breach {
    /// Builds the breach of a limit of `[budget]`.
    pub fn new(frame: u32, watched: Watched, measured: f64, limit: f64) -> Self {
        Self {
            frame,
            substep: None,
            watched,
            measured,
            limit,
            detail: None,
        }
    }

    /// Builds the breach for `count` values that are not finite.
    pub fn not_finite(frame: u32, count: u64, detail: Option<String>) -> Self {
        Self {
            detail,
            ..Self::new(frame, Watched::NotFinite, count as f64, 0.0)
        }
    }

    /// Adds the substep in which the breach was found.
    pub fn in_substep(self, substep: u32) -> Self {
        Self {
            substep: Some(substep),
            ..self
        }
    }

    /// Checks that a value is finite and does not exceed `limit`; `None` is no limit.
    ///
    /// # Errors
    /// The breach, if the value exceeds the limit or is not finite.
    pub fn check(
        frame: u32,
        watched: Watched,
        measured: f64,
        limit: Option<f64>,
    ) -> Result<(), Self> {
        if !measured.is_finite() {
            let detail = format!("{} is {measured}", watched.row().2.trim_end_matches(','));
            return Err(Self::not_finite(frame, 1, Some(detail)));
        }
        match limit {
            Some(limit) if measured > limit => Err(Self::new(frame, watched, measured, limit)),
            _ => Ok(()),
        }
    }
}

/// Formats a value with few digits: four decimals, or three in exponential notation.
struct Short(f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            value if value == value.trunc() && value.abs() < 1e9 => write!(f, "{value}"),
            value if (0.001..10_000.0).contains(&value.abs()) => write!(f, "{value:.4}"),
            value => write!(f, "{value:.3e}"),
        }
    }
}

impl fmt::Display for Breach {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "frame {}", self.frame)?;
        if let Some(substep) = self.substep {
            write!(f, ", substep {substep}")?;
        }
        let (watched, name, words) = self.watched.row();
        let (measured, limit) = (Short(self.measured), Short(self.limit));
        match watched {
            Watched::NotFinite | Watched::Particles => write!(f, ": {measured} {words}")?,
            Watched::Substeps => write!(f, ": {measured} {words}, and {name} is {limit}")?,
            Watched::SpeedJump => write!(
                f,
                ": {words} is {measured}, and budget.{name} allows {limit}"
            )?,
            // The limit as the scene states it, and the value in full where both would round to the
            // same text.
            _ if Short(self.measured).to_string() == Short(self.limit).to_string() => {
                let [measured, limit] = [self.measured, self.limit];
                write!(f, ": {words} is {measured}, and budget.{name} is {limit}")?;
            }
            _ => write!(f, ": {words} is {measured}, and budget.{name} is {limit}")?,
        }
        match &self.detail {
            Some(detail) => write!(f, " ({detail})"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_stand_in_the_order_of_the_variants() {
        for (k, (watched, ..)) in Watched::NAMED.into_iter().enumerate() {
            assert_eq!(watched as usize, k);
        }
    }

    #[test]
    fn a_breach_is_told_with_frame_substep_measure_and_limit() {
        let check = |measured, limit| Breach::check(7, Watched::Residual, measured, limit);
        assert_eq!(check(0.01, Some(0.01)), Ok(()));
        assert_eq!(check(1e9, None), Ok(()));
        let breach = check(0.034, Some(0.01)).unwrap_err().in_substep(2);
        assert_eq!(
            breach.to_string(),
            "frame 7, substep 2: the relative residual of the projection is 0.0340, and \
             budget.residual is 0.0100"
        );
        // A value that rounds to the same digits as the limit.
        let close = check(0.010_000_4, Some(0.01)).unwrap_err().to_string();
        assert!(
            close.contains("is 0.0100004, and budget.residual is 0.01"),
            "{close}"
        );
        // NaN exceeds every limit, and is a breach even without one.
        for limit in [Some(0.01), None] {
            let breach = check(f64::NAN, limit).unwrap_err();
            assert_eq!(breach.watched, Watched::NotFinite);
            assert!(breach.to_string().contains("is NaN"), "{breach}");
        }
    }
}
