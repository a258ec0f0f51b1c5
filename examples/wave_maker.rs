//! Makes regular waves with a piston, by FLIP on the CPU, and compares their height with linear
//! wave-maker theory (Dean and Dalrymple 1991, equation 6.26).
//!
//! `cargo run --release --example wave_maker [FOLDER]`
#![expect(clippy::print_stdout, reason = "a program that says what it measured")]

use std::{env, error::Error, f64::consts::TAU, path::PathBuf};
use swell::files::SceneBuilder;

use swell::{
    cache::CacheReader,
    domain::motion::{piston_height_ratio, wave_number},
    scene::Wall,
    stage::device::Device,
};

const DEPTH: f64 = 0.5;
const PERIOD: f64 = 1.5;
const STROKE: f64 = 0.08;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = env::args()
        .nth(1)
        .unwrap_or_else(|| "cache/example".to_owned());
    let cache = PathBuf::from(folder).join("waves");
    let scene = SceneBuilder::new("waves")
        .frames(96, 24.0)
        .domain([0.0; 3], [8.0, 0.9, 0.3])
        .block([0.0; 3], [8.0, DEPTH, 0.3])
        .wave_maker(
            Wall::NEG_X,
            &format!(r#"kind = "sine", stroke = {STROKE}, period = {PERIOD}, ramp = {PERIOD}"#),
        )
        .push("probe", "kind = \"elevation\"\nat = [2.0, 0.15]")
        .flip(0.1)
        .build()?;
    swell::bake(&scene).to(&cache).device(Device::Cpu).run()?;

    let text = std::fs::read_to_string(cache.join("probes/elevation-1.csv"))?;
    let mut names = text.lines().next().unwrap_or_default().split(',');
    let column = names
        .position(|name| name == "elevation_m")
        .ok_or("no elevation")?;
    let elevations: Vec<f64> = (text.lines().skip(1))
        .filter_map(|line| line.split(',').nth(column)?.parse().ok())
        .collect();
    let last = &elevations[elevations.len().saturating_sub(36)..];
    let highest = last.iter().copied().fold(f64::MIN, f64::max);
    let lowest = last.iter().copied().fold(f64::MAX, f64::min);
    let k = wave_number(TAU / PERIOD, DEPTH, 9.81);
    let (found, expected) = (highest - lowest, STROKE * piston_height_ratio(k, DEPTH));
    println!(
        "{} frames; waves {found:.3} m high, by theory {expected:.3} m",
        CacheReader::open(&cache)?.last_frame(),
    );
    // The waves are nine tenths of a cell high: an error of 3 % was measured, and five times that is
    // allowed.
    if (found / expected - 1.0).abs() < 0.15 {
        Ok(())
    } else {
        Err("the waves are not those of the theory".into())
    }
}
