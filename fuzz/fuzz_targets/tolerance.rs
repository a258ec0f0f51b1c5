//! Fuzzes the parser of `swell diff`'s tolerance files.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use swell::files::tolerance;

fuzz_target!(|text: &str| {
    let _ = tolerance::parse(text, Path::new("tolerance.toml"));
});
