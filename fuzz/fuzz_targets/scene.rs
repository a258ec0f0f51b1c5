//! Fuzzes the parser of scene files: any text gives a scene or an error.
#![no_main]

use std::path::Path;
use swell::files::parse_scene;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let _ = parse_scene(text, Path::new("scene.toml"), Path::new("/nowhere"), &[]);
});
