//! Bakes a column of water that collapses, and renders three of its frames.
//!
//! `cargo run --release --example bake_and_render [FOLDER]`
#![expect(clippy::print_stdout, reason = "a program that says what it made")]

use std::{env, error::Error, path::PathBuf};

use swell::{
    scene::{Scene, look::Look},
    stage::{bake, render},
};

const LOOK: &str = r#"
[image]
width = 320
height = 180
[[camera.keyframe]]
frame = 1
position = [4.5, 1.8, 3.5]
target = [1.0, 0.4, 0.5]
[water]
absorption_per_metre = [1.5, 0.62, 0.55]
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(
        env::args()
            .nth(1)
            .unwrap_or_else(|| "cache/example".to_owned()),
    );
    let scene = Scene::builder("drop")
        .frames(24, 24.0)
        .domain([0.0; 3], [2.0, 2.0, 1.0])
        .block([0.0; 3], [0.5, 1.0, 1.0])
        .pbf(0.05)
        .build()?;
    let cache = folder.join("drop");
    swell::bake(&scene)
        .to(&cache)
        .on_event(|event| match event {
            bake::Event::Ready {
                device, particles, ..
            } => {
                println!("{particles} particles on {device}");
            }
            bake::Event::Frame { frame, report, .. } => {
                println!("frame {frame}: {:.2} m/s", report.max_speed);
            }
            bake::Event::Written { .. } => {}
        })
        .run()?;

    let look = Look::parse(LOOK, "look.toml".as_ref())?;
    swell::render(&cache, &look)
        .frames(22..=24)
        .to(folder.join("pictures"))
        .on_event(|event| {
            if let render::Event::Frame { frame, seconds, .. } = event {
                println!("picture {frame}: {seconds:.2} s");
            }
        })
        .run()?;
    println!("{}", folder.display());
    Ok(())
}
