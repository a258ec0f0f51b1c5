//! Iterations and times of the pressure solve on the tank of n³ cells, by preconditioner and
//! surface.
//!
//! `tools/bench pressure [--adapter NAME] [--tolerance T] [--repeats R] [--passes] [--only P]
//! [N ...]`
//!
//! N defaults to 16, 32, 64, 96. P is one of none, jacobi, ipp, multigrid, or reference, the f64
//! solve on the CPU: by a sparse factorization where `reference::poisson::BUDGET` bytes suffice,
//! and by conjugate gradients. A time is that of one `project`, which includes system, solve,
//! gradient and waiting for the device; it is the median of the repeats after one that warms up.
//! `--passes` adds the time of each pass by the device's clock.
#![allow(
    clippy::print_stderr,
    clippy::print_stdout,
    reason = "a benchmark prints what it measured"
)]
#![allow(missing_docs, clippy::unwrap_used, reason = "a program")]

#[path = "../tests/suite/support/pressure.rs"]
#[allow(dead_code, unreachable_pub, reason = "tests have more of it")]
mod support;

use std::time::Instant;

use swell::{
    domain::poisson::cases::{Surface, tank, tank_rhs},
    gpu::{adapter::Context, recording::Timer},
    reference::poisson::{BUDGET, Solver},
    scene::flip::Preconditioner,
};

fn main() {
    let (mut adapter, mut tolerance, mut repeats, mut has_passes) = (None, 1e-6, 5, false);
    let (mut sizes, mut only) = (Vec::new(), None);
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--adapter" => adapter = words.next(),
            "--tolerance" => tolerance = words.next().unwrap().parse().unwrap(),
            "--repeats" => repeats = words.next().unwrap().parse().unwrap(),
            "--passes" => has_passes = true,
            "--only" => only = words.next(),
            "--bench" => {}
            _ => sizes.push(word.parse().unwrap()),
        }
    }
    if sizes.is_empty() {
        sizes = vec![16, 32, 64, 96];
    }
    let context = Context::open(adapter.as_deref()).unwrap();
    println!("{}, tolerance {tolerance:e}", context.info.name);
    println!("   n      rows  surface     preconditioner  iterations  residual     ms");
    for n in sizes {
        for surface in [Surface::Voxel, Surface::GhostFluid] {
            for preconditioner in [
                Preconditioner::None,
                Preconditioner::Jacobi,
                Preconditioner::Ipp,
                Preconditioner::Multigrid,
            ] {
                let name = format!("{preconditioner:?}").to_lowercase();
                if only.as_ref().is_some_and(|only| *only != name) {
                    continue;
                }
                let settings = support::settings(preconditioner, tolerance);
                let mut rig = support::Rig::new(&context, tank(n, surface, false), &settings);
                let b = tank_rhs(&rig.case, &rig.system);
                let mut times = Vec::new();
                let mut solved = rig.solve(&b);
                for _ in 0..repeats {
                    rig.set_rhs(&b);
                    context.wait().unwrap();
                    let start = Instant::now();
                    solved = rig.project(None).solved;
                    times.push(1e3 * start.elapsed().as_secs_f64());
                }
                times.sort_by(f64::total_cmp);
                println!(
                    "{n:>4} {:>9}  {:<10}  {:<14}  {:>10}  {:>8.1e}  {:>7.1}",
                    rig.system.cell.len(),
                    format!("{surface:?}"),
                    format!("{preconditioner:?}"),
                    solved.iterations,
                    solved.residual,
                    times[times.len() / 2]
                );
                if has_passes {
                    let mut timer = Timer::new(&context);
                    rig.set_rhs(&b);
                    rig.project(Some(&mut timer));
                    timer.times(|name, seconds, runs, _, _| {
                        println!("      {name:<28} {:>8.3} ms  {runs:>4} runs", 1e3 * seconds);
                    });
                }
            }
            if only.as_ref().is_none_or(|only| only == "reference") {
                for budget in [BUDGET, 0] {
                    print_reference(n, surface, budget);
                }
            }
        }
    }
}

/// Prints one line for the f64 solve with at most `budget` bytes for a factor, and how long its
/// preparation takes.
fn print_reference(n: u32, surface: Surface, budget: u64) {
    let case = tank(n, surface, false);
    let system = case.system();
    let b = tank_rhs(&case, &system);
    let start = Instant::now();
    let solver = Solver::new(&system, budget).unwrap();
    let prepared = start.elapsed();
    let solution = solver.solve(&b);
    let method = match solver.factor_bytes() {
        Some(bytes) => format!("f64, {} MiB", bytes >> 20),
        None => "f64, MIC(0)".to_owned(),
    };
    println!(
        "{n:>4} {:>9}  {:<10}  {method:<14}  {:>10}  {:>8.1e}  {:>7.1}  of which {:.1} prepare",
        system.cell.len(),
        format!("{surface:?}"),
        solution.iterations,
        solution.residual,
        1e3 * start.elapsed().as_secs_f64(),
        1e3 * prepared.as_secs_f64()
    );
}
