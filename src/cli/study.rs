//! `swell study STUDY`

use std::{cell::OnceCell, path::PathBuf};

use clap::Args;
use serde_json::json;

use crate::{
    experiment::{Event, PointEvent, PointStatus, Request, study},
    scene::study::Study,
};

use super::{
    Failure, GpuArgs, OUT_OF_TOLERANCE, bake,
    interrupt::{self, Interrupt},
    output,
    progress::{Mode, Progress},
    render,
};

#[derive(Args, Debug)]
pub(super) struct StudyArgs {
    /// Study file (TOML).
    study: PathBuf,
    /// Where caches, pictures, table and page go; studies/NAME where left out. Existing results are resumed.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    #[command(flatten)]
    gpu: GpuArgs,
    /// Take meshes, tables and panoramas that lie outside of the folders of the scene and the look.
    #[arg(long)]
    allow_outside: bool,
    /// How to tell progress.
    #[arg(long, value_enum, default_value_t)]
    progress: Mode,
}

pub(super) fn run(args: &StudyArgs) -> Result<u8, Failure> {
    let name = args.study.file_stem().unwrap_or_default();
    let default = || PathBuf::from("studies").join(name);
    let directory = args.output.clone().unwrap_or_else(default);
    let request = Request {
        name: name.to_string_lossy().into_owned(),
        study: Study::load_within(&args.study, bake::reach(args.allow_outside))?,
        command: format!(
            "swell study {} -o {}",
            args.study.display(),
            directory.display()
        ),
        directory,
        gpu: args.gpu.read()?,
    };
    let interrupt = Interrupt::install_or_warn();
    let say = |text: &str, event| Progress::new(args.progress.lines(), 0).say(text, event);
    let mut progress = OnceCell::new();
    let outcome = study(&request, interrupt.flag(), &mut |event| {
        let is_new = match &event {
            Event::Bake(event) => matches!(**event, crate::stage::bake::Event::Ready { .. }),
            Event::Render(event) => matches!(event, crate::stage::render::Event::Ready { .. }),
            _ => false,
        };
        if is_new && let Some(before) = progress.take() {
            Progress::finish(&before);
        }
        match event {
            Event::Solver(name) => say(
                &format!("solver {name}"),
                json!({ "event": "solver", "solver": name }),
            ),
            Event::Warning(warning) => {
                let (text, event) = bake::warned(&warning);
                say(&text, event);
            }
            Event::Bake(event) => bake::tell(args.progress, &progress, *event),
            Event::Render(event) => render::tell(args.progress, &progress, event),
            Event::Point(event) => {
                let bar = progress.get_or_init(|| Progress::new(args.progress, event.count as u64));
                let (text, json) = point(&event);
                match event.status {
                    PointStatus::Failed(_) => bar.frame_to_keep(&text, json),
                    PointStatus::Stands | PointStatus::Done(..) => bar.frame(&text, json),
                }
            }
        }
    });
    if let Some(progress) = progress.take() {
        progress.finish();
    }
    let outcome = outcome?;
    let Some(page) = outcome.page else {
        say(
            "ended by a signal; the same command goes on",
            json!({ "event": "end", "interrupted": true }),
        );
        return Ok(interrupt::EXIT_CODE as u8);
    };
    say(
        &format!("{}\npage: {}", outcome.findings.join("\n"), page.display()),
        json!({ "event": "end", "page": output::path(&page), "findings": outcome.findings, "missed": outcome.missed, "interrupted": false }),
    );
    Ok(match outcome.missed[..] {
        [] => 0,
        _ => OUT_OF_TOLERANCE,
    })
}

/// A point's line, and the same for farms.
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
        "event": "point", "number": event.number, "count": event.count, "name": event.name, "status": status,
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
