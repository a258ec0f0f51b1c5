//! Runs the whole program against full disks, read-only disks, flipped bits and second
//! writers. The bakes run on the CPU, whose processes start fast; the code under test does not
//! depend on the solver.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::Stdio,
    time::Duration,
};

use crate::support::job::Job;
use crate::support::tmpfs::Tmpfs;
use swell::cache::{self, CacheReader, directory_hash};

const WATCHED: &str = r#"
[grids]
surface = true
velocity = true

[[probe]]
kind = "energy"

[effects]"#;

const BAKE: &str = "bake small.toml --device cpu";

fn watched() -> Job {
    let job = Job::new();
    job.edit("small.toml", "[effects]", WATCHED);
    for (fine, coarse) in [
        ("particle_spacing = 0.1", "particle_spacing = 0.2"),
        ("cell_size = 0.2", "cell_size = 0.25"),
    ] {
        job.edit("small.toml", fine, coarse);
    }
    job
}

/// Lists all files below `dir`, relative to it.
fn files(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![dir.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                found.push(path.strip_prefix(dir).unwrap().to_owned());
            }
        }
    }
    found.sort();
    found
}

/// Returns the complete lines of a ledger.
fn ledger(cache: &Path) -> Vec<u8> {
    let mut bytes = fs::read(cache.join("frames.jsonl")).unwrap();
    let end = bytes
        .iter()
        .rposition(|&b| b == b'\n')
        .map_or(0, |at| at + 1);
    bytes.truncate(end);
    bytes
}

/// Asserts that all files in the ledger exist and that the ledger is a prefix of `whole`'s.
/// Returns the last frame.
fn holds(cache: &Path, whole: &Path) -> u32 {
    let reader = CacheReader::open(cache).unwrap();
    for problem in reader.survey().problems {
        let may_lag = problem.file.starts_with(cache.join("probes"));
        assert!(may_lag || problem.what.contains("truncated"), "{problem:?}");
    }
    assert!(ledger(whole).starts_with(&ledger(cache)));
    reader.last_frame()
}

/// The disk fills up at every page of a frame and its grids, in the ledger, and while the
/// cache is created.
#[test]
fn a_full_disk_ends_the_bake_and_with_space_it_goes_on_to_the_same_bytes() {
    const PAGE: u64 = 4096;
    let job = watched();
    job.expect(0, &format!("{BAKE} -o whole"));
    let whole = job.path("whole");
    let hash = job.hash("whole");
    let pages = |file: &PathBuf| whole.join(file).metadata().unwrap().len().div_ceil(PAGE);
    let all: u64 = files(&whole).iter().map(pages).sum();
    let frame: u64 = files(&whole)
        .iter()
        .filter(|file| file.to_string_lossy().contains(".0008."))
        .map(pages)
        .sum();
    let mut full = BTreeSet::new();
    let mut last_frames = BTreeSet::new();
    // Each of the first sizes fails in a different file of the creation; the last sizes fail
    // within one frame.
    let sizes = (3..9).chain(all - frame - 3..all);
    for pages in sizes {
        let name = "a_full_disk_ends_the_bake_and_with_space_it_goes_on_to_the_same_bytes";
        let Some(disk) = Tmpfs::mount(pages * PAGE, name) else {
            return;
        };
        let cache = disk.path().join("cache");
        let bake = format!("{BAKE} -o {} --resume", cache.display());
        let said = job.expect(4, &bake);
        assert!(said.contains("No space left"), "{said}");
        let named = said
            .split_whitespace()
            .find(|word| word.starts_with(&*cache.to_string_lossy()));
        let named = PathBuf::from(named.unwrap().trim_end_matches(':'));
        let kind = named.strip_prefix(&cache).unwrap();
        let kind = kind
            .components()
            .next()
            .unwrap()
            .as_os_str()
            .to_string_lossy()
            .into_owned();
        full.insert(kind);
        if cache::exists(&cache) {
            last_frames.insert(holds(&cache, &whole));
        }
        // While the disk is still full, the error is the same and nothing is lost.
        let before = cache::exists(&cache).then(|| ledger(&cache));
        job.expect(4, &bake);
        if let Some(before) = before {
            assert_eq!(ledger(&cache), before);
        }
        disk.remount("size=64m");
        job.expect(0, &bake);
        assert_eq!(directory_hash(&cache).unwrap(), hash, "{pages} pages");
    }
    println!("disk full while writing {full:?}; last frames {last_frames:?}");
    for kind in ["frames", "grids"] {
        assert!(full.contains(kind), "{full:?}");
    }
    assert!(
        full.len() >= 3 && last_frames.contains(&7),
        "{full:?} {last_frames:?}"
    );
    // Negative control: with enough space there is no error.
    let disk = Tmpfs::mount((2 * all + 64) * PAGE, "its control").unwrap();
    let cache = disk.path().join("cache");
    job.expect(0, &format!("{BAKE} -o {}", cache.display()));
    assert_eq!(directory_hash(&cache).unwrap(), hash);
}

/// A file size limit that only the ledger exceeds tears a line in the middle, without a mount.
#[test]
fn a_ledger_that_cannot_grow_is_cut_back_and_goes_on() {
    let job = Job::new();
    job.edit(
        "small.toml",
        "max = [-0.2, 1.5, 1.25]",
        "max = [-0.8, 0.7, 0.45]",
    );
    job.edit("small.toml", "frames = 8", "frames = 30");
    // Short lines and a short manifest.
    job.edit(
        "small.toml",
        "particle_spacing = 0.1",
        "particle_spacing = 0.1\ngrid_projection = false",
    );
    job.expect(0, &format!("{BAKE} -o whole"));
    let lines = ledger(&job.path("whole"));
    let longest = files(&job.path("whole"))
        .into_iter()
        .filter(|file| file != Path::new("frames.jsonl"))
        .map(|file| job.path("whole").join(file).metadata().unwrap().len())
        .max();
    // `ulimit -f` counts blocks of 512 bytes; a signal to the process would come before the error.
    let blocks = lines.len() as u64 * 3 / 4 / 512;
    assert!(
        512 * blocks > longest.unwrap(),
        "the ledger is the longest file"
    );
    let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" {BAKE} -o cache --resume");
    let limited = || {
        let mut command = std::process::Command::new("sh");
        command.current_dir(job.folder.path());
        command
            .args(["-c", &script, env!("CARGO_BIN_EXE_swell")])
            .output()
            .unwrap()
    };
    for _ in 0..2 {
        let output = limited();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(4), "{said}");
        assert!(
            said.contains("cache/frames.jsonl") && said.contains("File too large"),
            "{said}"
        );
        let last = holds(&job.path("cache"), &job.path("whole"));
        assert!((10..30).contains(&last), "{last}");
        let bytes = fs::read(job.path("cache/frames.jsonl")).unwrap();
        assert_eq!(
            bytes.last(),
            Some(&b'\n'),
            "the line that did not fit is cut"
        );
        assert!(bytes.len() as u64 <= 512 * blocks);
    }
    job.expect(0, &format!("{BAKE} -o cache --resume"));
    assert_eq!(job.hash("cache"), job.hash("whole"));
}

/// Readers accept a read-only cache; a bake refuses it and leaves it unchanged.
#[test]
fn a_cache_that_cannot_be_written_is_read_and_not_resumed() {
    let job = watched();
    let name = "a_cache_that_cannot_be_written_is_read_and_not_resumed";
    let Some(disk) = Tmpfs::mount(64 << 20, name) else {
        return;
    };
    let cache = disk.path().join("cache");
    let at = cache.display();
    job.expect(0, &format!("{BAKE} -o whole"));
    job.expect(0, &format!("{BAKE} -o {at} --frames 1-5"));
    disk.remount("ro");
    let before = directory_hash(&cache).unwrap();
    let said = job.expect(4, &format!("{BAKE} -o {at} --resume"));
    assert!(
        said.contains(&*cache.to_string_lossy()) && said.contains("Read-only"),
        "{said}"
    );
    let new = disk.path().join("new");
    let said = job.expect(4, &format!("{BAKE} -o {}", new.display()));
    assert!(
        said.contains(&*new.to_string_lossy()) && said.contains("Read-only"),
        "{said}"
    );
    for reading in [
        format!("verify {at}"),
        format!("inspect {at}"),
        format!("diff {at} {at}"),
        format!("{BAKE} --from {at}:5 -o branch"),
    ] {
        job.expect(0, &reading);
    }
    assert_eq!(directory_hash(&cache).unwrap(), before);
    disk.remount("rw");
    job.expect(0, &format!("{BAKE} -o {at} --resume"));
    assert_eq!(directory_hash(&cache).unwrap(), job.hash("whole"));
}

/// Flips a bit in each file, one after another. `verify` names the file. A resume either refuses
/// and names it as well, or reproduces the unbroken bake's bytes in every other file. The lock has
/// no content, and no checksum covers the timings.
#[test]
fn a_flipped_bit_in_any_file_is_named_or_does_not_matter() {
    let job = watched();
    job.expect(0, &format!("{BAKE} -o whole --frames 1-4"));
    job.expect(0, &format!("{BAKE} -o part --frames 1-3"));
    let (whole, part) = (job.path("whole"), job.path("part"));
    let copy = |name: &str| {
        let to = job.path(name);
        let _ = fs::remove_dir_all(&to);
        for file in files(&part) {
            fs::create_dir_all(to.join(&file).parent().unwrap()).unwrap();
            fs::copy(part.join(&file), to.join(file)).unwrap();
        }
        to
    };
    let (mut refused, mut mended, mut passed) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    for file in files(&part) {
        let is_exempt = file == Path::new("lock") || file == Path::new("timings.jsonl");
        let length = part.join(&file).metadata().unwrap().len() as usize;
        for (at, bit) in [(0, 0), (length / 2, 3), (length - 1, 6)] {
            let d = copy("flipped");
            let path = d.join(&file);
            let mut bytes = fs::read(&path).unwrap();
            bytes[at] ^= 1 << bit;
            fs::write(&path, bytes).unwrap();
            let spoiled = directory_hash(&d).unwrap();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            let verified = job.expect(if is_exempt { 0 } else { 4 }, "verify flipped");
            assert!(is_exempt || verified.contains(&name), "{verified}");
            let output = job.run(&format!("{BAKE} -o flipped --resume --frames 1-4"));
            let said = String::from_utf8_lossy(&output.stderr);
            if output.status.code() == Some(4) {
                // A changed digit of the format version makes the manifest unreadable: the message
                // names its directory and the fault.
                let is_named = said.contains(&name) || said.contains("cache format");
                assert!(is_named && !is_exempt, "{said}");
                assert_eq!(directory_hash(&d).unwrap(), spoiled, "refused untouched");
                refused.insert(file.clone());
                continue;
            }
            assert_eq!(output.status.code(), Some(0), "{said}");
            let off: Vec<_> = files(&whole)
                .into_iter()
                .filter(|other| other != Path::new("timings.jsonl") && other != Path::new("lock"))
                .filter(|other| {
                    fs::read(whole.join(other)).unwrap() != fs::read(d.join(other)).unwrap()
                })
                .collect();
            if is_exempt || off.is_empty() {
                assert_eq!(off, [] as [PathBuf; 0]);
                mended.insert(file.clone());
            } else {
                assert_eq!(off, std::slice::from_ref(&file));
                assert!(job.expect(4, "verify flipped").contains(&name));
                passed.insert(file.clone());
            }
        }
    }
    println!(
        "refused {refused:?}\nmended or of no account {mended:?}\n\
         left as they are, and named {passed:?}"
    );
    let has = |set: &BTreeSet<PathBuf>, name: &str| set.contains(Path::new(name));
    let is_mesh = |file: &&PathBuf| file.starts_with("assets");
    let mesh = files(&part)
        .iter()
        .find(is_mesh)
        .unwrap()
        .display()
        .to_string();
    for name in [
        "manifest.json",
        "scene.toml",
        "frames.jsonl",
        "frames/small.0003.ply",
        "grids/small.0003.vdb",
        &mesh,
    ] {
        assert!(has(&refused, name), "{name}: what the bake goes on from");
    }
    assert!(has(&mended, "probes/energy-1.csv") && has(&passed, "frames/small.0001.ply"));
    copy("flipped");
    job.expect(0, "verify flipped");
    job.expect(0, &format!("{BAKE} -o flipped --resume --frames 1-4"));
    assert_eq!(job.hash("flipped"), job.hash("whole"), "control");
}

#[test]
fn a_second_writer_is_refused_and_the_lock_of_a_dead_one_is_taken_over() {
    let job = Job::new();
    let bake = format!("{BAKE} --set shot.frames=2000 -o cache");
    let mut first = job
        .command(&bake)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let path = job.path("cache");
    let lines = || {
        fs::read_to_string(path.join("frames.jsonl")).map_or(0, |text| text.matches('\n').count())
    };
    while lines() < 3 {
        assert!(first.try_wait().unwrap().is_none(), "no frames");
        std::thread::sleep(Duration::from_millis(2));
    }
    let said = job.expect(4, &format!("{bake} --resume"));
    assert!(
        said.contains("cache is being written by another bake"),
        "{said}"
    );
    let said = job.expect(4, &bake);
    assert!(said.contains("already holds a cache"), "{said}");
    // A reader is not a second writer.
    job.expect(0, "inspect cache");
    let then = lines();
    while lines() < then + 2 {
        assert!(
            first.try_wait().unwrap().is_none(),
            "the first bake was harmed"
        );
        std::thread::sleep(Duration::from_millis(2));
    }
    first.kill().unwrap();
    assert!(first.wait().unwrap().code().is_none(), "killed in mid-bake");
    let last = CacheReader::open(&path).unwrap().last_frame() + 2;
    job.expect(0, &format!("{bake} --resume --frames 1-{last}"));
    job.expect(
        0,
        &format!("{BAKE} --set shot.frames=2000 -o alone --frames 1-{last}"),
    );
    assert_eq!(job.hash("cache"), job.hash("alone"));
}

/// Both a bake before its first frame and a dry run print the warning.
#[test]
fn a_disk_that_cannot_hold_the_frames_is_a_warning() {
    const NAME: &str = "a_disk_that_cannot_hold_the_frames_is_a_warning";
    const WARNING: &str = "warning: the disk has";
    let job = Job::new();
    let Some(disk) = Tmpfs::mount(65536, NAME) else {
        return;
    };
    let bake = format!("{BAKE} -o {}", disk.path().join("cache").display());
    let said = job.expect(0, &format!("{bake} --dry-run"));
    assert!(said.contains(WARNING), "{said}");
    let said = job.expect(4, &bake);
    let at = |words| said.find(words).unwrap();
    assert!(at(WARNING) < at("on the disk"), "{said}");
    assert!(at("on the disk") < at("No space left"), "{said}");
    // Negative control: with enough space there is no warning, and the estimate matches the bytes
    // that the frames then take.
    disk.remount("size=64m");
    let said = job.expect(0, &format!("{bake} --resume --progress json"));
    assert!(!said.contains("\"what\":\"disk\""), "{said}");
    let ready = said.lines().find(|line| line.contains("\"ready\""));
    let ready: serde_json::Value = serde_json::from_str(ready.unwrap()).unwrap();
    let [told, free] = ["disk_bytes", "disk_free"].map(|key| ready[key].as_u64().unwrap());
    assert!(told < free && free <= 64 << 20, "{ready}");
    let first = ready["first"].as_u64().unwrap();
    let taken: u64 = (first..=8)
        .map(|frame| format!("cache/frames/small.{frame:04}.ply"))
        .map(|file| disk.path().join(file).metadata().unwrap().len())
        .sum();
    // A frame's header holds its number and time, whose digits vary by a few.
    assert!(told.abs_diff(taken) < 64 * 8, "{told} {taken}");
}
