//! Generation zones in front of walls, in which the water is relaxed towards given waves:
//! these waves enter the domain, and outgoing ones are damped (relaxation zone, Jacobsen,
//! Fuhrman and Fredsøe 2012).

use std::f64::consts::TAU;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{Absorbs, Effect, zone::Zone};
use crate::{Wall, open_waves::Waves};
use swell_domain::open_waves::OpenWaves;

/// Key of the waves.
pub const WAVES: &str = "effects.generation_zone.waves";

/// Relaxation rate at the wall over the angular frequency of the waves.
///
/// The deviation from the target waves satisfies the equation of an absorbing zone; at the
/// wall, which is at rest, it equals the waves themselves. In shallow water a zone of 1.5
/// wavelengths then transmits 1.2 % of that error into its waves and reflects 0.6 % of outgoing
/// ones; one of a wavelength 5.9 and 4.1 %. (A rate of 2.5 transmits 4.6 and 14 %, one of 6
/// reflects 2.0 and 7.3 %.)
const RATE: f64 = 4.0;

/// Least length in wavelengths. In shallow water 13 % of the height of such a zone's waves is
/// wrong, and 30 % for half a wavelength.
const LEAST: f64 = 0.75;

/// `generation_zone = { walls = ["-x"], length = 9.4, waves = { kind = "stokes", height = 0.1,
/// period = 2.3, depth = 1.0 } }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Walls with a zone, each listed once.
    pub walls: Vec<Wall>,
    /// Length of each zone from its wall, metres.
    pub length: f64,
    /// Incoming waves.
    pub waves: Waves,
}

impl Settings {
    /// Returns the zones with their relaxation rate.
    pub fn zone(&self) -> Zone<'_> {
        Zone {
            walls: &self.walls,
            length: self.length,
            rate: RATE * TAU / self.waves.period(),
        }
    }

    /// Returns the incoming waves for a gravity, m/s².
    pub fn incoming(&self, gravity: DVec3) -> OpenWaves {
        self.waves.by(gravity.length())
    }
}

impl Effect for Settings {
    fn absorbs(&self) -> Option<Absorbs<'_>> {
        Some(Absorbs {
            zone: self.zone(),
            period: self.waves.period(),
            least: LEAST,
        })
    }

    fn generates(&self) -> Option<(&'static str, &Waves)> {
        Some((WAVES, &self.waves))
    }
}

#[cfg(test)]
mod tests;
