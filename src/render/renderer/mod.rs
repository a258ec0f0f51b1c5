//! One frame: samples over pixel and shutter, each a pass list over the whole frame.

mod aovs;
mod buffers;
mod build;
mod shade;
mod splats;

use rayon::prelude::*;
use wgpu::{BindGroup, Buffer};

use super::camera::{Sample, Setting, camera, pose, samples};
use super::frame::{Band, Extent, Filler, Filling};
use super::image::Image;
use super::pass::{Timer, folded, read, tiles};
use super::set::Set;
use super::surface::Filter;
use super::{RenderError, RenderScene, aeration, plan, uniform};
use crate::domain::particles::Particles;
use crate::gpu::adapter::Context;
use crate::scene::look::Look;
use buffers::Buffers;
use shade::Shade;
use splats::{Bound, Splats};

/// Time that a pass took over all frames so far.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    /// `ssfr/...`, as in [`super::passes`].
    pub name: &'static str,
    /// Seconds on the device; 0 where the adapter has no timestamps.
    pub seconds: f64,
    /// How often it ran.
    pub runs: u32,
}

/// Renders frames of one scene with one look.
pub struct Renderer {
    context: Context,
    look: Look,
    scene: RenderScene,
    extent: Extent,
    radius: f64,
    buffers: Buffers,
    bands: Vec<Band>,
    filler: Filler,
    clear_depth: Filling,
    clear_owner: Option<Filling>,
    clear_solid: Filling,
    set: Option<Set>,
    splats: Splats,
    filter: Filter,
    shade: Shade,
    shade_groups: Vec<BindGroup>,
    bound: Option<Bound>,
    has_solids: bool,
    timer: Timer,
}

impl Renderer {
    fn surface(&self) -> &Buffer {
        &self.buffers.depth[usize::from(self.filter.result_is_in_other())]
    }

    /// Names of the passes that a frame takes, as [`super::passes`] plans them.
    pub fn passes(&self) -> Vec<&'static str> {
        plan::passes(&self.look, self.has_solids)
    }

    /// What each pass has cost since the renderer was built, by name.
    pub fn times(&self) -> Vec<PassTime> {
        self.timer
            .totals
            .iter()
            .map(|(&name, &(seconds, runs))| PassTime {
                name,
                seconds,
                runs,
            })
            .collect()
    }

    /// Times passes one by one from here on, by the host's clock, and forgets earlier times: for software
    /// adapters, whose timestamps tell when work was queued, not when it was done. The pictures are the same.
    pub fn time_one_by_one(&mut self) {
        self.timer.time_one_by_one();
    }

    /// Renders one frame; the same frame, particles, look and adapter give the same bytes.
    ///
    /// # Errors
    /// [`RenderError::NotFinite`] for a damaged particle, [`RenderError::Gpu`] when the device is lost or the
    /// particles are more than it binds.
    pub fn render(&mut self, frame: u32, particles: &Particles) -> Result<Image, RenderError> {
        let count = self.load(frame, particles)?;
        let setting = Setting {
            origin: self.scene.origin + self.scene.domain.min,
            size: self.extent.size,
            margin: self.extent.margin,
            particle_count: count,
            radius: self.radius,
            frames_per_second: self.scene.frames_per_second,
        };
        let spec = self.look.spec().image.clone();
        for (index, sample) in (0u32..).zip(samples(spec.samples, spec.shutter)) {
            let camera = camera(&self.look, &setting, frame.into(), sample, index);
            self.sample(&camera, false)?;
        }
        let [width, height] = self.extent.picture;
        let mut image = Image::new(width, height);
        if self.shade.aovs.is_some() {
            // Depths and normals have no mean: they are taken at pixel centres, at the frame's instant.
            let still = Sample {
                jitter: [0.0; 2],
                instant: 0.0,
                weight: 1.0,
            };
            let next = camera(&self.look, &setting, f64::from(frame) + 1.0, still, 0);
            self.context
                .queue
                .write_buffer(&self.shade.next_camera, 0, bytemuck::bytes_of(&next));
            let camera = camera(&self.look, &setting, frame.into(), still, 0);
            self.sample(&camera, true)?;
            image.aovs = self.read_aovs()?;
        }
        image.beauty.clear();
        for band in &self.bands {
            let bytes = 16 * u64::from(width) * u64::from(band.rows);
            image
                .beauty
                .extend(read::<[f32; 4]>(&self.context, &band.colour, bytes)?);
        }
        Ok(image)
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
        // Front to back, so that splats find what hides them already there.
        let eye = pose(&self.look.spec().camera, frame.into());
        let forward = (eye.target - eye.position).normalize().as_vec3();
        packed.par_sort_unstable_by(|a, b| {
            let depth = |p: &uniform::Particle| glam::Vec3::from(p.position).dot(forward);
            depth(a).total_cmp(&depth(b)).then(a.tag.cmp(&b.tag))
        });
        if self
            .bound
            .as_ref()
            .is_none_or(|bound| bound.capacity < packed.len())
        {
            self.bound = Some(self.bind(packed.len().max(1).next_power_of_two())?);
        }
        if let Some(bound) = &self.bound {
            let bytes = bytemuck::cast_slice(&packed);
            self.context.queue.write_buffer(&bound.buffer, 0, bytes);
        }
        Ok(packed.len() as u32)
    }

    fn bind(&self, capacity: usize) -> Result<Bound, RenderError> {
        let (context, frame, surface) = (&self.context, &self.buffers, self.surface());
        let particles = Splats::particles(context, capacity)?;
        let aovs = self
            .shade
            .bind_aovs(context, &self.bands, frame, surface, &particles);
        let camera = &self.shade.camera;
        let bound = (self.splats).bind(context, particles, capacity, camera, frame, surface);
        Ok(Bound {
            shade_aovs: aovs,
            ..bound
        })
    }

    /// Draws one sample, into the picture's mean or, with `aovs`, into the channels beside it.
    fn sample(&mut self, camera: &uniform::Camera, aovs: bool) -> Result<(), RenderError> {
        let Some(bound) = &self.bound else {
            return Ok(());
        };
        let context = &self.context;
        let timer = &mut self.timer;
        let frame = &self.buffers;
        let mut encoder = context.device.create_command_encoder(&Default::default());
        context
            .queue
            .write_buffer(&self.shade.camera, 0, bytemuck::bytes_of(camera));
        match &self.set {
            Some(set) => {
                let solids = [&frame.solid_depth, &frame.solid_packed];
                set.run(&mut encoder, timer, &self.extent, solids);
            }
            None => self.filler.run(&mut encoder, timer, &self.clear_solid),
        }
        self.filler.run(&mut encoder, timer, &self.clear_depth);
        encoder.clear_buffer(&frame.thickness, 0, None);
        let groups = folded(camera.particle_count);
        self.splats
            .depth
            .run(&mut encoder, timer, &bound.depth, groups);
        self.splats
            .thickness
            .run(&mut encoder, timer, &bound.thickness, groups);
        if let (true, Some(pass), Some(group), Some(clear)) =
            (aovs, &self.splats.owner, &bound.owner, &self.clear_owner)
        {
            // Before the filter, while the depth is still that of the spheres.
            self.filler.run(&mut encoder, timer, clear);
            pass.run(&mut encoder, timer, group, groups);
        }
        self.filter.run(&mut encoder, timer);
        if let (false, Some(pass), Some(group), Some(spray)) =
            (aovs, &self.splats.spray, &bound.spray, &frame.spray)
        {
            encoder.clear_buffer(spray, 0, None);
            pass.run(&mut encoder, timer, group, groups);
        }
        let (pass, shade_groups) = match (&self.shade.aovs, aovs) {
            (Some(pass), true) => (pass, &bound.shade_aovs),
            _ => (&self.shade.pass, &self.shade_groups),
        };
        for (band, group) in self.bands.iter().zip(shade_groups) {
            let size = [self.extent.picture[0], band.rows];
            pass.run(&mut encoder, timer, group, tiles(size));
        }
        timer.resolve(&mut encoder);
        context.queue.submit([encoder.finish()]);
        timer.collect(context)?;
        context.wait()?;
        Ok(())
    }
}
