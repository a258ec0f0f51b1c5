//! A frame of a cache: what is read could be written.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use swell::cache::frame;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(particles) = frame::decode(bytes, Path::new("frame")) {
        frame::check(&particles).expect("what was read fits a frame");
    }
});
