//! `swell bake SCENE`

use std::path::{Path, PathBuf};
use swell_files::load_scene_within;

use clap::{
    Args,
    builder::{OsStringValueParser, TypedValueParser as _},
};
use serde_json::{Value, json};

use swell_domain::{frame_range::FrameRange, solver::StepReport};
use swell_files::Reach;
use swell_scene::{Method, Scene, SceneError};
use swell_stage::{
    bake::{self, BakeEvent, BakePlan, BakeRequest, DiskSpace},
    branch::BranchPoint,
};

use super::{
    DeviceArgs, Failure, count,
    dry_run::DryRun,
    interrupt::{self, Interrupt},
    lint::DenyArgs,
    output, pass_times,
    progress::{Mode, Progress, Recurring, Status},
    set_variable, size,
};

#[derive(Args, Debug)]
pub(super) struct BakeArgs {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Cache directory; SHOT/SOLVER in the folder that SWELL_CACHE names, or in cache/, where left
    /// out.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Which solver, pbf or flip: short for --set solver.method=SOLVER.
    #[arg(long, value_name = "SOLVER", value_parser = method)]
    solver: Option<Method>,
    /// Begin from a frame of another cache, such as cache/wave-city/pbf:120, of the same solver,
    /// spacing and frame rate; numbers and time go on from there.
    #[arg(
        long,
        value_name = "CACHE:FRAME",
        value_parser = OsStringValueParser::new().try_map(BranchPoint::try_from)
    )]
    from: Option<BranchPoint>,
    /// Frames to bake, such as 1-30; the whole shot where left out. With --resume past the end of
    /// the shot, which is then longer.
    #[arg(long, value_name = "A-B")]
    frames: Option<FrameRange>,
    /// Override a scene key, such as solver.pbf.iterations=8.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Go on after the last frame of the cache's ledger, if there is one. That frame is read whole,
    /// the others are looked for.
    #[arg(long)]
    resume: bool,
    /// Take meshes and tables that lie outside of the scene's folder.
    #[arg(long)]
    allow_outside: bool,
    #[command(flatten)]
    deny: DenyArgs,
    #[command(flatten)]
    device: DeviceArgs,
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

/// Parses the name of a solver.
pub(super) fn method(name: &str) -> Result<Method, String> {
    let mut named = Method::NAMED.into_iter();
    let found = named.find(|(known, _)| *known == name);
    let names = Method::NAMED.map(|(known, _)| known).join(" or ");
    found
        .map(|(_, method)| method)
        .ok_or_else(|| format!("no solver of that name; allowed: {names}"))
}

/// Which files scenes and looks may refer to.
pub(super) fn reach(allow_outside: bool) -> Reach {
    if allow_outside {
        Reach::Anywhere
    } else {
        Reach::Folder
    }
}

/// Loads a scene with overrides and the requested solver.
pub(super) fn load(
    file: &Path,
    set: &[String],
    solver: Option<Method>,
    allow_outside: bool,
) -> Result<Scene, SceneError> {
    let chosen = solver.map(Method::as_override);
    let overrides: Vec<String> = set.iter().cloned().chain(chosen).collect();
    load_scene_within(file, &overrides, reach(allow_outside))
}

/// Loads the scene. If a bake is to be resumed past the end of its shot, the shot is lengthened, so
/// that walls and solids are validated up to that frame.
fn load_lengthened(args: &BakeArgs) -> Result<Scene, SceneError> {
    let scene = load(&args.scene, &args.set, args.solver, args.allow_outside)?;
    match &args.frames {
        Some(frames) if args.resume && frames.last() > scene.shot.frames => {
            let longer = format!("shot.frames={}", frames.last());
            let set: Vec<String> = args.set.iter().cloned().chain([longer]).collect();
            load(&args.scene, &set, args.solver, args.allow_outside)
        }
        _ => Ok(scene),
    }
}

pub(super) fn run(args: &BakeArgs, progress: &Progress) -> Result<u8, Failure> {
    let device = args.device.read()?;
    let scene = load_lengthened(args)?;
    let method = scene.solver.method().name();
    let root = || set_variable("SWELL_CACHE").map_or_else(|| PathBuf::from("cache"), PathBuf::from);
    let default = || root().join(&scene.shot.name).join(method);
    let request = BakeRequest {
        directory: args.output.clone().unwrap_or_else(default),
        scene,
        frames: args.frames.clone(),
        resume: args.resume,
        from: args.from.clone(),
        device,
        time_passes: args.time_passes,
    };
    let interrupt = (!args.dry_run).then(Interrupt::install_or_warn);
    let plan = BakePlan::new(&request)?;
    args.deny.check(&args.scene, &plan)?;
    let Some(interrupt) = interrupt else {
        return dry_run(&request.directory, &plan, progress);
    };
    let outcome = bake::run(&request, &plan, interrupt.flag(), &mut |event| {
        tell(progress, event)
    })?;
    progress.finish();
    let end = if outcome.interrupted {
        "ended by a signal after"
    } else {
        "done:"
    };
    for warning in &outcome.warnings {
        let (text, event) = warned(warning);
        progress.say(&text, event);
    }
    progress.conclude(
        &format!(
            "{end} frame {} of {} in {} ({}, {} written now, waited {:.1} s for the disk)",
            outcome.last_frame,
            request.scene.shot.frames,
            request.directory.display(),
            count(outcome.frames.into(), "frame"),
            size(outcome.bytes),
            outcome.waited
        ),
        json!({
            "last_frame": outcome.last_frame, "frames": outcome.frames,
            "interrupted": outcome.interrupted, "directory": output::path(&request.directory),
        }),
    );
    pass_times::report(progress, &outcome.passes, &outcome.shares, outcome.frames);
    Ok(if outcome.interrupted {
        interrupt::EXIT_CODE as u8
    } else {
        0
    })
}

fn dry_run(directory: &Path, plan: &BakePlan<'_>, progress: &Progress) -> Result<u8, Failure> {
    let disk = DiskSpace::of(directory, plan, plan.first)?;
    for warning in plan.warnings.iter().chain(&plan.notes) {
        let (text, event) = warned(warning);
        progress.say(&text, event);
    }
    warn_of_disk(progress, disk);
    let told = DryRun {
        frames: (plan.first..=plan.last).collect(),
        standing: plan.standing as usize,
        bytes: Some(disk.bytes),
        place: output::path(directory),
    };
    let (start, volume) = (&plan.start, plan.volume());
    let particles = count(start.particles.len() as u64, "particle");
    let mut words = format!(", with {particles} at the start, {}", output::water(volume));
    let shapes: Vec<_> = start.shapes(plan.scene).collect();
    for shape in &shapes {
        words += &format!("\n{}", output::shape(shape));
    }
    let more = json!({
        "particles": start.particles.len(), "removed": start.removed, "volume": volume.made,
        "volume_asked": volume.asked,
        "disk_free": disk.free,
        "shapes": shapes.iter().map(|it| json!({
            "name": it.name, "files": it.files, "nodes": it.nodes, "times": it.times,
            "bytes": it.bytes, "device_bytes": it.device_bytes(),
        })).collect::<Vec<_>>(),
    });
    told.tell(progress, &words, more);
    Ok(0)
}

/// Disk space that the frames will need, in words.
fn taken(disk: DiskSpace) -> String {
    let compressed = if disk.is_compressed {
        " before compression"
    } else {
        ""
    };
    format!("about {}{compressed}", size(disk.bytes))
}

/// Warns if the disk cannot hold the frames.
fn warn_of_disk(progress: &Progress, disk: DiskSpace) {
    if let Some(free) = disk.short_of() {
        progress.say(
            &format!(
                "warning: the disk has {} free, but the frames will take {}; the bake ends when it \
                 is full, and --resume continues it",
                size(free),
                taken(disk)
            ),
            json!({ "event": "warning", "what": "disk", "free": free, "bytes": disk.bytes }),
        );
    }
}

pub(super) fn tell(progress: &Progress, event: BakeEvent) {
    match event {
        BakeEvent::Ready {
            device,
            software_warning,
            particles,
            removed,
            volume,
            boundary_samples,
            solver,
            bytes,
            disk,
            first,
            last,
            parent,
            notes,
            warnings,
        } => {
            let frames = u64::from((last + 1).saturating_sub(first));
            progress.begin(frames);
            progress.warn_of_adapter(software_warning.as_deref());
            for warning in &warnings {
                let (text, event) = warned(warning);
                progress.say(&text, event);
            }
            warn_of_disk(progress, disk);
            let span = if first > last {
                "nothing left to bake".into()
            } else {
                let disk = taken(disk);
                format!("frames {first} to {last}, {disk} on the disk")
            };
            let memory = bytes.map_or(String::new(), |bytes| match bytes {
                (all, 0) => format!(", {} on the device", size(all)),
                (all, lists) => format!(
                    ", {} on the device, of it {} neighbour lists",
                    size(all),
                    size(lists)
                ),
            });
            let device = device.to_string();
            let samples = match boundary_samples {
                0 => String::new(),
                count => format!(", {count} boundary samples"),
            };
            let text = format!(
                "{solver} on {device}\n{} ({removed} removed inside solids), \
                 {}{samples}{memory}\n{span}",
                count(particles as u64, "particle"),
                output::water(volume)
            );
            if let Some(parent) = &parent {
                let notes =
                    json!({ "event": "branch", "parent": parent.to_string(), "notes": notes });
                progress.say(&format!("begins from {parent}"), notes);
            }
            for note in &notes {
                progress.say(
                    &format!("note: {note}"),
                    json!({ "event": "note", "what": note }),
                );
            }
            progress.say(
                &text,
                json!({
                    "event": "ready", "solver": solver, "device": device, "particles": particles,
                    "removed": removed,
                    "volume": volume.made, "volume_asked": volume.asked,
                    "boundary_samples": boundary_samples, "bytes": bytes.map(|(all, _)| all),
                    "list_bytes": bytes.map(|(_, lists)| lists), "first": first, "last": last,
                    "frames": frames, "disk_bytes": disk.bytes, "disk_free": disk.free,
                }),
            );
        }
        BakeEvent::Frame {
            frame,
            report,
            seconds,
        } => {
            for warning in warnings(frame, &report) {
                progress.recur(warning);
            }
            progress.frame(
                &line(frame, &report, seconds),
                Status::Done,
                json!({ "event": "frame", "frame": frame, "seconds": seconds, "report": report }),
            );
        }
        BakeEvent::Written { bytes } => progress.wrote(bytes),
    }
}

fn line(frame: u32, report: &StepReport, seconds: f64) -> String {
    let projection = report.projection.as_ref().map_or(String::new(), |p| {
        format!(
            "  residual {:.1e}  divergence {:.2e} to {:.1e} /s",
            p.residual, p.divergence_before, p.divergence_after
        )
    });
    format!(
        "frame {frame:4}  {seconds:6.2} s  {} substeps, {} iterations{projection}  density error \
         {:.2} % (99 %: {:.2}, max {:.2})  top speed {:.2} m/s  {} capped",
        report.substeps,
        report.iterations,
        100.0 * report.density_error_mean,
        100.0 * report.density_error_p99,
        100.0 * report.density_error_max,
        report.max_speed,
        report.capped
    )
}

/// A warning about the scene, as a line and as a JSON event.
pub(super) fn warned(warning: &str) -> (String, Value) {
    (
        format!("warning: {warning}"),
        json!({ "event": "warning", "what": "scene", "text": warning }),
    )
}

/// Mean density error above which the water is clearly wrong; splashes of the included scenes stay
/// below 0.021.
const DENSE: f64 = 0.05;

/// Density error of a cell above which water has leaked or piled up there; FLIP's splashes stay
/// below 0.9.
const CROWDED: f64 = 1.0;

/// Mean divergence of a pocket, relative to the largest anywhere, above which it is not rounding.
const INCOMPATIBLE: f64 = 1e-3;

/// Warnings about a frame.
fn warnings(frame: u32, report: &StepReport) -> Vec<Recurring> {
    let mut warnings = Vec::new();
    let mut warn = |what, size, text, event| {
        warnings.push(Recurring {
            what,
            frame,
            size,
            text,
            event,
        });
    };
    let mean = report.density_error_mean;
    if mean > DENSE {
        let text = format!(
            "the water is {:.0} % too dense on average: its volume is not kept",
            100.0 * mean
        );
        warn("density", mean, text, json!({ "density_error_mean": mean }));
    }
    let Some(projection) = &report.projection else {
        return warnings;
    };
    let most = report.density_error_max;
    if most > CROWDED {
        let place = report.densest_at.map_or(String::new(), |at| {
            let [x, y, z] = at.map(|metres| (1e3 * metres).round() / 1e3);
            format!(", at [{x}, {y}, {z}]")
        });
        let text = format!(
            "a cell holds {:.1} times the water that it has room for{place}",
            1.0 + most
        );
        let event = json!({ "density_error_max": most, "place": report.densest_at });
        warn("crowded cell", most, text, event);
    }
    if projection.missed > 0 {
        let text = format!(
            "{} solves missed their tolerance; for pressure the residual is up to {:.1e} and the \
             divergence up to {:.1e} /s; where these are small, an effect's solve needed more \
             iterations than it is allowed",
            projection.missed, projection.residual, projection.divergence_after
        );
        let event = json!({ "missed": projection.missed, "residual": projection.residual });
        warn("missed projections", projection.missed.into(), text, event);
    }
    let squeezed = projection.incompatible;
    if squeezed > INCOMPATIBLE * projection.divergence_before {
        let text = format!(
            "water without air was squeezed by {squeezed:.1e} /s, which no pressure undoes: \
             its volume is not kept"
        );
        let event = json!({ "incompatible": squeezed });
        warn("incompatible pocket", squeezed, text, event);
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;
    use swell_domain::solver::Projection;

    fn report(projection: Option<Projection>) -> StepReport {
        StepReport {
            substeps: 2,
            iterations: 14,
            density_error_mean: 0.01,
            density_error_p99: 0.02,
            density_error_max: 0.03,
            kinetic_energy: 0.0,
            potential_energy: 0.0,
            max_speed: 3.0,
            capped: 0,
            searched: 0,
            boundary_work: 0.0,
            volume: None,
            projection,
            exchange: None,
            densest_at: Some([1.25, 0.5, 2.0]),
        }
    }

    #[test]
    fn a_projection_is_told_and_a_missed_one_is_a_warning() {
        assert!(!line(1, &report(None), 0.5).contains("residual"));
        assert!(warnings(1, &report(None)).is_empty());
        let good = Projection {
            residual: 8.1e-6,
            divergence_before: 3.5,
            divergence_after: 1e-4,
            ..Projection::default()
        };
        let text = line(1, &report(Some(good)), 0.5);
        assert!(
            text.contains("14 iterations  residual 8.1e-6  divergence 3.50e0 to 1.0e-4 /s"),
            "{text}"
        );
        assert!(warnings(1, &report(Some(good))).is_empty());
        let crowded = StepReport {
            density_error_max: 1.4,
            ..report(Some(good))
        };
        let told = warnings(5, &crowded);
        assert_eq!(told.len(), 1);
        assert_eq!(
            (told[0].frame, &*told[0].text),
            (
                5,
                "a cell holds 2.4 times the water that it has room for, at [1.25, 0.5, 2]"
            )
        );
        let missed = Projection { missed: 2, ..good };
        let warnings = warnings(7, &report(Some(missed)));
        assert!(warnings[0].text.starts_with("2 solves missed"));
        assert_eq!(warnings[0].event["missed"], 2);
        let dense = StepReport {
            density_error_mean: 0.4,
            ..report(None)
        };
        let warnings = self::warnings(3, &dense);
        assert!(warnings[0].text.starts_with("the water is 40 % too dense"));
        let squeezed = Projection {
            incompatible: 0.5,
            ..good
        };
        let warnings = self::warnings(7, &report(Some(squeezed)));
        let text = "water without air was squeezed by 5.0e-1 /s";
        assert!(warnings[0].text.starts_with(text));
    }

    #[test]
    fn solvers_go_by_their_names() {
        assert_eq!(method("flip"), Ok(Method::Flip));
        assert!(method("sph").is_err_and(|said| said.contains("pbf or flip")));
    }
}
