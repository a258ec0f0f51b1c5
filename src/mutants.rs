//! Faults that `tools/mutants` switches on at run time, one at a time; compiled with the feature `mutants` alone.
//!
//! The tool builds a copy of the tree in which each listed expression has become
//! `if crate::mutants::on(N) { mutated } else { original }`, so that one build holds every fault.

use std::{env, fs, path::Path, sync::LazyLock};

static ON: LazyLock<Option<u32>> = LazyLock::new(|| {
    let text = env::var("SWELL_MUTANT").ok()?;
    Some(text.parse().expect("SWELL_MUTANT is a number"))
});

static SHADERS: LazyLock<Option<std::ffi::OsString>> =
    LazyLock::new(|| env::var_os("SWELL_SHADERS"));

/// Whether the environment variable `SWELL_MUTANT` names this fault.
pub fn on(number: u32) -> bool {
    *ON == Some(number)
}

/// Text of a shader in the folder that the environment variable `SWELL_SHADERS` names; `None` where it names none.
///
/// # Panics
/// Where the folder does not hold the file: the embedded one would be a fault that nobody sees.
pub(crate) fn shader(path: &str) -> Option<String> {
    let folder = SHADERS.as_ref()?;
    let file = Path::new(folder).join(path);
    let text =
        fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    Some(text)
}
