//! Streams beside the water that a look draws.

use serde::Deserialize;

/// Rendering of a whitewater stream.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WhitewaterLook {
    /// Name of the stream in `CACHE/whitewater`.
    pub stream: String,
    /// Extinction within a whitewater particle, 1/m.
    pub density_per_metre: f64,
    /// Factor on the particle radius.
    pub size: f64,
    /// Fraction of the light on it that foam reflects.
    pub foam_albedo: f64,
    /// Factor on the area of foam.
    pub foam_amount: f64,
}

/// Rendering of wet solids.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WetLook {
    /// Name of the stream in `CACHE/wet`.
    pub stream: String,
    /// Root mean square slope of the film's surface.
    pub roughness: f64,
}
