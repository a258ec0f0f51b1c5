//! Waves on open water, as specified in a scene.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use crate::{
    lint::{CREST, Made},
    waves,
};
use swell_domain::{
    motion::{RegularWaves, Spectrum},
    open_waves::{Meeting, OpenSea, OpenWaves},
};

/// Waves as specified in a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Waves {
    /// Regular waves to second order.
    Stokes(Regular),
    /// Waves of a spectrum with random phases.
    Sea(Sea),
    /// Waves of a spectrum whose crests meet at a given position and time.
    Focused(Packet),
}

/// Regular waves as specified in a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Regular {
    /// Height from trough to crest, metres.
    pub height: f64,
    /// Wave period, seconds.
    pub period: f64,
    /// Still-water depth, metres.
    pub depth: f64,
    /// Depth of the water that is simulated, metres; `None` for all of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub simulated_depth: Option<f64>,
    /// Time until the full height is reached, seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ramp: Option<f64>,
    /// Direction of propagation, from +x towards +z.
    pub direction_degrees: f64,
}

/// Defines waves of a spectrum as specified in a scene: the documentation and keys of `$name`, then
/// the keys common to all spectra.
macro_rules! of_spectrum {
    ($(#[$about:meta])* $name:ident { $($own:tt)* }) => {
        $(#[$about])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($own)*
            /// Form of the spectrum.
            pub spectrum: Spectrum,
            /// Peak enhancement factor γ.
            #[serde(skip_serializing_if = "Option::is_none")]
            pub peak_enhancement: Option<f64>,
            /// Peak period, seconds.
            pub peak_period: f64,
            /// Period of the shortest waves, seconds.
            #[serde(skip_serializing_if = "Option::is_none")]
            pub shortest_period: Option<f64>,
            /// Still-water depth, metres.
            pub depth: f64,
            /// Depth of the water that is simulated, metres; `None` for all of it.
            #[serde(skip_serializing_if = "Option::is_none")]
            pub simulated_depth: Option<f64>,
            /// Time until the full height is reached, seconds.
            #[serde(skip_serializing_if = "Option::is_none")]
            pub ramp: Option<f64>,
            /// Main direction of propagation, from +x towards +z.
            pub direction_degrees: f64,
            /// Exponent s of the directional spreading (cos ½θ)^2s; without it all waves
            /// have one direction.
            #[serde(skip_serializing_if = "Option::is_none")]
            pub spreading: Option<f64>,
        }

        impl $name {
            /// Returns the sea with all defaults filled in, for a gravity, m/s².
            pub fn asked(&self, gravity: f64) -> OpenSea {
                OpenSea {
                    spectrum: self.spectrum,
                    meeting: self.meeting(),
                    peak_period: self.peak_period,
                    peak_enhancement: waves::peak_enhancement(self.spectrum, self.peak_enhancement),
                    shortest_period: (self.shortest_period)
                        .unwrap_or(waves::SHORTEST * self.peak_period),
                    depth: self.depth,
                    gravity,
                    ramp: self.ramp.unwrap_or(waves::RAMP * self.peak_period),
                    spreading: self.spreading,
                }
            }
        }
    };
}

of_spectrum! {
    /// A random sea as specified in a scene.
    Sea {
        /// Significant wave height: four standard deviations of the elevation, metres.
        pub significant_height: f64,
        /// Seed of the random phases.
        pub seed: u32,
    }
}

of_spectrum! {
    /// A focused wave packet as specified in a scene.
    Packet {
        /// Height of the crest above still water by linear theory, metres.
        pub height: f64,
        /// x and z where the crests meet, metres from the domain's least corner.
        pub at: [f64; 2],
        /// Time at which they meet, seconds.
        pub time: f64,
    }
}

impl Regular {
    /// Returns the waves with all defaults filled in, for a gravity, m/s².
    pub fn asked(&self, gravity: f64) -> RegularWaves {
        let water = [self.height, self.period, self.depth, gravity];
        waves::regular(water, self.ramp)
    }
}

impl Sea {
    fn meeting(&self) -> Meeting {
        Meeting::Random {
            significant_height: self.significant_height,
            seed: self.seed,
        }
    }
}

impl Packet {
    fn meeting(&self) -> Meeting {
        Meeting::Focused {
            height: self.height,
            at: DVec2::from_array(self.at),
            time: self.time,
        }
    }
}

impl Waves {
    /// Returns the spectrum and the given γ; `None` for regular waves.
    pub fn spectral(&self, gravity: f64) -> Option<(OpenSea, Option<f64>)> {
        match self {
            Self::Stokes(_) => None,
            Self::Sea(sea) => Some((sea.asked(gravity), sea.peak_enhancement)),
            Self::Focused(packet) => Some((packet.asked(gravity), packet.peak_enhancement)),
        }
    }

    /// Returns the period (the peak's for a spectrum), seconds, the still-water depth, metres, and
    /// the direction, degrees.
    pub fn common(&self) -> [f64; 3] {
        match self {
            Self::Stokes(waves) => [waves.period, waves.depth, waves.direction_degrees],
            Self::Sea(sea) => [sea.peak_period, sea.depth, sea.direction_degrees],
            Self::Focused(packet) => [packet.peak_period, packet.depth, packet.direction_degrees],
        }
    }

    /// Returns the depth of the water that is simulated, metres, if it is not all.
    pub fn simulated_depth(&self) -> Option<f64> {
        match self {
            Self::Stokes(waves) => waves.simulated_depth,
            Self::Sea(sea) => sea.simulated_depth,
            Self::Focused(packet) => packet.simulated_depth,
        }
    }

    /// Returns the height of still water above the domain's floor, metres.
    pub fn level(&self) -> f64 {
        self.simulated_depth().unwrap_or(self.common()[1])
    }

    /// Returns the exponent of the directional spreading; `None` for waves of one direction.
    pub fn spreading(&self) -> Option<f64> {
        match self {
            Self::Stokes(_) => None,
            Self::Sea(sea) => sea.spreading,
            Self::Focused(packet) => packet.spreading,
        }
    }

    /// Returns the period, or the peak period of a spectrum, seconds.
    pub fn period(&self) -> f64 {
        self.common()[0]
    }

    /// Returns what lints have to know of the waves of `key`.
    pub(crate) fn made(&self, key: String) -> Made {
        let (height, crest) = match self {
            Self::Stokes(waves) => (waves.height, 0.5 * waves.height),
            Self::Sea(sea) => (sea.significant_height, CREST * sea.significant_height),
            Self::Focused(packet) => (packet.height, packet.height),
        };
        let [period, depth, _] = self.common();
        Made {
            key,
            height,
            crest,
            period: Some(period),
            depth: Some(depth),
            simulated_depth: self.simulated_depth(),
            ramp: 0.0,
            meets: match self {
                Self::Focused(packet) => Some(packet.time),
                Self::Stokes(_) | Self::Sea(_) => None,
            },
        }
    }

    /// Returns the waves for a gravity, m/s².
    pub fn by(&self, gravity: f64) -> OpenWaves {
        let direction = self.common()[2].to_radians();
        let waves = match self {
            Self::Stokes(waves) => {
                OpenWaves::regular(&waves.asked(gravity), DVec2::from_angle(direction))
            }
            Self::Sea(sea) => OpenWaves::sea(&sea.asked(gravity), direction),
            Self::Focused(packet) => OpenWaves::sea(&packet.asked(gravity), direction),
        };
        waves.above(self.level())
    }
}
