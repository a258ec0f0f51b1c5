//! What `swell --version` says of the build: commit, target, profile, features.
//!
//! Runs again where the sources have changed, and not otherwise: a commit of pages alone compiles nothing anew. What is said is what was so
//! when the program was compiled.

use std::{
    env,
    path::{Path, PathBuf},
    process::Command,
};

/// What the program is made of.
const SOURCES: [&str; 5] = ["build.rs", "Cargo.toml", "Cargo.lock", "src", "shaders"];

fn main() {
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    for name in SOURCES {
        println!("cargo::rerun-if-changed={name}");
    }
    let features: Vec<String> = env::vars()
        .filter_map(|(name, _)| Some(name.strip_prefix("CARGO_FEATURE_")?.to_lowercase()))
        .collect();
    let told = |name: &str| env::var(name).unwrap_or_else(|_| "unknown".to_owned());
    let features = match features.is_empty() {
        true => "none".to_owned(),
        false => features.join(", "),
    };
    for (name, value) in [
        ("SWELL_COMMIT", commit(&root)),
        ("SWELL_TARGET", told("TARGET")),
        ("SWELL_PROFILE", told("PROFILE")),
        ("SWELL_FEATURES", features),
    ] {
        println!("cargo::rustc-env={name}={value}");
    }
}

/// The last commit of a tree that changed its sources, and whether they were edited since; in words that there is none to be known.
pub fn commit(root: &Path) -> String {
    let log = ["log", "-1", "--format=%H", "--"];
    let commit = git(root, &[&log[..], &SOURCES].concat());
    let Some(commit) = commit.filter(|it| !it.is_empty() && is_own(root)) else {
        return "unknown (built from a tree without git)".to_owned();
    };
    let status = ["--no-optional-locks", "status", "--porcelain", "--"];
    let edited = git(root, &[&status[..], &SOURCES].concat());
    match edited.as_deref() {
        Some("") => commit,
        Some(_) => format!("{commit} with edited sources"),
        None => format!("{commit}, edited or not"),
    }
}

/// Whether the tree is a repository's: an archive may have been unpacked within another one.
fn is_own(root: &Path) -> bool {
    let top = git(root, &["rev-parse", "--show-toplevel"]).map(PathBuf::from);
    let same = |top: PathBuf| Some(top.canonicalize().ok()? == root.canonicalize().ok()?);
    top.and_then(same) == Some(true)
}

/// What git says; `None` where there is no git, or it says that something is wrong.
fn git(root: &Path, arguments: &[&str]) -> Option<String> {
    let output = Command::new("git")
        .arg("-C")
        .arg(root)
        .args(arguments)
        .output();
    let output = output.ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}
