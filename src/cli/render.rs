//! `swell render CACHE --look LOOK`

mod preview;

use std::path::PathBuf;
use swell_files::load_look_with;

use clap::Args;
use serde_json::json;

use swell_domain::{chunk::Chunk, frame_range::FrameRange};
use swell_stage::render::{RenderEvent, RenderRequest, expected, render};

use super::{
    Failure, GpuArgs, bake, count,
    dry_run::DryRun,
    failed::{failed_in_all, frame_failed, refuse_failed},
    interrupt::{self, Interrupt},
    output, pass_times,
    progress::{Mode, Progress, Status},
};

#[derive(Args, Debug)]
pub(super) struct RenderArgs {
    /// Cache directory.
    cache: PathBuf,
    /// Look file (TOML).
    #[arg(long, value_name = "LOOK")]
    look: PathBuf,
    /// Where images go; renders/SHOT-LOOK where left out, with each --set behind it.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Override a look key, such as image.samples=8.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Frames to render, such as 1-240x2; all that are cached where left out.
    #[arg(long, value_name = "RANGE")]
    frames: Option<FrameRange>,
    /// Share of the frames, such as 1/4 for the first of four: several processes may fill one
    /// folder.
    #[arg(long, value_name = "I/N")]
    chunk: Option<Chunk>,
    /// Number of the first of the frames in the names of files, such as 1001; the others follow by
    /// their distance. The cache's own where left out.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(..=1_000_000_000))]
    number_from: Option<u32>,
    #[command(flatten)]
    gpu: GpuArgs,
    /// Take a panorama or a camera that lies outside of the look's folder.
    #[arg(long)]
    allow_outside: bool,
    /// Show one frame while the look file is edited: replace preview.png in the folder, first small
    /// and coarse, whenever the file changes, until a signal ends it. index.html there shows it.
    #[arg(
        long,
        requires_all = ["output", "frames"],
        conflicts_with_all = [
            "chunk", "number_from", "overwrite", "keep_going", "dry_run", "time_passes"
        ]
    )]
    preview: bool,
    /// Render frames again that exist, also those of another cache or look.
    #[arg(long)]
    overwrite: bool,
    /// Where frames of the cache are damaged, render the others; exit code 4 in the end.
    #[arg(long)]
    keep_going: bool,
    /// Say what would be made, how large and where, and make nothing. No device is opened.
    #[arg(long)]
    dry_run: bool,
    /// Time each pass and print a table; passes then run one by one.
    #[arg(long)]
    time_passes: bool,
    /// How to tell progress.
    #[arg(long, value_enum, default_value_t)]
    pub(super) progress: Mode,
}

pub(super) fn run(args: &RenderArgs, progress: &Progress) -> Result<u8, Failure> {
    let look = load_look_with(&args.look, &args.set, bake::reach(args.allow_outside))?;
    let directory = match &args.output {
        Some(directory) => directory.clone(),
        None => {
            let (manifest, _) = swell_stage::inspect::cache(&args.cache)?;
            let look = args.look.file_stem().unwrap_or_default().to_string_lossy();
            PathBuf::from("renders").join(folder_of(&manifest.shot, &look, &args.set))
        }
    };
    let request = RenderRequest {
        cache: args.cache.clone(),
        look,
        directory,
        frames: args.frames.clone(),
        chunk: args.chunk,
        gpu: args.gpu.read()?,
        number_from: args.number_from,
        overwrite: args.overwrite,
        keep_going: args.keep_going,
        time_passes: args.time_passes,
    };
    if args.dry_run {
        return dry_run(&request, progress);
    }
    if args.preview {
        return preview::run(request, args, progress);
    }
    let interrupt = Interrupt::install_or_warn();
    let outcome = render(&request, interrupt.flag(), &mut |event| {
        tell(progress, event)
    })?;
    progress.finish();
    progress.conclude(
        &format!(
            "{} {} rendered, {} already existed{}, in {}",
            if outcome.interrupted {
                "ended by a signal:"
            } else {
                "done:"
            },
            count(outcome.rendered.into(), "frame"),
            outcome.skipped,
            failed_in_all(&outcome.failed),
            request.directory.display()
        ),
        json!({
            "rendered": outcome.rendered, "skipped": outcome.skipped, "failed": outcome.failed,
            "interrupted": outcome.interrupted, "directory": output::path(&request.directory),
        }),
    );
    pass_times::report(progress, &outcome.passes, &[], outcome.rendered);
    if outcome.interrupted {
        return Ok(interrupt::EXIT_CODE as u8);
    }
    refuse_failed(&outcome.failed)
}

/// Longest name of a folder, characters; file systems allow 255 bytes.
const LONGEST: usize = 200;

/// Name of the folder of a look's images, with its overrides: each try has a folder of its own.
fn folder_of(shot: &str, look: &str, set: &[String]) -> String {
    let plain = |c: char| match c {
        c if c.is_ascii_alphanumeric() => Some(c),
        '.' | '-' | '_' | '=' => Some(c),
        '[' | ',' | '{' => Some('_'),
        _ => None,
    };
    let mut name = format!("{shot}-{look}");
    for set in set {
        name.push('-');
        name.extend(set.chars().filter_map(plain));
    }
    // Where two tries have one name, the second is refused: its folder has another look's images.
    name.chars().take(LONGEST).collect()
}

fn dry_run(request: &RenderRequest, progress: &Progress) -> Result<u8, Failure> {
    let found = expected(request)?;
    let bytes = found.bytes();
    let is_made = |frame: &u32| !found.standing.contains(frame);
    let told = DryRun {
        frames: found.frames.iter().copied().filter(is_made).collect(),
        standing: found.standing.len(),
        bytes,
        place: output::path(&request.directory),
    };
    told.tell(progress, "", json!({}));
    Ok(0)
}

pub(super) fn tell(progress: &Progress, event: RenderEvent) {
    match event {
        RenderEvent::Ready {
            device,
            software_warning,
            size,
            frames,
            left_out,
            warnings,
        } => {
            progress.begin(frames as u64);
            progress.warn_of_adapter(software_warning.as_deref());
            let [width, height] = size;
            let others = match left_out {
                0 => String::new(),
                more => format!(" ({more} more were baked without keeping their particles)"),
            };
            progress.say(
                &format!(
                    "on {device}\n{} of {width} × {height}{others}",
                    count(frames as u64, "frame")
                ),
                json!({
                    "event": "ready", "device": device, "width": width, "height": height,
                    "frames": frames,
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
        RenderEvent::Waiting { frames } => progress.say(
            &format!(
                "waiting for {} that other processes render",
                count(frames as u64, "frame")
            ),
            json!({ "event": "waiting", "frames": frames }),
        ),
        RenderEvent::Part { frame, part } => progress.part(
            &format!("frame {frame:4}"),
            (part.done.into(), part.count.into()),
            json!({ "of": "frame", "frame": frame }),
        ),
        RenderEvent::Frame {
            frame,
            seconds,
            skipped,
            bytes,
        } => {
            let (text, status) = match skipped {
                true => ("already exists".into(), Status::Skipped),
                false => (format!("{seconds:.2} s"), Status::Done),
            };
            progress.wrote(bytes);
            progress.frame(
                &format!("frame {frame:4}  {text}"),
                status,
                json!({
                    "event": "frame", "frame": frame, "seconds": seconds, "skipped": skipped,
                    "bytes": bytes,
                }),
            );
        }
        RenderEvent::Failed { frame, error } => frame_failed(progress, frame, &*error),
    }
}
