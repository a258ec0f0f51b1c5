//! Several processes and one folder of pictures: each frame is rendered once, looks do not mix, and
//! frames of a killed process are rendered by others. `SWELL_ROUNDS` sets how often three processes
//! share a range; in every second round one of them is killed.

use std::{
    fs,
    io::{BufRead, BufReader},
    path::Path,
    process::{Child, Stdio},
    time::Duration,
};

use crate::support::events::pictures;
use crate::support::job::{Job, LOOK, assert_has};
use crate::support::made_cache::{Made, SCENE, write_cache};

/// Last frame of the caches.
const LAST: u32 = 12;

fn job(last: u32) -> Job {
    let job = Job::of(&[
        ("look.toml", LOOK),
        ("wide.toml", &LOOK.replace("35.0", "24.0")),
    ]);
    let made = Made {
        last,
        ..Made::default()
    };
    write_cache(&job.path("cache"), &made);
    job
}

fn spawn(job: &Job, words: &str) -> Child {
    let mut command = job.command(&format!("{words} --progress json"));
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

/// Numbers of frames that a process rendered and skipped; it must have succeeded.
fn counts(child: Child) -> [u64; 2] {
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    let fault = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}{fault}");
    let end: serde_json::Value = serde_json::from_str(said.lines().last().unwrap()).unwrap();
    ["rendered", "skipped"].map(|key| end[key].as_u64().unwrap())
}

/// Waits until `done`; the process must still be running.
fn until(child: &mut Child, done: &dyn Fn() -> bool) {
    while !done() {
        assert!(child.try_wait().unwrap().is_none(), "it ended before");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// A folder has one numbering, which applies to skipping pictures and rendering them again, as the
/// cache's own numbering does.
#[test]
fn pictures_are_numbered_from_another_frame() {
    let job = job(4);
    let render = "render cache --look look.toml --frames 2-4x2 -o";
    job.expect(0, &format!("{render} plain"));
    job.expect(0, &format!("{render} moved --number-from 1001"));
    let picture = |folder: &str, name: &str| fs::read(job.path(folder).join(name)).unwrap();
    for (number, frame) in [(1001, 2), (1003, 4)] {
        for ending in ["png", "exr"] {
            let moved = picture("moved", &format!("small.{number}.{ending}"));
            assert_eq!(
                moved,
                picture("plain", &format!("small.{frame:04}.{ending}"))
            );
        }
    }
    assert_eq!(pictures(&job.path("moved")).len(), 4);
    assert_ne!(
        picture("moved", "small.1001.png"),
        picture("moved", "small.1003.png")
    );
    // `--chunk` divides the whole range; existing pictures are skipped.
    let share = format!("{render} moved --number-from 1001 --chunk 2/2");
    assert_has(&job.expect(0, &share), &["0 frames rendered, 1 already"]);
    let rest = "render cache --look look.toml --frames 3 --number-from 1002 -o moved";
    assert_has(&job.expect(0, rest), &["1 frame rendered"]);
    let before = pictures(&job.path("moved"));
    assert_eq!(before.len(), 6);
    // Another numbering is refused with nothing written, also in a dry run, and if it would leave
    // other pictures behind.
    let other = "render cache --look look.toml --frames 2-4 -o moved";
    for more in ["", " --dry-run", " --number-from 1002", " --overwrite"] {
        job.expect_clear(4, &format!("{other}{more}"), "numbering");
    }
    assert_eq!(pictures(&job.path("moved")), before);
    // Rendering all of them again is allowed.
    job.expect(
        0,
        "render cache --look look.toml --frames 2-4 --number-from 1001 -o moved --overwrite",
    );
    assert_eq!(pictures(&job.path("moved")), before);
}

#[test]
fn processes_share_a_range_and_make_up_for_a_killed_one() {
    let rounds = std::env::var("SWELL_ROUNDS").map_or(2, |text| text.parse().unwrap());
    let job = job(LAST);
    let render = "render cache --look look.toml -o";
    job.expect(0, &format!("{render} alone"));
    let alone = pictures(&job.path("alone"));
    assert_eq!(alone.len(), 2 * LAST as usize);
    let (mut shared, mut killed) = (0, 0);
    for round in 0..rounds {
        let folder = job.path(&format!("round{round}"));
        let words = format!("{render} round{round}");
        let mut children: Vec<Child> = (0..3).map(|_| spawn(&job, &words)).collect();
        let mut all = u64::from(LAST);
        if round % 2 == 1 {
            // Kills it while one of the processes renders that frame.
            let number = format!("small.{:04}", 2 + round % 9);
            let lock = folder.join(format!(".swell/{number}.lock"));
            let mut victim = children.remove(round % 3);
            until(&mut victim, &|| lock.exists());
            victim.kill().unwrap();
            let status = victim.wait().unwrap();
            killed += u32::from(status.code().is_none());
            all = 0;
        }
        let counted: Vec<[u64; 2]> = children.into_iter().map(counts).collect();
        for [rendered, stood] in &counted {
            assert_eq!(rendered + stood, u64::from(LAST), "{counted:?}");
        }
        let rendered: u64 = counted.iter().map(|count| count[0]).sum();
        // Without a kill each frame is rendered by exactly one process.
        assert!(
            rendered <= u64::from(LAST) && rendered >= all,
            "{counted:?}"
        );
        shared += u32::from(counted.iter().filter(|count| count[0] > 0).count() > 1);
        assert!(
            pictures(&folder) == alone,
            "round {round}: not the pictures of one process"
        );
    }
    println!(
        "{rounds} rounds of 3 processes: {shared} in which several rendered, {killed} \
         with one killed"
    );
    assert!(
        rounds < 2 || (shared > 0 && killed > 0),
        "{shared} {killed}"
    );
}

#[test]
fn pictures_of_something_else_are_refused_and_left() {
    let job = job(6);
    let day = job.path("day");
    let is_left = |code: i32, words: &str, says: &[&str]| {
        let before = (pictures(&day), day.join("render.json").exists());
        let said = job.expect(code, &format!("render {words} -o day"));
        assert_has(&said, says);
        assert!(before == (pictures(&day), day.join("render.json").exists()));
    };
    job.expect(0, "render cache --look look.toml -o day --frames 1-4");
    let first = pictures(&day);
    is_left(
        4,
        "cache --look wide.toml",
        &["small.0001.exr", "another look", "--overwrite"],
    );
    is_left(
        4,
        "cache --look wide.toml --frames 5-6",
        &["small.0001.exr", "another look"],
    );
    // Frame 4 would be left behind.
    is_left(
        4,
        "cache --look wide.toml --frames 1-3 --overwrite",
        &["small.0004.exr", "another look", "would leave it"],
    );
    let moved = Made {
        last: 6,
        spoil: &|_, particles| particles.position[0][1] += 0.01,
        ..Made::default()
    };
    write_cache(&job.path("moved"), &moved);
    is_left(4, "moved --look look.toml", &["another cache"]);
    let viscous = format!("{SCENE}\n[effects]\nviscosity = {{ xsph = 0.1 }}\n");
    for (name, scene, what) in [
        (
            "large",
            SCENE.replace("\"small\"", "\"large\""),
            "another shot",
        ),
        ("viscous", viscous, "another scene"),
    ] {
        let made = Made {
            scene: &scene,
            last: 6,
            ..Made::default()
        };
        write_cache(&job.path(name), &made);
        is_left(4, &format!("{name} --look look.toml"), &[what]);
    }
    // The record only helps; the existing pictures decide.
    fs::remove_file(day.join("render.json")).unwrap();
    is_left(4, "cache --look wide.toml", &["small.0001.exr"]);
    fs::write(day.join("render.json"), "{ half").unwrap();
    is_left(4, "cache --look wide.toml", &["small.0001.exr"]);

    // The same look continues with any frames; files that are not ours, and leftovers of a dead
    // process, do not interfere.
    fs::write(day.join("notes.png"), "mine").unwrap();
    fs::write(day.join("small.0005.png.tmp"), "half").unwrap();
    let said = job.expect(0, "render cache --look look.toml -o day --frames 3-6");
    assert!(said.contains("2 frames rendered, 2 already"), "{said}");
    assert!(!day.join("small.0005.png.tmp").exists());
    assert_eq!(fs::read_to_string(day.join("notes.png")).unwrap(), "mine");
    let both = pictures(&day);
    assert!(first.iter().all(|(name, bytes)| both[name] == *bytes));
    // A user's own picture under one of our names.
    fs::write(day.join("small.0002.png"), "mine").unwrap();
    fs::remove_file(day.join("render.json")).unwrap();
    is_left(
        4,
        "cache --look look.toml",
        &["small.0002.png", "not a readable picture"],
    );
    job.expect(0, "render cache --look wide.toml -o day --overwrite");
    job.expect(0, "render cache --look wide.toml -o wide");
    fs::remove_file(day.join("notes.png")).unwrap();
    assert!(pictures(&day) == pictures(&job.path("wide")));
}

/// Whether some process holds the lock of a frame of the folder.
#[cfg(unix)]
fn is_claimed(folder: &Path) -> bool {
    let locks = fs::read_dir(folder.join(".swell")).unwrap();
    let mut locks = locks.map(|entry| entry.unwrap().path());
    let is_lock = |path: &Path| path.extension().is_some_and(|end| end == "lock");
    locks.any(|path| is_lock(&path) && fs::File::open(path).unwrap().try_lock().is_err())
}

/// A process that works on the folder `busy`, stopped while it holds a frame: between two frames it
/// holds none, and other processes would not have to wait.
#[cfg(unix)]
fn stopped(job: &Job, words: &str) -> Child {
    let mut child = spawn(job, words);
    let said = BufReader::new(child.stdout.take().unwrap());
    let mut lines = said.lines().map(Result::unwrap);
    assert!(lines.any(|line| line.contains("\"event\":\"frame\"")));
    let signal = |name: &str| {
        let words = [name.to_owned(), child.id().to_string()];
        let status = std::process::Command::new("kill").args(words).status();
        assert!(status.unwrap().success());
        // A system call in progress ends before the process stops.
        std::thread::sleep(Duration::from_millis(20));
    };
    signal("-STOP");
    while !is_claimed(&job.path("busy")) {
        signal("-CONT");
        signal("-STOP");
    }
    child
}

#[cfg(unix)]
fn kill(mut child: Child) {
    child.kill().unwrap();
    assert_eq!(child.wait().unwrap().code(), None, "killed at work");
}

#[cfg(unix)]
#[test]
fn a_folder_in_use_is_shared_by_one_look_alone() {
    let job = job(LAST);
    let exists = |name: &str| job.path("busy").join(name).exists();
    let render = "render cache --look look.toml -o busy";
    let last = format!("{render} --frames {LAST}");
    let child = stopped(&job, render);
    let said = job.expect(4, "render cache --look wide.toml -o busy");
    assert_has(&said, &["busy is in use", "another look"]);
    for look in ["look.toml", "wide.toml"] {
        let words = format!("render cache --look {look} -o busy --overwrite");
        let said = job.expect(4, &words);
        assert_has(&said, &["busy is in use", "overwrite", "(-o)"]);
    }
    assert!(job.expect(0, &last).contains("1 frame rendered"));
    assert!(exists(".swell/work"), "the first is still at work");
    // The second process waits for that frame, and renders it once the first is dead.
    let second = spawn(&job, render);
    while !exists(&format!("small.{:04}.png", LAST - 1)) {
        std::thread::sleep(Duration::from_millis(5));
    }
    kill(child);
    let [rendered, stood] = counts(second);
    assert!(rendered > 0 && rendered + stood == u64::from(LAST));
    assert!(!exists(".swell"), "the last one to leave clears it");
    let all = pictures(&job.path("busy"));
    assert_eq!(all.len(), 2 * LAST as usize);

    // The next process removes what a dead process left.
    let child = stopped(&job, &format!("{render} --overwrite"));
    let said = job.expect(4, &last);
    assert_has(&said, &["busy is in use", "overwrite", "(-o)"]);
    kill(child);
    assert!(exists(".swell/work"));
    assert!(job.expect(0, &last).contains("0 frames rendered"));
    assert!(!exists(".swell"));
    assert!(pictures(&job.path("busy")) == all);
}

/// Into any cache, by any path.
#[test]
fn pictures_do_not_go_into_any_cache() {
    let job = job(2);
    let made = Made::default();
    write_cache(&job.path("other"), &made);
    fs::create_dir(job.path("begun")).unwrap();
    fs::copy(job.path("other/lock"), job.path("begun/lock")).unwrap();
    let mut targets = vec![
        "cache",
        "cache/pictures",
        "other",
        "other/frames",
        "other/a/b",
        "begun/a",
    ];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(job.path("other"), job.path("link")).unwrap();
        targets.push("link/pictures");
    }
    let hashes = || ["cache", "other", "begun"].map(|name| job.hash(name));
    let before = hashes();
    for target in targets {
        let said = job.expect(2, &format!("render cache --look look.toml -o {target}"));
        assert!(said.contains("is in the cache"), "{said}");
    }
    assert_eq!(hashes(), before);
    // Beside caches is allowed, also below the manifest of a web page.
    fs::create_dir(job.path("site")).unwrap();
    fs::write(job.path("site/manifest.json"), "{}").unwrap();
    job.expect(0, "render cache --look look.toml -o site/day --frames 1");
}
