//! `swell view CACHE|IMAGES|STUDY`

use std::{
    path::{Path, PathBuf},
    process::{Command, Stdio},
};
use swell_files::load_look_within;

use clap::{Args, ValueEnum};
use serde_json::json;

use swell_domain::frame_range::FrameRange;
use swell_stage::view::{Aspect, Placing, RATE, SHEET, ViewEvent, ViewRequest, view};

use super::{
    Failure, bake, count,
    interrupt::{self, Interrupt},
    output,
    progress::{Mode, Progress, Status},
    size,
};

#[derive(Args, Debug)]
pub(super) struct ViewArgs {
    /// Cache directory, folder of rendered pictures, or folder of a study; two caches or renders
    /// are held against each other.
    #[arg(required = true, num_args = 1..=2, value_name = "CACHE|IMAGES|STUDY")]
    subjects: Vec<PathBuf>,
    /// Where contact sheet and page go; views/NAME where left out.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Frames to look at, such as 1-240x2; all where left out.
    #[arg(long, value_name = "RANGE")]
    frames: Option<FrameRange>,
    /// Make a contact sheet, sheet.png, of at most so many frames. Without --sheet, --player and
    /// --movie sheet and page are made.
    #[arg(
        long,
        value_name = "N",
        num_args = 0..=1,
        require_equals = true,
        value_parser = clap::value_parser!(u32).range(1..=2000)
    )]
    sheet: Option<Option<u32>>,
    /// Make a page that plays the frames, index.html.
    #[arg(long)]
    player: bool,
    /// Make a movie: .apng by swell, .mp4 (H.264) or .webm (VP9) by ffmpeg.
    #[arg(long, value_name = "FILE")]
    movie: Option<PathBuf>,
    /// Reduce pictures of page and movie to at most so many pixels of width; a page's to 1280 where
    /// left out.
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(16..=16384))]
    width: Option<u32>,
    /// Frames a second; those of the cache or the pictures where left out, else 24.
    #[arg(long, value_name = "RATE", value_parser = rate)]
    fps: Option<f64>,
    /// Where the page has its pictures.
    #[arg(long, value_enum, default_value_t, value_name = "WHERE")]
    pictures: Pictures,
    /// From where the particles of a cache are looked at.
    #[arg(long, value_enum, default_value_t, value_name = "WHERE")]
    from: Sight,
    /// Cache whose times, probes and ledger are drawn below the pictures; a cache that is looked at
    /// has its own.
    #[arg(long, value_name = "CACHE")]
    curves: Option<PathBuf>,
    /// Look through whose [view] EXR files are shown.
    #[arg(long, value_name = "LOOK")]
    look: Option<PathBuf>,
    /// Take a panorama or a camera that lies outside of the look's folder.
    #[arg(long)]
    allow_outside: bool,
    /// The program that encodes .mp4 and .webm.
    #[arg(long, value_name = "PROGRAM", default_value = "ffmpeg")]
    ffmpeg: String,
    /// Hand the page, or else the sheet, to this system's browser.
    #[arg(long)]
    open: bool,
    /// How to tell progress.
    #[arg(long, value_enum, default_value_t)]
    pub(super) progress: Mode,
}

#[derive(ValueEnum, Clone, Copy, Debug, Default)]
enum Pictures {
    /// Within the page where they are at most 64 MB, else beside it.
    #[default]
    Auto,
    /// Within the page: one file, which can be sent.
    Within,
    /// In a folder beside the page, which opens at once.
    Beside,
}

#[derive(ValueEnum, Clone, Copy, Debug, Default)]
enum Sight {
    /// Along -z: x goes right, y up.
    #[default]
    Side,
    /// From above: x goes right, -z up.
    Top,
    /// From above a corner.
    Corner,
}

fn rate(text: &str) -> Result<f64, String> {
    let allowed = 0.1..=240.0;
    let found = text.parse().ok().filter(|x| allowed.contains(x));
    found.ok_or_else(|| "write a number from 0.1 to 240".to_owned())
}

pub(super) fn run(args: &ViewArgs, progress: &Progress) -> Result<u8, Failure> {
    let look = match &args.look {
        Some(look) => Some(load_look_within(look, bake::reach(args.allow_outside))?),
        None => None,
    };
    let is_default = args.sheet.is_none() && args.movie.is_none() && !args.player;
    let sheet = args.sheet.or(is_default.then_some(None));
    let request = ViewRequest {
        subjects: args.subjects.clone(),
        directory: args.output.clone(),
        frames: args.frames.clone(),
        sheet: sheet.map(|most| most.map_or(SHEET, |most| most as usize)),
        movie: args.movie.clone(),
        player: args.player || is_default,
        placing: match args.pictures {
            Pictures::Auto => Placing::Auto,
            Pictures::Within => Placing::Within,
            Pictures::Beside => Placing::Beside,
        },
        width: args.width.map(|width| width as usize),
        frames_per_second: args.fps,
        look,
        aspect: match args.from {
            Sight::Side => Aspect::Side,
            Sight::Top => Aspect::Top,
            Sight::Corner => Aspect::Corner,
        },
        curves: args.curves.clone(),
        ffmpeg: args.ffmpeg.clone(),
    };
    let interrupt = Interrupt::install_or_warn();
    let outcome = view(&request, interrupt.flag(), &mut |event| {
        tell(progress, event);
    })?;
    progress.finish();
    if outcome.interrupted {
        progress.conclude(
            "ended by a signal: nothing was made",
            json!({ "interrupted": true }),
        );
        return Ok(interrupt::EXIT_CODE as u8);
    }
    for (what, file, bytes) in &outcome.files {
        progress.wrote(*bytes);
        progress.say(
            &format!("{what}: {} ({})", file.display(), size(*bytes)),
            json!({ "event": "made", "what": what, "file": output::path(file), "bytes": bytes }),
        );
    }
    progress.conclude("done", json!({ "interrupted": false }));
    if args.open
        && let Some(page) = &outcome.page
    {
        open(page);
    }
    Ok(0)
}

/// Opens a page in the system's viewer. Failing to do so is only a warning.
fn open(page: &Path) {
    let (program, before): (&str, &[&str]) = match std::env::consts::OS {
        "macos" => ("open", &[]),
        "windows" => ("cmd", &["/C", "start", ""]),
        _ => ("xdg-open", &[]),
    };
    let begun = Command::new(program)
        .args(before)
        .arg(page)
        .stdin(Stdio::null())
        .status();
    let fault = match begun {
        Ok(ended) if ended.success() => return,
        Ok(ended) => ended.to_string(),
        Err(error) => error.to_string(),
    };
    output::say(&format!(
        "warning: --open: {program}: {fault}; open {} yourself",
        page.display()
    ));
}

fn tell(progress: &Progress, event: ViewEvent) {
    match event {
        ViewEvent::Ready { frames, size } => {
            progress.begin(frames as u64);
            let [width, height] = size;
            progress.say(
                &format!("{} of {width} × {height}", count(frames as u64, "frame")),
                json!({ "event": "ready", "frames": frames, "width": width, "height": height }),
            );
        }
        ViewEvent::Note(text) => note(progress, &text),
        ViewEvent::AssumedRate => note(
            progress,
            &format!(
                "{RATE} frames a second is assumed: give another rate with --fps, or the cache \
                 with --curves"
            ),
        ),
        ViewEvent::PicturesBeside(bytes) => note(
            progress,
            &format!(
                "the page's pictures are {} MB and are beside it in pictures/: move both together, \
                 or take fewer (--frames), smaller (--width) or --pictures within",
                bytes / 1_000_000
            ),
        ),
        ViewEvent::Warning(text) => progress.say(
            &format!("warning: {text}"),
            json!({ "event": "warning", "what": "view", "text": text }),
        ),
        ViewEvent::Frame(label) => progress.frame(
            &label,
            Status::Done,
            json!({ "event": "frame", "frame": label }),
        ),
    }
}

fn note(progress: &Progress, text: &str) {
    progress.say(text, json!({ "event": "note", "text": text }));
}
