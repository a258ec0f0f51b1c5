//! Whitewater: spray, foam and bubbles, generated from a finished bake (Ihmsen, Akinci, Akinci and
//! Teschner 2012, "Unified spray, foam and air bubbles for particle-based fluids").
//!
//! The motion of whitewater particles between two frames is a pass on the GPU, with its f64
//! reference in `reference::whitewater`. Births and deaths are decided here, in f64 on the host,
//! for both.

mod ages;
mod bubbles;
mod kills;
mod seeds;
mod thresholds;

use crate::{particles::Particles, sampling::finalized};

pub use ages::grow_older;
pub use kills::{Kill, KillDomain, KillMesh, KillRoom, kill};
pub use seeds::{Births, SeedWater};
pub use thresholds::{CLOSING, Potentials, ShotScale, Thresholds};

/// Names of a whitewater particle's attributes besides position, velocity and id, sorted as in
/// a frame.
pub const ATTRIBUTES: [&str; 4] = [AGE, KIND, LIFE, RADIUS];
/// Attribute: time since birth, seconds.
pub const AGE: &str = "age";
/// Attribute: [`WhitewaterKind`] as a number.
pub const KIND: &str = "kind";
/// Attribute: remaining life as foam, seconds.
pub const LIFE: &str = "life";
/// Attribute: radius, metres.
pub const RADIUS: &str = "radius";

/// Support radius of all sums over water, particle spacings.
pub const SUPPORT: f64 = 2.0;
/// Share of water around a point below which it is in the air: about 0.6 spacings above a surface
/// at rest.
pub const AIR_BELOW: f64 = 0.15;
/// Share of water above which a point is under the surface: about half a spacing below one at rest.
pub const WATER_ABOVE: f64 = 0.8;
/// Values of the density gradient's length times h at which a particle begins to count as at the
/// surface, and at which it fully does. A plane half a spacing above it gives 0.95, one and a half
/// spacings 0.02.
pub const SURFACE: [f64; 2] = [0.3, 0.6];
/// Cosines of the angle between velocity and normal at which a crest begins to count as moving
/// outward, and at which it fully does; Ihmsen's 0.6 lies in between.
pub const OUTWARD: [f64; 2] = [0.5, 0.7];
/// Steps of a flight per frame.
pub const FLIGHT_STEPS: u32 = 8;
/// Bisection steps in the search for the point where a frame's path meets the surface.
pub const HALVINGS: u32 = 5;

/// Kind of a whitewater particle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WhitewaterKind {
    /// A drop in the air, which flies.
    Spray,
    /// Foam on the surface, which the water carries.
    Foam,
    /// Air under the surface, which rises.
    Bubble,
}

impl WhitewaterKind {
    /// All kinds, in the order of their numbers.
    pub const ALL: [Self; 3] = [Self::Spray, Self::Foam, Self::Bubble];

    /// Shares of water at which one kind becomes another.
    pub const THRESHOLDS: [f64; 2] = [AIR_BELOW, WATER_ABOVE];

    /// Returns the kind for a share of water around a particle.
    pub fn of_share(share: f64) -> Self {
        if share < AIR_BELOW {
            Self::Spray
        } else if share > WATER_ABOVE {
            Self::Bubble
        } else {
            Self::Foam
        }
    }

    /// Returns the kind's number in frames and shaders.
    pub fn number(self) -> f32 {
        self as u8 as f32
    }

    /// Returns the kind with this number; `None` if there is none.
    pub fn of_number(number: f32) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.number() == number)
    }

    /// Returns the kind's name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Spray => "spray",
            Self::Foam => "foam",
            Self::Bubble => "bubbles",
        }
    }
}

/// Settings of a whitewater stream: a settings file with its thresholds calibrated.
#[derive(Clone, Debug, PartialEq)]
pub struct CompleteSettings {
    /// Seed of all random numbers.
    pub seed: u32,
    /// Largest number of particles; a frame with more ends the job.
    pub max_particles: u32,
    /// Least and greatest radius of a whitewater particle, metres.
    pub radius: [f64; 2],
    /// Whitewater particles born of a cubic metre that water closes where it meets water, 1/m³.
    pub trapped_air_rate: f64,
    /// Whitewater particles born per second of a cubic metre of water in crests, 1/(m³ s).
    pub wave_crest_rate: f64,
    /// Thresholds of the three potentials.
    pub thresholds: Thresholds,
    /// Radius of the drops that a spray particle represents, metres; it determines their drag.
    pub drop_radius: f64,
    /// Velocity of the air, m/s.
    pub wind: [f64; 3],
    /// Least and greatest lifetime of foam, seconds.
    pub lifetime: [f64; 2],
    /// Number of foam particles on a square metre above which foam dies faster, 1/m².
    pub crowd: f64,
    /// Speed of all bubbles through still water, m/s; `None` if each rises as its size does.
    pub rise_speed: Option<f64>,
    /// Relaxation time of a bubble's velocity towards that of the water, seconds.
    pub response: f64,
    /// Kill volumes.
    pub kills: Vec<Kill>,
}

impl CompleteSettings {
    /// Returns the speed at which the whitewater particle with this id rises as a bubble, m/s.
    pub fn rise_of(&self, id: u32) -> f64 {
        self.rise_speed.unwrap_or_else(|| bubbles::rise_of(id))
    }
}

/// Returns an empty whitewater state, with all attributes.
pub fn none() -> Particles {
    Particles {
        attributes: ATTRIBUTES.map(|name| (name.to_owned(), Vec::new())).into(),
        ..Particles::default()
    }
}

/// Returns the particles of these kinds.
#[must_use]
pub fn of_kinds(mut particles: Particles, kinds: &[WhitewaterKind]) -> Particles {
    let is_kept = |number: &f32| kinds.iter().any(|kind| kind.number() == *number);
    let numbers = particles.attributes.get(KIND);
    let keep: Vec<bool> = numbers.map_or(Vec::new(), |all| all.iter().map(is_kept).collect());
    particles.retain(&keep);
    particles
}

/// Counts the particles of each kind, in the order of [`WhitewaterKind::ALL`].
pub fn census(particles: &Particles) -> [usize; 3] {
    let kinds = particles
        .attributes
        .get(KIND)
        .map_or(&[][..], Vec::as_slice);
    WhitewaterKind::ALL.map(|kind| kinds.iter().filter(|&&k| k == kind.number()).count())
}

/// Returns a pseudo-random number in 0..1 that a particle keeps, by its id.
pub fn random_of(id: u32) -> f64 {
    random(0, id, 0, 0)
}

/// A pseudo-random number in 0..1 for these keys.
fn random(seed: u32, id: u32, frame: u32, channel: u32) -> f64 {
    let z = (u64::from(seed) << 32 | u64::from(id)).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (u64::from(frame) << 32 | u64::from(channel)).wrapping_mul(0xD1B5_4A32_D192_ED03);
    (finalized(z) >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests_support {
    use super::{CompleteSettings, Thresholds};

    pub(super) fn settings() -> CompleteSettings {
        CompleteSettings {
            seed: 1,
            max_particles: 1_000_000,
            radius: [0.005, 0.02],
            trapped_air_rate: 2500.0,
            wave_crest_rate: 50_000.0,
            thresholds: Thresholds::default(),
            drop_radius: 1e-3,
            wind: [0.0; 3],
            lifetime: [0.5, 4.0],
            crowd: 400.0,
            rise_speed: Some(0.25),
            response: 0.1,
            kills: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_numbers_are_even_and_belong_to_their_place() {
        let all: Vec<f64> = (0..4000).map(|id| random(1, id, 7, 0)).collect();
        let mean = all.iter().sum::<f64>() / 4000.0;
        let squares = all.iter().map(|x| (x - 0.5).powi(2)).sum::<f64>() / 4000.0;
        // Standard errors of 4000 uniform numbers: 0.0046 of the mean, 0.0012 of the variance; four
        // of each are allowed.
        assert!((mean - 0.5).abs() < 0.019, "{mean}");
        assert!((squares - 1.0 / 12.0).abs() < 0.005, "{squares}");
        let other = [(2, 0, 7, 0), (1, 1, 7, 0), (1, 0, 8, 0), (1, 0, 7, 1)];
        for (seed, id, frame, channel) in other {
            assert_ne!(random(seed, id, frame, channel), random(1, 0, 7, 0));
        }
    }

    #[test]
    fn kinds_have_numbers_and_shares() {
        for kind in WhitewaterKind::ALL {
            assert_eq!(WhitewaterKind::of_number(kind.number()), Some(kind));
        }
        assert_eq!(WhitewaterKind::of_number(0.5), None);
        let kinds = [0.0, 0.5, 1.0].map(WhitewaterKind::of_share);
        assert_eq!(kinds, WhitewaterKind::ALL);
    }
}
