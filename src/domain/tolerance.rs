//! Tolerances of a comparison of two results.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Limits of a comparison; quantities without a limit are reported but not judged.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tolerance {
    /// Limits by field: `position` (metres), `velocity` (m/s), and attributes by name.
    pub fields: BTreeMap<String, FieldLimits>,
    /// Limits by the names of [`Aggregates::NAMES`](super::aggregates::Aggregates::NAMES).
    pub aggregates: BTreeMap<String, ErrorLimit>,
    /// Limits of image comparisons.
    pub pictures: PictureLimits,
}

/// Largest allowed errors of one field in any frame, in its unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldLimits {
    /// Largest error of a particle.
    pub max: Option<f64>,
    /// Root mean square error.
    pub rms: Option<f64>,
    /// Error that 99 % of the particles do not exceed.
    pub p99: Option<f64>,
}

/// A limit of the form |a − b| ≤ absolute + relative · |b|.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ErrorLimit {
    /// Absolute term, in the value's unit.
    pub absolute: f64,
    /// Factor relative to the reference b.
    pub relative: f64,
}

impl ErrorLimit {
    /// Returns the largest allowed error for `reference`.
    pub fn allowed(&self, reference: f64) -> f64 {
        self.absolute + self.relative * reference.abs()
    }
}

/// Limits of a comparison of two images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PictureLimits {
    /// Mean error over the pixels.
    pub mean: Option<f64>,
    /// Error that 99 % of the pixels do not exceed.
    pub p99: Option<f64>,
    /// Largest error of a pixel.
    pub max: Option<f64>,
    /// Least SSIMULACRA 2 score; 100 means no visible difference.
    pub perceptual: Option<f64>,
}
