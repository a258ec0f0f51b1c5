//! Uploads a frame's particles.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{
    Renderer,
    build::capacity_for,
    shade::draws_spray,
    splats::{Pages, ROWS, filled},
    taken::{Taken, cameras, frame_seconds, hidden, sort},
};
use crate::{
    FrameInputs, RenderError,
    buffers::{
        AIRED, AIRED_GROUPS, BLOCK_GROUPS, BLOCKS, PAGES, PARTICLE_GROUPS, PARTICLES, PATHS,
        SHAPES, SPRAY_PARAMS,
    },
    camera::pose,
    in_frame::blocks_in_frame,
    lighting::spray_density,
    paths::Path,
    plan::per_particle,
    shapes::shapes,
    uniform::{Block, Page, Particle, SprayParams},
};
use swell_domain::level_set::kernels::Kernels;
use swell_gpu::{buffer::Workgroups, program::BufferSpec, recording::spread};
use swell_scene::look::{AovSpec, Look, MethodSpec};

/// Distance in particle spacings within which a particle affects the field at the eye: the support
/// of a kernel and of the neighbours that shape it.
const ABOUT_THE_EYE: f64 = 6.0;
/// Least number of particles within [`CLOSE`] spacings of an eye under water; fewer are drops that
/// hit the lens.
const FEW: usize = 6;
const CLOSE: f64 = 2.5;

/// State of a frame on the device.
#[derive(Default)]
pub(super) struct Loaded {
    /// Number of particles that may be visible.
    pub(super) count: u32,
    /// The same particles with their mean velocity to the next frame, for additional channels;
    /// empty unless a channel shows motion and there is a next frame.
    pub(super) ahead: Vec<Particle>,
}

impl Renderer {
    /// Uploads a frame's particles, relative to the domain's least corner.
    pub(super) fn load(
        &mut self,
        frame: u32,
        inputs: &FrameInputs<'_>,
    ) -> Result<Loaded, RenderError> {
        let Taken {
            mut packed,
            mut ways,
        } = Taken::of(&self.look, &self.scene, frame, inputs)?;
        let is_ssfr = self.look.spec().renderer.method == MethodSpec::Ssfr;
        if is_ssfr && self.is_under_water(frame, &packed) {
            return Err(RenderError::UnderWater { frame });
        }
        let wants_motion = self.look.wants(AovSpec::Forward);
        if let Some(water) = &mut self.water {
            water.take(&packed, &ways);
        }
        if let Some(caustics) = &mut self.caustics {
            caustics.forget();
        }
        if let Some(sea) = &mut self.sea {
            sea.take(&packed, &ways);
        }
        if let Some(cloud) = &mut self.cloud {
            let water = (&packed[..], &ways[..]);
            cloud.take(
                &self.look,
                &self.scene,
                self.plan.radius,
                water,
                inputs.white,
            );
        }
        self.load_spray(frame, inputs);
        if !self.program.has(PARTICLES.name()) {
            return Ok(Loaded::default());
        }
        let cameras = cameras(&self.look, &self.setting(0), frame);
        let hidden = hidden(&self.look, &self.scene, &packed);
        let seen = sort(
            (&self.look, &self.scene),
            (frame, &cameras),
            hidden.as_ref(),
            &mut packed,
            &mut ways,
        );
        let shapes = match self.program.has(SHAPES.name()) {
            true => shapes(&packed, seen, &self.scene, self.plan.radius),
            false => Vec::new(),
        };
        packed.truncate(seen);
        let count = seen as u32;
        self.reserve(seen)?;
        if let Some(hidden) = hidden {
            self.load_blocks(blocks_in_frame(hidden.blocks, &cameras))?;
        }
        let aired = self.load_aired(&packed);
        let pages = self.pages();
        let aired = self.load_pages(pages, packed.len(), &aired);
        for (buffer, shares) in [
            (PARTICLE_GROUPS, pages.shares(seen).collect()),
            (AIRED_GROUPS, aired),
        ] {
            if self.program.has(buffer.name()) {
                let groups = |share: &usize| spread(&self.program.context, ROWS, *share as u64);
                let groups: Vec<Workgroups> = shares.iter().map(|n| groups(n).into()).collect();
                self.program.upload(buffer, 0, &groups);
            }
        }
        self.program.upload(PARTICLES, 0, &packed);
        if self.program.has(SHAPES.name()) {
            self.program.upload(SHAPES, 0, &shapes);
        }
        if self.program.has(PATHS.name()) {
            let packed: Vec<_> = ways.iter().map(Path::packed).collect();
            self.program.upload(PATHS, 0, &packed);
        }
        let mut ahead = Vec::new();
        if wants_motion && inputs.beside()[1].is_some() {
            let seconds = frame_seconds(&self.scene);
            for (particle, way) in packed.iter_mut().zip(&ways) {
                particle.velocity = (way.displacement(seconds).as_vec3() / seconds).to_array();
            }
            ahead = packed;
        }
        Ok(Loaded { count, ahead })
    }

    /// Uploads the indices of the particles that hold air, a small part of all, and returns them in
    /// ascending order.
    fn load_aired(&self, packed: &[Particle]) -> Vec<u32> {
        if !self.program.has(AIRED.name()) {
            return Vec::new();
        }
        let aired = (0u32..).zip(packed).filter(|(_, it)| it.air & 0xffff > 0);
        let aired: Vec<u32> = aired.map(|(index, _)| index).collect();
        self.program.upload(AIRED, 0, &aired);
        aired
    }

    /// Uploads the range of particles of each dispatch, and returns the number of particles with
    /// air in each page.
    fn load_pages(&self, pages: Pages, particles: usize, aired: &[u32]) -> Vec<usize> {
        let counts: Vec<usize> = pages.shares(particles).collect();
        let mut windows = Vec::new();
        for (k, &count) in counts.iter().enumerate() {
            let first = k * pages.page;
            let before = |end: usize| aired.partition_point(|&index| (index as usize) < end);
            let aired = before(first)..before(first + count);
            windows.push(Page {
                first: first as u32,
                count: count as u32,
                aired_first: aired.start as u32,
                aired_count: aired.len() as u32,
            });
        }
        self.program.upload_windows(&PAGES, &windows);
        windows
            .iter()
            .map(|page| page.aired_count as usize)
            .collect()
    }

    /// Uploads the blocks of water that replace hidden particles; the rest of the buffer gets empty
    /// blocks.
    fn load_blocks(&mut self, mut blocks: Vec<Block>) -> Result<(), RenderError> {
        if !self.program.has(BLOCKS.name()) {
            return Ok(());
        }
        let groups = spread(&self.program.context, ROWS, blocks.len() as u64);
        let room = capacity_for(blocks.len());
        if room > self.blocks {
            self.program.refit(&[BLOCKS.sized(room)], &[])?;
            self.blocks = room;
            self.record();
        }
        blocks.resize(self.blocks, Block::default());
        self.program.upload(BLOCK_GROUPS, 0, &[groups.into()]);
        self.program.upload(BLOCKS, 0, &blocks);
        Ok(())
    }

    /// Grows the buffers to hold this number of particles.
    fn reserve(&mut self, particles: usize) -> Result<(), RenderError> {
        if particles <= self.capacity {
            return Ok(());
        }
        let capacity = capacity_for(particles);
        let pages = Pages {
            capacity,
            ..self.pages()
        };
        let mut grown = of_particles(&self.look, pages);
        grown.retain(|spec| self.program.has(&spec.name));
        self.program.refit(&grown, &[])?;
        self.capacity = capacity;
        self.record();
        Ok(())
    }

    /// Uploads the range of the spray sums: depths up to the domain's farthest corner and speeds up
    /// to the largest, both with a margin for motion within a frame and rounded up to powers of
    /// two, so that rounding differs little between frames.
    fn load_spray(&self, frame: u32, inputs: &FrameInputs<'_>) {
        if !draws_spray(&self.look) {
            return;
        }
        let rate = self.scene.frames_per_second;
        let eye = pose(&self.look, frame.into(), rate).position
            - (self.scene.origin + self.scene.domain.min);
        let farthest = eye
            .abs()
            .max((eye - self.scene.domain.size()).abs())
            .length();
        let fastest = (inputs.water.particles.max_speed()).max(inputs.white.max_speed());
        let room = |x: f64| (1.25 * x + 1.0).log2().ceil().exp2() as f32;
        let params = SprayParams {
            density: spray_density(&self.look) as f32,
            scale: filled(self.scene.particle_spacing, self.plan.radius) as f32,
            range: room(farthest),
            speed: room(fastest),
        };
        self.program.upload(SPRAY_PARAMS, 0, &[params]);
    }

    /// Whether the level-set field of the body's particles, as rays meet it, is positive at the eye
    /// at the frame's instant.
    fn is_under_water(&self, frame: u32, packed: &[Particle]) -> bool {
        let rate = self.scene.frames_per_second;
        let origin = self.scene.origin + self.scene.domain.min;
        let eye = pose(&self.look, frame.into(), rate).position - origin;
        let (size, spacing) = (self.scene.domain.size(), self.scene.particle_spacing);
        let is_within = |p: DVec3| p.cmpge(DVec3::ZERO).all() && p.cmple(size).all();
        if !is_within(eye) {
            return false;
        }
        let near: Vec<DVec3> = packed
            .par_iter()
            .filter(|particle| particle.tag & 1 == 1)
            .map(|particle| Vec3::from(particle.position).as_dvec3())
            .filter(|&p| is_within(p) && p.distance(eye) < ABOUT_THE_EYE * spacing)
            .collect();
        let close = near.iter().filter(|p| p.distance(eye) < CLOSE * spacing);
        close.count() >= FEW && Kernels::fit(&near, size, spacing).field().value(eye) > 0.0
    }
}

/// Descriptions of the buffers that hold data per particle and per page; a look uses some of them.
pub(super) fn of_particles(look: &Look, pages: Pages) -> Vec<BufferSpec> {
    let capacity = pages.capacity;
    let groups = [PARTICLE_GROUPS, AIRED_GROUPS];
    let groups = groups.map(|groups| groups.sized(pages.count()));
    let others = [
        per_particle(&PARTICLES, capacity, look),
        PAGES.sized(pages.count()),
        AIRED.sized(capacity),
        per_particle(&SHAPES, capacity, look),
        per_particle(&PATHS, capacity, look),
    ];
    others.into_iter().chain(groups).collect()
}
