//! Input of a frame's picture: its particles and those of the frames around it.

use std::{borrow::Cow, sync::OnceLock};

use super::neighbors;
use swell_domain::particles::Particles;
use swell_scene::look::{AovSpec, Look};

/// Number of frames on either side over which the classification of particles is filtered.
pub const REACH: u32 = 2;

/// Particles of a frame, with lazily computed properties.
#[derive(Debug, Default)]
pub struct WaterParticles {
    /// Particles as the cache stores them.
    pub particles: Particles,
    /// Weight of each particle's neighbours.
    weights: OnceLock<Vec<f32>>,
}

impl WaterParticles {
    /// Creates the water of a frame from its particles.
    pub fn new(particles: Particles) -> Self {
        Self {
            particles,
            weights: OnceLock::new(),
        }
    }

    /// Weight of each particle's neighbours. The first call determines `spacing`, which is always
    /// that of the bake.
    pub(super) fn weights(&self, spacing: f32) -> &[f32] {
        self.weights
            .get_or_init(|| neighbors::weights(&self.particles.position, spacing))
    }
}

/// Water and whitewater from which a picture is made. Missing neighbouring frames change blur and
/// spray, as [`frames_around`] says. The result does not depend on what was drawn before.
#[derive(Clone, Copy, Debug)]
pub struct FrameInputs<'a> {
    /// Water of the frame itself.
    pub water: &'a WaterParticles,
    /// Water of the frames 2 and 1 before, and 1 and 2 after; `None` for a frame that does not
    /// exist.
    pub around: [Option<&'a WaterParticles>; 2 * REACH as usize],
    /// Spray, foam and bubbles of the frame.
    pub white: &'a Particles,
}

impl<'a> FrameInputs<'a> {
    /// Inputs without neighbouring frames.
    pub fn alone(water: &'a WaterParticles, white: &'a Particles) -> Self {
        Self {
            water,
            around: [None; 2 * REACH as usize],
            white,
        }
    }

    /// Particles of the frames just before and just after.
    pub(super) fn beside(&self) -> [Option<&'a Particles>; 2] {
        let [_, before, after, _] = self.around;
        [before, after].map(|it| it.map(|it| &it.particles))
    }
}

/// Number of frames on each side of a frame that a look's pictures depend on: two for spray, one
/// for motion blur and `forward`, otherwise none.
pub fn frames_around(look: &Look) -> u32 {
    let spec = look.spec();
    if spec.water.spray.is_some() {
        REACH
    } else {
        u32::from(spec.image.shutter > 0.0 || look.wants(AovSpec::Forward))
    }
}

/// Index from ids to positions of particles.
pub(super) struct Ids<'a> {
    ids: Cow<'a, [u32]>,
    /// Positions in the order of ids; `None` where the ids are sorted already.
    order: Option<Vec<u32>>,
}

impl<'a> Ids<'a> {
    pub(super) fn of(particles: &'a Particles) -> Self {
        let ids = match particles.id.len() == particles.len() {
            true => Cow::Borrowed(&particles.id[..]),
            false => Cow::Owned((0..particles.len() as u32).collect()),
        };
        let is_sorted = ids.windows(2).all(|pair| pair[0] < pair[1]);
        let order = (!is_sorted).then(|| {
            let mut order: Vec<u32> = (0..ids.len() as u32).collect();
            order.sort_by_key(|&place| ids[place as usize]);
            order
        });
        Self { ids, order }
    }

    pub(super) fn id(&self, place: usize) -> u32 {
        self.ids[place]
    }

    /// Position of the particle with an id.
    pub(super) fn find(&self, id: u32) -> Option<usize> {
        match &self.order {
            None => {
                // Ids are consecutive where no particle was added or removed.
                let first = self.ids.first()?;
                let place = id.wrapping_sub(*first) as usize;
                match self.ids.get(place) == Some(&id) {
                    true => Some(place),
                    false => self.ids.binary_search(&id).ok(),
                }
            }
            Some(order) => {
                let found = order.binary_search_by_key(&id, |&place| self.ids[place as usize]);
                found.ok().map(|k| order[k] as usize)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ids that are consecutive, with gaps, and unsorted.
    #[test]
    fn each_id_is_found_and_no_other() {
        for ids in [
            vec![5, 6, 7, 8],
            vec![5, 6, 9, 12],
            vec![9, 5, 12, 7],
            vec![],
        ] {
            let particles = Particles {
                position: vec![[0.0; 3]; ids.len()],
                id: ids.clone(),
                ..Particles::default()
            };
            let found = Ids::of(&particles);
            for id in 0..20 {
                assert_eq!(
                    found.find(id),
                    ids.iter().position(|it| *it == id),
                    "{id} of {ids:?}"
                );
            }
        }
    }
}
