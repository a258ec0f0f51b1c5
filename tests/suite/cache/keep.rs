//! `[keep]`: which frames keep their particles, that a bake resumes from them with the same bytes,
//! and what commands report about the others.

use std::{
    fs,
    path::{Path, PathBuf},
};

use swell::{
    cache::{CacheError, CacheReader, CacheWriter, Clock, Manifest, directory_hash},
    domain::keep::Keep,
};

use crate::support::{
    cache::*,
    job::{Job, assert_has},
};

const LAST: u32 = 13;

fn manifest_of(keep: Keep) -> Manifest {
    Manifest {
        keep: Some(keep),
        ..manifest_of_all_streams()
    }
}

fn bake_kept(dir: &Path, keep: Keep, last: u32) {
    let clock = Clock::default();
    let (manifest, seen) = (manifest_of(keep), seen(clock));
    let start = start_of_all_streams();
    let writer =
        CacheWriter::create(dir, manifest, SCENE, &assets(), clock, &start, &seen).unwrap();
    go_on(writer, clock, start, last).unwrap();
}

/// Resumes a bake and returns the frame that it resumed from.
fn resume_kept(dir: &Path, keep: Keep) -> Result<u32, CacheError> {
    let (writer, entry, particles) = CacheWriter::resume(dir, &manifest_of(keep))?;
    let from = entry.frame;
    go_on(writer, entry.clock, particles, LAST)?;
    Ok(from)
}

fn frame_file(frame: u32) -> String {
    format!("frames/tank.{frame:04}.ply")
}

fn frames_there(dir: &Path) -> Vec<u32> {
    let is_there = |frame: &u32| dir.join(frame_file(*frame)).is_file();
    (0..=LAST).filter(is_there).collect()
}

const CASES: [(Keep, &[u32]); 3] = [
    (Keep::Every(5), &[0, 5, 10, LAST]),
    (Keep::Newest, &[0, LAST]),
    (Keep::Every(50), &[0, LAST]),
];

#[test]
fn particles_stay_of_the_frames_that_are_kept_and_all_else_of_every_frame() {
    let all = tempfile::tempdir().unwrap();
    bake_all_streams(all.path(), LAST);
    let of_all = CacheReader::open(all.path()).unwrap();
    assert_eq!(frames_there(all.path()).len(), LAST as usize + 1, "control");
    for (keep, kept) in CASES {
        let dir = tempfile::tempdir().unwrap();
        let d = dir.path();
        bake_kept(d, keep, LAST);
        assert_eq!(frames_there(d), kept, "{keep}");
        let reader = CacheReader::open(d).unwrap();
        let report = reader.verify().unwrap();
        assert_eq!((report.frames, &report.kept[..]), (LAST, kept));
        assert!(report.bytes < of_all.verify().unwrap().bytes);
        // The ledger lists every frame, including the particles' checksums; grids and
        // probes are complete.
        for (entry, other) in reader.entries().iter().zip(of_all.entries()) {
            assert_eq!((&entry.files, &entry.rows), (&other.files, &other.rows));
            assert_eq!((entry.clock, &entry.report), (other.clock, &other.report));
        }
        assert_eq!(reader.entries().len(), of_all.entries().len());
        let is_beside = |file: &PathBuf| file.starts_with("grids") || file.starts_with("probes");
        for file in files(all.path()).into_iter().filter(is_beside) {
            let [a, b] = [all.path(), d].map(|dir| fs::read(dir.join(&file)).unwrap());
            assert_eq!(a, b, "{}", file.display());
        }
        for frame in 0..=LAST {
            assert_eq!(reader.has_particles(frame), kept.contains(&frame));
            match reader.read(frame) {
                Ok(particles) => assert_eq!(particles, of_all.read(frame).unwrap()),
                Err(CacheError::NotKept { before, after, .. }) => {
                    let before_it = kept.iter().rfind(|&&k| k < frame);
                    let after_it = kept.iter().find(|&&k| k > frame);
                    assert_eq!((Some(&before), Some(&after)), (before_it, after_it));
                }
                other => panic!("{frame}: {other:?}"),
            }
        }
        // Negative control: a required frame that is missing is found.
        fs::remove_file(d.join(frame_file(LAST))).unwrap();
        assert_eq!(first_problem(d), d.join(frame_file(LAST)));
    }
}

/// A bake is stopped at any frame, with the leftovers of a kill between writing a frame's line and
/// removing the previous frame, and with the newest particles missing: the resumed cache equals the
/// unbroken one byte for byte.
#[test]
fn a_bake_goes_on_from_what_is_kept_with_the_same_bytes() {
    for (keep, kept) in CASES {
        let whole = tempfile::tempdir().unwrap();
        bake_kept(whole.path(), keep, LAST);
        let expected = directory_hash(whole.path()).unwrap();
        for stop in 1..LAST {
            let dir = tempfile::tempdir().unwrap();
            let d = dir.path();
            let before = frame_file(stop - 1);
            bake_kept(d, keep, stop - 1);
            let left = fs::read(d.join(&before)).unwrap();
            assert_eq!(resume_to(d, keep, stop), stop - 1);
            fs::write(d.join(&before), left).unwrap();
            assert!(CacheReader::open(d).unwrap().verify().is_ok());
            assert_ne!(directory_hash(d).unwrap(), expected, "control");
            let mut from = stop;
            if !kept.contains(&stop) && stop % 2 == 0 {
                from = *kept.iter().rfind(|&&k| k < stop).unwrap();
                for gone in (from + 1).max(stop - 1)..=stop {
                    fs::remove_file(d.join(frame_file(gone))).unwrap();
                }
            }
            assert_eq!(resume_kept(d, keep).unwrap(), from, "{keep}, {stop}");
            assert_eq!(directory_hash(d).unwrap(), expected, "{keep}, {stop}");
        }
    }
}

fn resume_to(dir: &Path, keep: Keep, last: u32) -> u32 {
    let (writer, entry, particles) = CacheWriter::resume(dir, &manifest_of(keep)).unwrap();
    go_on(writer, entry.clock, particles, last).unwrap();
    entry.frame
}

/// A frame that is kept for good is not a checkpoint that a resume may do without.
#[test]
fn a_kept_frame_that_is_missing_stops_a_resume_untouched() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    bake_kept(d, Keep::Every(5), 12);
    for file in [frame_file(10), frame_file(0)] {
        let bytes = fs::read(d.join(&file)).unwrap();
        fs::remove_file(d.join(&file)).unwrap();
        let before = directory_hash(d).unwrap();
        assert_eq!(damaged_file(resume_kept(d, Keep::Every(5))), d.join(&file));
        assert_eq!(directory_hash(d).unwrap(), before);
        fs::write(d.join(&file), bytes).unwrap();
    }
    let other = resume_kept(d, Keep::Every(4));
    assert!(other.is_err_and(|error| error.to_string().contains("keep = \"every 5\"")));
    assert_eq!(resume_kept(d, Keep::Every(5)).unwrap(), 12, "control");
}

/// Runs the whole program: of 8 frames, 0, 3, 6 and the newest keep their particles.
#[test]
fn commands_take_the_frames_that_are_there_and_name_them_for_the_others() {
    let job = Job::new();
    let gauge = "[[probe]]\nkind = \"energy\"\n\n[effects]";
    job.edit("small.toml", "[effects]", gauge);
    let bake = "bake small.toml --device cpu -o";
    job.expect(0, &format!("{bake} all"));
    job.edit(
        "small.toml",
        "[effects]",
        "[keep]\nparticles = \"every 3\"\n\n[effects]",
    );
    job.expect(0, &format!("{bake} thin"));
    // Stopped twice, once without the newest particles.
    job.expect(0, &format!("{bake} parts --frames 1-5"));
    fs::remove_file(job.path("parts/frames/small.0005.ply")).unwrap();
    let said = job.expect(0, &format!("{bake} parts --frames 1-7 --resume"));
    assert_has(&said, &["frames 4 to 7"]);
    let said = job.expect(0, &format!("{bake} parts --resume"));
    assert_has(&said, &["frames 8 to 8"]);
    assert_eq!(job.hash("parts"), job.hash("thin"));
    let rows =
        |cache: &str| fs::read_to_string(job.path(cache).join("probes/energy-1.csv")).unwrap();
    assert_eq!(rows("thin"), rows("all"));
    assert_eq!(rows("thin").lines().count(), 10, "a header and 9 rows");

    let said = job.expect(0, "verify thin");
    assert_has(&said, &["ok: 8 frames", "particles of frames 0, 3, 6, 8"]);
    assert_has(
        &job.expect(0, "inspect thin"),
        &["keeps particles: \"every 3\""],
    );
    let nearest = [
        "thin has no particles of frame 4",
        "particles = \"every 3\"",
        "are 3 and 6",
    ];
    for words in [
        "check thin --frames 4",
        "check thin --frames 3-6",
        "diff thin all --frames 3-6",
        "diff all thin --frames 4",
        "render thin --look look.toml --frames 4 -o out",
        "bake small.toml --device cpu --from thin:4 -o branch",
    ] {
        assert_has(&job.expect(4, words), &nearest);
    }
    assert!(!job.path("out").exists() && !job.path("branch").exists());
    job.expect(0, "bake small.toml --device cpu --from thin:3 -o branch");
    let said = job.expect(0, "render thin --look look.toml -o out");
    assert_has(&said, &["3 frames of 64 × 36 (5 more were baked"]);
    for frame in 1..=8 {
        let is_there = job.path(&format!("out/small.{frame:04}.png")).is_file();
        assert_eq!(is_there, [3, 6, 8].contains(&frame), "{frame}");
    }
    let said = job.expect(0, "diff thin all");
    assert_has(
        &said,
        &[
            "compared frames 0, 3, 6, 8",
            "not kept on both sides: frames 1-2, 4-5, 7",
            "the same in all that both keep",
        ],
    );
    // Negative control: probes, ledger and checksums reveal different water between kept frames.
    job.expect(
        0,
        "bake small.toml --device cpu -o other --set solver.pbf.iterations=5",
    );
    let said = job.expect(1, "diff thin other");
    assert_has(&said, &["out: ledger not the same in frames 1-8"]);
}

#[test]
fn a_keep_that_nothing_could_go_on_from_is_named_with_its_line() {
    let job = Job::new();
    let text = fs::read_to_string(job.path("small.toml")).unwrap();
    for (value, words) in [
        (
            "\"every 0\"",
            "\"every 0\": every 0th frame is none, and a bake resumes",
        ),
        (
            "\"every\"",
            "\"every\": it names no frames; allowed: \"all\", \"every N\"",
        ),
        ("10", "expected a string"),
    ] {
        let keep = format!("[keep]\nparticles = {value}\n{text}");
        job.write("small.toml", &keep);
        let said = job.expect(2, "bake small.toml --device cpu -o cache");
        assert_has(&said, &["small.toml:2: keep.particles", words]);
        assert!(!job.path("cache").exists());
    }
    for value in ["all", "none", "every 1000000"] {
        job.write(
            "small.toml",
            &format!("[keep]\nparticles = \"{value}\"\n{text}"),
        );
        job.expect(0, "bake small.toml --device cpu -o cache --frames 1");
        fs::remove_dir_all(job.path("cache")).unwrap();
    }
}

/// Every command, and a bake that resumes, treats compressed frames like plain ones.
#[test]
fn compressed_frames_are_the_plain_ones() {
    let job = Job::new();
    let bake = "bake small.toml --device cpu --frames 1-4 -o";
    job.expect(0, &format!("{bake} plain"));
    job.edit(
        "small.toml",
        "[effects]",
        "[keep]\ncompression = \"zstd\"\n\n[effects]",
    );
    job.expect(0, &format!("{bake} packed"));
    job.expect(0, "bake small.toml --device cpu --frames 1-2 -o parts");
    job.expect(0, &format!("{bake} parts --resume"));
    assert_eq!(job.hash("parts"), job.hash("packed"));
    job.expect(0, "verify packed");
    job.expect(0, "diff plain packed");
    let said = job.expect(0, "inspect packed");
    assert_has(&said, &["frames compressed by Zstandard"]);

    let file = |cache: &str, end: &str| job.path(cache).join(format!("frames/small.0004.{end}"));
    let size = |path: PathBuf| fs::metadata(path).unwrap().len();
    assert!(size(file("packed", "ply.zst")) < size(file("plain", "ply")));
    fs::copy(
        job.path("packed/frames/small.0003.ply.zst"),
        file("packed", "ply.zst"),
    )
    .unwrap();
    job.expect(4, "verify packed");
}
