//! Cameras, skies and water with known properties, and the renderer's pictures of them.

use std::path::Path;
use swell::files::parse_look;

use glam::{DVec2, DVec3};
use swell::domain::bounds::Bounds;
use swell::domain::particles::Particles;
use swell::gpu::adapter::Context;
use swell::render::{FrameInputs, Image, RenderError, RenderScene, Renderer, WaterParticles};
use wgpu::util::DeviceExt;

pub(crate) use crate::support::device::{context, spoiled};

/// Width of the film, mm.
pub(crate) const FILM: f64 = 9.0;

/// A pinhole camera with a square picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eye {
    pub(crate) position: DVec3,
    pub(crate) target: DVec3,
    pub(crate) up: DVec3,
    /// Focal length in pixels.
    pub(crate) focal: f64,
    pub(crate) size: u32,
}

impl Eye {
    pub(crate) fn new(position: [f64; 3], target: [f64; 3], focal: f64) -> Self {
        Self {
            position: position.into(),
            target: target.into(),
            up: DVec3::Y,
            focal,
            size: 64,
        }
    }

    pub(crate) fn focal_length_mm(&self) -> f64 {
        self.focal * FILM / f64::from(self.size)
    }

    /// The look's `[camera]` table of this camera, at rest.
    fn table(&self, lines: &str) -> String {
        format!(
            "[camera]\n{lines}focal_length_mm = {:?}\nfilm_back_mm = [{FILM:?}, {FILM:?}]\n\
             up = {:?}\nposition = {:?}\ntarget = {:?}\n",
            self.focal_length_mm(),
            self.up.to_array(),
            self.position.to_array(),
            self.target.to_array()
        )
    }

    /// The look's `[camera]` table of a camera that is at `self` in frame 1 and at `next` in frame
    /// 2.
    fn moving_table(&self, next: &Self) -> String {
        let key = |frame: u32, eye: &Self| {
            format!(
                "[[camera.keyframe]]\nframe = {frame}\nposition = {:?}\ntarget = {:?}\n\
                 focal_length_mm = {:?}\n",
                eye.position.to_array(),
                eye.target.to_array(),
                eye.focal_length_mm()
            )
        };
        format!(
            "[camera]\nfocal_length_mm = 1.0\nfilm_back_mm = [{FILM:?}, {FILM:?}]\nup = {:?}\n{}{}",
            self.up.to_array(),
            key(1, self),
            key(2, next)
        )
    }

    /// Right, up and forward, unit length.
    pub(crate) fn axes(&self) -> [DVec3; 3] {
        let forward = (self.target - self.position).normalize();
        let right = forward.cross(self.up).normalize();
        [right, right.cross(forward), forward]
    }

    pub(crate) fn forward(&self) -> DVec3 {
        self.axes()[2]
    }

    /// Unit vector through the centre of pixel `i`, rows from the top.
    pub(crate) fn direction(&self, i: usize) -> DVec3 {
        let [right, up, forward] = self.axes();
        let side = self.size as usize;
        let x = (i % side) as f64 + 0.5 - 0.5 * side as f64;
        let y = 0.5 * side as f64 - (i / side) as f64 - 0.5;
        (forward * self.focal + right * x + up * y).normalize()
    }

    /// Position in the picture of something in this direction, pixels right and up from the middle.
    pub(crate) fn place(&self, direction: DVec3) -> DVec2 {
        let [right, up, forward] = self.axes();
        DVec2::new(direction.dot(right), direction.dot(up)) * self.focal / direction.dot(forward)
    }
}

/// A look in parts. The defaults emit no light and hide nothing.
#[derive(Clone, Debug)]
pub(crate) struct Setup {
    pub(crate) eye: Eye,
    /// The camera one frame later.
    pub(crate) next: Option<Eye>,
    pub(crate) samples: u32,
    pub(crate) shutter: f64,
    /// Further lines of `[camera]` and `[image]`.
    pub(crate) camera: String,
    pub(crate) image: String,
    /// Method of the renderer.
    pub(crate) method: &'static str,
    /// Lines of `[surface]` and `[water]`.
    pub(crate) surface: String,
    pub(crate) water: String,
    /// Azimuth and elevation, degrees, and intensity.
    pub(crate) sun: [f64; 3],
    /// Lines of `[sky]`.
    pub(crate) sky: String,
    pub(crate) ground: [f64; 3],
    pub(crate) haze: f64,
    pub(crate) solids: [f64; 3],
    pub(crate) background: bool,
    /// Further tables.
    pub(crate) more: String,
    /// Further lines of `[output]`.
    pub(crate) output: String,
}

pub(crate) const PANORAMA: &str = "model = \"panorama\"\nfile = \"sky.exr\"\n";

impl Setup {
    pub(crate) fn new(eye: Eye) -> Self {
        Self {
            eye,
            next: None,
            samples: 1,
            shutter: 0.0,
            camera: String::new(),
            image: String::new(),
            method: "ssfr",
            surface: "smoothing_width_m = 0.0\n".to_owned(),
            water: String::new(),
            sun: [0.0, 45.0, 0.0],
            sky: PANORAMA.to_owned(),
            ground: [0.0; 3],
            haze: 1e7,
            solids: [1.0; 3],
            background: true,
            more: String::new(),
            output: String::new(),
        }
    }

    pub(super) fn text(&self) -> String {
        let camera = match &self.next {
            Some(next) => self.eye.moving_table(next),
            None => self.eye.table(&self.camera),
        };
        let side = self.eye.size;
        let [azimuth, elevation, intensity] = self.sun;
        format!(
            "{camera}[image]\nwidth = {side}\nheight = {side}\nsamples = {}\nshutter = {:?}\n\
             {}[renderer]\nmethod = \"{}\"\n[surface]\n{}[water]\n{}\
             [sun]\nazimuth_degrees = {azimuth:?}\nelevation_degrees = {elevation:?}\n\
             intensity = {intensity:?}\n[sky]\n{}\
             [ground]\ncolour = {:?}\nvariation = 0.0\nhaze_m = {:?}\n[solids]\ncolour = {:?}\n\
             [output]\nformats = [\"exr\"]\nbackground = {}\n\
             aovs = [\"Z\", \"N\", \"P\", \"forward\", \"thickness\"]\n{}{}",
            self.samples,
            self.shutter,
            self.image,
            self.method,
            self.surface,
            self.water,
            self.sky,
            self.ground,
            self.haze,
            self.solids,
            self.background,
            self.output,
            self.more,
        )
    }
}

/// Renders one frame. `sky` is the panorama's radiance as a function of direction and of (u, v) in
/// 0..1; it is ignored if the look has another sky.
pub(crate) fn draw(
    context: &Context,
    setup: &Setup,
    sky: &dyn Fn(DVec3, DVec2) -> [f64; 3],
    scene: &RenderScene,
    water: &Particles,
    frame: u32,
) -> Image {
    let water = WaterParticles::new(water.clone());
    let white = Particles::default();
    let inputs = FrameInputs::alone(&water, &white);
    draw_inputs(context, setup, sky, scene, &inputs, frame).unwrap()
}

/// Like [`draw`], with neighbouring frames.
pub(crate) fn draw_inputs(
    context: &Context,
    setup: &Setup,
    sky: &dyn Fn(DVec3, DVec2) -> [f64; 3],
    scene: &RenderScene,
    inputs: &FrameInputs<'_>,
    frame: u32,
) -> Result<Image, RenderError> {
    renderer(context, setup, sky, scene, u32::MAX).render_inputs(frame, inputs)
}

/// A renderer that draws frames in tiles of at most `tile` pixels.
pub(super) fn renderer(
    context: &Context,
    setup: &Setup,
    sky: &dyn Fn(DVec3, DVec2) -> [f64; 3],
    scene: &RenderScene,
    tile: u32,
) -> Renderer {
    let folder = tempfile::tempdir().unwrap();
    write_sky(&folder.path().join("sky.exr"), sky);
    let look = parse_look(&setup.text(), &folder.path().join("look.toml")).unwrap();
    Renderer::with_tile_limit(context, &look, scene, tile).unwrap()
}

/// Texels around the horizon; half as many from zenith to nadir. Their (u, v) are exact in half
/// precision.
pub(crate) const SKY_WIDTH: usize = 256;

/// Writes a latitude-longitude panorama: the first row is the zenith, the middle of a row is +x,
/// and three quarters along it is +z.
pub(super) fn write_sky(file: &Path, sky: &dyn Fn(DVec3, DVec2) -> [f64; 3]) {
    let (width, height) = (SKY_WIDTH, SKY_WIDTH / 2);
    let texels: Vec<[f32; 3]> = (0..width * height)
        .map(|i| {
            let u = ((i % width) as f64 + 0.5) / width as f64;
            let v = ((i / width) as f64 + 0.5) / height as f64;
            let azimuth = (u - 0.5) * std::f64::consts::TAU;
            let polar = v * std::f64::consts::PI;
            let direction = DVec3::new(
                polar.sin() * azimuth.cos(),
                polar.cos(),
                polar.sin() * azimuth.sin(),
            );
            sky(direction, DVec2::new(u, v)).map(|x| x as f32)
        })
        .collect();
    exr::prelude::write_rgb_file(file, width, height, |x, y| {
        let [r, g, b] = texels[y * width + x];
        (r, g, b)
    })
    .unwrap();
}

/// Position (u, v) of a direction in such a panorama.
pub(crate) fn sky_place(direction: DVec3) -> DVec2 {
    DVec2::new(
        direction.z.atan2(direction.x) / std::f64::consts::TAU + 0.5,
        direction.normalize().y.acos() / std::f64::consts::PI,
    )
}

/// Radiance 1 everywhere, which gives every face the irradiance π.
pub(crate) fn uniform_sky(_: DVec3, _: DVec2) -> [f64; 3] {
    [1.0; 3]
}

/// Red is u and green is v, so that a colour tells its direction. The renderer's own filtering
/// reads such a ramp exactly, up to the eight bits of a texture unit's weights.
pub(crate) fn ramp_sky(_: DVec3, place: DVec2) -> [f64; 3] {
    [place.x, place.y, 1.0]
}

/// Tolerance of readings of [`ramp_sky`]: a texel's step in 256 parts, half of that again for
/// rounding, and 4096 ulp of a number up to 1, which Vulkan allows for arc functions.
pub(crate) const RAMP_ERROR: f64 = 1.5 / 256.0 / (SKY_WIDTH / 2) as f64 + 4096.0 / 16_777_216.0;

/// An open box of 10 m without solids, whose particles are balls of `radius` metres and represent
/// `filled` times their balls' volume.
pub(crate) fn scene(radius: f64, filled: f64) -> RenderScene {
    RenderScene {
        origin: DVec3::ZERO,
        domain: Bounds {
            min: DVec3::ZERO,
            max: DVec3::splat(10.0),
        },
        solids: Vec::new(),
        wet: None,
        parts: Vec::new(),
        particle_spacing: radius * (filled * 4.0 / 3.0 * std::f64::consts::PI).cbrt(),
        frames_per_second: 24.0,
        gravity: DVec3::new(0.0, -9.81, 0.0),
        wave_makers: Vec::new(),
        moving: Vec::new(),
        waves: None,
    }
}

pub(crate) fn ball(centre: DVec3, velocity: DVec3) -> Particles {
    Particles {
        position: vec![centre.as_vec3().to_array()],
        velocity: vec![velocity.as_vec3().to_array()],
        id: vec![0],
        ..Particles::default()
    }
}

pub(crate) fn luminance(c: [f32; 4]) -> f64 {
    0.2126 * f64::from(c[0]) + 0.7152 * f64::from(c[1]) + 0.0722 * f64::from(c[2])
}

pub(crate) fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

/// Runs `body`, the text of a function from `vec4f` to `vec4f`, on each input, after including a
/// shared shader file.
pub(crate) fn kernel(
    context: &Context,
    import: &str,
    body: &str,
    input: &[[f32; 4]],
) -> Vec<[f32; 4]> {
    let shared = swell::gpu::shader::compose(import, &[]).unwrap();
    kernel_after(context, &shared, body, input)
}

/// The same after any text.
pub(crate) fn kernel_after(
    context: &Context,
    shared: &str,
    body: &str,
    input: &[[f32; 4]],
) -> Vec<[f32; 4]> {
    let count = input.len();
    let text = format!(
        "{shared}
        @group(0) @binding(0) var<storage, read_write> values: array<vec4f>;
        fn evaluate(value: vec4f) -> vec4f {{ {body} }}
        @compute @workgroup_size(64)
        fn main(@builtin(global_invocation_id) id: vec3u) {{
            if id.x < {count}u {{ values[id.x] = evaluate(values[id.x]); }}
        }}"
    );
    let device = &context.device;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    });
    let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: None,
        contents: bytemuck::cast_slice(input),
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
    });
    let staging = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: buffer.size(),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry {
            binding: 0,
            resource: buffer.as_entire_binding(),
        }],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(count.div_ceil(64) as u32, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&buffer, 0, &staging, 0, buffer.size());
    context.queue.submit([encoder.finish()]);
    staging.map_async(wgpu::MapMode::Read, .., |_| {});
    context.wait().unwrap();
    let bytes = staging.get_mapped_range(..).unwrap();
    bytemuck::pod_collect_to_vec(&bytes)
}
