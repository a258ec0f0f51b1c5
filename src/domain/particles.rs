//! A particle state: exactly what one cache frame holds.

use std::collections::BTreeMap;

/// Particles in the order of their ids.
///
/// The state between two frames is this and nothing else, so every frame is a checkpoint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Particles {
    /// World positions, metres.
    pub position: Vec<[f32; 3]>,
    /// Velocities, metres per second.
    pub velocity: Vec<[f32; 3]>,
    /// Unique and ascending.
    pub id: Vec<u32>,
    /// Further attributes that an effect declares, one value a particle, by name.
    pub attributes: BTreeMap<String, Vec<f32>>,
}

impl Particles {
    /// Number of particles.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether there is no particle.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }
}
