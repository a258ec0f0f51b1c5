//! `swell study STUDY`

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use swell_domain::{chunk::Chunk, posix};
use swell_experiment::{PointEvent, PointStatus, Share, StudyEvent, StudyRequest, study};
use swell_files::study::Study;

use super::{
    Failure, GpuArgs, OUT_OF_TOLERANCE, bake, count,
    interrupt::{self, Interrupt},
    output,
    progress::{Mode, Progress, Status},
    render,
};

#[derive(Args, Debug)]
pub(super) struct StudyArgs {
    /// Study file (TOML).
    study: PathBuf,
    /// Where caches, pictures, table and page go; studies/NAME where left out. Existing results are
    /// resumed.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Run share I of N of the points alone, such as 1/4, into a file of its own in the folder. The
    /// command without it takes over what shares have run, runs what is missing, and writes table
    /// and page.
    #[arg(long, value_name = "I/N")]
    chunk: Option<Chunk>,
    #[command(flatten)]
    gpu: GpuArgs,
    /// Take meshes, tables and panoramas that lie outside of the folders of the scene and the look.
    #[arg(long)]
    allow_outside: bool,
    /// How to tell progress.
    #[arg(long, value_enum, default_value_t)]
    pub(super) progress: Mode,
}

pub(super) fn run(args: &StudyArgs, progress: &Progress) -> Result<u8, Failure> {
    let name = args.study.file_stem().unwrap_or_default();
    let default = || PathBuf::from("studies").join(name);
    let directory = args.output.clone().unwrap_or_else(default);
    let request = StudyRequest {
        name: name.to_string_lossy().into_owned(),
        study: Study::load_within(&args.study, bake::reach(args.allow_outside))?,
        command: format!(
            "swell study {} -o {}{}",
            posix::path(&args.study),
            posix::path(&directory),
            match args.allow_outside {
                true => " --allow-outside",
                false => "",
            }
        ),
        directory,
        chunk: args.chunk,
        gpu: args.gpu.read()?,
    };
    conduct(&request, progress)
}

/// Runs a study of any kind, and reports its progress.
pub(super) fn conduct(request: &StudyRequest, progress: &Progress) -> Result<u8, Failure> {
    let interrupt = Interrupt::install_or_warn();
    let outcome = study(request, interrupt.flag(), &mut |event| match event {
        StudyEvent::Solver(name) => progress.say(
            &format!("solver {name}"),
            json!({ "event": "solver", "solver": name }),
        ),
        StudyEvent::Warning(warning) => {
            let (text, event) = bake::warned(&warning);
            progress.say(&text, event);
        }
        StudyEvent::SoftwareWarning(warning) => progress.warn_of_adapter(Some(&warning)),
        StudyEvent::Bake(event) => bake::tell(progress, *event),
        StudyEvent::Render(event) => render::tell(progress, event),
        StudyEvent::Point(event) => {
            progress.set_frames(event.count as u64);
            let (text, json) = point(&event);
            let status = match event.status {
                PointStatus::Failed(_) => Status::Failed,
                PointStatus::Stands => Status::Skipped,
                PointStatus::Done(..) => Status::Done,
            };
            progress.frame(&text, status, json);
        }
        StudyEvent::Joined {
            share,
            file,
            points,
        } => progress.say(
            &format!(
                "{} run by share {share} ({file})",
                count(points as u64, "point")
            ),
            json!({ "event": "joined", "ledger": file, "share": share, "points": points }),
        ),
    })?;
    progress.finish();
    if let (Some(share), Some(chunk)) = (outcome.share, request.chunk) {
        tell_share(progress, request, chunk, share);
        return Ok(0);
    }
    let Some(page) = outcome.page else {
        progress.conclude(
            "ended by a signal; the same command resumes",
            json!({ "interrupted": true }),
        );
        return Ok(interrupt::EXIT_CODE as u8);
    };
    progress.conclude(
        &format!("{}\npage: {}", outcome.findings.join("\n"), page.display()),
        json!({
            "page": output::path(&page), "findings": outcome.findings, "missed": outcome.missed,
            "interrupted": false,
        }),
    );
    Ok(match outcome.missed[..] {
        [] => 0,
        _ => OUT_OF_TOLERANCE,
    })
}

/// Reports the result of a share, and how to complete the study.
fn tell_share(progress: &Progress, request: &StudyRequest, chunk: Chunk, share: Share) {
    let Share {
        ran, stood, left, ..
    } = share;
    let most = if share.is_left_at_most {
        "at most "
    } else {
        ""
    };
    progress.conclude(
        &format!(
            "done: {} of share {chunk} run, {stood} already existed; left of the whole study: \
             {most}{left}; the same command without --chunk joins the shares and makes table and \
             page",
            count(ran as u64, "point")
        ),
        json!({
            "chunk": chunk.to_string(), "ran": ran, "stood": stood, "left": left,
            "is_left_at_most": share.is_left_at_most, "directory": output::path(&request.directory),
            "interrupted": false,
        }),
    );
}

/// A point as a line and as a JSON event.
fn point(event: &PointEvent) -> (String, serde_json::Value) {
    let (status, told) = match &event.status {
        PointStatus::Stands => ("stands there", String::new()),
        PointStatus::Done(ms, errors) => {
            let errors = errors
                .iter()
                .map(|(name, value)| format!("  {name} {value:.3e}"));
            (
                "done",
                format!("  {ms:.2} ms{}", errors.collect::<String>()),
            )
        }
        PointStatus::Failed(message) => ("failed", format!(": {message}")),
    };
    let text = format!(
        "point {} of {}  {}  {status}{told}",
        event.number, event.count, event.name
    );
    let mut json = json!({
        "event": "point", "number": event.number, "count": event.count, "name": event.name,
        "status": status,
    });
    match &event.status {
        PointStatus::Stands => {}
        PointStatus::Done(ms, errors) => {
            let errors: serde_json::Map<_, _> = errors
                .iter()
                .map(|(name, value)| ((*name).to_owned(), json!(value)))
                .collect();
            json["ms"] = json!(ms);
            json["errors"] = errors.into();
        }
        PointStatus::Failed(message) => json["message"] = json!(message),
    }
    (text, json)
}
