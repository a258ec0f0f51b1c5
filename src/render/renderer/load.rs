//! Uploads a frame's particles.

use glam::{DVec3, Vec3};

use super::{
    Renderer,
    build::capacity_for,
    drawn::{DrawnParticles, cameras},
    shade::draws_spray,
    splats::{Pages, ROWS, filled},
    taken::{Taken, frame_seconds},
};
use crate::{
    FrameInputs, RenderError,
    buffers::{
        AIRED, AIRED_GROUPS, BLOCK_GROUPS, BLOCKS, PAGES, PARTICLE_GROUPS, PARTICLES, PATHS,
        SHAPES, SPRAY_PARAMS,
    },
    camera::pose,
    lighting::spray_density,
    paths::Path,
    plan::per_particle,
    shapes::shapes,
    uniform::{Block, Page, Particle, Shape, SprayParams},
};
use swell_domain::{level_set::kernels::Kernels, parallel};
use swell_gpu::{
    buffer::{BufferSpec, Workgroups},
    recording::spread,
};
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

/// Division of a frame's visible particles into dispatches.
struct Paged {
    pages: Vec<Page>,
    /// Indices of the particles that hold air, a small part of all, in ascending order.
    aired: Vec<u32>,
}

impl Paged {
    fn of(pages: Pages, packed: &[Particle]) -> Self {
        let aired = (0u32..).zip(packed).filter(|(_, it)| it.air & 0xffff > 0);
        let aired: Vec<u32> = aired.map(|(index, _)| index).collect();
        let page = |(k, count): (usize, usize)| {
            let first = k * pages.page;
            let before = |end: usize| aired.partition_point(|&index| (index as usize) < end);
            let aired = before(first)..before(first + count);
            Page {
                first: first as u32,
                count: count as u32,
                aired_first: aired.start as u32,
                aired_count: aired.len() as u32,
            }
        };
        let shares = pages.shares(packed.len()).enumerate();
        Self {
            pages: shares.map(page).collect(),
            aired,
        }
    }
}

impl Renderer {
    /// Uploads a frame's particles, relative to the domain's least corner: takes them, culls and
    /// sorts them, and divides them into pages.
    pub(super) fn load(
        &mut self,
        frame: u32,
        inputs: &FrameInputs<'_>,
    ) -> Result<Loaded, RenderError> {
        let taken = Taken::of(&self.look, &self.scene, frame, inputs)?;
        self.refuse_under_water(frame, &taken.packed)?;
        self.load_rays(&taken, inputs);
        self.load_spray(frame, inputs);
        if !self.program.has(PARTICLES.name()) {
            return Ok(Loaded::default());
        }
        let cameras = cameras(&self.look, &self.setting(0), frame);
        let mut drawn = DrawnParticles::of(taken, &self.look, &self.scene, frame, &cameras);
        let shapes = self.shapes(&drawn);
        drawn.packed.truncate(drawn.seen);
        self.reserve(drawn.seen)?;
        if let Some(blocks) = drawn.blocks.take() {
            self.load_blocks(blocks)?;
        }
        self.load_pages(&Paged::of(self.pages(), &drawn.packed));
        self.load_drawn(&drawn, &shapes);
        Ok(Loaded {
            count: drawn.seen as u32,
            ahead: self.ahead(drawn, inputs),
        })
    }

    /// Refuses a picture by splats from within the water.
    fn refuse_under_water(&self, frame: u32, packed: &[Particle]) -> Result<(), RenderError> {
        let is_ssfr = self.look.spec().renderer.method == MethodSpec::Ssfr;
        match is_ssfr && self.is_under_water(frame, packed) {
            true => Err(RenderError::UnderWater { frame }),
            false => Ok(()),
        }
    }

    /// Hands a frame's particles to what rays meet.
    fn load_rays(&mut self, Taken { packed, ways }: &Taken, inputs: &FrameInputs<'_>) {
        if let Some(water) = &mut self.water {
            water.take(packed, ways, &self.scene);
        }
        if let Some(caustics) = &mut self.caustics {
            caustics.forget();
        }
        if let Some(sea) = &mut self.sea {
            sea.take(packed, ways);
        }
        if let Some(cloud) = &mut self.cloud {
            let (water, radius) = ((&packed[..], &ways[..]), self.plan.radius);
            cloud.take(&self.look, &self.scene, radius, water, inputs.white);
        }
    }

    /// Ellipsoids of the visible particles; none where the look splats spheres.
    fn shapes(&self, drawn: &DrawnParticles) -> Vec<Shape> {
        match self.program.has(SHAPES.name()) {
            true => shapes(&drawn.packed, drawn.seen, &self.scene, self.plan.radius),
            false => Vec::new(),
        }
    }

    /// Uploads visible particles with their shapes and paths.
    fn load_drawn(&self, drawn: &DrawnParticles, shapes: &[Shape]) {
        self.program.upload(PARTICLES, 0, &drawn.packed);
        if self.program.has(SHAPES.name()) {
            self.program.upload(SHAPES, 0, shapes);
        }
        if self.program.has(PATHS.name()) {
            let packed: Vec<_> = drawn.ways.iter().map(Path::packed).collect();
            self.program.upload(PATHS, 0, &packed);
        }
    }

    /// Visible particles with their mean velocity to the next frame, if a channel shows it.
    fn ahead(&self, drawn: DrawnParticles, inputs: &FrameInputs<'_>) -> Vec<Particle> {
        if !self.look.wants(AovSpec::Forward) || inputs.beside()[1].is_none() {
            return Vec::new();
        }
        let seconds = frame_seconds(&self.scene);
        let mut ahead = drawn.packed;
        for (particle, way) in ahead.iter_mut().zip(&drawn.ways) {
            particle.velocity = (way.displacement(seconds).as_vec3() / seconds).to_array();
        }
        ahead
    }

    /// Uploads the range of particles of each dispatch, and the particles with air.
    fn load_pages(&self, Paged { pages, aired }: &Paged) {
        if self.program.has(AIRED.name()) {
            self.program.upload(AIRED, 0, aired);
        }
        self.program.upload_windows(&PAGES, pages);
        let share = |page: &Page| [page.count, page.aired_count];
        for (buffer, kind) in [(PARTICLE_GROUPS, 0), (AIRED_GROUPS, 1)] {
            if self.program.has(buffer.name()) {
                let context = &self.program.context;
                let groups = |page| spread(context, ROWS, share(page)[kind].into()).into();
                let groups: Vec<Workgroups> = pages.iter().map(groups).collect();
                self.program.upload(buffer, 0, &groups);
            }
        }
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
        let near: Vec<DVec3> = parallel::flat_map(0..packed.len(), |k| {
            let p = Vec3::from(packed[k].position).as_dvec3();
            let is_near = is_within(p) && p.distance(eye) < ABOUT_THE_EYE * spacing;
            (packed[k].tag & 1 == 1 && is_near).then_some(p)
        });
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
