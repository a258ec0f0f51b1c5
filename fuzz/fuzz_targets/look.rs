//! Fuzzes the parser of look files.
#![no_main]

use std::path::Path;
use swell::files::parse_look;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let _ = parse_look(text, Path::new("/nowhere/look.toml"));
});
