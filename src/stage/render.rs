//! `render`: turns a particle cache and a look into an image sequence. The cache is only read.
//!
//! Several processes may render one look of one cache into one folder, each frame by one of them.

mod error;
mod expected;
mod folder;
pub mod gallery;
mod near;
mod pictures;
mod plan;
pub mod preview;
mod set;
mod streams;
pub mod surfaces;
mod whitewater;
mod writing;

use std::{
    collections::BTreeMap,
    ops::ControlFlow,
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use swell_cache::{CacheReader, refuse_inside};
use swell_domain::{
    chunk::{Chunk, share},
    frame_range::FrameRange,
    solver::PassTime,
};
use swell_gpu::adapter::{Context, Needs};
use swell_render::{Image, Part, RenderError, Renderer};
use swell_scene::{
    Scene,
    look::{FormatSpec, Look},
};

use self::folder::{Folder, Owner, Wanted};
use self::near::Near;
use self::pictures::{attributes, baked_note, is_current, name, pictures, whole_attributes};
use self::set::solid_names;
pub(crate) use self::set::{FrameState, render_scene};
use self::streams::Streams;
use self::writing::{DrawnFrame, Writing, end_writing};
use super::{
    device::{Gpu, PassTimes, shaders_note},
    numbering::Numbering,
};

pub use self::{
    error::RenderJobError,
    expected::{ExpectedRender, expected},
    folder::FolderError,
    pictures::picture_name,
    plan::{LookPlan, Subject, plan},
    whitewater::StreamError,
};

/// Interval between checks for frames that other processes are rendering.
const POLL: Duration = Duration::from_millis(50);

/// What to render, and where.
#[derive(Clone, Debug)]
pub struct RenderRequest {
    /// Directory of the cache.
    pub cache: PathBuf,
    /// Camera, light, shading, output.
    pub look: Look,
    /// Output folder of the images.
    pub directory: PathBuf,
    /// Frames to render; all frames with particles if `None`.
    pub frames: Option<FrameRange>,
    /// This process's share of the frames; all if `None`.
    pub chunk: Option<Chunk>,
    /// Adapter and shaders to render with.
    pub gpu: Gpu,
    /// Number that the first rendered frame gets in its file names; the others keep their distance
    /// from it. The cache's own numbers if `None`.
    pub number_from: Option<u32>,
    /// Whether to render frames again that exist already, even those of another look or cache.
    pub overwrite: bool,
    /// Whether to continue with other frames if one frame of the cache is damaged.
    pub keep_going: bool,
    /// Whether to time passes, which runs them one by one.
    pub time_passes: bool,
}

/// Progress of a running render.
#[derive(Clone, Debug)]
pub enum RenderEvent {
    /// The device is open.
    Ready {
        /// Name of the adapter.
        device: String,
        /// Warning about the adapter, as [`Context::software_warning`].
        software_warning: Option<String>,
        /// Width and height of the images, pixels.
        size: [u32; 2],
        /// Number of frames to render.
        frames: usize,
        /// Number of the cache's frames that are left out because their particles were not kept.
        left_out: usize,
        /// Warnings for legal but suspicious values of the look.
        warnings: Vec<String>,
    },
    /// Progress of a frame's drawing: sent before the first part and after each part.
    Part {
        /// Number of the frame.
        frame: u32,
        /// The parts of its picture, and how many are done.
        part: Part,
    },
    /// A frame is on the disk.
    Frame {
        /// Number of the frame.
        frame: u32,
        /// Wall-clock time, seconds; 0 for a frame that existed already with the same hashes.
        seconds: f64,
        /// Whether it existed already, or another process rendered it meanwhile.
        skipped: bool,
        /// Bytes of its pictures written by this run.
        bytes: u64,
    },
    /// A frame could not be rendered; the render continues.
    Failed {
        /// Number of the frame.
        frame: u32,
        /// The error.
        error: Arc<RenderJobError>,
    },
    /// All other frames are done, and other processes are rendering the remaining ones.
    Waiting {
        /// Number of frames waited for.
        frames: usize,
    },
}

/// Result of a render.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct RenderOutcome {
    /// Number of frames rendered by this run.
    pub rendered: u32,
    /// Number of frames that existed already, or that another process rendered meanwhile.
    pub skipped: u32,
    /// Frames that could not be rendered.
    pub failed: Vec<u32>,
    /// Whether a signal ended it.
    pub interrupted: bool,
    /// Times by pass name of the frames rendered by this run; empty unless requested.
    pub passes: PassTimes,
}

/// Renders the requested frames. `tell` receives progress events, and setting `stop` ends the
/// render after the current frame.
///
/// Frames that another process is rendering into the same folder are left to it and waited for at
/// the end; those of a process that was killed are rendered here.
///
/// # Errors
/// [`RenderJobError`]. Frames missing from the cache, and a folder that cannot be shared, are
/// reported before anything is rendered.
pub fn render(
    request: &RenderRequest,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(RenderEvent),
) -> Result<RenderOutcome, RenderJobError> {
    let Asked {
        cache,
        streams,
        frames,
        ends,
        left_out,
        numbering,
    } = Asked::open(request)?;
    let scene = super::baked_scene(&cache, &request.cache)?;
    let mut context = request.gpu.open(Needs::default())?;
    context.counts_operations = request.time_passes;
    let folder = enter(request, &cache, &frames, numbering)?;
    let image = &request.look.spec().image;
    let rate = cache.manifest().frames_per_second;
    let camera = ends.map(|ends| request.look.lint_camera(ends, rate));
    tell(RenderEvent::Ready {
        device: format!(
            "{}{}{}",
            context.info.name,
            shaders_note(request.gpu.shaders.edited()),
            baked_note(cache.manifest())
        ),
        software_warning: context.software_warning(),
        size: [image.width, image.height],
        frames: frames.len(),
        left_out,
        warnings: [request.look.lints(), camera.unwrap_or_default()].concat(),
    });
    let near = Near::new(&scene);
    let mut job = RenderJob {
        request,
        folder: Arc::new(folder),
        writing: None,
        cache,
        streams,
        scene,
        context,
        numbering,
        near,
        kept: None,
        times: BTreeMap::new(),
    };
    let mut outcome = job.run(frames, stop, tell)?;
    if request.time_passes {
        let times = std::mem::take(&mut job.times);
        outcome.passes = PassTimes::on(&job.context, times.into_values().collect())?;
    }
    Ok(outcome)
}

/// The resources that a request names, checked to exist.
struct Asked {
    cache: CacheReader,
    streams: Streams,
    /// Frames of this process's share.
    frames: Vec<u32>,
    /// The first and the last frame of all shares.
    ends: Option<[u32; 2]>,
    left_out: usize,
    numbering: Numbering,
}

impl Asked {
    fn open(request: &RenderRequest) -> Result<Self, RenderJobError> {
        let cache = CacheReader::open(&request.cache)?;
        refuse_inside(&request.directory, "folder")?;
        let all = super::frames_of(&cache, request.frames.as_ref());
        for &frame in &all {
            cache.kept(frame)?;
        }
        let baked = cache.last_frame() - cache.first_frame();
        let left_out = match &request.frames {
            Some(_) => 0,
            None => baked as usize - all.len(),
        };
        let frames = share(&all, request.chunk).to_vec();
        if let Some(of) = cache.manifest().stream_of() {
            return Err(RenderJobError::IsStream {
                directory: request.cache.clone(),
                of,
            });
        }
        let streams = Streams::open(&request.cache, &request.look, &cache, &frames)?;
        Ok(Self {
            cache,
            streams,
            frames,
            ends: all.first().zip(all.last()).map(|(&a, &b)| [a, b]),
            left_out,
            numbering: Numbering::new(&all, request.number_from),
        })
    }
}

/// Converts an error of the renderer; one caused by a panorama, a material or the method points to
/// its line in the look.
fn told(error: RenderError, look: &Look) -> RenderJobError {
    let fault = match &error {
        RenderError::Panorama(problem) => look.panorama_fault(problem),
        RenderError::Material { index, problem } => look.material_fault(*index, problem),
        RenderError::UnderWater { .. } => Some(look.method_fault(&error.to_string())),
        _ => None,
    };
    fault.map_or_else(|| error.into(), RenderJobError::Look)
}

/// Enters the output folder, registering this process there.
fn enter(
    request: &RenderRequest,
    cache: &CacheReader,
    frames: &[u32],
    numbering: Numbering,
) -> Result<Folder, RenderJobError> {
    let of_frame = |frame| cache.frame_hash(frame).ok().map(str::to_owned);
    let wanted = wanted(request, cache, (frames, numbering), &of_frame)?;
    Ok(Folder::enter(&request.directory, &wanted)?)
}

/// What this process will do in the output folder; `of_frame` gives a frame's hash.
fn wanted<'a>(
    request: &RenderRequest,
    cache: &CacheReader,
    (frames, numbering): (&[u32], Numbering),
    of_frame: &'a dyn Fn(u32) -> Option<String>,
) -> Result<Wanted<'a>, RenderJobError> {
    let first = attributes(cache, request, cache.first_frame())?;
    let mut names = Vec::new();
    for &frame in frames {
        names.extend(pictures(cache, &request.look, frame, numbering));
    }
    Ok(Wanted {
        owner: Owner {
            cache: cache.entry(cache.first_frame())?.chain.clone(),
            software: first.software,
            shot: first.shot,
            scene_hash: first.scene_hash,
            look_hash: first.look_hash,
            numbering: numbering.offset,
        },
        names: names.into_iter().map(|(name, _)| name).collect(),
        overwrite: request.overwrite,
        frame_hash: of_frame,
    })
}

/// What happened to a frame.
enum Done {
    /// It was drawn, and its pictures are to be written.
    Drawn(Box<DrawnFrame>),
    Stands,
    /// Another process is rendering it.
    Elsewhere,
}

/// A running render.
struct RenderJob<'a> {
    request: &'a RenderRequest,
    folder: Arc<Folder>,
    /// The frame drawn last, whose pictures are being encoded and written while the next one is
    /// drawn.
    writing: Option<Writing>,
    cache: CacheReader,
    streams: Streams,
    scene: Scene,
    context: Context,
    numbering: Numbering,
    /// Frames around the one drawn last, so that consecutive frames are read only once.
    near: Near,
    /// The renderer of the frame before, if it can draw another frame.
    kept: Option<Renderer>,
    /// Accumulated times of passes.
    times: BTreeMap<&'static str, PassTime>,
}

impl RenderJob<'_> {
    fn run(
        &mut self,
        frames: Vec<u32>,
        stop: &AtomicBool,
        tell: &mut dyn FnMut(RenderEvent),
    ) -> Result<RenderOutcome, RenderJobError> {
        let mut outcome = RenderOutcome::default();
        let drawn = self.draw_all(frames, stop, (&mut outcome, tell));
        // However it ended, what was drawn before is kept.
        let written = end_writing(&mut self.writing, &mut outcome, tell);
        drawn.and(written).map(|()| outcome)
    }

    fn draw_all(
        &mut self,
        mut frames: Vec<u32>,
        stop: &AtomicBool,
        (outcome, tell): (&mut RenderOutcome, &mut dyn FnMut(RenderEvent)),
    ) -> Result<(), RenderJobError> {
        let mut is_told = false;
        while !frames.is_empty() {
            let mut elsewhere = Vec::new();
            for &frame in &frames {
                if stop.load(Ordering::Relaxed) {
                    outcome.interrupted = true;
                    return Ok(());
                }
                let done = self.frame(frame, (&mut *outcome, &mut *tell));
                end_writing(&mut self.writing, outcome, tell)?;
                match done {
                    Ok(Done::Drawn(drawn)) => {
                        self.writing = Some(Writing::begin(*drawn, &self.folder, self.request));
                    }
                    Ok(Done::Stands) => {
                        outcome.skipped += 1;
                        tell(RenderEvent::Frame {
                            frame,
                            seconds: 0.0,
                            skipped: true,
                            bytes: 0,
                        });
                    }
                    Ok(Done::Elsewhere) => elsewhere.push(frame),
                    Err(error) if self.request.keep_going && error.is_of_frame() => {
                        outcome.failed.push(frame);
                        let error = Arc::new(error);
                        tell(RenderEvent::Failed { frame, error });
                    }
                    Err(error) => return Err(error),
                }
            }
            if elsewhere.len() == frames.len() {
                if !is_told {
                    tell(RenderEvent::Waiting {
                        frames: frames.len(),
                    });
                    is_told = true;
                }
                std::thread::sleep(POLL);
            }
            frames = elsewhere;
        }
        Ok(())
    }

    fn frame(
        &mut self,
        frame: u32,
        told: (&mut RenderOutcome, &mut dyn FnMut(RenderEvent)),
    ) -> Result<Done, RenderJobError> {
        let begin = Instant::now();
        let request = self.request;
        let attributes = whole_attributes(&self.cache, request, &self.streams, frame)?;
        let pictures = pictures(&self.cache, &request.look, frame, self.numbering);
        let stands = || {
            let is_there = |(name, format): &(String, FormatSpec)| {
                is_current(&request.directory.join(name), *format, &attributes)
            };
            !request.overwrite && pictures.iter().all(is_there)
        };
        if stands() {
            return Ok(Done::Stands);
        }
        let last = self.cache.last_frame();
        let number = name(&attributes.shot, frame, last, self.numbering);
        let Some(claim) = self.folder.claim(&number)? else {
            return Ok(Done::Elsewhere);
        };
        // Another process may have completed it before the claim.
        if stands() {
            return Ok(Done::Stands);
        }
        let image = self.draw(frame, told)?;
        Ok(Done::Drawn(Box::new(DrawnFrame {
            frame,
            begin,
            image,
            pictures,
            attributes,
            claim,
        })))
    }

    fn draw(
        &mut self,
        frame: u32,
        (outcome, tell): (&mut RenderOutcome, &mut dyn FnMut(RenderEvent)),
    ) -> Result<Image, RenderJobError> {
        let look = &self.request.look;
        let around = self.near.around(&self.cache, look, frame)?;
        let mut renderer = match self.kept.take() {
            Some(renderer) => renderer,
            None => {
                let mut set = render_scene(&self.scene, look, frame, &around.state())?;
                set.wet = self.streams.wet(frame)?;
                Renderer::new(&self.context, look, &set).map_err(|error| told(error, look))?
            }
        };
        renderer.name_solids(&solid_names(&self.scene));
        if self.request.time_passes {
            renderer.time_passes();
        }
        let white = self.streams.white(frame)?;
        let mut written = Ok(());
        let picture = renderer.render_parts(frame, &around.inputs(&white), &mut |part| {
            // Reports the previous frame as soon as it is on disk, before this one is drawn.
            let is_there = self.writing.as_ref().is_some_and(Writing::is_finished);
            if is_there && written.is_ok() {
                written = end_writing(&mut self.writing, outcome, tell);
            }
            tell(RenderEvent::Part { frame, part });
            ControlFlow::Continue(())
        });
        written?;
        let picture = picture.map_err(|error| told(error, look))?;
        for time in renderer.times() {
            let total = self.times.entry(time.pass);
            total.and_modify(|total| total.add(&time)).or_insert(time);
        }
        // A renderer knows the paths of what moves about one frame, and the wetness at it.
        let draws_plates = look.spec().wave_makers.is_some() && !self.scene.wave_makers.is_empty();
        let is_wet = look.spec().wet.is_some();
        let stands = self.scene.drawn_movers().next().is_none() && !draws_plates && !is_wet;
        self.kept = stands.then_some(renderer);
        Ok(picture)
    }
}
