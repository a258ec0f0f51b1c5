//! Runs the `swell` binary in a temporary folder.
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use swell::cache::directory_hash;
use tempfile::TempDir;

const SCENE: &str = r#"
[shot]
name = "small"
frames = 8
frames_per_second = 60

[domain]
min = [-1.0, 0.5, 0.25]
max = [1.0, 2.5, 1.25]

[[water.block]]
min = [-1.0, 0.5, 0.25]
max = [-0.2, 1.5, 1.25]

[[solid]]
mesh = "box.obj"

[[wave_maker]]
wall = "-x"
motion = { kind = "sine", stroke = 0.3, period = 0.5, ramp = 0.1 }

[solver]
method = "pbf"

[solver.pbf]
particle_spacing = 0.1

[solver.flip]
cell_size = 0.2

[effects]
viscosity = { xsph = 0.02 }
"#;

const BOX: &str = "v 0.3 0.5 0.5\nv 0.7 0.5 0.5\nv 0.7 1.0 0.5\nv 0.3 1.0 0.5\n\
    v 0.3 0.5 0.9\nv 0.7 0.5 0.9\nv 0.7 1.0 0.9\nv 0.3 1.0 0.9\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n";

pub const LOOK: &str = r#"
[camera]
focal_length_mm = 35.0
film_back_mm = [36.0, 20.25]
position = [-2.0, 3.0, 2.5]
target = [0.0, 1.0, 0.75]

[image]
width = 64
height = 36
samples = 1

[sky]
model = "hosek_wilkie"

[sun]
azimuth_degrees = 120.0
elevation_degrees = 35.0

[output]
formats = ["png", "exr"]
aovs = ["Z"]
"#;

const STUDY: &str = r#"
kind = "solver_comparison"
scene = "small.toml"
look = "look.toml"
solvers = ["pbf", "flip"]
frames = "1-6"
pictures = "3-6x3"
"#;

/// A temporary folder in which the program runs: a scene, its mesh, two looks and a study.
pub struct Job {
    pub folder: TempDir,
}

impl Job {
    pub fn new() -> Self {
        Self::of(&[
            ("small.toml", SCENE),
            ("box.obj", BOX),
            ("look.toml", LOOK),
            ("study.toml", STUDY),
            ("wide.toml", &LOOK.replace("35.0", "24.0")),
        ])
    }

    /// Like [`Self::new`], but on the disk of the build directory, where writing takes time:
    /// temporary folders may be in memory.
    pub fn on_disk() -> Self {
        let disk = Self {
            folder: TempDir::new_in(env!("CARGO_TARGET_TMPDIR")).unwrap(),
        };
        let new = Self::new();
        for entry in fs::read_dir(new.folder.path()).unwrap() {
            let entry = entry.unwrap();
            fs::copy(entry.path(), disk.folder.path().join(entry.file_name())).unwrap();
        }
        disk
    }

    /// A folder with these files, given as name and text.
    pub fn of(files: &[(&str, &str)]) -> Self {
        let job = Self {
            folder: TempDir::new().unwrap(),
        };
        for (name, text) in files {
            job.write(name, text);
        }
        job
    }

    pub fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    /// Copies the shipped shaders into a folder, for edits.
    pub fn copy_shaders(&self, folder: &str) {
        copy(
            &Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders"),
            &self.path(folder),
        );
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn edit(&self, file: &str, from: &str, to: &str) {
        let text = fs::read_to_string(self.path(file)).unwrap();
        assert!(text.contains(from), "{from}");
        fs::write(self.path(file), text.replace(from, to)).unwrap();
    }

    pub fn command(&self, words: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_swell"));
        command
            .current_dir(self.folder.path())
            .args(words.split_whitespace());
        command
    }

    pub fn run(&self, words: &str) -> Output {
        self.command(words).output().unwrap()
    }

    /// Runs the program, expects an exit code, and returns standard output followed by standard
    /// error.
    pub fn expect(&self, code: i32, words: &str) -> String {
        let output = self.run(words);
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8_lossy(&said).into_owned();
        assert_eq!(output.status.code(), Some(code), "swell {words}: {said}");
        said
    }

    /// Like [`Self::expect`], for an error that is reported in exactly one line; the output
    /// contains `part`.
    pub fn expect_clear(&self, code: i32, words: &str, part: &str) {
        let said = self.expect(code, words);
        assert!(said.contains(part), "{words}: {said}");
        let is_fault = |line: &&str| line.starts_with("swell: ") || line.starts_with("error: ");
        assert_eq!(said.lines().filter(is_fault).count(), 1, "{said}");
    }

    /// Runs the program with `--json`; standard output must be one JSON object and nothing else.
    pub fn json(&self, code: i32, words: &str) -> serde_json::Value {
        let output = self.run(&format!("{words} --json"));
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "swell {words}: {said}");
        serde_json::from_slice(&output.stdout).unwrap()
    }

    pub fn hash(&self, cache: &str) -> String {
        directory_hash(&self.path(cache)).unwrap()
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// Asserts that `said` contains every string of `words`.
pub fn assert_has(said: &str, words: &[&str]) {
    for word in words {
        assert!(said.contains(word), "no {word:?} in: {said}");
    }
}
