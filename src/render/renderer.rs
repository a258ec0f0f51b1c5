//! One frame: samples over pixel and shutter, each a pass list over the whole frame.

use rayon::prelude::*;
use wgpu::{BindGroup, BindingResource, Buffer, BufferUsages, TextureView};

use super::camera::{Sample, Setting, camera, longest_focal_px, pose, samples};
use super::frame::{AOV_BYTES, Band, Extent, FAR, Filler, Filling, bands};
use super::image::{Aovs, Image};
use super::lighting::{shading, shadow_sampler, sky_sampler, sky_texture};
use super::pass::{ComputePass, Slot, Timer, folded, read, storage, tiles, uniform};
use super::set::{Set, shadow_from_world, shadow_map, triangles, upload};
use super::sky::Sky;
use super::surface::{CurvatureFlow, Filter, FlowSettings, NarrowRange};
use super::{RenderError, RenderScene, aeration, plan, uniform};
use crate::domain::particles::Particles;
use crate::gpu::adapter::Context;
use crate::scene::look::{AovSpec, FilterSpec, Look};

/// Splat radius over particle spacing where the look leaves it out: 0.5 √3 closes a lattice seen along its
/// diagonal.
const RADIUS: f64 = 0.87;
/// Smoothing width over particle spacing where the look leaves it out.
const SMOOTHING: f64 = 1.6;

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

/// Buffers of the whole padded frame.
struct Buffers {
    depth: [Buffer; 2],
    thickness: Buffer,
    solid_depth: Buffer,
    solid_packed: Buffer,
    spray: Option<Buffer>,
    owner: Option<Buffer>,
}

/// Particles on the device, and the groups that bind them.
struct Bound {
    buffer: Buffer,
    capacity: usize,
    splat_depth: BindGroup,
    splat_thickness: BindGroup,
    splat_spray: Option<BindGroup>,
    splat_owner: Option<BindGroup>,
    shade_aovs: Vec<BindGroup>,
}

/// Renders frames of one scene with one look.
pub struct Renderer {
    context: Context,
    look: Look,
    scene: RenderScene,
    extent: Extent,
    radius: f64,
    camera: Buffer,
    next_camera: Buffer,
    shading: Buffer,
    thickness_params: Buffer,
    buffers: Buffers,
    bands: Vec<Band>,
    filler: Filler,
    clear_depth: Filling,
    clear_owner: Option<Filling>,
    clear_solid: Filling,
    set: Option<Set>,
    splat_depth: ComputePass,
    splat_thickness: ComputePass,
    splat_spray: Option<ComputePass>,
    splat_owner: Option<ComputePass>,
    filter: Filter,
    shade: ComputePass,
    shade_groups: Vec<BindGroup>,
    shade_aovs: Option<ComputePass>,
    sky: TextureView,
    sky_sampler: wgpu::Sampler,
    shadow: TextureView,
    shadow_sampler: wgpu::Sampler,
    bound: Option<Bound>,
    has_solids: bool,
    timer: Timer,
}

const SHADE_SLOTS: [Slot; 12] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Uniform,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Texture,
    Slot::Sampler,
    Slot::DepthTexture,
    Slot::CompareSampler,
    Slot::Write,
];

impl Renderer {
    /// Builds what the look calls for and nothing more.
    ///
    /// # Errors
    /// A frame larger than the adapter's buffers, a damaged panorama, a mesh that names vertices it lacks.
    pub fn new(context: &Context, look: &Look, scene: &RenderScene) -> Result<Self, RenderError> {
        Self::with_tile_limit(
            context,
            look,
            scene,
            context.limits.max_texture_dimension_2d,
        )
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
        check(scene)?;
        let spec = look.spec();
        let tile_limit = tile_limit.clamp(16, context.limits.max_texture_dimension_2d);
        let extent = Extent::new(spec.image.width, spec.image.height);
        let spacing = scene.particle_spacing;
        let radius = spec.surface.radius_m.unwrap_or(RADIUS * spacing);
        let smoothing = spec
            .surface
            .smoothing_width_m
            .unwrap_or(SMOOTHING * spacing);
        let mut timer = Timer::new(context);

        let camera = camera_buffer(context);
        let next_camera = camera_buffer(context);
        let buffers = buffers(context, look, &extent)?;
        let filler = Filler::new(context)?;
        let fill = |buffer: &Buffer, word| filler.prepare(context, buffer, word, extent.pixels());
        let clear_depth = fill(&buffers.depth[0], FAR.to_bits());
        let clear_owner = buffers.owner.as_ref().map(|owner| fill(owner, u32::MAX));
        let clear_solid = fill(&buffers.solid_depth, FAR.to_bits());

        let opaque = triangles(look, scene)?;
        let has_solids = !opaque.is_empty();
        let matrix = shadow_from_world(&opaque, scene.domain.size(), look.sun_direction());
        let uploaded = has_solids.then(|| upload(context, &opaque));
        let shadow = shadow_map(
            context,
            &mut timer,
            &matrix,
            uploaded.as_ref().map(|buffer| (buffer, opaque.len())),
        )?;
        let set = match &uploaded {
            Some(buffer) => Some(Set::new(
                context,
                &extent,
                tile_limit,
                &camera,
                buffer,
                opaque.len(),
            )?),
            None => None,
        };

        let baked = Sky::new(look, context.limits.max_texture_dimension_2d)?;
        let shading = uniform(
            context,
            "shading",
            &shading(look, &baked, matrix.to_cols_array_2d()),
        );
        let volume = spacing.powi(3) / (4.0 / 3.0 * std::f64::consts::PI * radius.powi(3));
        let thickness_params = uniform(context, "thickness", &[volume as f32, 0.0, 0.0, 0.0]);
        let sky = sky_texture(context, &baked);

        let depths = [&buffers.depth[0], &buffers.depth[1]];
        let filter = match spec.surface.filter {
            FilterSpec::CurvatureFlow => {
                let settings = FlowSettings::for_width(smoothing, radius, longest_focal_px(look));
                let flow = CurvatureFlow::new(context, &settings, &camera, depths, extent.size)?;
                Filter::Flow(Box::new(flow))
            }
            FilterSpec::NarrowRange => Filter::Narrow(NarrowRange::new(
                context,
                smoothing,
                radius,
                &camera,
                depths,
                extent.size,
            )?),
        };

        use Slot::{Read, Uniform, Write};
        let pass = |name, slots: &[Slot]| ComputePass::new(context, name, name, &[], slots);
        let splat_depth = pass("ssfr/splat_depth", &[Uniform, Read, Read, Write])?;
        let splat_thickness = pass(
            "ssfr/splat_thickness",
            &[Uniform, Uniform, Read, Read, Write],
        )?;
        let splat_spray = match spec.water.spray {
            Some(_) => Some(pass(
                "ssfr/splat_spray",
                &[Uniform, Uniform, Read, Read, Read, Write],
            )?),
            None => None,
        };
        let splat_owner = match look.wants(AovSpec::Forward) {
            true => Some(pass("ssfr/splat_owner", &[Uniform, Read, Read, Write])?),
            false => None,
        };
        let mut slots = SHADE_SLOTS.to_vec();
        let mut defines = Vec::new();
        if buffers.spray.is_some() {
            slots.push(Read);
            defines.push("SPRAY");
        }
        let shade = ComputePass::new(context, "ssfr/shade", "ssfr/shade", &defines, &slots)?;
        let shade_aovs = match spec.output.aovs.is_empty() {
            false => {
                let mut slots = SHADE_SLOTS.to_vec();
                slots.extend([Read, Read, Uniform]);
                let defines = ["AOVS"];
                Some(ComputePass::new(
                    context,
                    "ssfr/shade_aovs",
                    "ssfr/shade",
                    &defines,
                    &slots,
                )?)
            }
            true => None,
        };
        let bands = bands(context, &extent, shade_aovs.is_some(), tile_limit)?;
        let mut renderer = Self {
            context: context.clone(),
            look: look.clone(),
            scene: scene.clone(),
            extent,
            radius,
            camera,
            next_camera,
            shading,
            thickness_params,
            buffers,
            bands,
            filler,
            clear_depth,
            clear_owner,
            clear_solid,
            set,
            splat_depth,
            splat_thickness,
            splat_spray,
            splat_owner,
            filter,
            shade,
            shade_groups: Vec::new(),
            shade_aovs,
            sky,
            sky_sampler: sky_sampler(context),
            shadow,
            shadow_sampler: shadow_sampler(context),
            bound: None,
            has_solids,
            timer,
        };
        renderer.shade_groups = renderer
            .bands
            .iter()
            .map(|band| {
                let mut resources = renderer.shade_resources(band, &band.colour);
                resources.extend(
                    renderer
                        .buffers
                        .spray
                        .as_ref()
                        .map(Buffer::as_entire_binding),
                );
                renderer.shade.bind(context, resources)
            })
            .collect();
        context.wait()?;
        Ok(renderer)
    }

    fn surface(&self) -> &Buffer {
        &self.buffers.depth[usize::from(self.filter.result_is_in_other())]
    }

    fn shade_resources<'a>(
        &'a self,
        band: &'a Band,
        output: &'a Buffer,
    ) -> Vec<BindingResource<'a>> {
        vec![
            self.camera.as_entire_binding(),
            self.shading.as_entire_binding(),
            band.uniform.as_entire_binding(),
            self.surface().as_entire_binding(),
            self.buffers.thickness.as_entire_binding(),
            self.buffers.solid_depth.as_entire_binding(),
            self.buffers.solid_packed.as_entire_binding(),
            BindingResource::TextureView(&self.sky),
            BindingResource::Sampler(&self.sky_sampler),
            BindingResource::TextureView(&self.shadow),
            BindingResource::Sampler(&self.shadow_sampler),
            output.as_entire_binding(),
        ]
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
            origin: self.scene.domain.min,
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
        if self.shade_aovs.is_some() {
            // Depths and normals have no mean: they are taken at pixel centres, at the frame's instant.
            let still = Sample {
                jitter: [0.0; 2],
                instant: 0.0,
                weight: 1.0,
            };
            let next = camera(&self.look, &setting, f64::from(frame) + 1.0, still, 0);
            self.context
                .queue
                .write_buffer(&self.next_camera, 0, bytemuck::bytes_of(&next));
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
        let context = &self.context;
        let bytes = capacity as u64 * size_of::<uniform::Particle>() as u64;
        let buffer = storage(context, "render particles", bytes)?;
        let frame = &self.buffers;
        let group = |pass: &ComputePass, buffers: &[&Buffer]| {
            let resources = buffers
                .iter()
                .map(|buffer| buffer.as_entire_binding())
                .collect();
            pass.bind(context, resources)
        };
        let (camera, params) = (&self.camera, &self.thickness_params);
        let solid = &frame.solid_depth;
        let splat_spray = self.splat_spray.as_ref().zip(frame.spray.as_ref());
        let splat_owner = self.splat_owner.as_ref().zip(frame.owner.as_ref());
        let shade_aovs = self.shade_aovs.as_ref().map_or_else(Vec::new, |pass| {
            // Without `forward` no one is asked for, and any buffer of words stands in.
            let owner = frame.owner.as_ref().unwrap_or(&frame.thickness);
            self.bands
                .iter()
                .filter_map(|band| band.aovs.as_ref().map(|aovs| (band, aovs)))
                .map(|(band, aovs)| {
                    let mut resources = self.shade_resources(band, aovs);
                    resources.push(owner.as_entire_binding());
                    resources.push(buffer.as_entire_binding());
                    resources.push(self.next_camera.as_entire_binding());
                    pass.bind(context, resources)
                })
                .collect()
        });
        Ok(Bound {
            splat_depth: group(
                &self.splat_depth,
                &[camera, &buffer, solid, &frame.depth[0]],
            ),
            splat_thickness: group(
                &self.splat_thickness,
                &[camera, params, &buffer, solid, &frame.thickness],
            ),
            splat_spray: splat_spray.map(|(pass, spray)| {
                group(
                    pass,
                    &[camera, params, &buffer, solid, self.surface(), spray],
                )
            }),
            splat_owner: splat_owner
                .map(|(pass, owner)| group(pass, &[camera, &buffer, &frame.depth[0], owner])),
            shade_aovs,
            buffer,
            capacity,
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
            .write_buffer(&self.camera, 0, bytemuck::bytes_of(camera));
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
        self.splat_depth
            .run(&mut encoder, timer, &bound.splat_depth, groups);
        self.splat_thickness
            .run(&mut encoder, timer, &bound.splat_thickness, groups);
        if let (true, Some(pass), Some(group), Some(clear)) = (
            aovs,
            &self.splat_owner,
            &bound.splat_owner,
            &self.clear_owner,
        ) {
            // Before the filter, while the depth is still that of the spheres.
            self.filler.run(&mut encoder, timer, clear);
            pass.run(&mut encoder, timer, group, groups);
        }
        self.filter.run(&mut encoder, timer);
        if let (false, Some(pass), Some(group), Some(spray)) =
            (aovs, &self.splat_spray, &bound.splat_spray, &frame.spray)
        {
            encoder.clear_buffer(spray, 0, None);
            pass.run(&mut encoder, timer, group, groups);
        }
        let (pass, shade_groups) = match (&self.shade_aovs, aovs) {
            (Some(pass), true) => (pass, &bound.shade_aovs),
            _ => (&self.shade, &self.shade_groups),
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

    fn read_aovs(&self) -> Result<Aovs, RenderError> {
        let mut values: Vec<[f32; 10]> = Vec::new();
        for band in &self.bands {
            if let Some(buffer) = &band.aovs {
                let bytes = AOV_BYTES * u64::from(self.extent.picture[0]) * u64::from(band.rows);
                values.extend(read::<[f32; 10]>(&self.context, buffer, bytes)?);
            }
        }
        let origin = self.scene.domain.min;
        let seen = |v: &[f32; 10]| v[0] < 0.1 * FAR;
        let wants = |aov| self.look.wants(aov);
        Ok(Aovs {
            z: wants(AovSpec::Z).then(|| values.iter().map(|v| v[0]).collect()),
            n: wants(AovSpec::N).then(|| values.iter().map(|v| [v[1], v[2], v[3]]).collect()),
            p: wants(AovSpec::P).then(|| {
                values
                    .iter()
                    .map(|v| {
                        if !seen(v) {
                            return [0.0; 3];
                        }
                        [0, 1, 2].map(|axis| (f64::from(v[4 + axis]) + origin[axis]) as f32)
                    })
                    .collect()
            }),
            forward: wants(AovSpec::Forward).then(|| values.iter().map(|v| [v[7], v[8]]).collect()),
            thickness: wants(AovSpec::Thickness).then(|| values.iter().map(|v| v[9]).collect()),
        })
    }
}

fn check(scene: &RenderScene) -> Result<(), RenderError> {
    let size = scene.domain.size();
    if !(size.is_finite() && size.cmpgt(glam::DVec3::ZERO).all()) {
        return Err(RenderError::Scene(format!("the domain's size is {size}")));
    }
    for (name, value) in [
        ("particle_spacing", scene.particle_spacing),
        ("frames_per_second", scene.frames_per_second),
    ] {
        if !(value.is_finite() && value > 0.0) {
            return Err(RenderError::Scene(format!(
                "{name} is {value}; allowed is > 0"
            )));
        }
    }
    Ok(())
}

fn camera_buffer(context: &Context) -> Buffer {
    context.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("camera"),
        size: size_of::<uniform::Camera>() as u64,
        usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn buffers(context: &Context, look: &Look, extent: &Extent) -> Result<Buffers, RenderError> {
    let pixels = extent.pixels();
    let spray = match look.spec().water.spray {
        Some(_) => Some(storage(context, "spray", pixels)?),
        None => None,
    };
    let owner = match look.wants(AovSpec::Forward) {
        true => Some(storage(context, "owner", 4 * pixels)?),
        false => None,
    };
    Ok(Buffers {
        depth: [
            storage(context, "depth", 4 * pixels)?,
            storage(context, "depth", 4 * pixels)?,
        ],
        // Half the resolution on both sides, four bytes a cell.
        thickness: storage(context, "thickness", pixels)?,
        solid_depth: storage(context, "solid depth", 4 * pixels)?,
        solid_packed: storage(context, "solid normal", 4 * pixels)?,
        spray,
        owner,
    })
}
