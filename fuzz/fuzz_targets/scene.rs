//! A scene file: any text is a scene or a refusal.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use swell::scene::Scene;

fuzz_target!(|text: &str| {
    let _ = Scene::parse(text, Path::new("scene.toml"), Path::new("/nowhere"), &[]);
});
