//! Fuzzes the parser of look files.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use swell::scene::look::Look;

fuzz_target!(|text: &str| {
    let _ = Look::parse(text, Path::new("/nowhere/look.toml"));
});
