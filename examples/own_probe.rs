//! Observes every substep of the f64 solver with a probe of one's own: how far water reaches along x, which
//! is compared with the start of a dam break over a dry bed (Ritter 1892: the front runs at
//! 2 √(g h)).
//!
//! `cargo run --release --example own_probe`
#![expect(clippy::print_stdout, reason = "a program that says what it measured")]

use std::error::Error;
use swell::files::SceneBuilder;

use swell::{
    domain::solver::{Observed, Requested, Solver as _, Span, Watch},
    reference::flip::Flip,
    stage::prepare::Start,
};

/// Front of the water at the end of each substep: seconds and metres.
#[derive(Default)]
struct Front(Vec<(f64, f64)>);

impl Watch for Front {
    fn wants(&mut self, _: Span) -> Requested {
        Requested {
            particles: true,
            ..Requested::default()
        }
    }

    fn look(&mut self, substep: Span, seen: Observed) {
        let x = seen.particles.position.iter().map(|at| at[0]);
        self.0.push((substep.end, f64::from(x.fold(0.0, f32::max))));
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let height = 0.5;
    let scene = SceneBuilder::new("front")
        .frames(10, 24.0)
        .domain([0.0; 3], [3.0, 0.8, 0.2])
        .block([0.0; 3], [0.6, height, 0.2])
        .flip(0.05)
        .build()?;
    let scene = scene.with_flip().ok_or("the scene does not use FLIP")?;
    let start = Start::of(&scene)?;
    let mut solver = Flip::new(&scene, &start.boundary);
    solver.load(0, &start.particles)?;
    let mut front = Front::default();
    for _ in 0..scene.shot.frames {
        solver.advance_watched(&mut front)?;
    }
    let ritter = 2.0 * (9.81f64 * height).sqrt();
    let mut fastest = 0.0f64;
    for pair in front.0.windows(2) {
        let [(before, from), (after, to)] = [pair[0], pair[1]];
        let speed = (to - from) / (after - before);
        println!("{after:.4} s: {to:.3} m, {speed:.2} m/s (Ritter at most {ritter:.2})");
        fastest = fastest.max(speed);
    }
    // The column is as high as it is long, so that the front never reaches the theory's speed.
    if (0.5 * ritter..ritter).contains(&fastest) {
        Ok(())
    } else {
        Err("the front is not that of a dam break".into())
    }
}
