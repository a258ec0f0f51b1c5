//! Bakes a column of water that collapses, and renders three of its frames.
//!
//! `cargo run --release --example bake_and_render [FOLDER]`
#![expect(clippy::print_stdout, reason = "a program that says what it made")]

use std::{
    env,
    error::Error,
    path::{Path, PathBuf},
};

use swell::{
    files::{Reach, SceneBuilder, load_look_with},
    stage::{bake, render},
};

/// The shipped look by day, with another camera and a smaller picture.
const CHANGES: [&str; 4] = [
    "image.width=320",
    "image.height=180",
    "basin.height_m=0.1",
    "camera.keyframe=[{frame=1,position=[3.2,1.6,2.9],target=[1.2,0.35,0.5]}]",
];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(
        env::args()
            .nth(1)
            .unwrap_or_else(|| "cache/example".to_owned()),
    );
    let scene = SceneBuilder::new("drop")
        .frames(24, 24.0)
        .domain([0.0; 3], [2.0, 2.0, 1.0])
        .block([0.0; 3], [0.8, 0.6, 1.0])
        .pbf(0.05)
        .build()?;
    let cache = folder.join("drop");
    swell::bake(&scene)
        .to(&cache)
        .on_event(|event| match event {
            bake::BakeEvent::Ready {
                device, particles, ..
            } => {
                println!("{particles} particles on {device}");
            }
            bake::BakeEvent::Frame { frame, report, .. } => {
                println!("frame {frame}: {:.2} m/s", report.max_speed);
            }
            bake::BakeEvent::Written { .. } => {}
        })
        .run()?;

    let day = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/looks/day.toml");
    let look = load_look_with(&day, &CHANGES.map(str::to_owned), Reach::Folder)?;
    swell::render(&cache, &look)
        .frames(22..=24)
        .to(folder.join("pictures"))
        .on_event(|event| {
            if let render::RenderEvent::Frame { frame, seconds, .. } = event {
                println!("picture {frame}: {seconds:.2} s");
            }
        })
        .run()?;
    println!("{}", folder.display());
    Ok(())
}
