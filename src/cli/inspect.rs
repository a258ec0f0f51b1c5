//! `swell inspect SCENE|LOOK|STUDY|CACHE|FILE|--adapters`

mod file;
mod json;
mod look;
pub(super) mod study;

use std::{
    fmt::{self, Write},
    path::{Path, PathBuf},
};

use clap::Args;

use swell_domain::posix;
use swell_scene::{Method, Scene};
use swell_stage::{
    bake::BakePlan,
    device::Gpu,
    inspect::{
        Adapter, LIST_BUDGET, LedgerEntry, MOST_NODES, Manifest, PARTICLES, PROBES, Rounding,
        ScenePlan, adapters, cache, plan, plot,
    },
    replay::is_failed,
    time::{Timed, time},
};

use super::{
    Failure, RequireArgs, bake, check::Misplaced, count, is_cache, lint::DenyArgs, named_adapter,
    output, pass_times, size,
};

#[derive(Args, Debug)]
#[command(
    override_usage = "swell inspect [OPTIONS] <SCENE|LOOK|STUDY|CACHE|FILE>\n       swell inspect \
                      --adapters"
)]
pub(super) struct InspectArgs {
    /// A scene, look or study file, a cache directory, or a file: a frame or mesh (.ply, .obj,
    /// .stl), a .vdb, a picture (.png, .exr), a .usda, .glb or .gltf with cameras or animations.
    #[arg(required_unless_present = "adapters")]
    subject: Option<PathBuf>,
    /// List this machine's adapters with the limits that matter here.
    #[arg(long)]
    adapters: bool,
    /// Draw what the cache's probes saw over time, an SVG a probe, into this folder.
    #[arg(long, value_name = "DIR", requires = "subject")]
    plot: Option<PathBuf>,
    /// Plan a look for this scene or cache: its solids and its particles.
    #[arg(long, value_name = "SCENE|CACHE", requires = "subject")]
    scene: Option<PathBuf>,
    /// Override a scene key.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Plan for this solver, pbf or flip: short for --set solver.method=SOLVER.
    #[arg(long, value_name = "SOLVER", value_parser = bake::method)]
    solver: Option<Method>,
    /// Take meshes and tables that lie outside of the scene's folder.
    #[arg(long)]
    allow_outside: bool,
    /// Compute so many frames of the scene after its first, keep nothing, and tell what they took,
    /// by what passes are there for. Later frames of a shot may take more substeps.
    #[arg(
        long,
        value_name = "FRAMES",
        requires = "subject",
        value_parser = clap::value_parser!(u32).range(1..=1000)
    )]
    time: Option<u32>,
    /// Plan for the limits of this adapter; SWELL_ADAPTER in the environment where left out.
    #[arg(long, value_name = "NAME", requires = "subject")]
    adapter: Option<String>,
    #[command(flatten)]
    require: RequireArgs,
    #[command(flatten)]
    deny: DenyArgs,
    /// Print one JSON object.
    #[arg(long, conflicts_with = "plot")]
    json: bool,
}

impl InspectArgs {
    /// The adapter to plan for.
    fn gpu(&self) -> Gpu {
        Gpu {
            adapter: named_adapter(self.adapter.as_ref()),
            is_hardware_required: self.require.is_gpu(),
            ..Gpu::default()
        }
    }
}

pub(super) fn run(args: &InspectArgs) -> Result<u8, Failure> {
    // Writing to a String cannot fail.
    let mut text = String::new();
    let mut misfit = None;
    if let (Some(_), Some(subject)) = (&args.scene, &args.subject)
        && !look::is_look(subject)
    {
        return Err(misplaced("--scene", "looks", "none", subject));
    }
    if let (Some(_), Some(subject)) = (args.time, &args.subject)
        && look::is_look(subject)
    {
        return Err(misplaced("--time", "scenes", "a look", subject));
    }
    if args.subject.is_none() && args.require.require.is_some() {
        return Err(Failure {
            code: 2,
            error: "--require is for scenes and looks; --adapters lists all".into(),
        });
    }
    if args.json {
        return json::run(args);
    }
    let plotted = match (&args.plot, &args.subject) {
        (Some(folder), Some(directory)) => plot(directory, folder)?,
        _ => Vec::new(),
    };
    if args.adapters {
        for adapter in adapters()? {
            let _ = show_adapter(&mut text, &adapter);
        }
    }
    match &args.subject {
        Some(directory) if is_failed(directory) => return Err(broken_off(directory)),
        Some(subject) if file::is_file(subject) => file::show(&mut text, args, subject)?,
        Some(subject) if study::is_study(subject) => study::show(&mut text, args, subject)?,
        Some(directory) if is_cache(directory) => {
            refuse_options(args, CACHE, directory)?;
            let (manifest, entries) = cache(directory)?;
            let _ = show_cache(&mut text, &manifest, &entries);
            let _ = show_probes(&mut text, &manifest, &entries);
        }
        Some(file) if look::is_look(file) => {
            misfit = look::show(&mut text, args, file)?.misfit;
        }
        Some(file) => {
            let scene = bake::load(file, &args.set, args.solver, args.allow_outside)?;
            let planned = of_scene(args, file, &scene)?;
            let _ = show_plan(&mut text, &planned);
            match args.time {
                Some(frames) if planned.misfit.is_none() => {
                    let timed = time(&planned.bake, &args.gpu(), frames)?;
                    let _ = show_time(&mut text, &timed);
                }
                _ => {
                    let shares = planned.plan.shares(&[]);
                    let _ = write!(text, "\n{}", pass_times::shares(&shares, None));
                }
            }
            misfit = planned.misfit;
        }
        None => {}
    }
    for file in plotted {
        text += &format!("{}\n", file.display());
    }
    output::print(&text);
    misfit.map_or(Ok(0), |misfit| Err(misfit.into()))
}

/// Plans a scene for the chosen adapter, unless it is denied.
fn of_scene<'a>(
    args: &InspectArgs,
    file: &Path,
    scene: &'a Scene,
) -> Result<ScenePlan<'a>, Failure> {
    refuse_frames_beyond(args, file, scene.shot.frames)?;
    let bake = BakePlan::of(scene)?;
    args.deny.check(file, &bake)?;
    Ok(plan(bake, &args.gpu())?)
}

/// Error for the folder of a failed frame, which has neither plan nor ledger.
fn broken_off(directory: &Path) -> Failure {
    let what = format!(
        "{} is the frame at which a bake failed, which no cache lists; `swell check {}` computes \
         it again",
        directory.display(),
        posix::path(directory)
    );
    Failure {
        code: 2,
        error: what.into(),
    }
}

/// Refuses to time frames beyond the end of the shot, where motions are undefined; the first frame
/// is a warm-up.
fn refuse_frames_beyond(args: &InspectArgs, file: &Path, frames: u32) -> Result<(), Failure> {
    match args.time {
        Some(asked) if asked >= frames => {
            let error = format!(
                "--time {asked}: {} has {frames} frames, and the first is not timed: up to {} are \
                 possible; raise shot.frames",
                file.display(),
                frames - 1
            );
            Err(Failure {
                code: 2,
                error: error.into(),
            })
        }
        _ => Ok(()),
    }
}

/// Reason to refuse options of scenes for a cache.
const CACHE: &str = "a cache: it records what it was baked with";

/// Refuses options of scenes for other subjects.
fn refuse_options(args: &InspectArgs, is: &'static str, file: &Path) -> Result<(), Failure> {
    if args.time.is_some() {
        return Err(misplaced("--time", "scenes", is, file));
    }
    let has_adapter = args.adapter.is_some() || args.require.require.is_some();
    if args.set.is_empty() && args.solver.is_none() && !has_adapter {
        return Ok(());
    }
    Err(misplaced(
        "--set, --solver, --require or --adapter",
        "scenes",
        is,
        file,
    ))
}

fn misplaced(option: &'static str, what: &'static str, is: &'static str, file: &Path) -> Failure {
    let error = Misplaced {
        option,
        what,
        is,
        source_file: file.to_owned(),
    };
    Failure {
        code: 2,
        error: Box::new(error),
    }
}

fn show_adapter(out: &mut String, adapter: &Adapter) -> fmt::Result {
    writeln!(
        out,
        "{}: {} ({}), driver {}",
        adapter.index, adapter.name, adapter.kind, adapter.driver
    )?;
    for (name, value) in &adapter.limits {
        writeln!(out, "   {name} {value}")?;
    }
    writeln!(
        out,
        "   pass times: {}",
        if adapter.has_timestamps { "yes" } else { "no" }
    )?;
    writeln!(
        out,
        "   f64 in shaders: {}",
        if adapter.has_f64 { "yes" } else { "no" }
    )?;
    match &adapter.rounding {
        Ok(rounding) => show_rounding(out, rounding),
        Err(why) => writeln!(out, "   rounding: not measured: {why}"),
    }
}

fn show_rounding(out: &mut String, rounding: &Rounding) -> fmt::Result {
    writeln!(
        out,
        "   largest errors, ulp: {:.2} of division, {:.2} of square roots, {:.2} of inverse ones; \
         sine {:.0e}",
        rounding.division, rounding.square_root, rounding.inverse_square_root, rounding.sine
    )?;
    let yes = |is_so| if is_so { "yes" } else { "no" };
    writeln!(
        out,
        "   a b + c rounded once: {}; subnormal numbers lost: {}",
        yes(rounding.contracts),
        yes(rounding.flushes_inputs || rounding.flushes_results)
    )?;
    writeln!(
        out,
        "   two words keep what one loses: {}",
        yes(rounding.keeps_two_words())
    )
}

fn show_plan(out: &mut String, planned: &ScenePlan<'_>) -> fmt::Result {
    let (plan, bake) = (&planned.plan, &planned.bake);
    let (scene, start) = (bake.scene, &bake.start);
    let shot = &scene.shot;
    writeln!(
        out,
        "{}: {} frames at {} a second, by {}",
        shot.name,
        shot.frames,
        shot.frames_per_second,
        scene.solver.method().name()
    )?;
    for warning in &bake.warnings {
        writeln!(out, "warning: {warning}")?;
    }
    let samples = match plan.counts.boundary_samples {
        0 => String::new(),
        count => format!("{count} boundary samples, "),
    };
    writeln!(
        out,
        "{} ({} removed inside solids), {}, {samples}{} × {} × {} cells",
        count(start.particles.len() as u64, "particle"),
        start.removed,
        output::water(bake.volume()),
        plan.grid_dims[0],
        plan.grid_dims[1],
        plan.grid_dims[2]
    )?;
    for (index, inflow) in bake.inflows.iter().enumerate() {
        match inflow.predicted {
            Some(inflow) => writeln!(out, "emitter[{index}] brings {:.4} m³/s", inflow.rate)?,
            None => writeln!(out, "emitter[{index}] keeps a level")?,
        }
    }
    if let Some(most) = bake.entering() {
        let particles = count(most as u64, "particle");
        writeln!(
            out,
            "at most {particles} more by the last frame, but for levels"
        )?;
    }
    match &planned.adapter {
        Some(name) => writeln!(out, "planned for {name}")?,
        None => writeln!(out, "planned for common limits: no adapter here")?,
    }
    if let Some(warning) = &planned.software_warning {
        writeln!(out, "warning: {warning}")?;
    }
    writeln!(out, "\npass                          for")?;
    for pass in plan.parts().flat_map(|part| &part.passes) {
        writeln!(out, "{:28}  {}", pass.spec.name, pass.owner)?;
    }
    writeln!(
        out,
        "\nbuffer                        for                      bytes"
    )?;
    for buffer in plan.parts().flat_map(|part| &part.buffers) {
        writeln!(
            out,
            "{:28}  {:22} {:>12}",
            buffer.spec.name, buffer.owner, buffer.spec.bytes
        )?;
    }
    let (all, lists) = plan.bytes();
    let each = |bytes: u64| bytes as f64 / plan.counts.particles.max(1) as f64;
    write!(
        out,
        "\n{} in all: {:.0} bytes a particle",
        size(all),
        each(all - lists)
    )?;
    match lists {
        0 => writeln!(out)?,
        lists => writeln!(out, ", and {:.0} for neighbour lists", each(lists))?,
    }
    show_arrangement(out, planned)?;
    Ok(())
}

/// Describes how limits on bindings and lists changed the plan.
fn show_arrangement(out: &mut String, planned: &ScenePlan<'_>) -> fmt::Result {
    let plan = &planned.plan;
    match (
        planned.bake.scene.solver.method(),
        plan.has_lists,
        plan.chunks.len(),
    ) {
        (Method::Pbf, false, _) => writeln!(
            out,
            "no neighbour lists: they would take more than {}; each pass searches the cells",
            size(LIST_BUDGET)
        )?,
        (Method::Pbf, true, chunks @ 2..) => writeln!(
            out,
            "neighbour lists in {chunks} bindings: each pass goes out in as many dispatches"
        )?,
        _ => {}
    }
    if let Some(page) = plan.page {
        writeln!(out, "positions in two bindings, {page} in the first")?;
    }
    for shape in planned.bake.start.shapes(planned.bake.scene) {
        writeln!(out, "{}", output::shape(&shape))?;
    }
    if let Some(spacing) = planned.coarse_solids() {
        writeln!(
            out,
            "signed distance of solids every {spacing:.4} m, coarser than the water, with at \
             most {MOST_NODES} nodes"
        )?;
    }
    Ok(())
}

fn show_time(out: &mut String, timed: &Timed) -> fmt::Result {
    let [least, median, most] = timed.seconds;
    let frames = match timed.frames {
        1 => "one frame after the first".to_owned(),
        frames => format!("{frames} frames after the first"),
    };
    writeln!(
        out,
        "\n{median:.3} s a frame ({least:.3} to {most:.3}), {:.1} substeps, over {frames}, on {}; \
         by pass, one by one:\n",
        timed.substeps, timed.device
    )?;
    write!(
        out,
        "{}",
        pass_times::shares(&timed.shares, Some(timed.frames))
    )
}

fn show_cache(out: &mut String, manifest: &Manifest, entries: &[LedgerEntry]) -> fmt::Result {
    writeln!(
        out,
        "{}: {} by {} {}",
        manifest.shot, manifest.solver, manifest.program, manifest.program_version
    )?;
    writeln!(
        out,
        "on {} ({}, {})",
        manifest.device, manifest.driver, manifest.backend
    )?;
    if let Some(shaders) = &manifest.shaders {
        writeln!(out, "shaders {shaders}: not the shipped ones")?;
    }
    writeln!(out, "scene {}", manifest.scene_hash)?;
    if let Some(parent) = &manifest.parent {
        writeln!(out, "begins from {parent}")?;
    }
    for warning in &manifest.warnings {
        writeln!(out, "warning: {warning}")?;
    }
    writeln!(
        out,
        "{} a second, d = {} m",
        manifest.frames_per_second, manifest.particle_spacing
    )?;
    if let Some(keep) = manifest.keep {
        writeln!(
            out,
            "keeps particles: \"{keep}\", and the first and newest frame's"
        )?;
    }
    if manifest.compression.is_some() {
        writeln!(out, "frames compressed by Zstandard")?;
    }
    if manifest.origin != [0.0; 3] {
        writeln!(out, "solved about the origin {:?} m", manifest.origin)?;
    }
    let has_projection = entries
        .iter()
        .any(|entry| entry.report.get("projection").is_some());
    let columns = if has_projection {
        "  iterations  residual   divergence  missed  pockets"
    } else {
        ""
    };
    writeln!(
        out,
        "\nframe  particles       bytes  substeps{columns}  density error  top speed  capped"
    )?;
    let newest = entries.last().map_or(0, |entry| entry.frame);
    for entry in entries {
        let bytes = entry.file(PARTICLES).map_or(0, |file| file.bytes);
        let bytes = match manifest.has_particles(entry.frame, newest) {
            true => size(bytes),
            false => "-".to_owned(),
        };
        let number = |key: &str| entry.report.get(key).and_then(serde_json::Value::as_f64);
        let percent =
            number("density_error_mean").map_or("-".into(), |x| format!("{:.3} %", 100.0 * x));
        let speed = number("max_speed").map_or("-".into(), |x| format!("{x:.2} m/s"));
        let capped = number("capped").map_or("-".into(), |x| format!("{x}"));
        let columns = if has_projection {
            projection_columns(entry)
        } else {
            String::new()
        };
        writeln!(
            out,
            "{:5}  {:9}  {:>10}  {:8}{columns}  {percent:>13}  {speed:>9}  {capped:>6}",
            entry.clock.frame, entry.particles, bytes, entry.clock.substeps
        )?;
    }
    Ok(())
}

/// One line per column of each probe: its minimum, maximum and last value.
fn show_probes(out: &mut String, manifest: &Manifest, entries: &[LedgerEntry]) -> fmt::Result {
    if manifest.probes.is_empty() {
        return Ok(());
    }
    writeln!(
        out,
        "\n{:24}  {:14}  {:>12}  {:>12}  {:>12}",
        "probe", "column", "least", "greatest", "last"
    )?;
    for (index, probe) in manifest.probes.iter().enumerate() {
        for (k, column) in probe.columns.iter().enumerate() {
            let values = || {
                let of =
                    |entry| probe.looks(LedgerEntry::row(entry, PROBES, index), entry.clock.time);
                entries.iter().flat_map(of).map(|look| look.values[k])
            };
            let least = values().flatten().min_by(f64::total_cmp);
            let greatest = values().flatten().max_by(f64::total_cmp);
            let last = values().last().flatten();
            let [least, greatest, last] = [least, greatest, last]
                .map(|value| value.map_or("-".to_owned(), |v| format!("{v:.6}")));
            writeln!(
                out,
                "{:24}  {column:14}  {least:>12}  {greatest:>12}  {last:>12}",
                probe.name
            )?;
        }
    }
    Ok(())
}

/// Iterations and the fields of `projection`; the start has neither.
fn projection_columns(entry: &LedgerEntry) -> String {
    let of = |table: Option<&serde_json::Value>, key: &str| table?.get(key)?.as_f64();
    let projection = entry.report.get("projection");
    let number = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v}"));
    let scientific = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.1e}"));
    format!(
        "  {:>10}  {:>8}  {:>8} /s  {:>6}  {:>7}",
        number(of(Some(&entry.report), "iterations")),
        scientific(of(projection, "residual")),
        scientific(of(projection, "divergence_after")),
        number(of(projection, "missed")),
        number(of(projection, "pockets"))
    )
}
