//! `swell render CACHE --look LOOK`

use std::{cell::OnceCell, path::PathBuf};

use clap::Args;
use serde_json::json;

use crate::{
    domain::frame_range::FrameRange,
    scene::look::Look,
    stage::render::{Event, Request, render},
};

use super::{
    Failure, GpuArgs, bake, count,
    interrupt::{self, Interrupt},
    output,
    progress::{Mode, Progress},
};

#[derive(Args, Debug)]
pub(super) struct RenderArgs {
    /// Cache directory.
    cache: PathBuf,
    /// Look file (TOML).
    #[arg(long, value_name = "LOOK")]
    look: PathBuf,
    /// Where images go; renders/SHOT-LOOK where left out.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Frames to render, such as 1-240x2; all that are cached where left out.
    #[arg(long, value_name = "RANGE")]
    frames: Option<FrameRange>,
    #[command(flatten)]
    gpu: GpuArgs,
    /// Take a panorama or a camera that lies outside of the look's folder.
    #[arg(long)]
    allow_outside: bool,
    /// Render frames again that stand there, also those of another cache or look.
    #[arg(long)]
    overwrite: bool,
    /// Time each pass and print a table; passes then run one by one.
    #[arg(long)]
    time_passes: bool,
    /// How to tell progress.
    #[arg(long, value_enum, default_value_t)]
    progress: Mode,
}

pub(super) fn run(args: &RenderArgs) -> Result<u8, Failure> {
    let look = Look::load_within(&args.look, bake::reach(args.allow_outside))?;
    let directory = match &args.output {
        Some(directory) => directory.clone(),
        None => {
            let (manifest, _) = crate::stage::inspect::cache(&args.cache)?;
            let look = args.look.file_stem().unwrap_or_default().to_string_lossy();
            PathBuf::from("renders").join(format!("{}-{look}", manifest.shot))
        }
    };
    let request = Request {
        cache: args.cache.clone(),
        look,
        directory,
        frames: args.frames.clone(),
        gpu: args.gpu.read()?,
        overwrite: args.overwrite,
        time_passes: args.time_passes,
    };
    let interrupt = Interrupt::install_or_warn();
    let progress = OnceCell::new();
    let outcome = render(&request, interrupt.flag(), &mut |event| {
        tell(args.progress, &progress, event)
    });
    let progress = progress
        .into_inner()
        .unwrap_or_else(|| Progress::new(args.progress, 0));
    progress.finish();
    let outcome = outcome?;
    progress.say(
        &format!(
            "{} {} rendered, {} stood there already, in {}",
            if outcome.interrupted {
                "ended by a signal:"
            } else {
                "done:"
            },
            count(outcome.rendered.into(), "frame"),
            outcome.skipped,
            request.directory.display()
        ),
        json!({
            "event": "end", "rendered": outcome.rendered, "skipped": outcome.skipped,
            "interrupted": outcome.interrupted, "directory": output::path(&request.directory),
        }),
    );
    output::print_pass_times(&outcome.passes);
    Ok(if outcome.interrupted {
        interrupt::EXIT_CODE as u8
    } else {
        0
    })
}

pub(super) fn tell(mode: Mode, progress: &OnceCell<Progress>, event: Event) {
    match event {
        Event::Ready {
            device,
            size,
            frames,
            left_out,
            warnings,
        } => {
            let progress = progress.get_or_init(|| Progress::new(mode, frames as u64));
            let [width, height] = size;
            let others = match left_out {
                0 => String::new(),
                more => format!(" ({more} more were baked, and their particles not kept)"),
            };
            progress.say(
                &format!("on {device}\n{} of {width} × {height}{others}", count(frames as u64, "frame")),
                json!({
                    "event": "ready", "device": device, "width": width, "height": height, "frames": frames,
                    "not_kept": left_out,
                }),
            );
            for warning in &warnings {
                progress.say(
                    &format!("warning: {warning}"),
                    json!({ "event": "warning", "what": "look", "text": warning }),
                );
            }
        }
        Event::Waiting { frames } => {
            if let Some(progress) = progress.get() {
                progress.say(
                    &format!(
                        "waiting for {} that other processes render",
                        count(frames as u64, "frame")
                    ),
                    json!({ "event": "waiting", "frames": frames }),
                );
            }
        }
        Event::Frame {
            frame,
            seconds,
            skipped,
        } => {
            if let Some(progress) = progress.get() {
                let text = if skipped {
                    "stands there".into()
                } else {
                    format!("{seconds:.2} s")
                };
                progress.frame(
                    &format!("frame {frame:4}  {text}"),
                    json!({ "event": "frame", "frame": frame, "seconds": seconds, "skipped": skipped }),
                );
            }
        }
    }
}
