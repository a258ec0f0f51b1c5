//! Quantities that compare frames whose particles cannot be compared one by one: after an impact,
//! two bakes that differ by a rounding error have different trajectories but the same energies,
//! volume and wave.

use serde::{Deserialize, Serialize};

/// Sums and shapes of one frame; `None` where there is nothing to measure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aggregates {
    /// Kinetic energy, Σ ½ m v², J.
    pub kinetic_energy: f64,
    /// Potential energy, −Σ m g · (x − the domain's least corner), J.
    pub potential_energy: f64,
    /// Volume of the continuous water, m³.
    pub volume: f64,
    /// Median crest height over the rows along the wave's direction, metres above the still level.
    pub crest_height: f64,
    /// Distance that the wave's front has travelled, metres; `None` if there is no wave.
    pub front: Option<f64>,
    /// Height that 99.9 % of the particles do not exceed, metres above the still level.
    pub splash_height: f64,
    /// Fraction of the particles that are detached from the continuous water.
    pub airborne: f64,
    /// Mean of max(0, ρ/ρ0 − 1) as the solver reports it; `None` for the start, which has
    /// no report.
    pub density_error: Option<f64>,
}

impl Aggregates {
    /// Names and units, in the order of [`Self::values`].
    pub const NAMES: [(&str, &str); 8] = [
        ("kinetic_energy", "J"),
        ("potential_energy", "J"),
        ("volume", "m³"),
        ("crest_height", "m"),
        ("front", "m"),
        ("splash_height", "m"),
        ("airborne", ""),
        ("density_error", ""),
    ];

    /// Returns the values in the order of [`Self::NAMES`].
    pub fn values(&self) -> [Option<f64>; 8] {
        [
            Some(self.kinetic_energy),
            Some(self.potential_energy),
            Some(self.volume),
            Some(self.crest_height),
            self.front,
            Some(self.splash_height),
            Some(self.airborne),
            self.density_error,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each value is under its own name.
    #[test]
    fn values_stand_in_the_order_of_their_names() {
        for (k, (name, _)) in Aggregates::NAMES.into_iter().enumerate() {
            let mut table = serde_json::json!({
                "kinetic_energy": 0.0, "potential_energy": 0.0, "volume": 0.0, "crest_height": 0.0,
                "front": 0.0, "splash_height": 0.0, "airborne": 0.0, "density_error": 0.0,
            });
            table[name] = 1.0.into();
            let values = serde_json::from_value::<Aggregates>(table)
                .unwrap()
                .values();
            for (at, value) in values.into_iter().enumerate() {
                assert_eq!(value, Some(f64::from(u8::from(at == k))), "{name}");
            }
        }
    }
}
