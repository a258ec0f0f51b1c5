//! What the program says about itself: version and build, completions, man pages.

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
};

use crate::support::job::{Job, assert_has};

/// The build script, whose results `swell --version` prints.
#[path = "../../../build.rs"]
#[allow(dead_code, reason = "cargo runs the rest")]
mod build;

const COMMANDS: [&str; 15] = [
    "bake",
    "render",
    "export",
    "study",
    "tune",
    "view",
    "whitewater",
    "wet",
    "check",
    "inspect",
    "diff",
    "keys",
    "verify",
    "completions",
    "man",
];

#[test]
fn the_version_is_short_or_says_what_was_built() {
    let job = Job::of(&[]);
    let short = format!("swell {}\n", env!("CARGO_PKG_VERSION"));
    assert_eq!(job.expect(0, "-V"), short);
    let long = job.expect(0, "--version");
    assert!(long.starts_with(&short), "{long}");
    let value = |name: &str| {
        let mut lines = long.lines();
        let found = lines.find_map(|line| line.strip_prefix(&format!("{name}: ")));
        found.unwrap_or_else(|| panic!("{name}: {long}"))
    };
    let commit = value("commit");
    let hash = commit.split([' ', ',']).next().unwrap();
    let is_hash = hash.len() >= 40 && hash.chars().all(|c| c.is_ascii_hexdigit());
    assert!(is_hash || hash == "unknown", "{commit}");
    assert_has(value("target"), &[std::env::consts::ARCH]);
    assert!(matches!(value("profile"), "release" | "debug"), "{long}");
    assert_eq!(value("features"), "charts, perceptual");
}

fn git(folder: &Path, words: &str) -> String {
    let output = Command::new("git")
        .current_dir(folder)
        .args(["-c", "user.name=a", "-c", "user.email=a@b"])
        .args(words.split(' '))
        .output()
        .unwrap();
    assert!(output.status.success(), "git {words}: {output:?}");
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

#[test]
fn the_build_knows_its_commit_where_there_is_one() {
    let job = Job::of(&[("Cargo.toml", "1"), ("notes.txt", "1")]);
    let root = job.folder.path();
    fs::create_dir(job.path("src")).unwrap();
    job.write("src/lib.rs", "");
    let unknown = "unknown (built from a tree without git)";
    assert_eq!(build::commit(root), unknown);
    git(root, "init -q");
    assert_eq!(build::commit(root), unknown, "no commit yet");
    git(root, "add -A");
    git(root, "commit -q -m one");
    let commit = git(root, "rev-parse HEAD");
    assert_eq!(build::commit(root), commit);
    job.write("notes.txt", "2");
    assert_eq!(build::commit(root), commit, "not of the program");
    git(root, "commit -q -a -m notes");
    assert_eq!(build::commit(root), commit, "it changed no source");
    job.write("src/lib.rs", "//!");
    assert_eq!(build::commit(root), format!("{commit} with edited sources"));
    git(root, "commit -q -a -m two");
    assert_eq!(build::commit(root), git(root, "rev-parse HEAD"));
    assert_ne!(build::commit(root), commit);
    // An archive within another repository has none of its commits.
    assert_eq!(build::commit(&job.path("src")), unknown);
}

#[test]
fn completions_know_commands_and_options() {
    let job = Job::of(&[]);
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = job.expect(0, &format!("completions {shell}"));
        assert_has(&script, &COMMANDS);
        assert_has(&script, &["keep-going", "chunk"]);
    }
    assert_has(&job.expect(2, "completions tcsh"), &["tcsh", "bash"]);
    // Runs the completions in bash itself, if there is one.
    let mut bash = Command::new("bash");
    let tried = bash.arg("--version").stdout(Stdio::null()).status();
    if !tried.is_ok_and(|status| status.success()) {
        println!("no bash here: its completions were not run");
        return;
    }
    job.write("complete", &job.expect(0, "completions bash"));
    let complete = |words: &str| {
        let script = format!(
            "source ./complete; COMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); \
             _swell swell \"${{COMP_WORDS[COMP_CWORD]}}\" \"${{COMP_WORDS[COMP_CWORD - 1]}}\"; \
             echo \"${{COMPREPLY[*]}}\""
        );
        let mut bash = Command::new("bash");
        let output = bash.current_dir(job.folder.path()).args(["-c", &script]);
        String::from_utf8(output.output().unwrap().stdout).unwrap()
    };
    assert_eq!(complete("swell ren").trim(), "render");
    assert_eq!(complete("swell render --keep").trim(), "--keep-going");
    assert_eq!(complete("swell nothing").trim(), "");
}

#[test]
fn each_command_has_a_man_page() {
    let job = Job::of(&[]);
    job.expect(0, "man pages/man1");
    for name in COMMANDS {
        let page = fs::read_to_string(job.path(&format!("pages/man1/swell-{name}.1"))).unwrap();
        assert!(page.contains(".SH NAME"), "{name}");
        assert_eq!(
            page.contains("keep\\-going"),
            matches!(name, "render" | "export"),
            "{name}"
        );
    }
    let page = fs::read_to_string(job.path("pages/man1/swell.1")).unwrap();
    assert_has(&page, &["swell\\-render(1)", "Exit codes"]);
    job.write("file", "");
    let said = job.expect(4, "man file");
    assert_has(&said, &["cannot write to file"]);
    assert_eq!(said.lines().count(), 1, "{said}");
}
