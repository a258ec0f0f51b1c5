//! Fuzzes the parser of scene files: any text gives a scene or an error.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use swell::scene::Scene;

fuzz_target!(|text: &str| {
    let _ = Scene::parse(text, Path::new("scene.toml"), Path::new("/nowhere"), &[]);
});
