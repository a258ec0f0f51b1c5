//! Fuzzes the parser of study files.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use swell::files::study::Study;

fuzz_target!(|text: &str| {
    let _ = Study::parse(text, Path::new("study.toml"), Path::new("/nowhere"));
});
