//! One flipped bit in each file of a cache: every command that reads the file names it and exits
//! with code 4. Also compares the contents of a ledger with the frames beside it.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::support::job::Job;
use swell::{cache::CacheReader, domain::solver::StepReport};

const WATCHED: &str = r#"
[grids]
surface = true

[[probe]]
kind = "energy"

[effects]"#;

const BAKE: &str = "bake small.toml --device cpu";

fn job() -> Job {
    let job = Job::new();
    job.edit("small.toml", "[effects]", WATCHED);
    job
}

/// Flips a bit in the middle of a file and returns the original bytes.
fn flip(file: &Path) -> Vec<u8> {
    let sound = fs::read(file).unwrap();
    let mut bytes = sound.clone();
    bytes[sound.len() / 2] ^= 1;
    fs::write(file, bytes).unwrap();
    sound
}

fn name(file: &Path) -> String {
    file.file_name().unwrap().to_string_lossy().into_owned()
}

/// Returns the only file of a folder.
fn only(folder: &Path) -> PathBuf {
    let mut files = fs::read_dir(folder).unwrap();
    let file = files.next().unwrap().unwrap().path();
    assert!(files.next().is_none());
    file
}

#[test]
fn each_command_refuses_the_files_that_it_reads() {
    let job = job();
    job.expect(0, &format!("{BAKE} -o sound --frames 1-2"));
    job.expect(0, &format!("{BAKE} -o cache --frames 1-2"));
    let branch = format!("{BAKE} --from cache:2 -o branch --frames 1-3");
    let resume = format!("{BAKE} -o cache --resume --frames 1-3");
    let verify = "verify cache";
    let render = "render cache --look look.toml -o pictures --overwrite";
    let check = "check cache --frames 0,1,2";
    let diff = "diff cache sound";
    let plot = "inspect cache --plot plots";
    let all = [
        verify,
        "inspect cache",
        plot,
        render,
        check,
        diff,
        &branch,
        &resume,
    ];
    let mesh = only(&job.path("cache/assets"));
    let mesh = format!("assets/{}", name(&mesh));
    let files: [(&str, &[&str]); 10] = [
        ("manifest.json", &all),
        ("scene.toml", &all),
        (&mesh, &all),
        ("frames.jsonl", &all),
        ("frames/small.0000.ply", &[verify, check, diff]),
        ("frames/small.0001.ply", &[verify, render, check, diff]),
        (
            "frames/small.0002.ply",
            &[verify, render, check, diff, &branch, &resume],
        ),
        // A resume starts from the last frame; of earlier frames it checks only the lengths.
        ("grids/small.0001.vdb", &[verify]),
        ("grids/small.0002.vdb", &[verify, &resume]),
        // A resume rewrites it from the ledger.
        ("probes/energy-1.csv", &[verify]),
    ];
    for (file, commands) in files {
        let path = job.path("cache").join(file);
        let sound = flip(&path);
        let before = job.hash("cache");
        for command in commands {
            let said = job.expect(4, command);
            assert!(
                said.contains(&name(&path)),
                "{file}, swell {command}: {said}"
            );
        }
        assert_eq!(job.hash("cache"), before, "{file}: refused untouched");
        fs::remove_file(&path).unwrap();
        let said = job.expect(4, verify);
        assert!(said.contains("cache"), "{file} is missing: {said}");
        fs::write(path, sound).unwrap();
    }
    // Negative control: on an undamaged cache every command succeeds.
    for command in all {
        job.expect(0, command);
    }
    assert_eq!(job.hash("branch/grids"), {
        fs::remove_file(job.path("cache/grids/small.0000.vdb")).unwrap();
        fs::remove_file(job.path("cache/grids/small.0001.vdb")).unwrap();
        job.hash("cache/grids")
    });
}

#[test]
fn what_a_failed_frame_began_with_is_refused_damaged() {
    let job = job();
    job.expect(0, &format!("{BAKE} -o cache --frames 1-2"));
    let fast = "--resume --frames 1-3 --set budget.speed=0.2";
    job.expect(5, &format!("{BAKE} -o cache {fast}"));
    let failed = job.path("cache/failed");
    let mut files = ["scene.toml", "start.ply", "report.json"]
        .map(|name| failed.join(name))
        .to_vec();
    files.push(only(&job.path("cache/assets")));
    for file in files {
        let sound = flip(&file);
        for command in ["check cache/failed", "verify cache"] {
            let said = job.expect(4, command);
            assert!(said.contains(&name(&file)), "{command}: {said}");
        }
        fs::write(&file, sound).unwrap();
    }
    job.expect(5, "check cache/failed");
    let said = job.expect(0, "verify cache");
    assert!(said.contains("and the frame that failed"), "{said}");
    // As after a kill before the report, which is written last.
    fs::remove_file(failed.join("report.json")).unwrap();
    let said = job.expect(4, "verify cache");
    assert!(said.contains("report.json: it is missing"), "{said}");
}

/// Covers a bake from the start and one that was resumed.
#[test]
fn a_ledger_tells_the_clock_and_the_state_of_its_frames() {
    let job = job();
    job.expect(0, &format!("{BAKE} -o cache --frames 1-2"));
    job.expect(0, &format!("{BAKE} -o cache --resume --frames 1-4"));
    let cache = CacheReader::open(&job.path("cache")).unwrap();
    let manifest = cache.manifest();
    let mass = manifest.rest_density * manifest.particle_spacing.powi(3);
    let mut steps = 0;
    for entry in &cache.entries()[1..] {
        let report: StepReport = serde_json::from_value(entry.report.clone()).unwrap();
        let state = cache.read(entry.frame).unwrap();
        steps += u64::from(report.substeps);
        assert!(report.substeps > 0);
        assert_eq!(entry.clock.frame, entry.frame);
        assert_eq!(entry.clock.time, f64::from(entry.frame) / 60.0);
        assert_eq!(entry.clock.substeps, report.substeps);
        assert_eq!(entry.clock.steps, steps);
        assert_eq!(entry.particles, state.len() as u64);
        let squares = state.velocity.iter().map(|v| {
            let [x, y, z] = v.map(f64::from);
            x * x + y * y + z * z
        });
        let fastest = squares.clone().fold(0.0, f64::max).sqrt();
        // A sum of positive terms: one rounding per term, and three within each.
        let rounding = (state.len() + 3) as f64 * f64::EPSILON;
        let kinetic = 0.5 * mass * squares.sum::<f64>();
        assert!(kinetic > 0.0);
        assert!((report.kinetic_energy / kinetic - 1.0).abs() < rounding);
        // The squares may be summed in f32: four roundings, halved by the square root.
        assert!((report.max_speed / fastest - 1.0).abs() < 4.0 * f64::from(f32::EPSILON));
    }
}
