//! What `swell --version` says of the build: commit, target, profile, features.
//!
//! Runs again where the sources or the commit have changed, and not otherwise.

use std::{
    env,
    path::{Path, PathBuf},
    process::Command,
};

/// What the program is made of.
const SOURCES: [&str; 5] = ["build.rs", "Cargo.toml", "Cargo.lock", "src", "shaders"];

fn main() {
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let watched = SOURCES.map(|name| root.join(name)).into_iter();
    // A path that is not there would have every build run this again.
    for path in watched.chain(heads(&root)).filter(|path| path.exists()) {
        println!("cargo::rerun-if-changed={}", path.display());
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

/// The commit of a tree, and whether its sources were edited since; in words that there is none to be known.
pub fn commit(root: &Path) -> String {
    let Some(commit) = git(root, &["rev-parse", "HEAD"]).filter(|_| is_own(root)) else {
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

/// Files that change with the commit.
pub fn heads(root: &Path) -> Vec<PathBuf> {
    if !is_own(root) {
        return Vec::new();
    }
    let branch = git(root, &["symbolic-ref", "--quiet", "HEAD"]);
    let names = ["HEAD", "logs/HEAD", "packed-refs"].map(str::to_owned);
    let paths = names.into_iter().chain(branch).filter_map(|name| {
        let path = git(root, &["rev-parse", "--git-path", &name])?;
        Some(root.join(path))
    });
    paths.collect()
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
