//! The program's environment: missing adapters, streams that cannot be written, and paths that are
//! not UTF-8. Each command runs as a process of its own.

use std::{
    ffi::OsStr,
    fs::{self, File, OpenOptions},
    io,
    os::unix::ffi::OsStrExt as _,
    path::PathBuf,
    process::{Command, Stdio},
};

use crate::support::job::{Job, LOOK, assert_has};

/// A study that runs nothing: its only case is a refused scene.
const REFUSAL: &str = r#"
kind = "stability"
[[case]]
number = 1
name = "a name that is none"
scene = "small.toml"
devices = ["cpu"]
set = ["shot.name=../up"]
refused = ["not a safe file name"]
"#;

/// A job with a baked frame in `cache/small/pbf`.
fn baked() -> Job {
    let job = Job::new();
    job.write("refusal.toml", REFUSAL);
    job.expect(0, "bake small.toml --frames 1-1 --device cpu");
    job
}

/// The number of adapters, and indices that none of them has: the next one, and
/// numbers in their names.
fn numbers(job: &Job) -> (usize, Vec<String>) {
    let listed = job.expect(0, "inspect --adapters");
    let names: Vec<&str> = listed
        .lines()
        .filter(|line| !line.starts_with(' '))
        .collect();
    let runs = names.iter().flat_map(|name| {
        let (_, name) = name.split_once(": ").unwrap();
        name.split(|c: char| !c.is_ascii_digit())
    });
    let is_none = |run: &&str| run.parse().is_ok_and(|number: usize| number >= names.len());
    let mut none: Vec<String> = runs.filter(is_none).map(str::to_owned).collect();
    none.push(names.len().to_string());
    none.sort();
    none.dedup();
    (names.len(), none)
}

#[test]
fn an_adapter_that_is_not_there_is_refused_by_every_command() {
    let job = baked();
    let before = job.hash("cache");
    let (count, numbers) = numbers(&job);
    for (k, number) in numbers.iter().enumerate() {
        let commands = [
            "bake small.toml -o new",
            "bake small.toml --resume",
            "check small.toml",
            "check cache/small/pbf",
            "render cache/small/pbf --look look.toml -o new",
            "inspect small.toml",
            "study study.toml -o new",
            // Uses only the CPU, or no device: an unknown adapter is still an error.
            "study refusal.toml -o new",
        ];
        // The first number runs all commands, further numbers one.
        for command in &commands[..if k == 0 { commands.len() } else { 1 }] {
            let said = job.expect(2, &format!("{command} --adapter {number}"));
            assert_has(
                &said,
                &[&format!("no adapter matches `{number}`"), "\n  0: "],
            );
            let lines = said.lines().filter(|line| line.starts_with("  ")).count();
            assert_eq!(lines, count, "a line an adapter: {said}");
            assert!(!job.path("new").exists(), "{command} has written something");
        }
    }
    assert_eq!(job.hash("cache"), before);
    // Negative controls: the index of an existing adapter, and a device that a study cannot name.
    job.expect(0, "check small.toml --adapter 0");
    job.write("device.toml", &REFUSAL.replace("\"cpu\"", "\"5\""));
    let said = job.expect(2, "study device.toml");
    assert_has(&said, &["case[0].devices[0]", "\"5\" is not a device"]);
    // The cache records the adapter that it was baked on.
    let said = job.expect(2, "inspect cache/small/pbf --adapter 0");
    assert_has(&said, &["--adapter is for scenes"]);
}

/// A device that rejects every byte.
fn full() -> File {
    OpenOptions::new().write(true).open("/dev/full").unwrap()
}

#[test]
fn standard_output_that_takes_nothing_is_exit_code_4() {
    let job = baked();
    job.expect(0, "render cache/small/pbf --look look.toml -o a --frames 1");
    for command in [
        "--help",
        "--version",
        "bake --help",
        "keys",
        "inspect --adapters",
        "inspect small.toml",
        "inspect cache/small/pbf",
        "verify cache/small/pbf",
        "check small.toml --progress none",
        "check small.toml --json --progress none",
        "diff cache/small/pbf cache/small/pbf",
        "diff cache/small/pbf cache/small/pbf --json",
        "diff a a --json",
        "diff cache/small/pbf --write-baseline b.json",
        "bake small.toml -o json --device cpu --frames 1 --progress json",
        "bake small.toml -o timed --frames 1 --time-passes --progress none",
        "render cache/small/pbf --look look.toml -o b --frames 1 --progress json",
        "study refusal.toml -o s --progress json",
    ] {
        let output = job.command(command).stdout(full()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(4), "{command}: {said}");
        assert_has(&said, &["cannot write to standard output: No space left"]);
    }
    // The work itself was done.
    for cache in ["json", "timed"] {
        assert_has(
            &job.expect(0, &format!("verify {cache}")),
            &["ok: 1 frame,"],
        );
    }
    assert!(job.path("b/small.0001.png").exists() && job.path("s/index.html").exists());
    // A more serious fault keeps its exit code: usage errors, and a missing cache.
    for (code, command) in [
        (2, "bake none.toml --progress json"),
        (4, "verify none"),
        (2, "bake small.toml -o new --adapter 999 --progress json"),
    ] {
        let status = job.command(command).stdout(full()).status().unwrap();
        assert_eq!(status.code(), Some(code), "{command}");
    }
}

#[test]
fn standard_error_that_takes_nothing_ends_no_work() {
    let job = baked();
    for (code, command) in [
        (
            4,
            "bake small.toml -o plain --device cpu --frames 1 --progress plain",
        ),
        (4, "render cache/small/pbf --look look.toml -o c --frames 1"),
        (4, "study refusal.toml -o s"),
        // The fault cannot be printed, but its exit code is kept.
        (2, "bake none.toml"),
        (2, "bake small.toml --frames none"),
        (0, "verify cache/small/pbf"),
    ] {
        let status = job.command(command).stderr(full()).status().unwrap();
        assert_eq!(status.code(), Some(code), "{command}");
    }
    job.expect(0, "verify plain");
    assert!(job.path("c/small.0001.png").exists());
}

#[test]
fn a_closed_pipe_is_no_fault() {
    let job = baked();
    job.expect(
        0,
        "bake small.toml -o other --device cpu --frames 1 --set water.gravity=[0,-9,0]",
    );
    let closed = |command: &str| {
        let (reader, writer) = io::pipe().unwrap();
        drop(reader);
        let mut command = job.command(command);
        let output = command.stdout(writer).stderr(Stdio::piped()).output();
        let output = output.unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), said)
    };
    for (code, command) in [
        (0, "--help"),
        (0, "inspect small.toml"),
        (0, "verify cache/small/pbf"),
        (0, "diff cache/small/pbf cache/small/pbf --json"),
        // The result is the exit code, whether or not anyone reads the output.
        (1, "diff cache/small/pbf other"),
    ] {
        let (found, said) = closed(command);
        assert_eq!(found, Some(code), "{command}: {said}");
        assert!(!said.contains("cannot write"), "{said}");
    }
    // Events must be complete, so a closed pipe is an error.
    for command in [
        "bake small.toml -o json --device cpu --frames 1-2 --progress json",
        "study refusal.toml -o s --progress json",
    ] {
        let (found, said) = closed(command);
        assert_eq!(found, Some(4), "{command}: {said}");
        assert_has(&said, &["cannot write to standard output: Broken pipe"]);
    }
    assert_has(&job.expect(0, "verify json"), &["ok: 2 frames"]);
}

/// `café` in Latin-1.
fn latin(job: &Job, name: &[u8]) -> PathBuf {
    let folder = job.folder.path().join(OsStr::from_bytes(b"caf\xe9"));
    fs::create_dir_all(&folder).unwrap();
    folder.join(OsStr::from_bytes(name))
}

/// Runs a command with paths inserted at each `@` of its words.
fn with_paths(job: &Job, words: &str, paths: &[&PathBuf]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_swell"));
    command.current_dir(job.folder.path());
    let mut paths = paths.iter();
    for word in words.split_whitespace() {
        match word {
            "@" => command.arg(paths.next().unwrap()),
            word => command.arg(word),
        };
    }
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{words}: {said}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn paths_need_not_be_utf_8() {
    let job = baked();
    let path = |name: &str| latin(&job, name.as_bytes());
    let [scene, look, cache, other, pictures, more] = [
        "sc\u{e8}ne.toml",
        "look.toml",
        "cache",
        "other",
        "pictures",
        "more",
    ]
    .map(path);
    fs::copy(job.path("small.toml"), &scene).unwrap();
    fs::copy(job.path("box.obj"), path("box.obj")).unwrap();
    fs::write(&look, LOOK).unwrap();
    let lossy = "caf\u{fffd}";
    for folder in [&cache, &other] {
        let words = "bake @ -o @ --device cpu --frames 1 --progress json";
        let told = with_paths(&job, words, &[&scene, folder]);
        let end: serde_json::Value = serde_json::from_str(told.lines().last().unwrap()).unwrap();
        assert!(end["directory"].as_str().unwrap().contains(lossy), "{told}");
    }
    let same = with_paths(&job, "diff @ @ --json", &[&cache, &other]);
    let same: serde_json::Value = serde_json::from_str(&same).unwrap();
    assert!(same["a"].as_str().unwrap().contains(lossy), "{same}");
    assert_eq!(same["is_within"], true);
    let mut from = cache.clone().into_os_string();
    from.push(":1");
    let words = "bake @ --from @ -o @ --device cpu --frames 2";
    with_paths(&job, words, &[&scene, &from.into(), &path("branch")]);
    for words in ["verify @", "inspect @", "check @ --progress none"] {
        with_paths(&job, words, &[&cache]);
    }
    for folder in [&pictures, &more] {
        let words = "render @ --look @ -o @ --frames 1 --progress json";
        let told = with_paths(&job, words, &[&cache, &look, folder]);
        let end: serde_json::Value = serde_json::from_str(told.lines().last().unwrap()).unwrap();
        assert!(end["directory"].as_str().unwrap().contains(lossy), "{told}");
    }
    // With difference images, whose paths are printed as well.
    let words = "diff @ @ -o @ --json";
    let same = with_paths(&job, words, &[&pictures, &more, &path("difference")]);
    let same: serde_json::Value = serde_json::from_str(&same).unwrap();
    let image = same["diff"]["pairs"][0]["image"].as_str().unwrap();
    assert!(image.contains(lossy), "{same}");
    let told = with_paths(
        &job,
        "study refusal.toml -o @ --progress json",
        &[&path("study")],
    );
    let end: serde_json::Value = serde_json::from_str(told.lines().last().unwrap()).unwrap();
    assert!(end["page"].as_str().unwrap().contains(lossy), "{told}");
}
