//! `render --preview`: one frame by a look that is being edited, as a picture that is replaced.

use std::{
    ops::ControlFlow,
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, Ordering},
    time::{Duration, Instant, SystemTime},
};

use super::{
    Asked, RenderJobError, RenderRequest,
    near::Near,
    pictures::{whole_attributes, write},
    set::render_scene,
    streams::Streams,
    told,
};
use crate::Blame;
use swell_cache::CacheReader;
use swell_domain::output::{self, Draft};
use swell_gpu::adapter::{Context, Needs};
use swell_render::{Image, RenderError, Renderer};
use swell_scene::{
    Scene,
    look::{FormatSpec, Look, LookError},
};

/// Name of the picture in its folder.
pub const PICTURE: &str = "preview.png";
/// Name of the page that shows it, and loads it again twice a second.
pub const PAGE: &str = "index.html";
/// Factors by which the picture is smaller, and samples a pixel, until it is the look's own.
const STEPS: [(u32, Option<u32>); 3] = [(4, Some(1)), (1, Some(1)), (1, None)];
/// Interval between checks of the look file.
const POLL: Duration = Duration::from_millis(50);

/// What a preview does.
#[derive(Debug)]
pub enum PreviewEvent {
    /// The device is open.
    Ready {
        /// Name of the adapter.
        device: String,
        /// Warning about the adapter, as [`Context::software_warning`].
        software_warning: Option<String>,
    },
    /// The picture was replaced.
    Shown {
        /// Width and height, pixels.
        size: [u32; 2],
        /// Samples a pixel.
        samples: u32,
        /// Wall-clock time since the look was read, seconds.
        seconds: f64,
        /// Whether it is the picture that a render would write.
        is_whole: bool,
    },
    /// The look cannot be read or drawn as it is now; the picture stays.
    Refused {
        /// The error.
        error: Box<RenderJobError>,
    },
}

/// Draws one frame of `request` into its folder, first small and coarse, again whenever the look
/// file `watched` has changed, until `stop` is set. `load` reads the look again.
///
/// # Errors
/// [`RenderJobError`] before the first picture, or of the device. Later errors of the look, and of
/// files that it names, are told.
pub fn preview(
    mut request: RenderRequest,
    watched: &Path,
    load: &mut dyn FnMut() -> Result<Look, LookError>,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(PreviewEvent),
) -> Result<(), RenderJobError> {
    let Asked { cache, frames, .. } = Asked::open(&request)?;
    let [frame] = frames[..] else {
        return Err(RenderJobError::NotOneFrame(frames.len()));
    };
    let scene = crate::baked_scene(&cache, &request.cache)?;
    let context = request.gpu.open(Needs::default())?;
    tell(PreviewEvent::Ready {
        device: context.info.name.clone(),
        software_warning: context.software_warning(),
    });
    output::create_folder(&request.directory).map_err(RenderJobError::Output)?;
    let text = page(&cache.manifest().shot, frame);
    output::write(&request.directory.join(PAGE), text).map_err(RenderJobError::Output)?;
    let near = Near::new(&scene);
    let mut job = Preview {
        frame,
        cache,
        scene,
        context,
        near,
        watched: Watched::new(watched),
        stop,
    };
    let mut shown = None;
    while !stop.load(Ordering::Relaxed) {
        let begin = Instant::now();
        job.watched.seen = job.watched.now();
        let drawn = load().map_err(RenderJobError::from).and_then(|look| {
            let hash = look.hash();
            if shown.as_ref() == Some(&hash) {
                return Ok(());
            }
            request.look = look;
            let is_whole = job.show(&request, begin, tell)?;
            shown = is_whole.then_some(hash);
            Ok(())
        });
        match drawn {
            Ok(()) => {}
            Err(error) if !matches!(Blame::from(&error), Blame::Device) => {
                shown = None;
                tell(PreviewEvent::Refused {
                    error: Box::new(error),
                });
            }
            Err(error) => return Err(error),
        }
        while !job.is_stale() {
            std::thread::sleep(POLL);
        }
    }
    Ok(())
}

/// A running preview.
struct Preview<'a> {
    frame: u32,
    cache: CacheReader,
    scene: Scene,
    context: Context,
    /// The frames that the picture is drawn from, with their neighbours found.
    near: Near,
    watched: Watched,
    stop: &'a AtomicBool,
}

impl Preview<'_> {
    /// Whether what is being drawn is not wanted any more.
    fn is_stale(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.watched.is_changed()
    }

    /// Replaces the picture step by step; returns whether all steps were taken.
    fn show(
        &mut self,
        request: &RenderRequest,
        begin: Instant,
        tell: &mut dyn FnMut(PreviewEvent),
    ) -> Result<bool, RenderJobError> {
        let streams = Streams::open(&request.cache, &request.look, &self.cache, &[self.frame])?;
        let attributes = whole_attributes(&self.cache, request, &streams, self.frame)?;
        let whole = request.look.of_picture(1, None);
        let mut before = None;
        for (smaller, samples) in STEPS {
            let look = request.look.of_picture(smaller, samples);
            let step = (look.window().size, look.spec().image.samples);
            if before.replace(step) == Some(step) {
                continue;
            }
            let Some(image) = self.draw(&look, &streams)? else {
                return Ok(false);
            };
            let mut draft = Draft::beside(&request.directory.join(PICTURE));
            write(draft.path(), FormatSpec::Png, &image, &attributes, &look)?;
            draft.publish().map_err(RenderJobError::Output)?;
            tell(PreviewEvent::Shown {
                size: step.0,
                samples: step.1,
                seconds: begin.elapsed().as_secs_f64(),
                is_whole: step == (whole.window().size, whole.spec().image.samples),
            });
        }
        Ok(true)
    }

    /// Draws the frame; `None` where it is not wanted any more.
    fn draw(&mut self, look: &Look, streams: &Streams) -> Result<Option<Image>, RenderJobError> {
        let around = self.near.around(&self.cache, look, self.frame)?;
        let mut set = render_scene(&self.scene, look, self.frame, &around.state())?;
        set.wet = streams.wet(self.frame)?;
        let white = streams.white(self.frame)?;
        let mut renderer =
            Renderer::new(&self.context, look, &set).map_err(|error| told(error, look))?;
        let inputs = around.inputs(&white);
        let drawn = renderer.render_parts(self.frame, &inputs, &mut |_| match self.is_stale() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        });
        match drawn {
            Ok(image) => Ok(Some(image)),
            Err(RenderError::Ended { .. }) => Ok(None),
            Err(error) => Err(told(error, look)),
        }
    }
}

/// When a file was last written, and its length; `None` while there is none, as in the moment in
/// which an editor replaces it.
type Stamp = Option<(SystemTime, u64)>;

/// A file that is edited.
struct Watched {
    file: PathBuf,
    /// Its stamp when it was read.
    seen: Stamp,
}

impl Watched {
    fn new(file: &Path) -> Self {
        Self {
            file: file.to_owned(),
            seen: None,
        }
    }

    fn now(&self) -> Stamp {
        let about = self.file.metadata().ok()?;
        Some((about.modified().ok()?, about.len()))
    }

    fn is_changed(&self) -> bool {
        let now = self.now();
        now.is_some() && now != self.seen
    }
}

fn page(shot: &str, frame: u32) -> String {
    let title = format!("{shot}, frame {frame}");
    let title = title.replace('&', "&amp;").replace('<', "&lt;");
    format!(
        "<!doctype html>\n<meta charset=\"utf-8\">\n<title>{title}</title>\n\
         <style>body {{ margin: 0; background: #222 }} img {{ width: 100% }}</style>\n\
         <img id=\"picture\" src=\"{PICTURE}\" alt=\"{title}\">\n\
         <script>\nsetInterval(() => {{\n  const next = new Image();\n  \
         next.onload = () => {{ document.getElementById(\"picture\").src = next.src; }};\n  \
         next.src = \"{PICTURE}?\" + Date.now();\n}}, 500);\n</script>\n"
    )
}
