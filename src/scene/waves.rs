//! Defaults and limits of waves that wave makers and generation zones share.

use swell_domain::motion::{RegularWaves, Spectrum};

/// Default of the shortest period over the peak period. What is left out has 1.5 % of the energy of
/// the Pierson-Moskowitz spectrum.
pub const SHORTEST: f64 = 1.0 / 3.0;

/// Default of γ: the mean of the JONSWAP measurements off Sylt (Hasselmann et al. 1973).
pub const PEAK_ENHANCEMENT: f64 = 3.3;

/// Default duration of the ramp to full size, in (peak) periods.
pub const RAMP: f64 = 2.0;

/// Largest steepness of a wave, H / (λ tanh kh) (Miche 1944).
pub const STEEPEST: f64 = 0.142;

/// Returns γ; 1 for the Pierson-Moskowitz form.
pub fn peak_enhancement(spectrum: Spectrum, given: Option<f64>) -> f64 {
    match spectrum {
        Spectrum::PiersonMoskowitz => 1.0,
        _ => given.unwrap_or(PEAK_ENHANCEMENT),
    }
}

/// Largest wave height on shallow water, in depths (McCowan 1894).
pub const HIGHEST: f64 = 0.78;

/// Returns the waves of a table with defaults filled in.
pub fn regular([height, period, depth, gravity]: [f64; 4], ramp: Option<f64>) -> RegularWaves {
    RegularWaves {
        height,
        period,
        depth,
        gravity,
        ramp: ramp.unwrap_or(RAMP * period),
    }
}
