//! Time per output frame and per pass of FLIP in a collapsing dam.
//!
//! `tools/bench flip [--adapter NAME | --device cpu] [--frames N] [--box XxYxZ]
//! [--set "KEY = VALUE"] [--twice] [--json]`
//!
//! `--device cpu` runs the f64 reference; its times per pass are wall-clock times. The default box
//! has 128×77×64 cells of 0.1 m, of which 36×49×64 hold 903 168 particles, already moving at 2 m/s.
//! A frame lasts 1/60 s. The first two frames warm up; the medians of the others are printed.
//! `--set` adds a line to `[solver.flip]`. `--twice` also measures a box four times as high and
//! prints the ratio. `--json` prints one line for programs, without times per pass.
#![allow(
    clippy::print_stderr,
    clippy::print_stdout,
    reason = "a benchmark prints what it measured"
)]
#![allow(missing_docs, reason = "a program")]

use std::{path::Path, time::Instant};
use swell::files::parse_scene;

use swell::{
    domain::solver::{PassTime, Solver},
    gpu::adapter::Context,
    reference::flip::Flip as Reference,
    scene::FlipScene,
    solve::{flip::Flip, plan::device_limits},
    stage::prepare::Start,
};

const WARM_UP: usize = 2;

/// Cells of water at the start.
const WATER: [f64; 3] = [36.0, 49.0, 64.0];

struct Options {
    adapter: Option<String>,
    is_cpu: bool,
    frames: usize,
    cells: [f64; 3],
    settings: String,
    is_twice: bool,
    is_json: bool,
}

fn options() -> Result<Options, String> {
    let mut options = Options {
        adapter: None,
        is_cpu: false,
        frames: 12,
        cells: [128.0, 77.0, 64.0],
        settings: String::new(),
        is_twice: false,
        is_json: false,
    };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} wants a value"));
        match word.as_str() {
            "--adapter" => options.adapter = Some(value()?),
            "--device" => match value()?.as_str() {
                "cpu" => options.is_cpu = true,
                other => return Err(format!("--device wants cpu, not `{other}`")),
            },
            "--frames" => {
                options.frames = value()?.parse().map_err(|_| "--frames wants a number")?
            }
            "--box" => options.cells = cells(&value()?)?,
            "--set" => options.settings += &format!("{}\n", value()?),
            "--json" => options.is_json = true,
            "--twice" => options.is_twice = true,
            // Passed by Cargo.
            "--bench" => {}
            _ => return Err(format!("`{word}` is no option")),
        }
    }
    Ok(options)
}

fn cells(word: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> = word
        .split(['x', '×'])
        .filter_map(|n| n.parse().ok())
        .collect();
    numbers
        .try_into()
        .map_err(|_| format!("--box wants three numbers of cells, not `{word}`"))
}

fn dam(
    options: &Options,
    height: f64,
) -> Result<(FlipScene<'static>, Start), Box<dyn std::error::Error>> {
    let metres = |cells: [f64; 3]| format!("{:?}", cells.map(|n| n / 10.0));
    let [x, y, z] = options.cells;
    let text = format!(
        "[shot]\nname = \"bench\"\nframes = 1\nframes_per_second = 60\n\
         [domain]\nmin = [0.0, 0.0, 0.0]\nmax = {}\n\
         [[water.block]]\nmin = [0.0, 0.0, 0.0]\nmax = {}\n\
         [solver]\nmethod = \"flip\"\n[solver.flip]\ncell_size = 0.1\n{}",
        metres([x, y * height, z]),
        metres([WATER[0].min(x), WATER[1].min(y), WATER[2].min(z)]),
        options.settings
    );
    let scene = parse_scene(&text, Path::new("bench.toml"), Path::new("."), &[])?;
    let scene = scene.with_flip().ok_or("a scene of FLIP")?.to_owned_scene();
    let mut start = Start::of(&scene)?;
    start.particles.velocity.fill([2.0, 0.0, 0.0]);
    Ok((scene, start))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Measurements of one box after the warm-up.
#[derive(Default)]
struct Frames {
    seconds: Vec<f64>,
    substeps: u32,
    iterations: u64,
    correction: u64,
}

/// Times dams in boxes of these relative heights. The boxes are interleaved frame by frame, so that
/// other load on the machine affects all of them alike.
fn measure(
    context: &Context,
    options: &Options,
    heights: &[f64],
) -> Result<Vec<Vec<f64>>, Box<dyn std::error::Error>> {
    let mut boxes = Vec::new();
    for &height in heights {
        let (scene, start) = dam(options, height)?;
        let plan = start.plan(&scene, device_limits(context));
        let mut solver = Flip::new(context, &scene, plan, &start.boundary, false)?;
        solver.load(0, &start.particles)?;
        boxes.push((solver, Frames::default()));
    }
    for frame in 0..options.frames + WARM_UP {
        for (solver, told) in &mut boxes {
            let begin = Instant::now();
            let (_, report) = solver.advance()?;
            if frame >= WARM_UP {
                told.seconds.push(begin.elapsed().as_secs_f64());
                told.substeps += report.substeps;
                told.iterations += report.iterations;
                told.correction += report.projection.map_or(0, |p| p.correction_iterations);
            }
        }
    }
    for (solver, told) in &boxes {
        print_box(solver, told);
    }
    Ok(boxes.into_iter().map(|(_, told)| told.seconds).collect())
}

fn print_box(solver: &Flip, told: &Frames) {
    let [x, y, z] = solver.plan().grid_dims;
    println!(
        "\n{} particles in {x}×{y}×{z} cells",
        solver.plan().counts.particles
    );
    let (least, most) = told
        .seconds
        .iter()
        .fold((f64::MAX, 0.0f64), |(a, b), &t| (a.min(t), b.max(t)));
    let frames = told.seconds.len() as f64;
    println!(
        "{:.3} s a frame ({least:.3} to {most:.3} over {frames} frames), {:.2} substeps, \
         {:.1} iterations and {:.1} of the correction",
        median(told.seconds.clone()),
        f64::from(told.substeps) / frames,
        told.iterations as f64 / frames,
        told.correction as f64 / frames,
    );
    println!(
        "{:.0} MB on the device, {} bricks with water and {} within reach",
        1e-6 * solver.plan().bytes().0 as f64,
        solver.bricks().wet,
        solver.bricks().active - solver.bricks().wet
    );
}

fn measure_passes(context: &Context, options: &Options) -> Result<(), Box<dyn std::error::Error>> {
    let (scene, start) = dam(options, 1.0)?;
    let plan = start.plan(&scene, device_limits(context));
    let mut solver = Flip::new(context, &scene, plan, &start.boundary, true)?;
    solver.load(0, &start.particles)?;
    let frames = options.frames.min(4) + WARM_UP;
    for _ in 0..frames {
        solver.advance()?;
    }
    print_passes(solver.timings(), frames);
    Ok(())
}

/// Times each frame and prints one line of JSON.
fn print_line<S: Solver>(
    mut solver: S,
    device: &str,
    start: &Start,
    frames: usize,
) -> Result<(), Box<dyn std::error::Error>>
where
    S::Error: std::error::Error + 'static,
{
    solver.load(0, &start.particles)?;
    let (mut seconds, mut substeps) = (Vec::new(), 0);
    for frame in 0..frames + WARM_UP {
        let begin = Instant::now();
        let (_, report) = solver.advance()?;
        if frame >= WARM_UP {
            seconds.push(begin.elapsed().as_secs_f64());
            substeps += report.substeps;
        }
    }
    let line = serde_json::json!({
        "device": device,
        "particles": start.particles.len(),
        "seconds": seconds,
        "substeps": substeps,
    });
    println!("{line}");
    Ok(())
}

/// Measures the f64 reference: µs per particle and substep, and the time of each pass.
fn measure_reference(options: &Options) -> Result<(), Box<dyn std::error::Error>> {
    let (scene, start) = dam(options, 1.0)?;
    let mut solver = Reference::new(&scene, &start.boundary);
    if options.is_json {
        return print_line(solver, "CPU f64 reference", &start, options.frames);
    }
    solver.load(0, &start.particles)?;
    let (mut substeps, mut iterations) = (0, 0);
    let begin = Instant::now();
    for _ in 0..options.frames {
        let (_, report) = solver.advance()?;
        substeps += report.substeps;
        iterations += report.iterations;
    }
    let seconds = begin.elapsed().as_secs_f64();
    let n = start.particles.len();
    println!(
        "{n} particles, f64: {:.3} µs a particle and substep over {substeps} substeps, \
         {:.1} iterations each",
        1e6 * seconds / (n as f64 * f64::from(substeps)),
        iterations as f64 / f64::from(substeps)
    );
    print_passes(solver.timings(), options.frames);
    Ok(())
}

fn print_passes(mut rows: Vec<PassTime>, frames: usize) {
    rows.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    println!("\npasses, by their time a frame:");
    for PassTime {
        pass,
        seconds,
        runs,
        ..
    } in &rows
    {
        println!(
            "   {pass:28} {:8.2} ms   {:7.3} ms × {runs}",
            1e3 * seconds / frames as f64,
            1e3 * seconds / *runs as f64
        );
    }
    if rows.is_empty() {
        println!("   this adapter has no timestamps: no times per pass");
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = options()?;
    if options.is_cpu {
        return measure_reference(&options);
    }
    let context = Context::open(options.adapter.as_deref())?;
    let info = &context.info;
    let device = format!("{} ({} {})", info.name, info.driver, info.driver_info);
    if options.is_json {
        let (scene, start) = dam(&options, 1.0)?;
        let plan = start.plan(&scene, device_limits(&context));
        let solver = Flip::new(&context, &scene, plan, &start.boundary, false)?;
        return print_line(solver, &device, &start, options.frames);
    }
    println!("{device}");
    let heights: &[f64] = if options.is_twice {
        &[1.0, 4.0]
    } else {
        &[1.0]
    };
    let times = measure(&context, &options, heights)?;
    if let [once, tall] = times.as_slice() {
        let ratios = once.iter().zip(tall).map(|(once, tall)| tall / once);
        println!(
            "\nthe box doubled twice in height: {:.3} × the time of the same frame",
            median(ratios.collect())
        );
    }
    measure_passes(&context, &options)
}
