//! `render`: a particle cache and a look to an image sequence. The cache is only read.
//!
//! Several processes may render one look of one cache into one folder: each frame is rendered by one of them.

mod folder;
pub mod gallery;
mod plan;
mod set;
pub mod surfaces;
mod whitewater;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use crate::{
    cache::{self, CacheError, CacheReader, Manifest},
    domain::{
        frame_range::FrameRange, mesh_file::MeshError, particles::Particles,
        signed_distance::SignedDistanceError,
    },
    gpu::adapter::{Context, GpuError, Needs},
    render::{
        Attributes, Image, Moment, REACH, RenderError, Renderer, Water, frames_around,
        image::{read_exr_attributes, read_png_attributes, write_exr, write_png_with_attributes},
    },
    scene::{
        Scene, SceneError,
        look::{FormatSpec, Look, LookError},
    },
};

use self::folder::{Folder, Owner, Wanted};
use self::set::{render_scene, solid_names};
use self::whitewater::Whitewater;
use super::{
    Blame,
    device::{Gpu, shaders_note},
};

pub use self::{
    folder::FolderError,
    plan::{LookPlan, Subject, plan},
    whitewater::StreamError,
};

/// Between two looks at frames that other processes render.
const POLL: Duration = Duration::from_millis(50);

/// What to render, and where to.
#[derive(Clone, Debug)]
pub struct Request {
    /// Cache directory.
    pub cache: PathBuf,
    /// Camera, light, shading, output.
    pub look: Look,
    /// Where images go.
    pub directory: PathBuf,
    /// Frames wanted; all whose particles are cached where `None`.
    pub frames: Option<FrameRange>,
    /// What to render on.
    pub gpu: Gpu,
    /// Whether frames that stand there already are made again, also those of another look or cache.
    pub overwrite: bool,
    /// Whether passes are timed, which runs them one by one.
    pub time_passes: bool,
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
        /// Frames of the cache that are left out: their particles were not kept.
        left_out: usize,
        /// What of the look is allowed and hardly meant.
        warnings: Vec<String>,
    },
    /// A frame is on the disk.
    Frame {
        /// Its number.
        frame: u32,
        /// Wall clock; 0 for a frame that stood there with the same hashes.
        seconds: f64,
        /// Whether it stood there, or another process rendered it meanwhile.
        skipped: bool,
    },
    /// All other frames are done, and these are being rendered by other processes.
    Waiting {
        /// How many.
        frames: usize,
    },
}

/// How a render ended.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Frames rendered now.
    pub rendered: u32,
    /// Frames that stood there, or that another process rendered meanwhile.
    pub skipped: u32,
    /// Whether a signal ended it.
    pub interrupted: bool,
    /// Pass, seconds, runs, by name, of the frames rendered now; nothing unless that was asked for.
    pub passes: Vec<(&'static str, f64, u64)>,
}

/// Why a render failed.
#[derive(Debug, thiserror::Error)]
pub enum RenderJobError {
    /// A comparison of nothing is none that held.
    #[error("nothing was compared: no water is seen in these frames")]
    NoWater,
    /// The cache.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The scene in the cache.
    #[error("the cache's scene: {0}")]
    Scene(#[from] SceneError),
    /// The solids of a scene that is planned for.
    #[error(transparent)]
    Solid(#[from] SignedDistanceError),
    /// What the look names.
    #[error(transparent)]
    Look(#[from] LookError),
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The file of a solid's mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The renderer.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The output folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A stream of whitewater is no water.
    #[error("{} is a stream of whitewater: render the cache that it was made from, with a look that has [whitewater]", .0.display())]
    IsWhitewater(PathBuf),
    /// The stream that the look draws.
    #[error(transparent)]
    Whitewater(#[from] StreamError),
    /// The output would go into a cache.
    #[error("{} is in the cache {}: choose another -o", directory.display(), cache.display())]
    IntoCache {
        /// Where images were to go.
        directory: PathBuf,
        /// This cache or another.
        cache: PathBuf,
    },
}

impl From<&RenderJobError> for Blame {
    fn from(error: &RenderJobError) -> Self {
        match error {
            RenderJobError::Cache(error) => error.into(),
            RenderJobError::Scene(_) | RenderJobError::Folder(_) => Self::Files,
            RenderJobError::Solid(error) => error.into(),
            RenderJobError::Look(error) => error.into(),
            RenderJobError::Gpu(error) => error.into(),
            RenderJobError::Render(RenderError::Gpu(error)) => error.into(),
            RenderJobError::Render(
                RenderError::Panorama(_)
                | RenderError::Scene(_)
                | RenderError::Material { .. }
                | RenderError::UnderWater { .. },
            )
            | RenderJobError::NoWater
            | RenderJobError::IsWhitewater(_)
            | RenderJobError::IntoCache { .. } => Self::Input,
            RenderJobError::Whitewater(_) | RenderJobError::Mesh(_) => Self::Files,
            RenderJobError::Render(
                RenderError::NotFinite { .. }
                | RenderError::Write { .. }
                | RenderError::Format { .. },
            ) => Self::Files,
        }
    }
}

/// Renders the frames that are wanted; `tell` hears of progress, and `stop` ends it after the current frame. Frames that
/// another process renders into the same folder are left to it, and waited for at the end; those of one that was killed
/// are rendered here.
///
/// # Errors
/// [`RenderJobError`]; a missing cache frame is one before anything is rendered, and so is a folder that cannot be shared.
pub fn render(
    request: &Request,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(Event),
) -> Result<Outcome, RenderJobError> {
    let cache = CacheReader::open(&request.cache)?;
    if let Some(cache) = cache::around(&request.directory) {
        return Err(RenderJobError::IntoCache {
            directory: request.directory.clone(),
            cache,
        });
    }
    let frames: Vec<u32> = match &request.frames {
        Some(frames) => frames.iter().collect(),
        None => (cache.first_frame() + 1..=cache.last_frame())
            .filter(|&frame| cache.has_particles(frame))
            .collect(),
    };
    for &frame in &frames {
        cache.kept(frame)?;
    }
    let baked = cache.last_frame() - cache.first_frame();
    let left_out = match &request.frames {
        Some(_) => 0,
        None => baked as usize - frames.len(),
    };
    if cache.manifest().is_whitewater() {
        return Err(RenderJobError::IsWhitewater(request.cache.clone()));
    }
    let whitewater = match &request.look.spec().whitewater {
        Some(look) => Some(Whitewater::open(
            &request.cache,
            &look.stream,
            &cache,
            &frames,
        )?),
        None => None,
    };
    let scene = super::baked_scene(&cache, &request.cache)?;
    let context = request.gpu.open(Needs::default())?;
    let folder = enter(request, &cache, &frames)?;
    let image = &request.look.spec().image;
    tell(Event::Ready {
        device: format!(
            "{}{}{}",
            context.info.name,
            shaders_note(request.gpu.shaders.edited()),
            baked_note(cache.manifest())
        ),
        size: [image.width, image.height],
        frames: frames.len(),
        left_out,
        warnings: request.look.lints(),
    });
    let mut job = Job {
        request,
        folder,
        cache,
        whitewater,
        scene,
        context,
        near: BTreeMap::new(),
        kept: None,
        times: BTreeMap::new(),
    };
    let mut outcome = job.run(frames, stop, tell)?;
    outcome.passes = job.times.into_values().collect();
    Ok(outcome)
}

/// A renderer's fault; that of a panorama, of a material or of the method at its place in the look.
fn told(error: RenderError, look: &Look) -> RenderJobError {
    let fault = match &error {
        RenderError::Panorama(problem) => look.panorama_fault(problem),
        RenderError::Material { index, problem } => look.material_fault(*index, problem),
        RenderError::UnderWater { .. } => Some(look.method_fault(&error.to_string())),
        _ => None,
    };
    fault.map_or_else(|| error.into(), RenderJobError::Look)
}

/// Takes this process's place in the output folder.
fn enter(request: &Request, cache: &CacheReader, frames: &[u32]) -> Result<Folder, RenderJobError> {
    let first = attributes(cache, request, cache.first_frame())?;
    let mut names = Vec::new();
    for &frame in frames {
        names.extend(pictures(cache, &request.look, frame));
    }
    let wanted = Wanted {
        owner: Owner {
            cache: cache.entry(cache.first_frame())?.chain.clone(),
            software: first.software,
            shot: first.shot,
            scene_hash: first.scene_hash,
            look_hash: first.look_hash,
        },
        names: names.into_iter().map(|(name, _)| name).collect(),
        overwrite: request.overwrite,
        frame_hash: &|frame| cache.frame_hash(frame).ok().map(str::to_owned),
    };
    Ok(Folder::enter(&request.directory, &wanted)?)
}

/// What became of a frame.
enum Done {
    Rendered,
    Stands,
    /// Another process is at it.
    Elsewhere,
}

/// A render under way.
struct Job<'a> {
    request: &'a Request,
    folder: Folder,
    cache: CacheReader,
    /// Of the stream that the look draws.
    whitewater: Option<Whitewater>,
    scene: Scene,
    context: Context,
    /// Frames about the last one that was drawn, so that each is read once in a row of them.
    near: BTreeMap<u32, Arc<Water>>,
    /// Of the frame before, where it can draw another.
    kept: Option<Renderer>,
    /// What passes took so far.
    times: BTreeMap<&'static str, (&'static str, f64, u64)>,
}

impl Job<'_> {
    fn run(
        &mut self,
        mut frames: Vec<u32>,
        stop: &AtomicBool,
        tell: &mut dyn FnMut(Event),
    ) -> Result<Outcome, RenderJobError> {
        let mut outcome = Outcome::default();
        let mut is_told = false;
        while !frames.is_empty() {
            let mut elsewhere = Vec::new();
            for &frame in &frames {
                if stop.load(Ordering::Relaxed) {
                    outcome.interrupted = true;
                    return Ok(outcome);
                }
                let begin = Instant::now();
                let (seconds, skipped) = match self.frame(frame)? {
                    Done::Rendered => (begin.elapsed().as_secs_f64(), false),
                    Done::Stands => (0.0, true),
                    Done::Elsewhere => {
                        elsewhere.push(frame);
                        continue;
                    }
                };
                outcome.rendered += u32::from(!skipped);
                outcome.skipped += u32::from(skipped);
                tell(Event::Frame {
                    frame,
                    seconds,
                    skipped,
                });
            }
            if elsewhere.len() == frames.len() {
                if !is_told {
                    tell(Event::Waiting {
                        frames: frames.len(),
                    });
                    is_told = true;
                }
                std::thread::sleep(POLL);
            }
            frames = elsewhere;
        }
        Ok(outcome)
    }

    fn frame(&mut self, frame: u32) -> Result<Done, RenderJobError> {
        let request = self.request;
        let mut attributes = attributes(&self.cache, request, frame)?;
        attributes.cache_hash += &self.around(frame)?;
        if let Some(stream) = &self.whitewater {
            attributes.cache_hash += &format!(" {}", stream.frame_hash(frame)?);
        }
        let pictures = pictures(&self.cache, &request.look, frame);
        let stands = || {
            let is_there = |(name, format): &(String, FormatSpec)| {
                is_current(&request.directory.join(name), *format, &attributes)
            };
            !request.overwrite && pictures.iter().all(is_there)
        };
        if stands() {
            return Ok(Done::Stands);
        }
        let number = name(&attributes.shot, frame, self.cache.last_frame());
        let Some(_claim) = self.folder.claim(&number)? else {
            return Ok(Done::Elsewhere);
        };
        // Another process may have come to its end with it between the two.
        if stands() {
            return Ok(Done::Stands);
        }
        let picture = self.draw(frame)?;
        for (name, format) in &pictures {
            let draft = self.folder.draft(name);
            write(&draft, *format, &picture, &attributes, &request.look)?;
            self.folder.publish(name)?;
        }
        Ok(Done::Rendered)
    }

    /// A frame's particles, read once in a row of frames.
    fn water(&mut self, frame: u32) -> Result<Arc<Water>, CacheError> {
        if let Some(water) = self.near.get(&frame) {
            return Ok(water.clone());
        }
        let water = Arc::new(Water::new(self.cache.read(frame)?));
        self.near.insert(frame, water.clone());
        Ok(water)
    }

    /// What a picture's header says of the frames around its own that it is drawn from: a hash of theirs, so that it is drawn again when
    /// the cache has come to have more of them. Nothing where the look takes none.
    fn around(&self, frame: u32) -> Result<String, CacheError> {
        let reach = frames_around(&self.request.look);
        if reach == 0 {
            return Ok(String::new());
        }
        let mut hasher = blake3::Hasher::new();
        for (side, other) in others(frame) {
            if other.abs_diff(frame) <= reach && self.cache.has_particles(other) {
                let hash = self.cache.frame_hash(other)?;
                hasher.update(format!("{side} {hash}\n").as_bytes());
            }
        }
        Ok(format!(" around {}", hasher.finalize().to_hex()))
    }

    fn draw(&mut self, frame: u32) -> Result<Image, RenderJobError> {
        let look = &self.request.look;
        let water = self.cache.read(frame)?;
        let mut renderer = match self.kept.take() {
            Some(renderer) => renderer,
            None => {
                let set = render_scene(&self.scene, look, frame, &water)?;
                Renderer::new(&self.context, look, &set).map_err(|error| told(error, look))?
            }
        };
        renderer.name_solids(&solid_names(&self.scene));
        if self.request.time_passes {
            renderer.time_passes();
        }
        let white = match &self.whitewater {
            Some(stream) => stream.read(frame)?,
            None => Particles::default(),
        };
        let reach = frames_around(look);
        self.near.retain(|&other, _| other.abs_diff(frame) <= reach);
        let water = self.water(frame)?;
        let mut found = [const { None }; 2 * REACH as usize];
        for (side, other) in others(frame) {
            if other.abs_diff(frame) <= reach && self.cache.has_particles(other) {
                found[side] = Some(self.water(other)?);
            }
        }
        let moment = Moment {
            water: &water,
            around: found.each_ref().map(Option::as_deref),
            white: &white,
        };
        let picture = renderer
            .render_moment(frame, &moment)
            .map_err(|error| told(error, look))?;
        for (name, seconds, runs) in renderer.times() {
            let total = self.times.entry(name).or_insert((name, 0.0, 0));
            total.1 += seconds;
            total.2 += runs;
        }
        // Solids that move are drawn where they stand at the frame's time, not blurred over its shutter:
        // a renderer draws its solids once.
        let draws_plates = look.spec().wave_makers.is_some() && !self.scene.wave_makers.is_empty();
        let stands = self.scene.moving_solids.is_empty() && !draws_plates;
        self.kept = stands.then_some(renderer);
        Ok(picture)
    }
}

/// Frames about a frame, in the order of [`Moment::around`]: with their places there.
fn others(frame: u32) -> impl Iterator<Item = (usize, u32)> {
    let reach = i64::from(REACH);
    let offsets = (-reach..=reach).filter(|&offset| offset != 0);
    let frames = offsets.map(move |offset| u32::try_from(i64::from(frame) + offset).ok());
    let placed = frames.enumerate();
    placed.filter_map(|(side, frame)| Some((side, frame?)))
}

fn attributes(
    cache: &CacheReader,
    request: &Request,
    frame: u32,
) -> Result<Attributes, CacheError> {
    let manifest = cache.manifest();
    Ok(Attributes {
        frame,
        shot: manifest.shot.clone(),
        software: format!(
            "{} {}{}{}",
            env!("CARGO_PKG_NAME"),
            env!("CARGO_PKG_VERSION"),
            shaders_note(request.gpu.shaders.edited()),
            baked_note(manifest)
        ),
        scene_hash: manifest.scene_hash.clone(),
        cache_hash: cache.frame_hash(frame)?.to_owned(),
        look_hash: request.look.hash(),
    })
}

/// What is said of a cache behind a program: nothing where the program's own shaders baked it.
fn baked_note(manifest: &Manifest) -> String {
    let note = shaders_note(manifest.edited_shaders());
    match note.is_empty() {
        true => note,
        false => format!(", of a cache baked{note}"),
    }
}

/// `SHOT.0001`, with as many digits as the last cached frame needs, at least four.
fn name(shot: &str, frame: u32, last_frame: u32) -> String {
    let digits = last_frame.to_string().len().max(4);
    format!("{shot}.{frame:0digits$}")
}

fn ending(format: FormatSpec) -> &'static str {
    match format {
        FormatSpec::Png => "png",
        FormatSpec::Exr => "exr",
    }
}

/// Names of a frame's pictures, and in which format each.
fn pictures(cache: &CacheReader, look: &Look, frame: u32) -> Vec<(String, FormatSpec)> {
    let name = name(&cache.manifest().shot, frame, cache.last_frame());
    let formats = look.spec().output.formats.iter();
    formats
        .map(|&format| (format!("{name}.{}", ending(format)), format))
        .collect()
}

/// Name of the PNG of a frame of a cache.
pub fn picture_name(cache: &CacheReader, frame: u32) -> String {
    let name = name(&cache.manifest().shot, frame, cache.last_frame());
    format!("{name}.{}", ending(FormatSpec::Png))
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
