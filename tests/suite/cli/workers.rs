//! Shares of a range, damaged frames, killed workers.

use std::{collections::BTreeMap, fs, process::Stdio};

use serde_json::Value;

use crate::support::{
    events::{assert_counted, damage, events, frames, made, named, pictures, totals},
    job::{Job, LOOK, assert_has},
    made_cache::{Made, write_cache},
};

#[test]
fn a_damaged_frame_is_told_and_the_others_are_rendered() {
    let job = made();
    let render = "render cache --look look.toml -o";
    job.expect(0, &format!("{render} whole"));
    let mut whole = pictures(&job.path("whole"));
    let frame = job.path("cache/frames/small.0002.ply");
    let bytes = fs::read(&frame).unwrap();
    damage(&job, 2);
    let told = events(&job, 4, &format!("{render} day --keep-going"));
    assert_counted(&told, 4);
    assert_eq!(
        (frames(&told, "done"), totals(&told)),
        (vec![1, 3, 4], [3, 0, 1])
    );
    assert_eq!(frames(&told, "failed"), [2]);
    assert_eq!(told.last().unwrap()["failed"], serde_json::json!([2]));
    let failed = named(&told, "frame")[1]["message"].as_str().unwrap();
    assert_has(failed, &["small.0002.ply is damaged"]);
    assert_eq!(named(&told, "error")[0]["message"], "1 frame failed: 2");
    let good = whole.clone();
    whole.retain(|name, _| !name.contains("0002"));
    assert!(pictures(&job.path("day")) == whole && good.len() == whole.len() + 2);
    // Negative control: without the flag the frames after it are not rendered.
    let told = events(&job, 4, &format!("{render} stopped"));
    assert_eq!(totals(&told), [1, 0, 0]);
    // A missing frame is treated the same, and so is one of a stream.
    fs::remove_file(&frame).unwrap();
    let said = job.expect(4, &format!("{render} day --keep-going"));
    assert_has(
        &said,
        &["1 failed", "frame    2  failed:", "1 frame failed: 2"],
    );
    fs::write(&frame, bytes).unwrap();
    let told = events(&job, 0, &format!("{render} day --keep-going"));
    assert_eq!(totals(&told), [1, 3, 0]);
    assert!(pictures(&job.path("day")) == good);
    // Frames that were never baked are a wrong range, with any flags.
    let said = job.expect(4, &format!("{render} more --keep-going --frames 3-9"));
    assert_has(&said, &["frames 0 to 4, not 5"]);
    assert!(!job.path("more").exists());
}

#[test]
fn a_damaged_frame_is_told_and_the_others_are_exported() {
    let job = made();
    let export = "export cache --npy p.%04d.npy --mesh m.%04d.ply";
    damage(&job, 3);
    let told = events(&job, 4, &format!("{export} --keep-going"));
    assert_eq!(
        (frames(&told, "done"), frames(&told, "failed")),
        (vec![1, 2, 4], vec![3])
    );
    assert_eq!(totals(&told), [3, 0, 1]);
    assert!(job.path("m.0004.ply").exists() && !job.path("p.0003.npy").exists());
    damage(&job, 1);
    let said = job.expect(4, &format!("{export} --keep-going --overwrite"));
    assert_has(&said, &["2 frames failed: 1, 3", "2 failed"]);
    // Bakes and whitewater need every earlier frame, so they cannot continue after a damaged one.
    job.expect(2, "whitewater cache --keep-going");
}

#[test]
fn shares_of_a_range_are_rendered_into_one_folder() {
    let job = made();
    let render = "render cache --look look.toml -o";
    job.expect(0, &format!("{render} whole"));
    let mut all = Vec::new();
    for share in 1..=3 {
        let told = events(&job, 0, &format!("{render} shared --chunk {share}/3"));
        assert_eq!(named(&told, "ready")[0]["frames"], totals(&told)[0]);
        all.push(frames(&told, "done"));
    }
    assert_eq!(all, [vec![1], vec![2], vec![3, 4]]);
    assert!(pictures(&job.path("whole")) == pictures(&job.path("shared")));
    let told = events(
        &job,
        0,
        &format!("{render} some --frames 1-4x2 --chunk 2/2"),
    );
    assert_eq!(frames(&told, "done"), [3]);
    // More shares than frames: some are empty.
    let told = events(&job, 0, &format!("{render} empty --chunk 1/9"));
    assert_eq!((totals(&told), job.path("empty").exists()), ([0; 3], false));
    for (chunk, part) in [
        ("5/4", "there is no share 5 of 4: the shares are 1/4 to 4/4"),
        ("0/4", "there is no share 0 of 4"),
        ("1/0", "`1/0` is not a share: write 1/4"),
        ("half", "`half` is not a share"),
    ] {
        for command in [&format!("{render} new"), "export cache --npy new.%04d.npy"] {
            let said = job.expect(2, &format!("{command} --chunk {chunk}"));
            assert_has(said.lines().next().unwrap(), &[part]);
        }
    }
    assert!(!job.path("new").exists() && !job.path("new.0001.npy").exists());
}

/// Counts how often each frame was made, according to several workers' events.
fn made_by(workers: &[Vec<Value>]) -> BTreeMap<u64, usize> {
    let mut made = BTreeMap::new();
    for frame in workers.iter().flat_map(|told| frames(told, "done")) {
        *made.entry(frame).or_insert(0) += 1;
    }
    made
}

/// The complete events of a worker that may have been killed while it wrote one.
#[cfg(unix)]
fn told_by(output: &std::process::Output) -> Vec<Value> {
    let text = String::from_utf8_lossy(&output.stdout);
    let lines = text
        .split_inclusive('\n')
        .filter(|line| line.ends_with('\n'));
    lines
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// Three workers on one render; one is killed and one is told to stop, each at a random time.
/// SWELL_ROUNDS sets the number of rounds.
#[cfg(unix)]
#[test]
fn workers_that_are_killed_and_stopped_cost_no_frame() {
    use std::time::{Duration, Instant};
    let rounds = std::env::var("SWELL_ROUNDS").map_or(20, |text| text.parse().unwrap());
    let job = Job::of(&[("look.toml", LOOK)]);
    let last = 12;
    write_cache(
        &job.path("cache"),
        &Made {
            last,
            ..Made::default()
        },
    );
    let render = "render cache --look look.toml --progress json -o";
    let begun = Instant::now();
    job.expect(0, &format!("{render} alone"));
    let alone = begun.elapsed();
    let wanted = pictures(&job.path("alone"));
    let (mut killed, mut stopped) = (0, 0);
    for round in 0..rounds {
        let words = format!("{render} round{round}");
        let mut workers: Vec<_> = (0..3)
            .map(|_| {
                let mut command = job.command(&words);
                command.stdout(Stdio::piped()).stderr(Stdio::piped());
                command.spawn().unwrap()
            })
            .collect();
        // Up to the time that one worker needs for all frames.
        let at = |k: u64| {
            alone
                .mul_f64(0.5 + 0.5 * crate::support::noise(2 * round + k))
                .max(Duration::ZERO)
        };
        let mut faults = [(at(0), "-KILL", 0), (at(1), "-TERM", 1)];
        faults.sort();
        let begun = Instant::now();
        for (when, signal, worker) in faults {
            std::thread::sleep(when.saturating_sub(begun.elapsed()));
            let id = workers[worker].id().to_string();
            // A worker that has finished no longer exists.
            if workers[worker].try_wait().unwrap().is_none() {
                std::process::Command::new("kill")
                    .args([signal, &id])
                    .status()
                    .unwrap();
            }
        }
        let outputs: Vec<_> = workers
            .drain(..)
            .map(|it| it.wait_with_output().unwrap())
            .collect();
        killed += u32::from(outputs[0].status.code().is_none());
        stopped += u32::from(outputs[1].status.code() == Some(130));
        assert_eq!(outputs[2].status.code(), Some(0), "round {round}");
        let told: Vec<Vec<Value>> = outputs.iter().map(told_by).collect();
        let made = made_by(&told);
        assert!(
            made.values().all(|&many| many == 1),
            "round {round}: {made:?}"
        );
        // The killed worker may have renamed its last frame without reporting it.
        assert!(made.len() as u32 + 1 >= last, "round {round}: {made:?}");
        let folder = job.path(&format!("round{round}"));
        if folder.join(".swell").exists() {
            // A worker killed while the last one leaves cannot clean up: the next to come does, and
            // renders nothing.
            assert!(outputs[0].status.code().is_none(), "round {round}");
            let told = events(
                &job,
                0,
                &format!("render cache --look look.toml -o round{round}"),
            );
            assert_eq!(totals(&told), [0, u64::from(last), 0], "round {round}");
        }
        assert!(pictures(&folder) == wanted, "round {round}");
    }
    println!(
        "{rounds} rounds of three workers: {killed} killed at work, {stopped} stopped at work"
    );
    assert!(
        rounds < 20 || (killed > 0 && stopped > 0),
        "{killed} {stopped}"
    );
    // Negative controls: a frame that two workers made, and a picture that differs.
    let told = events(&job, 0, "render cache --look look.toml -o again");
    let twice = made_by(&[told.clone(), told]);
    assert!(twice.values().all(|&many| many == 2) && twice.len() as u32 == last);
    let mut other = wanted.clone();
    other.values_mut().next().unwrap()[100] ^= 1;
    assert!(other != wanted && pictures(&job.path("again")) == wanted);
}
