//! Fuzzes whitewater settings: any text gives an error that names the file, or settings that
//! survive being written and read again.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use swell::{
    domain::whitewater::Thresholds,
    files::whitewater::{WhitewaterSettings, written_out},
};

fuzz_target!(|text: &str| {
    let shot = Thresholds {
        trapped_air: [7.0, 30.0],
        wave_crest: [2.5, 9.0],
        energy: [0.5, 4.0],
    };
    let parse = |text: &str| WhitewaterSettings::parse(text, Path::new("w.toml"));
    match parse(text) {
        Ok(settings) => {
            let settled = settings.settled(0.1, &shot);
            let again = parse(&written_out(&settled)).expect("what was written");
            assert_eq!(again.settled(9.0, &shot), settled);
        }
        Err(error) => assert!(error.to_string().starts_with("w.toml")),
    }
});
