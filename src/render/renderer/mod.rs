//! Renders a frame as samples over pixel and shutter, each one a recording of commands over the
//! whole frame.

mod aovs;
mod build;
mod cloud;
mod drawn;
mod load;
mod measured;
mod parts;
mod shade;
mod splats;
mod taken;
mod water;
mod whitewater;

use std::ops::ControlFlow;

use bytemuck::Pod;
use glam::DVec3;

use super::buffers::{CAMERA, MOMENTS, objects, picture};
use super::camera::{Setting, camera, eye};
use super::caustics::{Caustics, above};
use super::cryptomatte::{Covers, unique};
use super::image::{CameraAttributes, Image};
use super::open::seed;
use super::plan::{Limits, Plan};
use super::samples::{Moments, Sample, samples_of};
use super::{FrameInputs, RenderError, RenderScene, WaterParticles, sea::Sea, uniform};
use build::capacity_for;
use cloud::RayCloud;
pub use parts::Part;
use parts::PartProgress;
use shade::draws_spray;
use splats::Pages;
use swell_domain::{particles::Particles, solver::PassTime};
use swell_gpu::{
    adapter::Context,
    buffer::Buf,
    program::Program,
    recording::{Command, Recording, Timer},
};
use swell_scene::look::Look;
use water::RayWater;
use whitewater::WhitewaterDrawing;

/// Near plane of opaque geometry, particle spacings.
const NEAR: f64 = 0.12;

/// Renders frames of one scene with one look.
pub struct Renderer {
    look: Look,
    scene: RenderScene,
    plan: Plan,
    program: Program,
    /// Commands that run before the first frame; `None` afterwards.
    once: Option<Recording>,
    /// Commands that depend on the water only.
    light: Recording,
    /// Commands of a sample, split into bands where rays are cast.
    sample: Vec<Recording>,
    aovs: Vec<Recording>,
    /// Whether the last sample was slow; true before the first one.
    is_slow: bool,
    /// Allocated particles.
    capacity: usize,
    /// Allocated blocks of water.
    blocks: usize,
    /// `None` where the look casts no rays.
    water: Option<RayWater>,
    /// `None` where the look draws neither whitewater nor, by rays, spray.
    cloud: Option<RayCloud>,
    /// `None` where the look has no caustics.
    caustics: Option<Caustics>,
    /// `None` where the look has no sea.
    sea: Option<Sea>,
    /// `None` where the look draws no whitewater.
    whitewater: Option<WhitewaterDrawing>,
    timer: Option<Timer>,
    /// Names of the scene's solids in Cryptomatte layers.
    solids: Vec<String>,
}

impl Renderer {
    /// Builds exactly the resources that the look needs.
    ///
    /// # Errors
    /// A frame that exceeds the adapter's buffers, a damaged panorama, or a mesh that refers to
    /// missing vertices.
    pub fn new(context: &Context, look: &Look, scene: &RenderScene) -> Result<Self, RenderError> {
        let most = context.limits.max_texture_dimension_2d;
        Self::with_tile_limit(context, look, scene, most)
    }

    /// Like [`Renderer::new`], with textures and bands of the picture of at most `tile_limit`
    /// pixels along a side. The picture does not depend on the limit.
    ///
    /// # Errors
    /// As for [`Renderer::new`].
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
        let plan = Plan::new(look, scene, &limits)?;
        let program = plan.program(context)?;
        let record = |commands| Recording::new(&program, commands);
        let renderer = Self {
            look: look.clone(),
            scene: scene.clone(),
            once: Some(record(&plan.once)),
            light: record(&plan.water),
            sample: parts::record(&program, &plan.sample),
            aovs: parts::record(&program, &plan.aovs),
            is_slow: true,
            plan,
            program,
            capacity: capacity_for(0),
            blocks: capacity_for(0),
            water: RayWater::of(look, scene),
            cloud: RayCloud::of(look, scene),
            caustics: Caustics::of(look, scene),
            sea: Sea::of(look, scene),
            whitewater: WhitewaterDrawing::of(look, scene),
            timer: None,
            solids: unique(&vec!["solid".to_owned(); scene.solids.len()]),
        };
        context.wait()?;
        Ok(renderer)
    }

    /// Sets the names of the solids in Cryptomatte layers, in the order of [`RenderScene::solids`].
    /// Without names, each is "solid" with a number.
    pub fn name_solids(&mut self, names: &[String]) {
        self.solids = unique(names);
    }

    /// Returns the plan from which the renderer was built.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Starts to measure the time of each pass and discards earlier times. Passes then run one by
    /// one; the pictures stay the same.
    pub fn time_passes(&mut self) {
        self.timer = Some(Timer::new(&self.program.context));
    }

    /// Returns the time of each pass since [`Self::time_passes`], by name.
    pub fn times(&self) -> Vec<PassTime> {
        let timer = self.timer.as_ref();
        timer.map_or_else(Vec::new, |timer| timer.times(PassTime::new))
    }

    /// Renders one frame. Equal frame numbers, particles, looks and adapters give equal bytes.
    ///
    /// # Errors
    /// [`RenderError::NotFinite`] for a damaged particle, and [`RenderError::Gpu`] if the device is
    /// lost or cannot bind that many particles.
    pub fn render(&mut self, frame: u32, particles: &Particles) -> Result<Image, RenderError> {
        self.render_with(frame, particles, &Particles::default())
    }

    /// Like [`Renderer::render`], with whitewater, which is drawn where the look names a stream of
    /// it.
    ///
    /// # Errors
    /// As for [`Renderer::render`].
    pub fn render_with(
        &mut self,
        frame: u32,
        particles: &Particles,
        white: &Particles,
    ) -> Result<Image, RenderError> {
        let water = WaterParticles::new(particles.clone());
        self.render_inputs(frame, &FrameInputs::alone(&water, white))
    }

    /// Like [`Renderer::render_with`], with the frames around it: motion blur then follows the
    /// particles' paths, and the classification of spray is steady over time.
    ///
    /// # Errors
    /// As for [`Renderer::render`], and [`RenderError::UnderWater`] where the screen-space method
    /// cannot draw what the camera sees.
    pub fn render_inputs(
        &mut self,
        frame: u32,
        inputs: &FrameInputs<'_>,
    ) -> Result<Image, RenderError> {
        self.render_parts(frame, inputs, &mut |_| ControlFlow::Continue(()))
    }

    /// Like [`Renderer::render_inputs`]. Calls `tell` with the progress before the first part of
    /// the picture and after each one, until it breaks.
    ///
    /// # Errors
    /// As for [`Renderer::render_inputs`], and [`RenderError::Ended`] if `tell` breaks.
    pub fn render_parts(
        &mut self,
        frame: u32,
        inputs: &FrameInputs<'_>,
        tell: &mut dyn FnMut(Part) -> ControlFlow<()>,
    ) -> Result<Image, RenderError> {
        let samples = samples_of(&self.look).len();
        let count = samples * self.sample.len() + self.aov_samples().len() * self.aovs.len();
        let parts = &mut PartProgress::new(frame, count, tell);
        parts.add(0)?;
        let loaded = self.load(frame, inputs)?;
        if let Some(whitewater) = &mut self.whitewater {
            let white = inputs.white;
            let grew = whitewater.load(&mut self.program, &self.scene, frame, white)?;
            if grew {
                self.record();
            }
        }
        let setting = self.setting(loaded.count);
        self.draw_once()?;
        let wants_objects = self.look.spec().output.cryptomatte;
        let mut covers = wants_objects.then(|| Covers::new(self.plan.extent.shaded()));
        for (index, sample) in (0u32..).zip(samples_of(&self.look)) {
            let shot = Shot {
                frame,
                order: index,
                index,
                sample,
                setting: &setting,
            };
            self.sample(&shot, false, parts)?;
            if let Some(covers) = &mut covers {
                covers.add(&self.read_bands(objects, 1)?, sample.weight as f32);
            }
        }
        let rate = self.scene.frames_per_second;
        let eye = eye(&self.look, DVec3::ZERO, frame.into(), rate);
        let mut image = Image::of(self.look.window(), eye.size);
        image.view = Some(CameraAttributes::of(&eye, rate));
        image.exr_space = self.look.spec().output.colour_space;
        if !self.plan.aovs.is_empty() {
            image.aovs = self.draw_aovs(frame, &setting, &loaded.ahead, parts)?;
        }
        image.matte = covers.map(|covers| {
            let spec = self.look.spec();
            let has_walls = spec.basin.is_some() || spec.wave_makers.is_some();
            covers.matte(&self.solids, has_walls, draws_spray(&self.look))
        });
        self.read_picture(&mut image)?;
        Ok(image)
    }

    /// Inputs of cameras besides look and sample, with this number of particles on the device.
    fn setting(&self, particle_count: u32) -> Setting {
        setting(&self.plan, &self.scene, particle_count)
    }

    /// Reads back the beauty and its light components.
    fn read_picture(&self, image: &mut Image) -> Result<(), RenderError> {
        let stride = self.plan.stride;
        let values = self.read_bands(picture, stride)?;
        for (index, light) in self.look.lights().into_iter().enumerate() {
            let part = values.iter().skip(1 + index).step_by(stride);
            let part = part.map(|&[r, g, b, _]| [r, g, b]).collect();
            image.lights.push((light, part));
        }
        image.beauty = match stride {
            1 => values,
            _ => values.into_iter().step_by(stride).collect(),
        };
        Ok(())
    }

    /// Reads back `values` values per pixel from the buffers that `of` returns for each band.
    fn read_bands<T: Pod>(
        &self,
        of: fn(usize) -> Buf<T>,
        values: usize,
    ) -> Result<Vec<T>, RenderError> {
        let width = values * self.plan.extent.picture[0] as usize;
        let mut pixels = Vec::new();
        for (band, &rows) in self.plan.bands.iter().enumerate() {
            let read = self.program.read(of(band), width * rows as usize)?;
            match pixels.is_empty() {
                true => pixels = read,
                false => pixels.extend(read),
            }
        }
        Ok(pixels)
    }

    /// Records all commands again with the current buffers.
    fn record(&mut self) {
        let pages = self.pages();
        let spread = |commands: &[Command]| pages.spread(commands);
        self.light = Recording::new(&self.program, &spread(&self.plan.water));
        self.sample = parts::record(&self.program, &spread(&self.plan.sample));
        self.aovs = parts::record(&self.program, &spread(&self.plan.aovs));
    }

    /// Division of the particles into dispatches.
    fn pages(&self) -> Pages {
        Pages::new(self.capacity, Limits::of(&self.program.context).storage)
    }

    /// Runs the commands that precede the first frame.
    fn draw_once(&mut self) -> Result<(), RenderError> {
        if let Some(once) = self.once.take() {
            once.run(&self.program, self.timer.as_mut())?;
        }
        Ok(())
    }

    /// Traces the sun's rays through the water of a sample, unless the last trace is still current.
    fn light(&mut self, camera: &uniform::Camera) -> Result<(), RenderError> {
        let (Some(caustics), Some(water)) = (&mut self.caustics, &self.water) else {
            return Ok(());
        };
        let sea = self.sea.as_ref().map_or(0.0, Sea::highest);
        let top = above(water.top().max(sea), &self.look, &self.scene);
        if caustics.stand_at(camera, top, &self.program) {
            self.light.run(&self.program, self.timer.as_mut())?;
        }
        Ok(())
    }

    /// Draws one sample into the picture's mean or, with `aovs`, into the additional channels.
    fn sample(
        &mut self,
        shot: &Shot<'_>,
        aovs: bool,
        parts: &mut PartProgress<'_>,
    ) -> Result<(), RenderError> {
        let camera = &shot.camera(&self.look, shot.sample.instant);
        let rate = self.scene.frames_per_second;
        let moments = Moments::of(&self.look, &shot.sample);
        let seconds = |frames: f64| (frames / rate) as f32;
        let span = moments.span.map(seconds);
        if let Some(water) = &mut self.water {
            let slice = water.slice(camera.seconds, span[0] < span[1]);
            let grew = water.stand_at(slice, &mut self.program, &self.scene)?;
            if grew {
                self.record();
            }
        }
        if self.program.has(MOMENTS.name()) {
            let instant = self.water.as_ref().map_or([0.0; 2], RayWater::instant);
            let moments = shot.moments(&self.look, &moments, instant);
            self.program.upload(MOMENTS, 0, &moments);
        }
        if let Some(cloud) = &mut self.cloud {
            let instants = match span[0] < span[1] {
                true => moments.instants.map(seconds).to_vec(),
                false => vec![camera.seconds],
            };
            let grew = cloud.stand_at(instants, &mut self.program, &self.scene)?;
            if grew {
                self.record();
            }
        }
        if let Some(sea) = &mut self.sea {
            sea.stand_at(camera, &mut self.program, &self.scene);
        }
        if let Some(moving) = &mut self.plan.moving {
            let times = (camera.seconds, span);
            moving.stand_at(times, &self.program, &mut self.plan.closed);
        }
        let (eye, near) = (camera.position.into(), camera.near);
        let camera = &uniform::Camera {
            closed: self.plan.closed.seen_from(eye, near),
            ..*camera
        };
        self.program.upload(CAMERA, 0, &[*camera]);
        if !aovs {
            self.light(camera)?;
        }
        self.run_portions(aovs, parts)
    }
}

/// A sample to draw.
struct Shot<'a> {
    frame: u32,
    /// Position among the samples of the same rays.
    order: u32,
    /// The same among those that are added up; the first one replaces what was there.
    index: u32,
    sample: Sample,
    setting: &'a Setting,
}

impl Shot<'_> {
    /// The sample's camera at an instant, frames from the frame's.
    fn camera(&self, look: &Look, instant: f64) -> uniform::Camera {
        let sample = Sample {
            instant,
            ..self.sample
        };
        camera(look, self.setting, self.frame.into(), sample, self.index)
    }

    /// Moments of the sample's rays, with a level set of the instant `stands`, seconds from the
    /// frame, and velocities beside it with components up to `speed`, m/s.
    fn moments(
        &self,
        look: &Look,
        moments: &Moments,
        [stands, speed]: [f32; 2],
    ) -> Vec<uniform::Moment> {
        let moment = |(k, &instant): (usize, &f64)| {
            let at = self.camera(look, instant);
            uniform::Moment {
                position: at.position,
                seconds: at.seconds,
                right: at.right,
                focal: at.focal,
                up: at.up,
                part: moments.part(k) as f32,
                forward: at.forward,
                since: at.seconds - stands,
                centre: at.centre,
                speed,
                seed: seed(self.frame, self.order),
            }
        };
        moments.instants.iter().enumerate().map(moment).collect()
    }
}

fn setting(plan: &Plan, scene: &RenderScene, particle_count: u32) -> Setting {
    Setting {
        origin: scene.origin + scene.domain.min,
        extent: plan.extent,
        particle_count,
        radius: plan.radius,
        near: NEAR * scene.particle_spacing,
        frames_per_second: scene.frames_per_second,
    }
}
