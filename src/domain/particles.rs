//! State of the particles: exactly what one frame of a cache holds.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{absorber::AbsorberStates, body::BodyState, bounds::Bounds, deep::Deep};

/// Particles that a thread takes at a time: a task takes longer than to hand it over.
pub const AT_ONCE: usize = 1 << 14;

/// Particles in the order of their ids.
///
/// Between two frames the simulation has no other state, so every frame is a checkpoint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Particles {
    /// Positions, metres, relative to the scene's origin, which is the world's except for scenes
    /// far from it.
    pub position: Vec<[f32; 3]>,
    /// Velocities, m/s.
    pub velocity: Vec<[f32; 3]>,
    /// Ids, unique and ascending.
    pub id: Vec<u32>,
    /// Additional attributes declared by effects, by name, with one value per particle.
    pub attributes: BTreeMap<String, Vec<f32>>,
    /// State of absorbing walls from this time on; caches store it in their ledger.
    pub walls: AbsorberStates,
    /// States of the bodies that the water moves, in the scene's order; caches store them in their
    /// ledger.
    pub bodies: Vec<BodyState>,
    /// Length of the substep that ended in this state, seconds; 0 if there was none. Caches store
    /// it in their ledger.
    pub substep: f64,
    /// Water without particles, below those of a band; empty if particles are everywhere.
    pub deep: Deep,
}

impl Particles {
    /// Returns the number of particles.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Returns whether there are no particles.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Adds particles at rest with ids from 2³¹ on, whose attributes are 0.
    pub fn extend_at_rest(&mut self, positions: &[[f32; 3]]) {
        self.id
            .extend((0..positions.len() as u32).map(|k| (1 << 31) + k));
        self.position.extend_from_slice(positions);
        self.velocity.resize(self.position.len(), [0.0; 3]);
        for column in self.attributes.values_mut() {
            column.resize(self.position.len(), 0.0);
        }
    }

    /// Returns the particles with positions relative to the origin `to` instead of `from`, both in
    /// world coordinates, metres; bodies as well. Positions are rounded to f32.
    #[must_use]
    pub fn about(mut self, from: DVec3, to: DVec3) -> Self {
        if from != to {
            for p in &mut self.position {
                let local = Vec3::from_array(*p).as_dvec3() + (from - to);
                *p = local.as_vec3().to_array();
            }
            for body in &mut self.bodies {
                body.centre += from - to;
            }
            if !self.deep.is_empty() {
                self.deep.grid.origin += from - to;
            }
        }
        self
    }

    /// Keeps the particles that are marked in `keep`, in their order.
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

    /// Returns how many particles are outside a box.
    pub fn count_outside(&self, room: &Bounds) -> usize {
        let is_outside = |x: &&[f32; 3]| !room.contains(Vec3::from_array(**x).as_dvec3());
        let all = self.position.par_iter().with_min_len(AT_ONCE);
        all.filter(is_outside).count()
    }

    /// Returns the largest speed, m/s; 0 without particles.
    pub fn max_speed(&self) -> f64 {
        max_speed(&self.velocity)
    }

    /// Returns how many particles have values that are not finite, and a description of the first;
    /// `None` if there are none. `density` is one relative density per particle, if known.
    pub fn first_not_finite(&self, density: Option<&[f64]>) -> Option<(u64, String)> {
        let is_bad = |v: &[f32; 3]| !v.iter().all(|x| x.is_finite());
        let density = |k: usize| density.map_or(1.0, |density| density[k]);
        let is_bad = |k: &usize| {
            is_bad(&self.position[*k]) || is_bad(&self.velocity[*k]) || !density(*k).is_finite()
        };
        let all = (0..self.len()).into_par_iter().with_min_len(AT_ONCE);
        if !all.any(|k| is_bad(&k)) {
            return None;
        }
        let mut bad = (0..self.len()).filter(is_bad);
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

/// Returns the largest of these speeds, m/s; 0 for none. NaN does not count.
pub fn max_speed(velocity: &[[f32; 3]]) -> f64 {
    // The root of the largest square has the bits of the largest root.
    let square = |v: &[f32; 3]| Vec3::from_array(*v).as_dvec3().length_squared();
    let all = velocity.par_iter().with_min_len(AT_ONCE);
    all.map(square).reduce(|| 0.0, f64::max).sqrt()
}
