//! Fuzzes the parser of look files.
#![no_main]

use swell::files::parse_look;
use std::path::Path;

use libfuzzer_sys::fuzz_target;
use swell::scene::look::Look;

fuzz_target!(|text: &str| {
    let _ = parse_look(text, Path::new("/nowhere/look.toml"));
});
