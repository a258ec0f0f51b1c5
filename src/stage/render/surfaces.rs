//! `check --render`: how far the surfaces in pictures of a cache are from rays in f64 through the particles' own field.

use std::{
    path::PathBuf,
    sync::atomic::{AtomicBool, Ordering},
    time::Instant,
};

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    cache::CacheReader,
    check::render::{Summary, Surfaces},
    domain::{frame_range::FrameRange, level_set::kernels::Kernels, particles::Particles},
    gpu::adapter::Needs,
    reference::rays::{Seen, cast},
    render::{RenderError, RenderScene, Renderer, eye, opaque},
    scene::look::{Look, MethodSpec},
};

use super::{RenderJobError, render_scene, told};
use crate::stage::{baked_scene, device::Gpu};

/// What rays may be off by: the 95th percentile of their depths, spacings. Half a voxel, a quarter of a spacing: a surface between
/// two corners of a voxel is where trilinear values put it.
pub const DEPTH: f64 = 0.25;

/// What rays may be off by: the median between normals, degrees. Differences over two voxels of a field that bends over a kernel's
/// shortest axis, a spacing.
pub const NORMAL: f64 = 5.0;

/// What to check.
#[derive(Clone, Debug)]
pub struct Request {
    /// Cache directory.
    pub cache: PathBuf,
    /// Camera and surface; spray and whitewater are left out.
    pub look: Look,
    /// Frames; the last one whose particles are cached where `None`.
    pub frames: Option<FrameRange>,
    /// What to render on.
    pub gpu: Gpu,
}

/// One method's surfaces.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Row {
    /// `ssfr` or `ray`.
    pub method: &'static str,
    /// Over all frames; `None` where no water was seen.
    pub surface: Option<Summary>,
    /// Wall clock a frame of rendering its channels, seconds.
    pub seconds: f64,
}

impl Row {
    /// Whether it is as near the truth as its method has to be: rays have a pass mark, splats are measured.
    pub fn is_within(&self) -> bool {
        let of_rays = |it: &Summary| it.depth[1] <= DEPTH && it.normal[0] <= NORMAL;
        self.method != "ray" || self.surface.as_ref().is_some_and(of_rays)
    }
}

/// What a check found.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// One a method.
    pub rows: Vec<Row>,
    /// Frames checked.
    pub frames: Vec<u32>,
    /// Particles whose centres lie outside of the surface, of all.
    pub outside: f64,
    /// Wall clock a frame of the truth, seconds.
    pub truth_seconds: f64,
    /// Adapter.
    pub device: String,
    /// Whether a signal ended it.
    pub interrupted: bool,
}

/// Renders frames by both methods and holds their depths and normals against rays in f64.
///
/// # Errors
/// The cache, its scene, the device, a frame that cannot be rendered, and that no frame shows water.
pub fn check_render(request: &Request, stop: &AtomicBool) -> Result<Outcome, RenderJobError> {
    let cache = CacheReader::open(&request.cache)?;
    let scene = baked_scene(&cache, &request.cache)?;
    let frames: Vec<u32> = match &request.frames {
        Some(frames) => frames.iter().collect(),
        None => vec![cache.last_frame()],
    };
    for &frame in &frames {
        cache.kept(frame)?;
    }
    let context = request.gpu.open(Needs::default())?;
    let methods = [("ssfr", MethodSpec::Ssfr), ("ray", MethodSpec::Ray)];
    let mut surfaces = methods.map(|_| (Surfaces::default(), 0.0));
    let mut outcome = Outcome {
        device: context.info.name.clone(),
        ..Outcome::default()
    };
    let (mut outside, mut all) = (0usize, 0usize);
    for frame in frames {
        if stop.load(Ordering::Relaxed) {
            outcome.interrupted = true;
            break;
        }
        let water = cache.read(frame)?;
        let set = render_scene(&scene, frame, &water);
        let begun = Instant::now();
        let (truth, out) = truth(&request.look, &set, frame, &water)?;
        outcome.truth_seconds += begun.elapsed().as_secs_f64();
        outside += out;
        all += water.len();
        for ((_, method), (surface, seconds)) in methods.iter().zip(&mut surfaces) {
            let look = request.look.of_surface(*method);
            let mut renderer =
                Renderer::new(&context, &look, &set).map_err(|error| told(error, &look))?;
            let begun = Instant::now();
            let image = renderer.render(frame, &water)?;
            *seconds += begun.elapsed().as_secs_f64();
            surface.add(&image, &truth, set.particle_spacing);
        }
        outcome.frames.push(frame);
    }
    let count = outcome.frames.len().max(1) as f64;
    outcome.truth_seconds /= count;
    outcome.outside = outside as f64 / all.max(1) as f64;
    let has_water = outcome.interrupted || surfaces.iter().any(|(it, _)| !it.is_empty());
    if !has_water {
        return Err(RenderJobError::NoWater);
    }
    for ((method, _), (surface, seconds)) in methods.into_iter().zip(surfaces) {
        outcome.rows.push(Row {
            method,
            surface: surface.summary(),
            seconds: seconds / count,
        });
    }
    Ok(outcome)
}

/// What rays in f64 meet, and how many particles' centres are outside of the surface.
fn truth(
    look: &Look,
    set: &RenderScene,
    frame: u32,
    water: &Particles,
) -> Result<(Vec<Seen>, usize), RenderError> {
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
