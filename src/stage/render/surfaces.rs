//! Compares the surfaces in pictures of a cache with f64 rays through the
//! particles' own field and, on request, pictures of the water with pictures by finer rays.

use std::{
    path::PathBuf,
    sync::atomic::{AtomicBool, Ordering},
    time::Instant,
};

use glam::DVec3;
use rayon::prelude::*;

use swell_cache::CacheReader;
use swell_check::{
    pictures::{Residual, score, shown},
    render::{Summary, Surfaces},
};
use swell_compare::{perceptual, pictures::Picture};
use swell_domain::{
    eye::Eye, frame_range::FrameRange, level_set::kernels::Kernels, particles::Particles,
};
use swell_gpu::adapter::{Context, Needs};
use swell_reference::rays::{RayHit, cast, cast_through, moment};
use swell_render::{RayTimes, RenderError, RenderScene, Renderer, eye, opaque};
use swell_scene::look::{Look, MethodSpec};

use super::{
    RenderJobError,
    near::{DrawnWater, Near},
    render_scene,
    set::FrameState,
    told,
};
use crate::{baked_scene, device::Gpu};
use swell_scene::Scene;

/// Tolerance of the ray method for depth: 95th percentile, in spacings. Half a voxel, a quarter of
/// a spacing: trilinear interpolation decides where a surface between two voxel corners lies.
pub const DEPTH: f64 = 0.25;

/// Tolerance of the ray method for normals: median angle, degrees. Finite differences over two
/// voxels approximate a field that bends over a kernel's shortest axis, which is one spacing.
pub const NORMAL: f64 = 5.0;

/// Samples of the reference pictures relative to the look's own, and their voxels per spacing: as
/// fine as a check has time for.
pub const FINER: (u32, f64) = (4, 2.0);

/// What to check.
#[derive(Clone, Debug)]
pub struct SurfaceRequest {
    /// Directory of the cache.
    pub cache: PathBuf,
    /// Camera and surface; spray and whitewater are left out.
    pub look: Look,
    /// Frames to check; the last frame with particles if `None`.
    pub frames: Option<FrameRange>,
    /// Whether to score pictures against finer rays.
    pub colour: bool,
    /// Whether to measure flicker, of each frame between its neighbours.
    pub flicker: bool,
    /// Adapter and shaders to render with.
    pub gpu: Gpu,
}

/// Result for one render method.
#[derive(Clone, Debug, serde::Serialize)]
pub struct SurfaceRow {
    /// `ssfr`, `ray`, or `open`: rays that each have a time while the shutter is open.
    pub method: &'static str,
    /// Error of the surface over all frames; `None` if no water was visible.
    pub surface: Option<Summary>,
    /// Wall-clock seconds per frame to render its channels.
    pub seconds: f64,
    /// SSIMULACRA 2 score of its pictures against the reference pictures, mean over the frames;
    /// `None` if not requested, or if a side is shorter than 8 pixels.
    pub score: Option<f64>,
    /// Flicker beyond that of the reference, as a fraction of white, mean over the frames; `None`
    /// if not requested.
    pub flicker: Option<f64>,
    /// Difference of its pictures from the mean of their neighbours, in the same unit: flicker and
    /// uneven motion.
    pub residual: Option<f64>,
}

impl SurfaceRow {
    /// Whether the method meets its tolerance: rays have one, also with an open shutter; splats are
    /// only measured.
    pub fn is_within(&self) -> bool {
        let of_rays = |it: &Summary| it.depth[1] <= DEPTH && it.normal[0] <= NORMAL;
        self.method == METHODS[0].0 || self.surface.as_ref().is_some_and(of_rays)
    }
}

/// Progress of a running check.
#[derive(Clone, Debug)]
pub enum SurfacesEvent {
    /// The device is open.
    Ready {
        /// Name of the adapter.
        device: String,
        /// Warning about the adapter, as [`Context::software_warning`].
        software_warning: Option<String>,
        /// Number of frames to check.
        frames: usize,
    },
    /// A frame was checked.
    Frame {
        /// Number of the frame.
        frame: u32,
        /// Wall-clock time of the whole frame, seconds.
        seconds: f64,
    },
}

/// Result of a check.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct SurfaceOutcome {
    /// One row per method.
    pub rows: Vec<SurfaceRow>,
    /// Frames that were checked.
    pub frames: Vec<u32>,
    /// Fraction of the particles whose centres lie outside the surface.
    pub outside: f64,
    /// Wall-clock seconds per frame to compute the f64 rays.
    pub truth_seconds: f64,
    /// Difference of the reference pictures from the mean of their neighbours, as a fraction of
    /// white, mean over the frames.
    pub truth_residual: Option<f64>,
    /// Name of the adapter.
    pub device: String,
    /// Whether a signal ended it.
    pub interrupted: bool,
}

/// Renders frames by both methods and compares their depths and normals with f64 rays. `tell`
/// receives progress events, and setting `stop` ends the check after the current frame.
///
/// # Errors
/// Errors of the cache, its scene or the device; a frame that cannot be rendered; no visible water
/// in any frame.
pub fn check_render(
    request: &SurfaceRequest,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(SurfacesEvent),
) -> Result<SurfaceOutcome, RenderJobError> {
    if request.colour {
        perceptual::require()?;
    }
    let cache = CacheReader::open(&request.cache)?;
    let scene = baked_scene(&cache, &request.cache)?;
    let frames: Vec<u32> = match &request.frames {
        Some(frames) => frames.iter().collect(),
        // Leaves a frame after it if neighbours are needed.
        None => vec![(cache.last_frame()).saturating_sub(u32::from(request.flicker))],
    };
    for &frame in &frames {
        if request.flicker && !(1..cache.last_frame()).contains(&frame) {
            return Err(RenderJobError::NoNeighbours(frame));
        }
        for frame in around(frame, request.flicker) {
            cache.kept(frame)?;
        }
    }
    let context = request.gpu.open(Needs::default())?;
    tell(SurfacesEvent::Ready {
        device: context.info.name.clone(),
        software_warning: context.software_warning(),
        frames: frames.len(),
    });
    let mut surfaces = METHODS.map(|_| (Surfaces::default(), 0.0));
    let mut open = OpenRays::default();
    let mut pictures = Pictures::new(request);
    let mut outcome = SurfaceOutcome {
        device: context.info.name.clone(),
        ..SurfaceOutcome::default()
    };
    let (mut outside, mut all) = (0usize, 0usize);
    for frame in frames {
        if stop.load(Ordering::Relaxed) {
            outcome.interrupted = true;
            break;
        }
        let whole = Instant::now();
        let water = DrawnWater::of(&scene).complete(frame, cache.read(frame)?);
        let set = render_scene(&scene, &request.look, frame, &FrameState::alone(&water))?;
        let begun = Instant::now();
        let (truth, out) = truth(&request.look, &set, frame, &water)?;
        outcome.truth_seconds += begun.elapsed().as_secs_f64();
        outside += out;
        all += water.len();
        let eye = eye(
            &request.look,
            DVec3::ZERO,
            frame.into(),
            set.frames_per_second,
        );
        for ((_, method), (surface, seconds)) in METHODS.iter().zip(&mut surfaces) {
            let look = request.look.of_surface(*method);
            let mut renderer =
                Renderer::new(&context, &look, &set).map_err(|error| told(error, &look))?;
            let begun = Instant::now();
            let image = renderer.render(frame, &water)?;
            *seconds += begun.elapsed().as_secs_f64();
            surface.add(&image, &truth, &eye, set.particle_spacing);
        }
        open.take((&context, &request.look, &set), frame, &water)?;
        let set = Set {
            cache: &cache,
            scene: &scene,
            context: &context,
        };
        pictures.take(&set, frame, &eye)?;
        outcome.frames.push(frame);
        tell(SurfacesEvent::Frame {
            frame,
            seconds: whole.elapsed().as_secs_f64(),
        });
    }
    let count = outcome.frames.len().max(1) as f64;
    outcome.truth_seconds /= count;
    outcome.outside = outside as f64 / all.max(1) as f64;
    let has_water = outcome.interrupted || surfaces.iter().any(|(it, _)| !it.is_empty());
    if !has_water {
        return Err(RenderJobError::NoWater);
    }
    outcome.truth_residual = mean(&pictures.residuals);
    let found = surfaces.into_iter().zip(&pictures.methods);
    for ((method, _), ((surface, seconds), pictures)) in METHODS.into_iter().zip(found) {
        outcome.rows.push(SurfaceRow {
            method,
            surface: surface.summary(),
            seconds: seconds / count,
            score: mean(&pictures.scores),
            flicker: mean(&pictures.flickers),
            residual: mean(&pictures.residuals),
        });
    }
    if request.look.spec().image.shutter > 0.0 {
        outcome.rows.push(SurfaceRow {
            method: "open",
            surface: open.surfaces.summary(),
            seconds: open.seconds / count,
            score: None,
            flicker: None,
            residual: None,
        });
    }
    Ok(outcome)
}

/// One of this many moments is compared, because each needs kernels of its own.
const EVERY: usize = 8;

/// Surfaces that rays with times of their own meet.
#[derive(Default)]
struct OpenRays {
    surfaces: Surfaces,
    seconds: f64,
}

impl OpenRays {
    /// Compares a frame's depths and normals by rays while the shutter is open with f64 rays at the
    /// same times; the water moves straight by its velocities. The shutter is open for as long as
    /// the look says, but no longer than the fastest water takes for the two spacings that one
    /// level set serves.
    fn take(
        &mut self,
        (context, look, set): (&Context, &Look, &RenderScene),
        frame: u32,
        water: &Particles,
    ) -> Result<(), RenderJobError> {
        let (rate, spacing) = (set.frames_per_second, set.particle_spacing);
        let shutter = look.spec().image.shutter;
        if shutter == 0.0 {
            return Ok(());
        }
        let longest = 2.0 * spacing * rate / water.max_speed().max(1e-30);
        let look = look.of_open_surface(shutter.min(longest));
        let mut renderer =
            Renderer::new(context, &look, set).map_err(|error| told(error, &look))?;
        let begun = Instant::now();
        let image = renderer.render(frame, water)?;
        self.seconds += begun.elapsed().as_secs_f64();
        let Some(times) = RayTimes::of(&look, frame, rate) else {
            return Ok(());
        };
        let width = image.width as usize;
        let mut pixels = vec![Vec::new(); times.seconds.len()];
        for pixel in 0..width * image.height as usize {
            let at = [pixel % width, pixel / width].map(|c| c as u32);
            let counted = [0, 1].map(|axis| at[axis].wrapping_add(times.first[axis]));
            pixels[moment(times.seed, counted)].push(pixel);
        }
        let moments = times
            .seconds
            .iter()
            .zip(&pixels)
            .skip(EVERY / 2)
            .step_by(EVERY);
        for (&seconds, pixels) in moments {
            let seen = truth_at(&look, set, (frame, seconds), water, pixels)?;
            self.surfaces.add_some(&image, pixels, &seen, spacing);
        }
        Ok(())
    }
}

/// Casts f64 rays through some pixels at an instant, seconds after the frame's.
fn truth_at(
    look: &Look,
    set: &RenderScene,
    (frame, seconds): (u32, f64),
    water: &Particles,
    pixels: &[usize],
) -> Result<Vec<RayHit>, RenderError> {
    let (corner, size) = (set.domain.min, set.domain.size());
    let wide = |v: &[f32; 3]| DVec3::from(v.map(f64::from));
    let moved = water.position.iter().zip(&water.velocity);
    let places: Vec<DVec3> = moved
        .map(|(p, v)| wide(p) - corner + seconds * wide(v))
        .collect();
    let kernels = Kernels::fit(&places, size, set.particle_spacing);
    let instant = f64::from(frame) + seconds * set.frames_per_second;
    let eye = eye(look, set.origin + corner, instant, set.frames_per_second);
    let opaque = opaque(look, &set.standing_at(seconds))?;
    Ok(cast_through(
        pixels,
        &eye,
        &kernels,
        (size, set.particle_spacing),
        &opaque,
    ))
}

const METHODS: [(&str, MethodSpec); 2] = [("ssfr", MethodSpec::Ssfr), ("ray", MethodSpec::Ray)];

/// A frame, with its neighbours if they are needed.
fn around(frame: u32, with_neighbours: bool) -> Vec<u32> {
    match with_neighbours {
        true => vec![frame - 1, frame, frame + 1],
        false => vec![frame],
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// What pictures are drawn from.
pub(super) struct Set<'a> {
    pub(super) cache: &'a CacheReader,
    pub(super) scene: &'a Scene,
    pub(super) context: &'a Context,
}

impl Set<'_> {
    /// The picture of a frame with a look as a screen shows it, drawn from the same inputs as in
    /// [`super::render`].
    pub(super) fn draw(&self, look: &Look, frame: u32) -> Result<Picture, RenderJobError> {
        let around = Near::new(self.scene).around(self.cache, look, frame)?;
        let set = render_scene(self.scene, look, frame, &around.state())?;
        let mut renderer =
            Renderer::new(self.context, look, &set).map_err(|error| told(error, look))?;
        let image = renderer.render_inputs(frame, &around.inputs(&Particles::default()))?;
        Ok(shown(&image, &look.spec().view))
    }
}

/// Measurements of one method's pictures, one entry per frame.
#[derive(Default)]
struct Pictured {
    scores: Vec<f64>,
    flickers: Vec<f64>,
    residuals: Vec<f64>,
}

/// Measurements of the pictures of all methods and of the reference.
struct Pictures<'a> {
    request: &'a SurfaceRequest,
    /// In the order of [`METHODS`].
    methods: [Pictured; 2],
    residuals: Vec<f64>,
}

impl<'a> Pictures<'a> {
    fn new(request: &'a SurfaceRequest) -> Self {
        Self {
            request,
            methods: METHODS.map(|_| Pictured::default()),
            residuals: Vec::new(),
        }
    }

    /// Draws and measures what is requested of a frame seen from `eye`.
    fn take(&mut self, set: &Set<'_>, frame: u32, eye: &Eye) -> Result<(), RenderJobError> {
        let SurfaceRequest {
            look,
            colour,
            flicker,
            ..
        } = self.request;
        if !(*colour || *flicker) {
            return Ok(());
        }
        let film = look.film_mm()[0];
        let focal_length_mm = eye.focal * film / f64::from(eye.size[0]);
        let still = look.standing(eye.position, eye.position + eye.forward, focal_length_mm);
        let frames = around(frame, *flicker);
        let middle = frames.len() / 2;
        let draw = |look: &Look| {
            let draw = |&frame: &u32| set.draw(look, frame);
            frames.iter().map(draw).collect::<Result<Vec<_>, _>>()
        };
        let residual = |all: &[Picture]| match all {
            [a, b, c] => Some(Residual::of([a, b, c])),
            _ => None,
        };
        let (samples, voxels) = FINER;
        let truth = draw(&still.of_water(MethodSpec::Ray).finer(samples, voxels))?;
        let moved = residual(&truth);
        self.residuals
            .extend(moved.as_ref().map(Residual::strength));
        for ((_, method), found) in METHODS.iter().zip(&mut self.methods) {
            let all = draw(&still.of_water(*method))?;
            if *colour {
                found.scores.extend(score(&all[middle], &truth[middle])?);
            }
            if let (Some(residual), Some(moved)) = (residual(&all), &moved) {
                found.flickers.push(residual.beyond(moved));
                found.residuals.push(residual.strength());
            }
        }
        Ok(())
    }
}

/// Casts the f64 rays, and counts the particles whose centres are outside the surface.
pub(super) fn truth(
    look: &Look,
    set: &RenderScene,
    frame: u32,
    water: &Particles,
) -> Result<(Vec<RayHit>, usize), RenderError> {
    let (corner, size) = (set.domain.min, set.domain.size());
    let places: Vec<DVec3> = water
        .position
        .iter()
        .map(|p| DVec3::from(p.map(f64::from)) - corner)
        .collect();
    let kernels = Kernels::fit(&places, size, set.particle_spacing);
    let field = kernels.field();
    let is_outside = |p: &&DVec3| field.value(**p) <= 0.0;
    let outside = places.par_iter().filter(is_outside).count();
    let eye = eye(
        look,
        set.origin + corner,
        frame.into(),
        set.frames_per_second,
    );
    let opaque = opaque(look, set)?;
    let seen = cast(&eye, &kernels, (size, set.particle_spacing), &opaque);
    Ok((seen, outside))
}
