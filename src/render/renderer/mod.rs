//! One frame: samples over pixel and shutter, each a recording over the whole frame.

mod aovs;
mod build;
mod shade;
mod splats;
mod water;
mod whitewater;

use bytemuck::Pod;
use glam::DVec3;
use rayon::prelude::*;

use super::buffers::{CAMERA, NEXT_CAMERA, PARTICLE_GROUPS, PARTICLES, SHAPES, picture};
use super::camera::{Sample, Setting, camera, eye, pose, samples};
use super::image::{Image, View};
use super::plan::{Limits, Plan};
use super::{RenderError, RenderScene, aeration, shapes::shapes, uniform};
use crate::domain::particles::Particles;
use crate::gpu::{
    adapter::Context,
    buffer::Buf,
    program::Program,
    recording::{Recording, Timer, spread},
};
use crate::scene::look::Look;
pub(super) use build::RADIUS;
use build::room;
use water::Water;
use whitewater::Whitewater;

/// Depth before which nothing solid is drawn, particle spacings.
const NEAR: f64 = 0.12;

/// Renders frames of one scene with one look.
pub struct Renderer {
    look: Look,
    scene: RenderScene,
    plan: Plan,
    program: Program,
    /// Until the first frame.
    once: Option<Recording>,
    sample: Recording,
    aovs: Recording,
    /// Particles that there is room for.
    capacity: usize,
    /// `None` where the look casts no rays.
    water: Option<Water>,
    /// `None` where the look draws none.
    whitewater: Option<Whitewater>,
    timer: Option<Timer>,
}

impl Renderer {
    /// Builds what the look calls for and nothing more.
    ///
    /// # Errors
    /// A frame larger than the adapter's buffers, a damaged panorama, a mesh that names vertices it lacks.
    pub fn new(context: &Context, look: &Look, scene: &RenderScene) -> Result<Self, RenderError> {
        let most = context.limits.max_texture_dimension_2d;
        Self::with_tile_limit(context, look, scene, most)
    }

    /// As [`Renderer::new`], with textures and bands of the picture no larger than `tile_limit` pixels along a
    /// side. The picture is the same at any limit.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn with_tile_limit(
        context: &Context,
        look: &Look,
        scene: &RenderScene,
        tile_limit: u32,
    ) -> Result<Self, RenderError> {
        let whole = Limits::of(context);
        let limits = Limits {
            tile: tile_limit.clamp(16, whole.texture),
            ..whole
        };
        let plan = Plan::new(look, scene, 0, &limits)?;
        let program = plan.program(context)?;
        let record = |commands| Recording::new(&program, commands);
        let renderer = Self {
            look: look.clone(),
            scene: scene.clone(),
            once: Some(record(&plan.once)),
            sample: record(&plan.sample),
            aovs: record(&plan.aovs),
            plan,
            program,
            capacity: room(0),
            water: Water::of(look, scene),
            whitewater: Whitewater::of(look, scene),
            timer: None,
        };
        context.wait()?;
        Ok(renderer)
    }

    /// What it was built from.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Times each pass from here on, and forgets earlier times; passes then run one by one. The pictures are the same.
    pub fn time_passes(&mut self) {
        self.timer = Some(Timer::new(&self.program.context));
    }

    /// Pass, seconds and runs since [`Self::time_passes`], by name.
    pub fn times(&self) -> Vec<(&'static str, f64, u64)> {
        self.timer.as_ref().map_or_else(Vec::new, Timer::times)
    }

    /// Renders one frame; the same frame, particles, look and adapter give the same bytes.
    ///
    /// # Errors
    /// [`RenderError::NotFinite`] for a damaged particle, [`RenderError::Gpu`] when the device is lost or the
    /// particles are more than it binds.
    pub fn render(&mut self, frame: u32, particles: &Particles) -> Result<Image, RenderError> {
        self.render_with(frame, particles, &Particles::default())
    }

    /// As [`Renderer::render`], with whitewater, which is drawn where the look names a stream of it.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_with(
        &mut self,
        frame: u32,
        particles: &Particles,
        white: &Particles,
    ) -> Result<Image, RenderError> {
        let count = self.load(frame, particles)?;
        if let Some(whitewater) = &mut self.whitewater {
            let grew = whitewater.load(&mut self.program, &self.scene, frame, white)?;
            if grew {
                self.record();
            }
        }
        let setting = Setting {
            origin: self.scene.origin + self.scene.domain.min,
            size: self.plan.extent.size,
            margin: self.plan.extent.margin,
            particle_count: count,
            radius: self.plan.radius,
            near: NEAR * self.scene.particle_spacing,
            frames_per_second: self.scene.frames_per_second,
        };
        self.draw_once()?;
        let spec = self.look.spec().image.clone();
        for (index, sample) in (0u32..).zip(samples(spec.samples, spec.shutter)) {
            let camera = camera(&self.look, &setting, frame.into(), sample, index);
            self.sample(&camera, false)?;
        }
        let [width, height] = self.plan.extent.picture;
        let mut image = Image::new(width, height);
        let eye = eye(&self.look, DVec3::ZERO, frame.into());
        image.view = Some(View::of(&eye, self.scene.frames_per_second));
        if !self.plan.aovs.is_empty() {
            // Depths and normals have no mean: they are taken at pixel centres, at the frame's instant.
            let still = Sample {
                jitter: [0.0; 2],
                instant: 0.0,
                weight: 1.0,
            };
            let next = camera(&self.look, &setting, f64::from(frame) + 1.0, still, 0);
            self.program.upload(NEXT_CAMERA, 0, &[next]);
            let camera = camera(&self.look, &setting, frame.into(), still, 0);
            self.sample(&camera, true)?;
            image.aovs = self.read_aovs()?;
        }
        image.beauty = self.read_bands(picture)?;
        Ok(image)
    }

    /// Every pixel of what is kept in the buffers that `of` gives for each band.
    fn read_bands<T: Pod>(&self, of: fn(usize) -> Buf<T>) -> Result<Vec<T>, RenderError> {
        let width = self.plan.extent.picture[0] as usize;
        let mut pixels = Vec::new();
        for (band, &rows) in self.plan.bands.iter().enumerate() {
            pixels.extend(self.program.read(of(band), width * rows as usize)?);
        }
        Ok(pixels)
    }

    /// Moves a frame's particles to the device, relative to the domain's least corner.
    fn load(&mut self, frame: u32, particles: &Particles) -> Result<u32, RenderError> {
        let origin = self.scene.domain.min;
        let mut packed = Vec::with_capacity(particles.len());
        for (index, (p, v)) in particles
            .position
            .iter()
            .zip(&particles.velocity)
            .enumerate()
        {
            if !p.iter().chain(v).all(|x| x.is_finite()) {
                return Err(RenderError::NotFinite { index, frame });
            }
            let position = [0, 1, 2].map(|axis| (f64::from(p[axis]) - origin[axis]) as f32);
            packed.push(uniform::Particle {
                position,
                aeration: 0.0,
                velocity: *v,
                tag: particles.id.get(index).map_or(index as u32, |&id| id) << 1 | 1,
            });
        }
        if let Some(spray) = &self.look.spec().water.spray {
            aeration::classify(&mut packed, self.scene.particle_spacing as f32, spray);
        }
        if let Some(water) = &mut self.water {
            water.take(&packed);
        }
        if !self.program.has(PARTICLES.name()) {
            return Ok(packed.len() as u32);
        }
        // Front to back, so that splats find what hides them already there.
        let eye = pose(&self.look.spec().camera, frame.into());
        let forward = (eye.target - eye.position).normalize().as_vec3();
        packed.par_sort_unstable_by(|a, b| {
            let depth = |p: &uniform::Particle| glam::Vec3::from(p.position).dot(forward);
            depth(a).total_cmp(&depth(b)).then(a.tag.cmp(&b.tag))
        });
        self.reserve(packed.len())?;
        let groups = spread(&self.program.context, 1, packed.len() as u64);
        self.program.upload(PARTICLE_GROUPS, 0, &[groups.into()]);
        self.program.upload(PARTICLES, 0, &packed);
        if self.program.has(SHAPES.name()) {
            let shapes = shapes(&packed, &self.scene, self.plan.radius);
            self.program.upload(SHAPES, 0, &shapes);
        }
        Ok(packed.len() as u32)
    }

    /// Makes room for so many particles.
    fn reserve(&mut self, particles: usize) -> Result<(), RenderError> {
        if particles <= self.capacity {
            return Ok(());
        }
        let capacity = room(particles);
        let mut buffers = vec![PARTICLES.sized(capacity)];
        if self.program.has(SHAPES.name()) {
            buffers.push(SHAPES.sized(capacity));
        }
        self.program.refit(&buffers, &[])?;
        self.capacity = capacity;
        self.record();
        Ok(())
    }

    /// Binds every command to the buffers as they are now.
    fn record(&mut self) {
        self.sample = Recording::new(&self.program, &self.plan.sample);
        self.aovs = Recording::new(&self.program, &self.plan.aovs);
    }

    /// Draws what does not change from frame to frame.
    fn draw_once(&mut self) -> Result<(), RenderError> {
        if let Some(once) = self.once.take() {
            once.run(&self.program, self.timer.as_mut())?;
        }
        Ok(())
    }

    /// Draws one sample, into the picture's mean or, with `aovs`, into the channels beside it.
    fn sample(&mut self, camera: &uniform::Camera, aovs: bool) -> Result<(), RenderError> {
        if let Some(water) = &mut self.water {
            let grew = water.stand_at(camera.seconds, &mut self.program, &self.scene)?;
            if grew {
                self.record();
            }
        }
        self.program.upload(CAMERA, 0, &[*camera]);
        let recording = if aovs { &self.aovs } else { &self.sample };
        recording.run(&self.program, self.timer.as_mut())?;
        self.program.context.wait()?;
        Ok(())
    }
}
