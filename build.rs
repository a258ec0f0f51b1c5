//! Sets what `swell --version` prints about the build: commit, target, profile, features.
//!
//! Runs again only when the sources change, so that a commit of documentation alone recompiles
//! nothing. The output therefore describes the state at compile time.

use std::{
    env,
    path::{Path, PathBuf},
    process::Command,
};

/// Paths that the program is built from.
const SOURCES: [&str; 5] = ["build.rs", "Cargo.toml", "Cargo.lock", "src", "shaders"];

fn main() {
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    for name in SOURCES {
        println!("cargo::rerun-if-changed={name}");
    }
    let mut features: Vec<String> = env::vars()
        .filter_map(|(name, _)| Some(name.strip_prefix("CARGO_FEATURE_")?.to_lowercase()))
        .filter(|name| name != "default")
        .collect();
    features.sort();
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

/// The last commit that changed the sources of a tree, and whether they were edited since.
/// Describes in words what cannot be determined.
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

/// Whether the tree is the root of its repository: an archive may have been unpacked inside another
/// one.
fn is_own(root: &Path) -> bool {
    let top = git(root, &["rev-parse", "--show-toplevel"]).map(PathBuf::from);
    let same = |top: PathBuf| Some(top.canonicalize().ok()? == root.canonicalize().ok()?);
    top.and_then(same) == Some(true)
}

/// Output of git; `None` if git is missing or fails.
fn git(root: &Path, arguments: &[&str]) -> Option<String> {
    let output = Command::new("git")
        .arg("-C")
        .arg(root)
        .args(arguments)
        .output();
    let output = output.ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}
