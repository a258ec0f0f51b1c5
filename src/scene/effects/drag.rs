//! Air drag on detached water: drops, and sheets thinner than a neighbourhood.

use std::f64::consts::PI;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{Effect, Grain, Push};
use crate::words::shown;
use swell_domain::air;

/// `drag = { drop_radius = 0.001, wind = [8.0, 0.0, 0.0] }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Radius of the drops that an isolated particle represents, metres.
    pub drop_radius: f64,
    /// Air velocity, m/s.
    pub wind: [f64; 3],
}

impl Settings {
    /// Returns the air velocity, m/s.
    pub fn wind(&self) -> DVec3 {
        DVec3::from_array(self.wind)
    }
}

impl Effect for Settings {
    fn looks_at_neighbors(&self) -> bool {
        true
    }

    fn lint(&self, Grain { spacing, .. }: Grain) -> Option<String> {
        let worth = 4.0 / 3.0 * PI * (self.drop_radius / spacing).powi(3);
        (worth > 1.0).then(|| {
            format!(
                "effects.drag.drop_radius: a drop of {} m radius holds {worth:.1} times the water \
                 of a particle, but may hold only a part of it",
                shown(self.drop_radius)
            )
        })
    }

    /// Bounds the acceleration by that of a drop at rest, and the gain by the speed of the wind; a
    /// flying drop gains less.
    fn push(&self) -> Push {
        let wind = self.wind().length();
        Push {
            acceleration: air::resistance(self.drop_radius, wind) * wind,
            speed: wind,
        }
    }
}
