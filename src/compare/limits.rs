//! Limits of a baseline's aggregates, each with its reason.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use swell_domain::aggregates::Aggregates;

/// Limits for a scene whose spread was not measured ([`super::spread`]): name, absolute limit
/// (lengths in particle spacings, everything else in its own unit), relative limit, reason. They
/// are wide enough for water after an impact with either solver. The measurements are the largest
/// over the shipped scenes in the frames that `tools/regress` bakes, with gravity changed in its
/// last place (-9.81 to -9.810001, by a diff of the caches).
const DEFAULT_TOLERANCES: [(&str, f64, f64, &str); 8] = [
    (
        "kinetic_energy",
        0.0,
        0.03,
        "gravity off by its last place: 0.8 % (wave-city, PBF); other drivers round everywhere",
    ),
    (
        "potential_energy",
        0.0,
        0.001,
        "gravity off by its last place: 0.03 % (quickstart, PBF)",
    ),
    (
        "volume",
        0.0,
        0.01,
        "gravity off by its last place: 0.2 % (quickstart, PBF)",
    ),
    (
        "crest_height",
        0.5,
        0.0,
        "half a particle spacing; gravity off by its last place: 0.08 spacings (quickstart, PBF)",
    ),
    (
        "front",
        0.5,
        0.0,
        "half a particle spacing; gravity off by its last place: 0.1 spacings (quickstart, PBF)",
    ),
    (
        "splash_height",
        1.0,
        0.0,
        "a particle spacing; gravity off by its last place: 0.15 spacings (quickstart, PBF)",
    ),
    (
        "airborne",
        0.002,
        0.0,
        "few drops, each with a way of its own; gravity off by its last place: \
         0.0004 (quickstart, PBF)",
    ),
    (
        "density_error",
        1e-4,
        0.1,
        "gravity off by its last place: 2.7 % (dam-break, PBF)",
    ),
];

/// A limit and its reason.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatedLimit {
    /// Absolute term, in the aggregate's unit.
    pub absolute: f64,
    /// Factor relative to the baseline's value.
    pub relative: f64,
    /// Factor of the frame's spread. The three terms are added.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub spreads: f64,
    /// Reason for the limit.
    pub reason: String,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Returns the default limits of a new baseline; `spacing` is the distance of particles at
/// rest, metres.
pub fn default_tolerances(spacing: f64) -> BTreeMap<String, StatedLimit> {
    let is_length = |name: &str| Aggregates::NAMES.contains(&(name, "m"));
    let stated = |&(name, absolute, relative, reason): &(&str, f64, f64, &str)| {
        let limit = StatedLimit {
            absolute: absolute * if is_length(name) { spacing } else { 1.0 },
            relative,
            spreads: 0.0,
            reason: reason.to_owned(),
        };
        (name.to_owned(), limit)
    };
    DEFAULT_TOLERANCES.iter().map(stated).collect()
}
