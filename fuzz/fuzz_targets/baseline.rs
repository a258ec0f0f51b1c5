//! Fuzzes the stored baseline of `swell diff`.
#![no_main]

use libfuzzer_sys::fuzz_target;
use swell::compare::baseline::Baseline;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(baseline) = serde_json::from_slice::<Baseline>(bytes)
        && baseline.check().is_ok()
    {
        let _ = baseline.compare(Some("an adapter"), &[]);
    }
});
