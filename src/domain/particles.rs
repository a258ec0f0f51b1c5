//! A particle state: exactly what one cache frame holds.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};

use super::answer::Answers;

/// Particles in the order of their ids.
///
/// The state between two frames is this and nothing else, so every frame is a checkpoint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Particles {
    /// Positions, metres, about the scene's origin: the world's, but for scenes far off.
    pub position: Vec<[f32; 3]>,
    /// Velocities, metres per second.
    pub velocity: Vec<[f32; 3]>,
    /// Unique and ascending.
    pub id: Vec<u32>,
    /// Further attributes that an effect declares, one value a particle, by name.
    pub attributes: BTreeMap<String, Vec<f32>>,
    /// What walls that absorb do from then on; a cache has it in its ledger.
    pub walls: Answers,
    /// Length of the substep that ended in this state, seconds; 0 where none did. A cache has it in its ledger.
    pub substep: f64,
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

    /// The particles with their positions about another origin; both in the world, metres. What 32 bits do not hold is
    /// rounded.
    #[must_use]
    pub fn about(mut self, from: DVec3, to: DVec3) -> Self {
        if from != to {
            for p in &mut self.position {
                let local = Vec3::from_array(*p).as_dvec3() + (from - to);
                *p = local.as_vec3().to_array();
            }
        }
        self
    }

    /// Keeps those that are marked, in their order.
    pub fn retain(&mut self, keep: &[bool]) {
        fn kept<T>(values: &mut Vec<T>, keep: &[bool]) {
            let mut marks = keep.iter();
            values.retain(|_| marks.next() == Some(&true));
        }
        kept(&mut self.position, keep);
        kept(&mut self.velocity, keep);
        kept(&mut self.id, keep);
        for column in self.attributes.values_mut() {
            kept(column, keep);
        }
    }

    /// Largest speed, m/s; 0 without particles.
    pub fn max_speed(&self) -> f64 {
        self.velocity
            .iter()
            .map(|v| Vec3::from_array(*v).as_dvec3().length())
            .fold(0.0, f64::max)
    }

    /// How many particles are not finite, and the first of them in words; `density` is one relative density a particle,
    /// where there is any.
    pub fn first_not_finite(&self, density: Option<&[f64]>) -> Option<(u64, String)> {
        let is_bad = |v: &[f32; 3]| !v.iter().all(|x| x.is_finite());
        let density = |k: usize| density.map_or(1.0, |density| density[k]);
        let mut bad = (0..self.len()).filter(|&k| {
            is_bad(&self.position[k]) || is_bad(&self.velocity[k]) || !density(k).is_finite()
        });
        let k = bad.next()?;
        let first = format!(
            "particle {} first: position {:?}, velocity {:?}, relative density {}",
            self.id[k],
            self.position[k],
            self.velocity[k],
            density(k)
        );
        Some((1 + bad.count() as u64, first))
    }
}
