//! Time per pass and per particle-step, and bytes per particle, of PBF in a collapsing dam.
//!
//! `tools/bench pbf [--device cpu] [--adapter NAME] [--frames N] [--rate HZ] [--alone] [--json]
//! [COUNT ...]`
//!
//! `--device cpu` runs the f64 reference. COUNT is a number of particles; the default is 60 000,
//! 250 000 and 1 000 000. With `--rate` a frame is one step of 1/HZ s. `--json` prints one line per
//! count for programs, without times per pass. The time of a step includes the grid projection
//! (unless `--alone` is given), the sort, neighbour lists, 4 red/black iterations, and a share of
//! the frame's density measurement and readback. h = 2d, without effects and solids. The first two
//! frames warm up; the medians of the others are printed.
#![allow(
    clippy::print_stderr,
    clippy::print_stdout,
    reason = "a benchmark prints what it measured"
)]
#![allow(missing_docs, reason = "a program")]

use std::{path::Path, time::Instant};
use swell::files::parse_scene;

use swell::{
    domain::solver::PassTime,
    gpu::adapter::Needs,
    scene::Scene,
    solve::plan::Plan,
    stage::{
        device::{Built, Device, Opened},
        prepare::Start,
    },
};

const WARM_UP: usize = 2;

struct Options {
    device: Device,
    frames: usize,
    /// Steps a second, one per frame. Without it, a frame of 1/30 s takes as many substeps as the
    /// CFL condition requires.
    rate: Option<f64>,
    has_projection: bool,
    is_json: bool,
    counts: Vec<usize>,
}

fn options() -> Result<Options, String> {
    let mut options = Options {
        device: Device::Gpu(None.into()),
        frames: 8,
        rate: None,
        has_projection: true,
        is_json: false,
        counts: Vec::new(),
    };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} wants a value"));
        match word.as_str() {
            "--adapter" => options.device = Device::Gpu(Some(value()?).into()),
            "--device" => match value()?.as_str() {
                "gpu" => {}
                "cpu" => options.device = Device::Cpu,
                other => return Err(format!("--device {other}: gpu or cpu")),
            },
            "--frames" => {
                options.frames = value()?.parse().map_err(|_| "--frames wants a number")?
            }
            "--rate" => options.rate = Some(value()?.parse().map_err(|_| "--rate wants a number")?),
            "--json" => options.is_json = true,
            "--alone" => options.has_projection = false,
            // Passed by Cargo.
            "--bench" => {}
            _ => options.counts.push(
                word.parse()
                    .map_err(|_| format!("`{word}` is no number of particles"))?,
            ),
        }
    }
    if options.counts.is_empty() {
        options.counts = vec![60_000, 250_000, 1_000_000];
    }
    Ok(options)
}

/// A dam of about `count` particles, twice as long as wide and high, with as much empty space in
/// front of it. It already moves, so that a frame takes as many substeps as one of a shot.
fn dam(count: usize, options: &Options) -> Result<(Scene, Start), Box<dyn std::error::Error>> {
    let edge = (count as f64 / 2.0).cbrt().round() * 0.1;
    let has_projection = options.has_projection;
    // One substep: with this `cfl` no displacement is too long for a step, and a second substep
    // would be an error.
    let (rate, cfl, substeps) = options.rate.map_or((30.0, 0.5, 64), |rate| (rate, 5.0, 1));
    let text = format!(
        "[shot]\nname = \"bench\"\nframes = 1\nframes_per_second = {rate:?}\n\
         [domain]\nmin = [0.0, 0.0, 0.0]\nmax = [{}, {}, {edge}]\n\
         [[water.block]]\nmin = [0.0, 0.0, 0.0]\nmax = [{}, {edge}, {edge}]\n\
         [solver]\nmethod = \"pbf\"\n\
         [solver.pbf]\nparticle_spacing = 0.1\niterations = 4\ncfl = {cfl:?}\n\
         max_substeps = {substeps}\ngrid_projection = {has_projection}\n",
        4.0 * edge,
        2.0 * edge,
        2.0 * edge
    );
    let scene = parse_scene(&text, Path::new("bench.toml"), Path::new("."), &[])?;
    let mut start = Start::of(&scene)?;
    start.particles.velocity.fill([2.0, 0.0, 0.0]);
    Ok((scene, start))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Measurements after the warm-up.
struct Timed {
    /// Wall-clock time of a step, seconds; one value per frame.
    seconds: Vec<f64>,
    substeps: u32,
    searched: u64,
}

fn time_frames(
    built: &mut Built,
    start: &Start,
    frames: usize,
) -> Result<Timed, Box<dyn std::error::Error>> {
    let mut timed = Timed {
        seconds: Vec::new(),
        substeps: 0,
        searched: 0,
    };
    built.solver.load(0, &start.particles)?;
    for frame in 0..frames + WARM_UP {
        let begin = Instant::now();
        let (_, report) = built.solver.advance()?;
        if frame >= WARM_UP {
            let seconds = begin.elapsed().as_secs_f64();
            timed.seconds.push(seconds / f64::from(report.substeps));
            timed.searched += report.searched;
            timed.substeps += report.substeps;
        }
    }
    Ok(timed)
}

fn measure(
    opened: &Opened,
    options: &Options,
    count: usize,
) -> Result<(), Box<dyn std::error::Error>> {
    let (scene, start) = dam(count, options)?;
    let n = start.particles.len();
    let mut built = opened.build(&scene, &start, false)?;
    let timed = time_frames(&mut built, &start, options.frames)?;
    if options.is_json {
        let line = serde_json::json!({
            "device": opened.identity().to_string(),
            "particles": n,
            "seconds": timed.seconds,
            "substeps": timed.substeps,
        });
        println!("{line}");
        return Ok(());
    }
    print_steps(built.plan.as_ref(), &timed, n as f64);
    print_passes(opened, options, &scene, &start)
}

fn print_steps(plan: Option<&Plan>, timed: &Timed, n: f64) {
    println!("\n{n} particles");
    if let Some((all, lists)) = plan.map(Plan::bytes) {
        println!(
            "{:.0} bytes each, and {:.0} for neighbour lists",
            (all - lists) as f64 / n,
            lists as f64 / n
        );
    }
    let (least, most) = timed
        .seconds
        .iter()
        .fold((f64::MAX, 0.0f64), |(a, b), &t| (a.min(t), b.max(t)));
    let middle = median(timed.seconds.clone());
    println!(
        "step {:.2} ms ({:.2} to {:.2} over {} frames): {:.3} µs a particle-step",
        1e3 * middle,
        1e3 * least,
        1e3 * most,
        timed.seconds.len(),
        1e6 * middle / n
    );
    if plan.is_some() {
        let overflowed = timed.searched as f64 / (n * f64::from(timed.substeps));
        println!("{overflowed:.2e} of lists overflowed");
    }
}

fn print_passes(
    opened: &Opened,
    options: &Options,
    scene: &Scene,
    start: &Start,
) -> Result<(), Box<dyn std::error::Error>> {
    let mut solver = opened.build(scene, start, true)?.solver;
    solver.load(0, &start.particles)?;
    let mut steps = 0;
    for _ in 0..options.frames + WARM_UP {
        steps += solver.advance()?.1.substeps;
    }
    let mut rows = solver.timings();
    rows.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    let n = start.particles.len() as f64;
    for PassTime {
        pass,
        seconds,
        runs,
        ..
    } in &rows
    {
        let each = 1e3 * seconds / *runs as f64;
        println!(
            "   {pass:24} {each:9.3} ms × {runs:5}  {:7.3} µs a particle-step",
            1e6 * seconds / (n * f64::from(steps))
        );
    }
    if rows.is_empty() {
        println!("   this adapter has no timestamps: no times per pass");
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = options()?;
    let opened = options.device.open(Needs::default())?;
    if !options.is_json {
        println!("{}", opened.identity());
    }
    for &count in &options.counts {
        measure(&opened, &options, count)?;
    }
    Ok(())
}
