//! Reads a cache into plain arrays: the centre of mass and the highest particle of each frame.
//!
//! `cargo run --release --example read_cache CACHE`
#![expect(clippy::print_stdout, reason = "a program that says what it read")]

use std::{env, error::Error, path::PathBuf};

use swell::cache::CacheReader;

fn main() -> Result<(), Box<dyn Error>> {
    let path = env::args().nth(1).ok_or("usage: read_cache CACHE")?;
    let cache = CacheReader::open(&PathBuf::from(path))?;
    let manifest = cache.manifest();
    println!("{}, by {}", manifest.shot, manifest.solver);
    for frame in 0..=cache.last_frame() {
        // Frames whose particles were not kept have a report, but no particles.
        if cache.kept(frame).is_err() {
            continue;
        }
        // Verifies the checksum. Positions in metres, velocities in m/s, both as [x, y, z].
        let state = cache.read(frame)?;
        let positions: &[[f32; 3]] = &state.position;
        let count = positions.len().max(1) as f64;
        let center = [0, 1, 2].map(|axis| {
            let sum: f64 = positions.iter().map(|at| f64::from(at[axis])).sum();
            sum / count
        });
        let top = positions.iter().map(|at| at[1]).fold(f32::MIN, f32::max);
        println!("frame {frame}: {count} particles, centre {center:.3?} m, top {top:.3} m");
    }
    Ok(())
}
