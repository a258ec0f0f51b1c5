//! `swell bake SCENE`

use std::{cell::OnceCell, path::PathBuf, process::ExitCode};

use clap::Args;
use serde_json::json;

use crate::{
    domain::{frame_range::FrameRange, solver::StepReport},
    scene::Scene,
    stage::bake::{Event, Request, bake},
};

use super::{
    Failure,
    interrupt::{self, Interrupt},
    progress::{Mode, Progress},
    size,
};

#[derive(Args, Debug)]
pub(super) struct BakeArgs {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Cache directory; cache/SHOT/SOLVER where left out.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Frames to bake, such as 1-30; the whole shot where left out.
    #[arg(long, value_name = "A-B")]
    frames: Option<FrameRange>,
    /// Override a scene key, such as solver.pbf.iterations=8.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Go on after the last frame of the cache's ledger, if there is one; a damaged frame is refused by name.
    #[arg(long)]
    resume: bool,
    /// Index or part of the name of the adapter (see `swell inspect --adapters`).
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Time each pass on the device and print a table; passes then run one by one.
    #[arg(long)]
    time_passes: bool,
    /// How to tell progress.
    #[arg(long, value_enum, default_value_t)]
    progress: Mode,
}

pub(super) fn run(args: &BakeArgs) -> Result<ExitCode, Failure> {
    let scene = Scene::load(&args.scene, &args.set)?;
    let default = || PathBuf::from("cache").join(&scene.shot.name).join("pbf");
    let request = Request {
        directory: args.output.clone().unwrap_or_else(default),
        scene,
        frames: args.frames.clone(),
        resume: args.resume,
        adapter: args.adapter.clone(),
        time_passes: args.time_passes,
    };
    // Without a handler a signal ends the process at once, which a bake survives as well.
    let interrupt = Interrupt::install().unwrap_or_default();
    let progress = OnceCell::new();
    let outcome = bake(&request, interrupt.flag(), &mut |event| {
        tell(args.progress, &progress, event)
    });
    let progress = progress
        .into_inner()
        .unwrap_or_else(|| Progress::new(args.progress, 0));
    progress.finish();
    let outcome = outcome?;
    let end = if outcome.interrupted {
        "ended by a signal after"
    } else {
        "done:"
    };
    progress.say(
        &format!(
            "{end} frame {} of {} in {} ({} frames, {} written now, waited {:.1} s for the disk)",
            outcome.last_frame,
            request.scene.shot.frames,
            request.directory.display(),
            outcome.frames,
            size(outcome.bytes),
            outcome.waited
        ),
        json!({
            "event": "end", "last_frame": outcome.last_frame, "frames": outcome.frames, "bytes": outcome.bytes,
            "interrupted": outcome.interrupted, "directory": request.directory,
        }),
    );
    for (pass, seconds, runs) in &outcome.passes {
        let each = 1e3 * seconds / *runs as f64;
        println!("{pass:28} {each:9.3} ms × {runs:6} = {seconds:8.3} s");
    }
    Ok(if outcome.interrupted {
        ExitCode::from(interrupt::EXIT_CODE as u8)
    } else {
        ExitCode::SUCCESS
    })
}

fn tell(mode: Mode, progress: &OnceCell<Progress>, event: Event) {
    match event {
        Event::Ready {
            device,
            particles,
            removed,
            boundary_samples,
            bytes,
            first,
            last,
        } => {
            let frames = u64::from((last + 1).saturating_sub(first));
            let progress = progress.get_or_init(|| Progress::new(mode, frames));
            let (all, lists) = bytes;
            if particles == 0 {
                progress.say(
                    "warning: the scene holds no water",
                    json!({ "event": "warning", "what": "no water" }),
                );
            }
            let span = if first > last {
                "nothing left to bake".into()
            } else {
                format!("frames {first} to {last}")
            };
            let text = format!(
                "on {device}\n{particles} particles ({removed} left out where solids are), {boundary_samples} boundary \
                 samples, {} on the device, of it {} neighbour lists\n{span}",
                size(all),
                size(lists)
            );
            progress.say(
                &text,
                json!({
                    "event": "ready", "device": device, "particles": particles, "removed": removed,
                    "boundary_samples": boundary_samples, "bytes": all, "list_bytes": lists, "first": first, "last": last,
                }),
            );
        }
        Event::Frame {
            frame,
            report,
            seconds,
        } => {
            if let Some(progress) = progress.get() {
                progress.frame(
                    &line(frame, &report, seconds),
                    json!({ "event": "frame", "frame": frame, "seconds": seconds, "report": report }),
                );
            }
        }
    }
}

fn line(frame: u32, report: &StepReport, seconds: f64) -> String {
    format!(
        "frame {frame:4}  {seconds:6.2} s  {} substeps, {} iterations  density error {:.2} % (99 %: {:.2}, max {:.2})  \
         top speed {:.2} m/s  {} capped",
        report.substeps,
        report.iterations,
        100.0 * report.density_error_mean,
        100.0 * report.density_error_p99,
        100.0 * report.density_error_max,
        report.max_speed,
        report.capped
    )
}
