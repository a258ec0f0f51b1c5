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
    // Positions in frames are relative to this point, metres; zero but far from the world's origin.
    println!("origin {:?} m", manifest.origin);
    for frame in cache.first_frame()..=cache.last_frame() {
        // Some frames have a report but no particles (`[keep]` in the scene).
        if !cache.has_particles(frame) {
            continue;
        }
        // Verifies the checksum. Positions in metres, velocities in m/s, both as [x, y, z].
        let state = cache.read(frame)?;
        let positions: &[[f32; 3]] = &state.position;
        if positions.is_empty() {
            println!("frame {frame}: no water");
            continue;
        }
        let count = positions.len() as f64;
        let center = [0, 1, 2].map(|axis| {
            let sum: f64 = positions.iter().map(|at| f64::from(at[axis])).sum();
            sum / count
        });
        let top = positions.iter().map(|at| at[1]).fold(f32::MIN, f32::max);
        println!("frame {frame}: {count} particles, centre {center:.3?} m, top {top:.3} m");
    }
    Ok(())
}
