//! Faults that `tools/mutants` switches on at run time, one at a time; compiled with the feature `mutants` alone.
//!
//! The tool builds a copy of the tree in which each listed expression has become
//! `if crate::mutants::on(N) { mutated } else { original }`, so that one build holds every fault.

use std::{env, path::Path, sync::LazyLock};

use crate::gpu::shader::Shaders;

static ON: LazyLock<Option<u32>> = LazyLock::new(|| {
    let text = env::var("SWELL_MUTANT").ok()?;
    Some(text.parse().expect("SWELL_MUTANT is a number"))
});

static SHADERS: LazyLock<Option<Shaders>> = LazyLock::new(|| {
    let folder = env::var_os("SWELL_SHADERS")?;
    let read = Shaders::read(Path::new(&folder));
    Some(read.expect("the whole of shaders/").in_disguise())
});

/// Whether the environment variable `SWELL_MUTANT` names this fault.
pub fn on(number: u32) -> bool {
    *ON == Some(number)
}

/// Shaders of the folder that the environment variable `SWELL_SHADERS` names; `None` where it names none.
///
/// # Panics
/// Where the folder lacks a file: the embedded one would be a fault that nobody sees.
pub(crate) fn shaders() -> Option<Shaders> {
    SHADERS.clone()
}
