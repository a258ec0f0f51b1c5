//! Bakes and renders with defaults, for programs; [`stage`](crate::stage) has the requests behind
//! them, and the other jobs.

use std::{
    ops::RangeInclusive,
    path::{Path, PathBuf},
    sync::atomic::AtomicBool,
};

use crate::{
    cache::CacheReader,
    domain::frame_range::FrameRange,
    scene::{Scene, look::Look},
    stage::{
        bake::{self, BakeError},
        branch::BranchPoint,
        device::{Device, Gpu},
        render::{self, RenderJobError},
    },
};

static NEVER: AtomicBool = AtomicBool::new(false);

/// Begins a bake of `scene`: the whole shot, on the best adapter, into `cache/SHOT/SOLVER`.
///
/// ```no_run
/// # use swell::{files::SceneBuilder, stage::device::Device};
/// # let scene = SceneBuilder::new("drop").build()?;
/// let outcome = swell::bake(&scene).to("cache/drop").device(Device::Cpu).run()?;
/// println!("{} frames", outcome.frames);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn bake(scene: &Scene) -> Bake<'_> {
    let solver = scene.solver.method().name();
    Bake {
        request: bake::BakeRequest {
            scene: scene.clone(),
            directory: Path::new("cache").join(&scene.shot.name).join(solver),
            frames: None,
            resume: false,
            from: None,
            device: Device::Gpu(Gpu::default()),
            time_passes: false,
        },
        stop: &NEVER,
        tell: Box::new(|_| {}),
    }
}

/// Begins a render of the cache in `directory`: all frames, on the best adapter, into
/// `renders/SHOT`.
///
/// ```no_run
/// let look = swell::files::load_look("scenes/looks/day.toml".as_ref())?;
/// swell::render("cache/drop", &look).frames(1..=24).to("out").run()?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn render<'a>(directory: impl AsRef<Path>, look: &Look) -> Render<'a> {
    Render {
        request: render::RenderRequest {
            cache: directory.as_ref().to_owned(),
            look: look.clone(),
            directory: PathBuf::new(),
            frames: None,
            chunk: None,
            gpu: Gpu::default(),
            number_from: None,
            overwrite: false,
            keep_going: false,
            time_passes: false,
        },
        stop: &NEVER,
        tell: Box::new(|_| {}),
    }
}

/// A bake that has not begun; [`bake()`] makes one.
#[must_use = "nothing is baked until `run`"]
pub struct Bake<'a> {
    request: bake::BakeRequest,
    stop: &'a AtomicBool,
    tell: Box<dyn FnMut(bake::BakeEvent) + Send + 'a>,
}

impl<'a> Bake<'a> {
    /// Sets the directory of the cache.
    pub fn to(mut self, directory: impl Into<PathBuf>) -> Self {
        self.request.directory = directory.into();
        self
    }

    /// Sets the device.
    pub fn device(mut self, device: Device) -> Self {
        self.request.device = device;
        self
    }

    /// Bakes up to the last of these frames. The first may be no later than the next frame to bake:
    /// 1, the one after the cache's last, or the one after that of [`from`](Self::from).
    ///
    /// # Panics
    /// If the range is empty, or longer than 10⁷ frames.
    pub fn frames(mut self, frames: RangeInclusive<u32>) -> Self {
        self.request.frames = Some(range(frames));
        self
    }

    /// Continues a bake that is already in the directory, or begins one if there is none.
    pub fn resume(mut self) -> Self {
        self.request.resume = true;
        self
    }

    /// Begins from a frame of another cache instead of the scene's own water.
    pub fn from(mut self, cache: impl Into<PathBuf>, frame: u32) -> Self {
        let directory = cache.into();
        self.request.from = Some(BranchPoint { directory, frame });
        self
    }

    /// Calls `tell` with the progress.
    pub fn on_event(mut self, tell: impl FnMut(bake::BakeEvent) + Send + 'a) -> Self {
        self.tell = Box::new(tell);
        self
    }

    /// Ends after the current frame once `stop` is set.
    pub fn stop_when(mut self, stop: &'a AtomicBool) -> Self {
        self.stop = stop;
        self
    }

    /// Returns the request, whose other fields can be set too.
    pub fn request_mut(&mut self) -> &mut bake::BakeRequest {
        &mut self.request
    }

    /// Bakes.
    ///
    /// # Errors
    /// [`BakeError`]; the frames that were completed before are in the cache.
    pub fn run(mut self) -> Result<bake::BakeOutcome, BakeError> {
        bake::bake(&self.request, self.stop, &mut self.tell)
    }
}

/// A render that has not begun; [`render()`] makes one.
#[must_use = "nothing is rendered until `run`"]
pub struct Render<'a> {
    request: render::RenderRequest,
    stop: &'a AtomicBool,
    tell: Box<dyn FnMut(render::RenderEvent) + Send + 'a>,
}

impl<'a> Render<'a> {
    /// Sets the folder of the pictures.
    pub fn to(mut self, directory: impl Into<PathBuf>) -> Self {
        self.request.directory = directory.into();
        self
    }

    /// Sets the adapter and the shaders.
    pub fn gpu(mut self, gpu: Gpu) -> Self {
        self.request.gpu = gpu;
        self
    }

    /// Renders these frames only.
    ///
    /// # Panics
    /// If the range is empty, or longer than 10⁷ frames.
    pub fn frames(mut self, frames: RangeInclusive<u32>) -> Self {
        self.request.frames = Some(range(frames));
        self
    }

    /// Renders frames again that exist already, even those of another look or cache.
    pub fn overwrite(mut self) -> Self {
        self.request.overwrite = true;
        self
    }

    /// Calls `tell` with the progress.
    pub fn on_event(mut self, tell: impl FnMut(render::RenderEvent) + Send + 'a) -> Self {
        self.tell = Box::new(tell);
        self
    }

    /// Ends after the current frame once `stop` is set.
    pub fn stop_when(mut self, stop: &'a AtomicBool) -> Self {
        self.stop = stop;
        self
    }

    /// Returns the request, whose other fields can be set too.
    pub fn request_mut(&mut self) -> &mut render::RenderRequest {
        &mut self.request
    }

    /// Renders.
    ///
    /// # Errors
    /// [`RenderJobError`]. Frames missing from the cache, and a folder that cannot be shared, are
    /// reported before anything is rendered.
    pub fn run(mut self) -> Result<render::RenderOutcome, RenderJobError> {
        if self.request.directory.as_os_str().is_empty() {
            let cache = CacheReader::open(&self.request.cache)?;
            self.request.directory = Path::new("renders").join(&cache.manifest().shot);
        }
        render::render(&self.request, self.stop, &mut self.tell)
    }
}

fn range(frames: RangeInclusive<u32>) -> FrameRange {
    FrameRange::inclusive(*frames.start(), *frames.end()).expect("a range with a frame in it")
}
