//! Time and memory of a PBF step by particle count: `tools/bench [--counts 60000,250000] [--adapter NAME]`.
#![allow(missing_docs, reason = "a program")]
use glam::DVec3;
use std::{path::PathBuf, time::Instant};
use swell::{
    domain::{bounds::Bounds, particles::Particles, solver::Solver},
    gpu::adapter::Context,
    scene::*,
    solve::{boundary::Boundary, pbf::Pbf},
};

fn scene(side: f64, depth: f64, iteration: Iteration, iterations: u32) -> Scene {
    Scene {
        shot: Shot {
            name: "bench".into(),
            frames: 10,
            frames_per_second: 100.0,
        },
        domain: Bounds {
            min: DVec3::ZERO,
            max: DVec3::new(side * 1.5, depth * 2.0, side),
        },
        water: Water {
            rest_density: 1000.0,
            gravity: DVec3::new(0.0, -9.81, 0.0),
            blocks: vec![],
            meshes: vec![],
        },
        solids: vec![],
        wave_makers: vec![],
        solver: swell::scene::Solver {
            pbf: swell::scene::Pbf {
                particle_spacing: 0.1,
                support_ratio: 2.0,
                iteration,
                stop: Stop::Iterations(iterations),
                cfl: 1.0,
                relaxation: 1.0,
                artificial_pressure: 0.0,
                max_substeps: 32,
            },
        },
        effects: Effects::default(),
    }
}

fn main() {
    let _ = PathBuf::new();
    let context = Context::open(None).expect("adapter");
    println!(
        "{} {} {}",
        context.info.name, context.info.driver, context.info.driver_info
    );
    let args: Vec<usize> = std::env::args()
        .skip(1)
        .filter_map(|a| a.parse().ok())
        .collect();
    for target in if args.is_empty() { vec![60_000] } else { args } {
        let n = ((target as f64 * 2.0).cbrt()).round() as usize;
        let m = n / 2;
        let s = scene(n as f64 * 0.1, m as f64 * 0.1, Iteration::RedBlack, 4);
        let mut p = Particles::default();
        for z in 0..n {
            for y in 0..m {
                for x in 0..n {
                    p.position.push([
                        (x as f32 + 0.5) * 0.1,
                        (y as f32 + 0.5) * 0.1,
                        (z as f32 + 0.5) * 0.1,
                    ]);
                    p.velocity.push([0.0; 3]);
                    p.id.push(p.id.len() as u32);
                }
            }
        }
        let count = p.len();
        for timed in [false, true] {
            let mut solver =
                Pbf::new(&context, &s, count, &Boundary::default(), timed).expect("solver");
            solver.load(0, &p).expect("load");
            for frame in 0..8 {
                let t = Instant::now();
                let (_, report) = solver.advance().expect("advance");
                let us = t.elapsed().as_secs_f64() * 1e6 / (count as f64 * report.substeps as f64);
                println!("{count} frame {frame}: {us:.3} us/particle-step {report:?}");
            }
            if timed {
                let mut rows = solver.timings();
                rows.sort_by(|a, b| b.1.total_cmp(&a.1));
                let steps = 8.0;
                for (name, s, runs) in rows {
                    println!(
                        "{name:28} {:8.3} ms x {runs} = {:.3} us/particle-step",
                        s / runs as f64 * 1e3,
                        s * 1e6 / (count as f64 * steps)
                    );
                }
            }
            println!(
                "{:?} bytes/particle {}",
                solver.plan().bytes(),
                solver.plan().bytes().0 as f64 / count as f64
            );
        }
    }
}
