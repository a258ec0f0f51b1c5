//! Fuzzes a frame of a cache, plain or compressed: whatever can be read could have been written.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use swell::cache::frame;

fuzz_target!(|bytes: &[u8]| {
    let plain = frame::decode(bytes, Path::new("frame")).ok();
    let packed = frame::planes::decode(bytes, Path::new("frame")).ok();
    let planes = frame::planes::read(bytes).ok();
    for particles in [plain, packed, planes].into_iter().flatten() {
        frame::check(&particles).expect("what was read fits a frame");
    }
});
