//! The `swell` command.

use std::{env, process::ExitCode};

/// Version, commit, target, profile and features of this build.
const BUILD: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\ncommit: ",
    env!("SWELL_COMMIT"),
    "\ntarget: ",
    env!("SWELL_TARGET"),
    "\nprofile: ",
    env!("SWELL_PROFILE"),
    "\nfeatures: ",
    env!("SWELL_FEATURES"),
);

fn main() -> ExitCode {
    // Without a desktop session, Mesa's device-select layer prints two lines that look like a
    // failure of ours.
    if env::var_os("XDG_RUNTIME_DIR").is_none() && env::var_os("NODEVICE_SELECT").is_none() {
        // SAFETY: no other thread runs yet.
        unsafe { env::set_var("NODEVICE_SELECT", "1") };
    }
    swell::cli::main(BUILD)
}
