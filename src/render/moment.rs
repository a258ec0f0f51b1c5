//! What a picture of a frame is made from: its particles, and those of the frames around it.

use std::{borrow::Cow, sync::OnceLock};

use super::neighbors;
use swell_domain::particles::Particles;
use swell_scene::look::{AovSpec, Look};

/// Frames on either side that the membership of a particle is made steady over.
pub const REACH: u32 = 2;

/// A frame's particles, with what is found out about them once.
#[derive(Debug, Default)]
pub struct Water {
    /// As they stand in the cache.
    pub particles: Particles,
    /// Weight of each one's neighbours.
    weights: OnceLock<Vec<f32>>,
}

impl Water {
    /// Of these particles.
    pub fn new(particles: Particles) -> Self {
        Self {
            particles,
            weights: OnceLock::new(),
        }
    }

    /// Weight of each one's neighbours; `spacing` is always the bake's.
    pub(super) fn weights(&self, spacing: f32) -> &[f32] {
        self.weights
            .get_or_init(|| neighbors::weights(&self.particles.position, spacing))
    }
}

/// What a picture is made from. Frames that are left out change how blur and spray are drawn, as
/// [`frames_around`] says; they are all the same whatever was drawn before.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// The frame's own water.
    pub water: &'a Water,
    /// That of the frames 2 and 1 before it, and 1 and 2 after it; `None` where there is none.
    pub around: [Option<&'a Water>; 2 * REACH as usize],
    /// Spray, foam and bubbles of the frame.
    pub white: &'a Particles,
}

impl<'a> Moment<'a> {
    /// Of a frame of which nothing else is known.
    pub fn alone(water: &'a Water, white: &'a Particles) -> Self {
        Self {
            water,
            around: [None; 2 * REACH as usize],
            white,
        }
    }

    /// The frames just before and just after it.
    pub(super) fn beside(&self) -> [Option<&'a Particles>; 2] {
        let [_, before, after, _] = self.around;
        [before, after].map(|it| it.map(|it| &it.particles))
    }
}

/// On how many sides of a frame, and how far, a look's pictures take the frames around it into account: one for motion blur and
/// `forward`, two for spray, none otherwise.
pub fn frames_around(look: &Look) -> u32 {
    let spec = look.spec();
    if spec.water.spray.is_some() {
        REACH
    } else {
        u32::from(spec.image.shutter > 0.0 || look.wants(AovSpec::Forward))
    }
}

/// Which particle has which id.
pub(super) struct Ids<'a> {
    ids: Cow<'a, [u32]>,
    /// Places in the order of ids; `None` where that is their own.
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

    /// Where the particle of an id is.
    pub(super) fn find(&self, id: u32) -> Option<usize> {
        match &self.order {
            None => {
                // Ids are numbers in a row where no particle was added or lost.
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

    /// Ids in a row, with gaps, and in no order.
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
