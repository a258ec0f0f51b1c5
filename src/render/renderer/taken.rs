//! Takes a frame's particles: their air and their paths.

use rayon::prelude::*;

use crate::{
    FrameInputs, RenderError, RenderScene,
    aeration::{self, CLEAR, Fall},
    paths::{Path, paths},
    uniform::Particle,
};
use swell_domain::{parallel, particles::Particles};
use swell_scene::look::{AovSpec, Look};

/// Particles of a frame relative to the domain's least corner, with their air.
pub(super) struct Taken {
    pub(super) packed: Vec<Particle>,
    /// Path of each particle; empty where the look needs no motion.
    pub(super) ways: Vec<Path>,
}

impl Taken {
    pub(super) fn of(
        look: &Look,
        scene: &RenderScene,
        frame: u32,
        inputs: &FrameInputs<'_>,
    ) -> Result<Self, RenderError> {
        let water = &inputs.water.particles;
        let spec = look.spec();
        let mut packed = pack(scene, frame, water)?;
        if let Some(spray) = &spec.water.spray {
            let fall = Fall::of(scene, packed.len());
            let standing = aeration::standing(inputs, &fall);
            aeration::classify(&mut packed, &standing, spray, &fall);
        }
        let ways = match spec.image.shutter > 0.0 || look.wants(AovSpec::Forward) {
            true => paths(
                water,
                inputs.beside(),
                frame_seconds(scene),
                scene.domain.size(),
            ),
            false => Vec::new(),
        };
        Ok(Self { packed, ways })
    }
}

pub(super) fn frame_seconds(scene: &RenderScene) -> f32 {
    (1.0 / scene.frames_per_second) as f32
}

/// Converts particles to positions relative to the domain's least corner.
fn pack(
    scene: &RenderScene,
    frame: u32,
    particles: &Particles,
) -> Result<Vec<Particle>, RenderError> {
    let origin = scene.domain.min;
    let (places, velocities) = (&particles.position, &particles.velocity);
    let is_finite = |(p, v): (&[f32; 3], &[f32; 3])| p.iter().chain(v).all(|x| x.is_finite());
    let both = places.par_iter().zip(velocities);
    if let Some(index) = both.position_first(|it| !is_finite(it)) {
        return Err(RenderError::NotFinite { index, frame });
    }
    let pack = |index: usize| Particle {
        position: [0, 1, 2].map(|k| (f64::from(places[index][k]) - origin[k]) as f32),
        air: CLEAR,
        velocity: velocities[index],
        tag: particles.id.get(index).map_or(index as u32, |&id| id) << 1 | 1,
    };
    Ok(parallel::map(0..places.len(), pack))
}
