//! Quantities measured at each frame and written beside the particles.

use glam::{DVec2, DVec3};

use super::{Scene, Wall};
use swell_domain::probe::Rate;

/// A gauge with its own CSV file in the cache.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// Safe as a file name; unique in the scene, ignoring case.
    pub name: String,
    /// Measured quantity.
    pub kind: ProbeKind,
    /// Sampling rate.
    pub rate: Rate,
    /// Length of the window before each sample over which mean, minimum and maximum are also
    /// reported, seconds.
    pub window: Option<f64>,
}

/// Quantity that a probe measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProbeKind {
    /// Height of the water surface.
    Elevation {
        /// x and z, metres.
        at: DVec2,
    },
    /// Water pressure at a point.
    Pressure {
        /// Position, metres.
        at: DVec3,
    },
    /// Kinetic, potential and total energy of all water.
    Energy,
    /// Volume of all water.
    Volume,
    /// Position of the front along an axis: the given fraction of the water is behind it.
    Front {
        /// Wall that the front moves towards.
        towards: Wall,
        /// Fraction of the water behind the front, in (0, 1].
        quantile: f64,
    },
    /// Highest water that is connected to the main body.
    RunUp {
        /// Fraction of the main body below that height, in (0, 1].
        quantile: f64,
    },
    /// Volume flow rate through a plane.
    Flux {
        /// Wall towards which the flow is positive.
        towards: Wall,
        /// Position of the plane along the axis, metres.
        at: f64,
    },
    /// Pressure force on a solid or a wall, and its moment.
    Force {
        /// Body that bears the force.
        on: Bearer,
        /// Reference point of the moment, metres.
        about: DVec3,
    },
}

/// Body on which a force is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bearer {
    /// Index into [`Scene::solids`].
    Solid(usize),
    /// Index into [`Scene::moving_solids`].
    MovingSolid(usize),
    /// A face of the domain, including its wave maker.
    Wall(Wall),
}

impl Bearer {
    /// Returns the name used in scenes: the wall's name, or the index among all solids with the
    /// static ones first.
    pub fn name(self, scene: &Scene) -> String {
        match self {
            Self::Solid(index) => index.to_string(),
            Self::MovingSolid(index) => (scene.solids.len() + index).to_string(),
            Self::Wall(wall) => wall.name().to_owned(),
        }
    }
}

impl ProbeKind {
    /// Names used in scenes.
    pub const NAMES: [&str; 8] = [
        "elevation",
        "pressure",
        "energy",
        "volume",
        "front",
        "run_up",
        "flux",
        "force",
    ];

    /// Returns the name used in scenes.
    pub fn name(self) -> &'static str {
        Self::NAMES[match self {
            Self::Elevation { .. } => 0,
            Self::Pressure { .. } => 1,
            Self::Energy => 2,
            Self::Volume => 3,
            Self::Front { .. } => 4,
            Self::RunUp { .. } => 5,
            Self::Flux { .. } => 6,
            Self::Force { .. } => 7,
        }]
    }

    /// Returns the names of the values per sample, with units.
    pub fn columns(self) -> &'static [&'static str] {
        match self {
            Self::Elevation { .. } => &["elevation_m"],
            Self::Pressure { .. } => &["pressure_Pa"],
            Self::Energy => &["kinetic_J", "potential_J", "total_J"],
            Self::Volume => &["volume_m3"],
            Self::Front { .. } => &["front_m"],
            Self::RunUp { .. } => &["run_up_m"],
            Self::Flux { .. } => &["flux_m3/s"],
            Self::Force { .. } => &[
                "force_x_N",
                "force_y_N",
                "force_z_N",
                "moment_x_Nm",
                "moment_y_Nm",
                "moment_z_Nm",
            ],
        }
    }

    /// Returns the probe's position in world coordinates, metres: x and z, or x, y and z,
    /// the position of a plane, the reference point of a moment, or nothing. `origin` is
    /// that of the scene.
    pub fn at(self, origin: DVec3) -> Vec<f64> {
        match self {
            Self::Elevation { at } => (at + DVec2::new(origin.x, origin.z)).to_array().to_vec(),
            Self::Pressure { at } | Self::Force { about: at, .. } => {
                (at + origin).to_array().to_vec()
            }
            Self::Flux { towards, at } => vec![at + origin[towards.axis]],
            Self::Energy | Self::Volume | Self::Front { .. } | Self::RunUp { .. } => Vec::new(),
        }
    }

    /// Returns the positive direction of a front or a flux.
    pub fn towards(self) -> Option<Wall> {
        match self {
            Self::Front { towards, .. } | Self::Flux { towards, .. } => Some(towards),
            _ => None,
        }
    }

    /// Returns the fraction of the water that a front or a run-up uses.
    pub fn quantile(self) -> Option<f64> {
        match self {
            Self::Front { quantile, .. } | Self::RunUp { quantile } => Some(quantile),
            _ => None,
        }
    }
}
