//! `render`: a particle cache and a look to an image sequence. The cache is only read.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, Ordering},
    time::Instant,
};

use glam::DAffine3;

use crate::{
    cache::{CacheError, CacheReader},
    domain::frame_range::FrameRange,
    gpu::adapter::{Context, GpuError},
    render::{
        Attributes, Image, RenderError, RenderScene, Renderer,
        image::{read_exr_attributes, read_png_attributes, write_exr, write_png_with_attributes},
    },
    scene::{
        Scene, SceneError,
        look::{FormatSpec, Look, LookError},
    },
};

use super::Blame;

/// What to render, and where to.
#[derive(Clone, Debug)]
pub struct Request {
    /// Cache directory.
    pub cache: PathBuf,
    /// Camera, light, shading, output.
    pub look: Look,
    /// Where images go.
    pub directory: PathBuf,
    /// Frames wanted; all that are cached where `None`.
    pub frames: Option<FrameRange>,
    /// Index or part of the name of an adapter.
    pub adapter: Option<String>,
    /// Whether frames that stand there already are made again.
    pub overwrite: bool,
}

/// What a render has to tell while it runs.
#[derive(Clone, Debug)]
pub enum Event {
    /// The device is open.
    Ready {
        /// Adapter name.
        device: String,
        /// Pixels.
        size: [u32; 2],
        /// Frames wanted.
        frames: usize,
    },
    /// A frame is on the disk.
    Frame {
        /// Its number.
        frame: u32,
        /// Wall clock; 0 for a frame that stood there with the same hashes.
        seconds: f64,
        /// Whether it stood there.
        skipped: bool,
    },
}

/// How a render ended.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Frames rendered now.
    pub rendered: u32,
    /// Frames that stood there.
    pub skipped: u32,
    /// Whether a signal ended it.
    pub interrupted: bool,
}

/// Why a render failed.
#[derive(Debug, thiserror::Error)]
pub enum RenderJobError {
    /// The cache.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The scene in the cache.
    #[error("the cache's scene: {0}")]
    Scene(#[from] SceneError),
    /// What the look names.
    #[error(transparent)]
    Look(#[from] LookError),
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The renderer.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The output folder.
    #[error("{directory}: {source}", directory = .directory.display())]
    Directory {
        /// Which.
        directory: PathBuf,
        /// The system's words.
        source: std::io::Error,
    },
    /// The output would go into the cache.
    #[error("{} is in the cache itself: choose another -o", .0.display())]
    IntoCache(PathBuf),
}

impl From<&RenderJobError> for Blame {
    fn from(error: &RenderJobError) -> Self {
        match error {
            RenderJobError::Cache(error) => error.into(),
            RenderJobError::Scene(_) | RenderJobError::Directory { .. } => Self::Files,
            RenderJobError::Look(error) => error.into(),
            RenderJobError::Gpu(error) => error.into(),
            RenderJobError::Render(RenderError::Gpu(error)) => error.into(),
            RenderJobError::Render(RenderError::Panorama(_) | RenderError::Scene(_))
            | RenderJobError::IntoCache(_) => Self::Input,
            RenderJobError::Render(
                RenderError::NotFinite { .. }
                | RenderError::Write { .. }
                | RenderError::Format { .. },
            ) => Self::Files,
        }
    }
}

/// Renders the frames that are wanted; `tell` hears of progress, and `stop` ends it after the current frame.
///
/// # Errors
/// [`RenderJobError`]; a missing cache frame is one before anything is rendered.
pub fn render(
    request: &Request,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(Event),
) -> Result<Outcome, RenderJobError> {
    let cache = CacheReader::open(&request.cache)?;
    if is_inside(&request.directory, &request.cache) {
        return Err(RenderJobError::IntoCache(request.directory.clone()));
    }
    let frames: Vec<u32> = match &request.frames {
        Some(frames) => frames.iter().collect(),
        None => (cache.first_frame() + 1..=cache.last_frame()).collect(),
    };
    for &frame in &frames {
        cache.entry(frame)?;
    }
    // The cache's own copy: what was baked, wherever the cache has been moved to.
    let scene = Scene::parse(
        cache.scene_toml(),
        &request.cache.join("scene.toml"),
        &request.cache,
        &[],
    )?;
    let context = Context::open(request.adapter.as_deref())?;
    let image = &request.look.spec().image;
    tell(Event::Ready {
        device: context.info.name.clone(),
        size: [image.width, image.height],
        frames: frames.len(),
    });
    let mut kept = None;
    let mut outcome = Outcome::default();
    for frame in frames {
        if stop.load(Ordering::Relaxed) {
            outcome.interrupted = true;
            break;
        }
        let begin = Instant::now();
        let attributes = attributes(&cache, &request.look, frame)?;
        let files = files(request, &attributes, cache.last_frame());
        if !request.overwrite
            && files
                .iter()
                .all(|(file, format)| is_current(file, *format, &attributes))
        {
            outcome.skipped += 1;
            tell(Event::Frame {
                frame,
                seconds: 0.0,
                skipped: true,
            });
            continue;
        }
        let mut renderer = match kept.take() {
            Some(renderer) => renderer,
            None => Renderer::new(&context, &request.look, &render_scene(&scene, frame))
                .map_err(|error| told(error, &request.look))?,
        };
        fs::create_dir_all(&request.directory).map_err(|source| RenderJobError::Directory {
            directory: request.directory.clone(),
            source,
        })?;
        let picture = renderer.render(frame, &cache.read(frame)?)?;
        // Solids that move are drawn where they stand at the frame's time, not blurred over its shutter:
        // a renderer draws its solids once.
        kept = scene.moving_solids.is_empty().then_some(renderer);
        for (file, format) in &files {
            write(file, *format, &picture, &attributes, &request.look)?;
        }
        outcome.rendered += 1;
        tell(Event::Frame {
            frame,
            seconds: begin.elapsed().as_secs_f64(),
            skipped: false,
        });
    }
    Ok(outcome)
}

/// A renderer's fault; that of a panorama at its place in the look.
fn told(error: RenderError, look: &Look) -> RenderJobError {
    let fault = match &error {
        RenderError::Panorama(problem) => look.panorama_fault(problem),
        _ => None,
    };
    fault.map_or_else(|| error.into(), RenderJobError::Look)
}

/// Whether a folder is, or would be, within another.
fn is_inside(directory: &Path, other: &Path) -> bool {
    let Ok(other) = other.canonicalize() else {
        return false;
    };
    let mut ancestor = std::path::absolute(directory).unwrap_or_else(|_| directory.to_owned());
    loop {
        if let Ok(real) = ancestor.canonicalize() {
            return real.starts_with(&other);
        }
        if !ancestor.pop() {
            return false;
        }
    }
}

/// A scene as it stands at a frame.
fn render_scene(scene: &Scene, frame: u32) -> RenderScene {
    let time = f64::from(frame) / scene.shot.frames_per_second;
    let moving = scene.moving_solids.iter().map(|solid| {
        let way = DAffine3::from_translation(solid.displacement(time));
        solid.placed.mesh.transformed(&way)
    });
    let solids = scene.solids.iter().map(|solid| solid.mesh.clone());
    RenderScene {
        origin: scene.origin,
        domain: scene.domain,
        solids: solids.chain(moving).collect(),
        particle_spacing: scene.particle_spacing(),
        frames_per_second: scene.shot.frames_per_second,
    }
}

fn attributes(cache: &CacheReader, look: &Look, frame: u32) -> Result<Attributes, CacheError> {
    let manifest = cache.manifest();
    Ok(Attributes {
        frame,
        shot: manifest.shot.clone(),
        software: format!("{} {}", env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION")),
        scene_hash: manifest.scene_hash.clone(),
        cache_hash: cache.entry(frame)?.blake3.clone(),
        look_hash: look.hash(),
    })
}

/// `SHOT.0001.png`, with as many digits as the last cached frame needs, at least four.
fn name(shot: &str, frame: u32, last_frame: u32, extension: &str) -> String {
    let digits = last_frame.to_string().len().max(4);
    format!("{shot}.{frame:0digits$}.{extension}")
}

/// Name of the PNG of a frame of a cache.
pub(super) fn picture_name(cache: &CacheReader, frame: u32) -> String {
    name(&cache.manifest().shot, frame, cache.last_frame(), "png")
}

/// Where a frame's pictures go, and in which format each.
fn files(
    request: &Request,
    attributes: &Attributes,
    last_frame: u32,
) -> Vec<(PathBuf, FormatSpec)> {
    let formats = &request.look.spec().output.formats;
    formats
        .iter()
        .map(|&format| {
            let extension = match format {
                FormatSpec::Png => "png",
                FormatSpec::Exr => "exr",
            };
            let name = name(&attributes.shot, attributes.frame, last_frame, extension);
            (request.directory.join(name), format)
        })
        .collect()
}

fn is_current(file: &Path, format: FormatSpec, attributes: &Attributes) -> bool {
    let found = match format {
        FormatSpec::Png => read_png_attributes(file),
        FormatSpec::Exr => read_exr_attributes(file),
    };
    found.is_ok_and(|found| found == *attributes)
}

fn write(
    file: &Path,
    format: FormatSpec,
    image: &Image,
    attributes: &Attributes,
    look: &Look,
) -> Result<(), RenderError> {
    match format {
        FormatSpec::Png => write_png_with_attributes(file, image, &look.spec().view, attributes),
        FormatSpec::Exr => write_exr(file, image, attributes),
    }
}
