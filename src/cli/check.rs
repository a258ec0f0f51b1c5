//! `swell check CACHE|SCENE`

use std::{collections::BTreeMap, fmt::Write as _, path::PathBuf};

use clap::Args;
use serde_json::json;

use swell_domain::{frame_range::FrameRange, substep::SubstepChoice};
use swell_scene::Method;
use swell_stage::{
    check::{
        CheckEvent, CheckInput, CheckOutcome, CheckRequest, CheckRow, CheckTable, FirstOver, check,
    },
    device::{Gpu, Imprecision},
    replay::{Replayed, is_failed, replay_failed},
};

use super::{
    Failure, GpuArgs, bake, check_render,
    check_render::SurfaceArgs,
    interrupt::{self, Interrupt},
    is_cache, output,
    progress::{Mode, Progress, Status},
};

#[derive(Args, Debug)]
pub(super) struct CheckArgs {
    /// A cache's folder, or a scene file (TOML), of which the start is taken; or the `failed`
    /// folder of a cache, whose frame is then computed again.
    #[arg(value_name = "CACHE|SCENE")]
    source: PathBuf,
    /// Frames of the cache from which the step is taken, such as 1,30,72; its last where left out.
    #[arg(long, value_name = "FRAMES")]
    frames: Option<FrameRange>,
    /// Substep of the frame after each that is checked: a number from 1 on, or last. The ones
    /// before it run, and are not compared. With 1, the default, a frame of a cache is itself what
    /// the passes read.
    #[arg(long, value_name = "N|last")]
    substep: Option<SubstepChoice>,
    /// Of a scene: which solver, pbf or flip.
    #[arg(long, value_name = "SOLVER", value_parser = bake::method)]
    solver: Option<Method>,
    /// Of a scene: override a key, such as solver.pbf.iteration=jacobi.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Of a scene: take meshes and tables that lie outside of its folder.
    #[arg(long)]
    allow_outside: bool,
    #[command(flatten)]
    surface: SurfaceArgs,
    /// The result as one JSON object on standard output.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    gpu: GpuArgs,
    /// Let the passes compute as imprecisely as Vulkan permits, to see whether the scene would be
    /// within tolerance on any GPU: vulkan-worst, or vulkan-worst:SEED for other errors.
    #[arg(long, value_name = "PROFILE", conflicts_with = "render")]
    imprecision: Option<Imprecision>,
    /// How to tell progress.
    #[arg(long, value_enum, default_value_t)]
    pub(super) progress: Mode,
}

/// An option that applies only to another kind of source.
#[derive(Debug, thiserror::Error)]
#[error("{option} is for {what}; {} is {is}", .source_file.display())]
pub(super) struct Misplaced {
    pub(super) option: &'static str,
    pub(super) what: &'static str,
    pub(super) is: &'static str,
    pub(super) source_file: PathBuf,
}

/// Recomputes the frame of a failed bake: reports the same failure as the bake, or that it now
/// succeeds.
fn run_failed(args: &CheckArgs, progress: &Progress) -> Result<u8, Failure> {
    let has_solver = args.solver.is_some() || !args.set.is_empty();
    let is_imprecise = args.imprecision.is_some();
    if args.frames.is_some() || args.substep.is_some() || has_solver || is_imprecise {
        let error = Misplaced {
            option: "--frames, --substep, --solver, --set or --imprecision",
            what: "caches or scenes",
            is: "a frame that failed: it records how it was baked",
            source_file: args.source.clone(),
        };
        return Err(Failure {
            code: 2,
            error: Box::new(error),
        });
    }
    let Replayed {
        frame,
        software_warning,
        failure,
    } = replay_failed(&args.source, &args.gpu.read()?)?;
    progress.warn_of_adapter(software_warning.as_deref());
    let Some(failure) = failure else {
        let text = format!("frame {frame} is within its budgets now");
        match progress.is_json() {
            true => progress.conclude(&text, json!({ "frame": frame })),
            false => output::print(&format!("{text}\n")),
        }
        return Ok(0);
    };
    Err(Failure {
        code: 5,
        error: failure.to_string().into(),
    })
}

pub(super) fn run(args: &CheckArgs, progress: &Progress) -> Result<u8, Failure> {
    if is_failed(&args.source) {
        return run_failed(args, progress);
    }
    if let Some(look) = args.surface.look() {
        return run_render(args, look, progress);
    }
    let request = CheckRequest {
        source: source(args)?,
        substep: args.substep.unwrap_or_default(),
        gpu: Gpu {
            imprecision: args.imprecision,
            ..args.gpu.read()?
        },
    };
    let interrupt = Interrupt::install_or_warn();
    let outcome = check(&request, interrupt.flag(), &mut |event| {
        tell(progress, &event);
    })?;
    progress.finish();
    if progress.is_json() {
        progress.result(to_json(&outcome));
    } else if args.json {
        output::print(&format!("{}\n", to_json(&outcome)));
    } else {
        let table = show(&outcome.table);
        let substeps = show_substeps(&outcome);
        output::print(&format!("{substeps}{table}{}\n", verdict(&outcome)));
    }
    progress.tell_end(json!({ "interrupted": outcome.interrupted }));
    Ok(if outcome.interrupted {
        interrupt::EXIT_CODE as u8
    } else {
        u8::from(outcome.first_over.is_some())
    })
}

/// Checks pictures of a cache.
fn run_render(args: &CheckArgs, look: &PathBuf, progress: &Progress) -> Result<u8, Failure> {
    let has_step = args.substep.is_some() || args.solver.is_some() || !args.set.is_empty();
    let source_file = args.source.clone();
    let misplaced = match (has_step, is_cache(&args.source)) {
        (false, true) => None,
        (true, _) => Some(Misplaced {
            option: "--substep, --solver or --set",
            what: "checks of passes",
            is: "checked by its pictures",
            source_file,
        }),
        (false, false) => Some(Misplaced {
            option: "--render",
            what: "caches",
            is: "none: bake it first",
            source_file,
        }),
    };
    if let Some(error) = misplaced {
        return Err(Failure {
            code: 2,
            error: Box::new(error),
        });
    }
    let source = (args.source.clone(), look);
    check_render::run(
        source,
        &args.surface,
        args.frames.clone(),
        &args.gpu,
        (args.json, progress),
    )
}

fn source(args: &CheckArgs) -> Result<CheckInput, Failure> {
    let misplaced = |option, what, is| Failure {
        code: 2,
        error: Box::new(Misplaced {
            option,
            what,
            is,
            source_file: args.source.clone(),
        }),
    };
    if !is_cache(&args.source) {
        if args.frames.is_some() {
            return Err(misplaced(
                "--frames",
                "caches",
                "a scene: its start is frame 0",
            ));
        }
        let scene = bake::load(&args.source, &args.set, args.solver, args.allow_outside)?;
        return Ok(CheckInput::Scene(Box::new(scene)));
    }
    if args.solver.is_some() || !args.set.is_empty() {
        let is = "a cache: it records what it was baked with";
        return Err(misplaced("--solver or --set", "scenes", is));
    }
    Ok(CheckInput::Cache(args.source.clone(), args.frames.clone()))
}

fn tell(progress: &Progress, event: &CheckEvent<'_>) {
    match event {
        CheckEvent::Ready {
            device,
            software_warning,
            solver,
            particles,
            frames,
            warnings,
        } => {
            progress.begin(*frames as u64);
            progress.warn_of_adapter(software_warning.as_deref());
            for warning in warnings {
                let (text, event) = bake::warned(warning);
                progress.say(&text, event);
            }
            progress.say(
                &format!("{solver} on {device} against f64, {particles} particles at the start"),
                json!({
                    "event": "ready", "solver": solver, "device": device,
                    "particles": particles, "frames": frames,
                }),
            );
        }
        CheckEvent::Frame {
            frame,
            checked,
            seconds,
        } => {
            let rows = &checked.table.rows;
            let over = rows.iter().filter(|row| !row.is_within()).count();
            let substep = checked
                .substep
                .map(|substep| format!(", substep {substep}"));
            progress.frame(
                &format!(
                    "frame {frame:4}{}  {seconds:6.2} s  {} rows, {over} out of tolerance",
                    substep.unwrap_or_default(),
                    rows.len()
                ),
                Status::Done,
                json!({
                    "event": "frame", "frame": frame, "substep": checked.substep,
                    "seconds": seconds, "rows": rows.len(),
                    "over": over,
                }),
            );
        }
    }
}

fn to_json(outcome: &CheckOutcome) -> serde_json::Value {
    let first = outcome.first_over.map(|first| {
        json!({
            "frame": first.frame, "substep": first.substep, "pass": first.pass,
            "field": first.field,
        })
    });
    json!({
        "frames": outcome.frames,
        "substeps": outcome.substeps,
        "interrupted": outcome.interrupted,
        "shaders": outcome.shaders,
        "within": outcome.first_over.is_none(),
        "first_over": first,
        "rows": outcome.table.rows,
        "unchecked": outcome.table.unchecked,
    })
}

/// A number with two significant digits.
fn short(value: f64) -> String {
    match value {
        0.0 => "0".into(),
        value if (0.01..100.0).contains(&value) => format!("{value:.2}"),
        value => format!("{value:.1e}"),
    }
}

fn line(row: &CheckRow) -> String {
    let worst = &row.worst;
    format!(
        "{:28} {:30} {:>4} {:>9} {:>6} {:>9} {:>9} {:>9} {:>8}{}",
        row.field.pass,
        row.field.name,
        row.field.unit,
        row.values,
        row.ties,
        short(row.deviation.max),
        short(worst.error),
        short(worst.tolerance),
        short(worst.ratio),
        if row.is_within() { "" } else { "  OUT" }
    )
}

fn show(table: &CheckTable) -> String {
    let mut text = format!(
        "{:28} {:30} {:>4} {:>9} {:>6} {:>9} {:>9} {:>9} {:>8}\n",
        "pass", "field", "unit", "values", "ties", "max", "worst", "allowed", "part"
    );
    for row in &table.rows {
        let _ = writeln!(text, "{}", line(row));
    }
    let mut passes: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (pass, why) in &table.unchecked {
        passes.entry(why).or_default().push(pass);
    }
    for (why, passes) in passes {
        let _ = writeln!(text, "without a row: {} ({why})", passes.join(", "));
    }
    text
}

/// The substeps that the table covers.
fn show_substeps(outcome: &CheckOutcome) -> String {
    let checked = outcome.frames.iter().zip(&outcome.substeps);
    let all: Vec<String> = checked
        .map(|(frame, substep)| match substep {
            Some(substep) => format!("substep {substep} after frame {frame}"),
            None => format!("no water in frame {frame}"),
        })
        .collect();
    match all.is_empty() {
        true => String::new(),
        false => format!("{}\n", all.join(", ")),
    }
}

fn verdict(outcome: &CheckOutcome) -> String {
    match outcome.first_over {
        None if outcome.interrupted => {
            format!("ended by a signal after {} frames", outcome.frames.len())
        }
        None => "all within tolerance".into(),
        Some(FirstOver {
            frame,
            substep,
            pass,
            field,
        }) => {
            let rows = &outcome.table.rows;
            let row = rows
                .iter()
                .find(|row| row.field.pass == pass && row.field.name == field);
            let why = row.map_or_else(String::new, |row| {
                let [error, tolerance] = [row.worst.error, row.worst.tolerance].map(short);
                let reason = match row.field.derivation.tolerance.why() {
                    "" => String::new(),
                    reason => format!(" ({reason})"),
                };
                let unit = row.field.unit;
                let unit = if unit.is_empty() {
                    ""
                } else {
                    &format!(" {unit}")
                };
                format!(
                    "; off by {error}{unit} where {tolerance}{unit} is allowed{reason}; \
                     --json has the derivation"
                )
            });
            format!(
                "out of tolerance: {pass} first, its {field}, in substep {} \
                 after frame {frame}{why}",
                substep.unwrap_or_default()
            )
        }
    }
}
