//! Bakes killed at random moments: every line of the ledger survives, and a resumed bake ends with
//! the bytes of the unbroken one. `tools/durability COUNT` runs it for longer; SWELL_KILLS and
//! SWELL_SEED set count and seed.
//!
//! Most kills hit bakes by the f64 reference, whose processes start fast: the code that writes a
//! cache does not depend on the solver. A tenth hit bakes on the GPU.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Child, Stdio},
    sync::atomic::{AtomicU32, Ordering},
    time::{Duration, Instant, SystemTime, UNIX_EPOCH},
};

use crate::support::job::Job;
use swell::cache::{self, CacheReader};

/// Frames of a shot: several times as many as a process bakes before its kill.
const FRAMES: u32 = 160;

const WATCHED: &str = r#"
[grids]
surface = true
velocity = true

[[probe]]
kind = "pressure"
at = [-0.6, 0.7, 0.75]

[[probe]]
kind = "energy"
"#;

const KEEP: &str = "[keep]\nparticles = \"every 10\"\n";

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable)
        .ok()
        .map(|text| text.parse().unwrap())
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % end.max(1)
    }

    fn sleep_up_to(&mut self, most: Duration) {
        std::thread::sleep(Duration::from_nanos(self.below(most.as_nanos() as u64)));
    }
}

/// When a kill hit, judged by what it left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fell {
    /// Before the process added a frame: start-up, creation or resume.
    Before,
    /// A file exists that no line of the ledger lists yet, or a row is missing.
    Within,
    /// Frames were added, and the ledger lists every file.
    Between,
}

/// A bake under test and the hash of its unbroken run.
struct Case {
    job: Job,
    bake: String,
    random: Random,
    startup: Duration,
    frame: Duration,
    whole_ledger: Vec<u8>,
    whole: String,
    finished: u32,
}

fn whole_lines(cache: &Path) -> Vec<u8> {
    let mut bytes = fs::read(cache.join("frames.jsonl")).unwrap_or_default();
    let end = bytes
        .iter()
        .rposition(|&b| b == b'\n')
        .map_or(0, |at| at + 1);
    bytes.truncate(end);
    bytes
}

fn count(lines: &[u8]) -> u64 {
    lines.iter().filter(|&&b| b == b'\n').count() as u64
}

fn names(folder: &Path) -> Vec<String> {
    let Ok(entries) = fs::read_dir(folder) else {
        return Vec::new();
    };
    entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect()
}

fn has_temporary(cache: &Path) -> bool {
    let folders = ["frames", "grids"].map(|name| cache.join(name));
    folders
        .iter()
        .flat_map(|folder| names(folder))
        .any(|name| name.ends_with(".tmp"))
}

impl Case {
    fn new(solver: &str, device: &str, more: &str, seed: u64) -> Self {
        let job = Job::on_disk();
        for (from, to) in [
            ("frames = 8", format!("frames = {FRAMES}").as_str()),
            ("particle_spacing = 0.1", "particle_spacing = 0.2"),
            ("cell_size = 0.2", "cell_size = 0.25"),
        ] {
            job.edit("small.toml", from, to);
        }
        job.edit("small.toml", "[effects]", &format!("{more}\n[effects]"));
        let mut case = Self {
            job,
            bake: format!("bake small.toml --solver {solver} --device {device}"),
            random: Random(seed),
            startup: Duration::ZERO,
            frame: Duration::ZERO,
            whole_ledger: Vec::new(),
            whole: String::new(),
            finished: 0,
        };
        let begin = Instant::now();
        let mut child = case.spawn("whole");
        let ledger = case.job.path("whole");
        while count(&whole_lines(&ledger)) < 2 && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_micros(200));
        }
        case.startup = begin.elapsed();
        assert!(child.wait().unwrap().success());
        case.frame = (begin.elapsed() - case.startup) / FRAMES;
        case.whole_ledger = whole_lines(&ledger);
        assert_eq!(count(&case.whole_ledger), u64::from(FRAMES) + 1);
        case.whole = case.job.hash("whole");
        case
    }

    fn cache(&self) -> PathBuf {
        self.job.path("cache")
    }

    fn spawn(&self, cache: &str) -> Child {
        let words = format!("{} -o {cache} --resume", self.bake);
        let said = fs::File::create(self.job.path("said")).unwrap();
        let mut command = self.job.command(&words);
        command.stdout(Stdio::null()).stderr(said).spawn().unwrap()
    }

    /// Waits for the moment to kill: of five kills, one falls anywhere in a process's start, two
    /// anywhere in a frame, and two while a file is being written.
    fn wait(&mut self, child: &mut Child, before: u64, kind: u32) {
        if kind == 0 {
            let most = self.startup + 4 * self.frame;
            self.random.sleep_up_to(most);
            return;
        }
        let wanted = before.max(1) + 1 + self.random.below(4);
        let cache = self.cache();
        let until = |child: &mut Child, done: &dyn Fn() -> bool| {
            while !done() && child.try_wait().unwrap().is_none() {
                std::thread::sleep(Duration::from_micros(50));
            }
        };
        until(child, &|| count(&whole_lines(&cache)) >= wanted);
        if kind < 3 {
            let most = 2 * self.frame;
            self.random.sleep_up_to(most);
        } else {
            until(child, &|| has_temporary(&cache));
            self.random.sleep_up_to(Duration::from_micros(300));
        }
    }

    /// Bakes until a kill. Returns where it hit, or `None` if the bake finished first.
    fn strike(&mut self, kind: u32) -> Option<Fell> {
        let cache = self.cache();
        let before = whole_lines(&cache);
        let hash_before = cache.exists().then(|| self.job.hash("cache"));
        let mut child = self.spawn("cache");
        self.wait(&mut child, count(&before), kind);
        let seen = whole_lines(&cache);
        child.kill().unwrap();
        let status = child.wait().unwrap();
        if let Some(code) = status.code() {
            let said = fs::read_to_string(self.job.path("said")).unwrap();
            assert_eq!(code, 0, "a resume was refused: {said}");
            assert_eq!(self.job.hash("cache"), self.whole, "{}", self.bake);
            fs::remove_dir_all(&cache).unwrap();
            self.finished += 1;
            return None;
        }
        // No line of the ledger may be lost.
        let after = whole_lines(&cache);
        assert!(
            after.starts_with(&before) && after.starts_with(&seen),
            "the ledger lost a line"
        );
        if !cache::exists(&cache) {
            return Some(Fell::Before);
        }
        assert!(
            self.whole_ledger.starts_with(&after),
            "the ledger is another"
        );
        let is_whole = self.examine(&cache);
        // Leftovers of an earlier kill may still exist, or be cleared already.
        let is_untouched = hash_before == Some(self.job.hash("cache"));
        let has_grown = after.len() > before.len();
        Some(match (has_grown, is_whole || is_untouched) {
            (false, true) => Fell::Before,
            (true, true) => Fell::Between,
            (_, false) => Fell::Within,
        })
    }

    /// Asserts that every file in the ledger is undamaged. Returns whether no other file exists.
    fn examine(&self, cache: &Path) -> bool {
        let reader = CacheReader::open(cache).unwrap();
        let mut is_whole = true;
        for problem in reader.survey().problems {
            let is_allowed = problem.file == cache.join("frames.jsonl")
                || problem.file.starts_with(cache.join("probes"));
            assert!(is_allowed, "{problem:?}");
            is_whole = false;
        }
        let last = reader.last_frame();
        let behind = ["frames", "grids"]
            .into_iter()
            .flat_map(|folder| names(&cache.join(folder)));
        for name in behind {
            let number = name.split('.').nth(1).unwrap().parse::<u32>().unwrap();
            is_whole &= number <= last && !name.ends_with(".tmp");
        }
        is_whole
    }

    fn end(mut self, kills: u32) -> [u32; 3] {
        let mut fell = [0; 3];
        let mut struck = 0;
        while struck < kills {
            if let Some(place) = self.strike(struck % 5) {
                fell[place as usize] += 1;
                struck += 1;
            }
        }
        let cache = self.cache();
        let is_broken = cache.exists();
        if is_broken {
            // Negative control: before it is resumed, the cache differs.
            assert_ne!(self.job.hash("cache"), self.whole);
        }
        assert!(self.spawn("cache").wait().unwrap().success());
        assert_eq!(self.job.hash("cache"), self.whole, "{}", self.bake);
        self.job.expect(0, "verify cache");
        // Negative control: a flipped bit is detected.
        let frame = cache.join(format!("frames/small.{FRAMES:04}.ply"));
        let mut bytes = fs::read(&frame).unwrap();
        let last = bytes.len() - 1;
        bytes[last] ^= 1;
        fs::write(&frame, bytes).unwrap();
        assert_ne!(self.job.hash("cache"), self.whole);
        self.job.expect(4, "verify cache");
        fell
    }
}

/// Runs a quarter of all kills, a tenth of them on the GPU.
fn killed(name: &str, solver: &str, more: &str) {
    let kills = number("SWELL_KILLS").unwrap_or(100).div_ceil(4) as u32;
    let of_gpu = (kills / 10).max(1);
    let cpu = killed_on("cpu", name, solver, more, kills - of_gpu);
    let gpu = killed_on("gpu", name, solver, more, of_gpu);
    let [_, within, between]: [u32; 3] = std::array::from_fn(|k| cpu[k] + gpu[k]);
    // Four of five kills wait for frames, and half of these for a file that is being written.
    assert!(
        2 * (within + between) >= kills,
        "too few fell in mid-bake: {cpu:?} {gpu:?}"
    );
    assert!(
        10 * within >= kills,
        "too few fell within a write: {cpu:?} {gpu:?}"
    );
}

fn killed_on(device: &str, name: &str, solver: &str, more: &str, kills: u32) -> [u32; 3] {
    static CASE: AtomicU32 = AtomicU32::new(0);
    let clock = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
    let seed = number("SWELL_SEED").unwrap_or(clock.as_nanos() as u64);
    eprintln!("{name}, {device}: SWELL_SEED={seed}");
    let begin = Instant::now();
    let case = Case::new(
        solver,
        device,
        more,
        seed ^ u64::from(CASE.fetch_add(1, Ordering::Relaxed)),
    );
    let (startup, frame) = (case.startup, case.frame);
    let fell = case.end(kills);
    let [before, within, between] = fell;
    println!(
        "{name}, {device}: {kills} kills, {before} before the first frame of their process, \
         {within} within a frame's write, {between} between frames; start-up {:.2} s, \
         frame {:.1} ms, {:.0} s in all",
        startup.as_secs_f64(),
        1e3 * frame.as_secs_f64(),
        begin.elapsed().as_secs_f64()
    );
    fell
}

#[test]
fn pbf_bakes_survive_kills() {
    killed("pbf", "pbf", "");
}

#[test]
fn pbf_bakes_with_grids_and_probes_survive_kills() {
    killed("pbf, grids and probes", "pbf", WATCHED);
}

#[test]
fn flip_bakes_survive_kills() {
    killed("flip, every 10th frame's particles", "flip", KEEP);
}

#[test]
fn flip_bakes_with_grids_and_probes_survive_kills() {
    killed("flip, grids and probes", "flip", WATCHED);
}

/// Drops at a wall after the fastest one has passed: passes that a substep does not need must be
/// empty, also where an earlier, faster substep needed them, which a resumed bake does not know. If
/// they are not, twelve particles differ at frame 55.
#[test]
fn a_calmer_frame_is_the_same_after_a_resume() {
    const SPLASH: &str = r#"
[shot]
name = "splash"
frames = 58
frames_per_second = 50

[domain]
min = [0.0, 0.0, 0.0]
max = [1.6, 0.8, 0.8]

[[water.block]]
min = [0.0, 0.0, 0.0]
max = [0.6, 0.5, 0.8]

[solver]
method = "flip"
[solver.flip]
cell_size = 0.1
[solver.pbf]
particle_spacing = 0.1
"#;
    let job = Job::of(&[("splash.toml", SPLASH)]);
    job.expect(0, "bake splash.toml -o whole");
    let bake = "bake splash.toml -o stopped";
    for frames in [
        "--frames 1-20",
        "--resume --frames 1-41",
        "--resume --frames 1-54",
    ] {
        job.expect(0, &format!("{bake} {frames}"));
    }
    job.expect(0, &format!("{bake} --resume"));
    assert_eq!(job.hash("stopped"), job.hash("whole"));
}
