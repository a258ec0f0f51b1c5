//! Uploads the drops and bubbles that rays traverse, and the foam on the water.

use glam::DVec3;

use super::{capacity_for, shade::draws_spray, whitewater::kind};
use crate::{
    RenderError, RenderScene,
    buffers::{CLOUD, CLOUD_WORDS},
    cloud::{Drop, drops_of, grid, white_of},
    foam::FoamColumns,
    paths::Path,
    plan::Limits,
    rays::voxel,
    uniform::{self, Particle},
};
use swell_domain::{
    particles::Particles,
    whitewater::{WhitewaterKind, of_kinds},
};
use swell_gpu::program::Program;
use swell_scene::look::{Look, MethodSpec, WhitewaterLook};

/// Drops and bubbles of a frame, and the state of their grid on the device.
pub(super) struct RayCloud {
    /// Whether rays are cast; otherwise the grid is empty, and there is foam alone.
    casts: bool,
    /// Drops and bubbles with their paths.
    drops: Vec<(Drop, Path)>,
    /// Foam at the frame's instant.
    foam: Particles,
    look: Option<WhitewaterLook>,
    /// Instants, in seconds from the frame, for which the device holds the grid; none before the
    /// first grid of this frame.
    stands: Vec<f32>,
    /// Allocated words.
    capacity: usize,
    /// Edge length of a voxel, metres.
    voxel: f64,
    /// Unit vector towards the sun.
    sun: DVec3,
}

impl RayCloud {
    /// Returns `None` where the look draws neither whitewater nor, by rays, spray.
    pub(super) fn of(look: &Look, scene: &RenderScene) -> Option<Self> {
        let casts = look.spec().renderer.method == MethodSpec::Ray;
        let is_drawn = look.spec().whitewater.is_some() || casts && draws_spray(look);
        is_drawn.then(|| Self {
            casts,
            drops: Vec::new(),
            foam: Particles::default(),
            look: look.spec().whitewater.clone(),
            stands: Vec::new(),
            capacity: 1,
            voxel: voxel(look, scene),
            sun: look.sun_direction(),
        })
    }

    /// Takes a frame's particles, whose splats have `radius` metres, and its whitewater; without
    /// `paths` particles move in straight lines.
    pub(super) fn take(
        &mut self,
        look: &Look,
        scene: &RenderScene,
        radius: f64,
        water: (&[Particle], &[Path]),
        white: &Particles,
    ) {
        if self.casts {
            self.drops = drops_of(look, scene, radius, water);
            let of_white = white_of(look, scene, white, |index| kind(white, index));
            self.drops.extend(of_white);
        }
        self.foam = of_kinds(white.clone(), &[WhitewaterKind::Foam]);
        self.stands.clear();
    }

    /// Uploads the mean grid of instants with the same share of the light, in seconds from the
    /// frame. Returns whether a buffer was reallocated.
    pub(super) fn stand_at(
        &mut self,
        instants: Vec<f32>,
        program: &mut Program,
        scene: &RenderScene,
    ) -> Result<bool, RenderError> {
        if self.stands == instants {
            return Ok(false);
        }
        let (about, words) = self.grid(&instants, scene);
        let grew = words.len() > self.capacity;
        if grew {
            self.capacity = room_of(words.len(), Limits::of(&program.context).storage);
            program.refit(&[CLOUD_WORDS.sized(self.capacity)], &[])?;
        }
        program.upload(CLOUD, 0, &[about]);
        program.upload(CLOUD_WORDS, 0, &words);
        self.stands = instants;
        Ok(grew)
    }

    /// Builds the uniform and the words of the mean grid of instants, in seconds from the frame.
    pub(super) fn grid(&self, instants: &[f32], scene: &RenderScene) -> (uniform::Cloud, Vec<u32>) {
        let seconds = instants.iter().sum::<f32>() / instants.len().max(1) as f32;
        let foam = (self.look.as_ref()).map_or_else(FoamColumns::none, |look| {
            let mut foam = self.foam.clone();
            for (place, velocity) in foam.position.iter_mut().zip(&self.foam.velocity) {
                for (x, v) in place.iter_mut().zip(velocity) {
                    *x += v * seconds;
                }
            }
            FoamColumns::new(&foam, scene, look)
        });
        grid(&self.drops, instants, &foam, scene, (self.voxel, self.sun))
    }
}

/// Capacity in words for a required number of them, within a binding of `storage` bytes.
pub(super) fn room_of(words: usize, storage: u64) -> usize {
    let room = capacity_for(words);
    match room as u64 > storage / 4 {
        true => words,
        false => room,
    }
}
