//! `swell tune SCENE`

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::{Value, json};

use swell_domain::{chunk::Chunk, frame_range::FrameRange, posix};
use swell_experiment::{StudyRequest, dealt};
use swell_files::study::{
    Study,
    tune::{Limit, Tune, TuneRequest},
};
use swell_scene::Method;
use swell_stage::inspect::study::Outline;

use super::{
    Failure, GpuArgs, bake, inspect, output,
    progress::{Mode, Progress},
    study,
};

#[derive(Args, Debug)]
pub(super) struct TuneArgs {
    /// Scene file (TOML).
    scene: PathBuf,
    /// An error that has to be held: crest, front, run_up, energy, pressure or density, in per cent
    /// of the finer run's greatest value, or in metres or Pa. Several of them all have to hold.
    #[arg(long = "error", value_name = "NAME=VALUE%|m|Pa", required = true)]
    errors: Vec<Limit>,
    /// The most that the bake of the whole shot may take on this machine, seconds.
    #[arg(long, value_name = "SECONDS")]
    seconds: Option<f64>,
    /// The most that a frame may take, seconds.
    #[arg(long, value_name = "SECONDS")]
    per_frame: Option<f64>,
    /// Which solver, pbf or flip; the scene's where left out.
    #[arg(long, value_name = "SOLVER", value_parser = bake::method)]
    solver: Option<Method>,
    /// Frames that are run, from the first on, such as 1-30; the whole shot where left out.
    #[arg(long, value_name = "1-B")]
    frames: Option<FrameRange>,
    /// Spacing of the run that errors are told against, in the scene's own; the others are 1.25 to
    /// 2.5 times as coarse as it.
    #[arg(long, value_name = "FACTOR", default_value_t = 0.8)]
    reference: f64,
    /// Runs of each setting; times are medians.
    #[arg(long, value_name = "N", default_value_t = 1)]
    repeats: u32,
    /// Scene with the settings, beside SCENE; SCENE's name with .tuned.toml where left out.
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// Where table, curves and page go; studies/NAME-tune where left out. Existing results are
    /// resumed.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Of the first runs, before anything is proposed, run share I of N alone, such as 1/4, into a
    /// file of its own in the folder. The same command without this option takes them over,
    /// proposes and runs the rest.
    #[arg(long, value_name = "I/N")]
    chunk: Option<Chunk>,
    #[command(flatten)]
    gpu: GpuArgs,
    /// Take meshes and tables that lie outside of the scene's folder.
    #[arg(long)]
    allow_outside: bool,
    /// Say what would be run, and run nothing. No device is opened.
    #[arg(long)]
    dry_run: bool,
    /// How to tell progress.
    #[arg(long, value_enum, default_value_t)]
    pub(super) progress: Mode,
}

pub(super) fn run(args: &TuneArgs, progress: &Progress) -> Result<u8, Failure> {
    let tune = Tune::load(request(args)?)?;
    if args.dry_run {
        return tell_runs(tune, args, progress);
    }
    let name = format!("{}-tune", stem(&args.scene));
    let default = || PathBuf::from("studies").join(&name);
    let request = StudyRequest {
        directory: args.output.clone().unwrap_or_else(default),
        command: command(args),
        study: Study::Tune(Box::new(tune)),
        chunk: args.chunk,
        gpu: args.gpu.read()?,
        name,
    };
    study::conduct(&request, progress)
}

fn stem(scene: &Path) -> String {
    let stem = scene.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

fn request(args: &TuneArgs) -> Result<TuneRequest, Failure> {
    let frames = match &args.frames {
        None => None,
        Some(frames) if frames.first() == 1 && frames.len() == frames.last() as usize => {
            Some(frames.last())
        }
        Some(frames) => {
            return Err(Failure {
                code: 2,
                error: format!("--frames {frames}: a shot is run from its start, as in 1-30")
                    .into(),
            });
        }
    };
    let beside = || {
        args.scene
            .with_file_name(format!("{}.tuned.toml", stem(&args.scene)))
    };
    Ok(TuneRequest {
        scene: args.scene.clone(),
        solver: args.solver,
        limits: args.errors.clone(),
        per_frame: args.per_frame,
        seconds: args.seconds,
        frames,
        reference: args.reference,
        repeats: args.repeats,
        target: args.write.clone().unwrap_or_else(beside),
        reach: bake::reach(args.allow_outside),
    })
}

/// The command that reproduces the settings, for the page and the scene.
fn command(args: &TuneArgs) -> String {
    let mut words = vec![format!("swell tune {}", posix::path(&args.scene))];
    words.extend(args.errors.iter().map(|limit| {
        let text = limit.to_string().replacen(' ', "=", 1);
        format!("--error {}", text.replace(' ', ""))
    }));
    let mut add = |name: &str, value: Option<String>| {
        words.extend(value.map(|value| format!("--{name} {value}")));
    };
    add("seconds", args.seconds.map(|s| s.to_string()));
    add("per-frame", args.per_frame.map(|s| s.to_string()));
    add("solver", args.solver.map(|m| m.name().to_owned()));
    add("frames", args.frames.as_ref().map(FrameRange::to_string));
    add("reference", Some(args.reference.to_string()));
    add("repeats", Some(args.repeats.to_string()));
    add("write", args.write.as_deref().map(posix::path));
    add("output", args.output.as_deref().map(posix::path));
    words.join(" ")
}

/// `--dry-run`: prints the runs that are known in advance, or a share of them.
fn tell_runs(tune: Tune, args: &TuneArgs, progress: &Progress) -> Result<u8, Failure> {
    let untried = tune.untried.clone();
    let study = Study::Tune(Box::new(tune));
    let mut outline = Outline::of(&study);
    if let Some(chunk) = args.chunk {
        outline.keep(&dealt(&study, chunk)?);
    }
    let text = inspect::study::told(&outline, &args.scene);
    let after = match args.chunk {
        None => "and what the laws of these propose".to_owned(),
        Some(chunk) => format!(
            "that is share {chunk}; the command without --chunk joins the shares, and runs what \
             the laws of all propose"
        ),
    };
    let text = format!(
        "{text}\n{after}\n\nnot tried\n   {}\n",
        untried.join("\n   ")
    );
    match progress.is_json() {
        true => {
            let mut event: Value = inspect::study::outline_object(&outline);
            event["event"] = json!("dry_run");
            event["untried"] = json!(untried);
            event["chunk"] = json!(args.chunk.map(|chunk| chunk.to_string()));
            progress.tell(event);
        }
        false => output::print(&text),
    }
    output::log(text.trim_end());
    Ok(0)
}
