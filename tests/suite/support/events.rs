//! Events of `--progress json`, as a render farm reads them.

use std::{collections::BTreeMap, fs, path::Path};

use serde_json::Value;

use super::{
    job::{Job, LOOK},
    made_cache::{Made, write_cache},
};

/// A folder with a look and a cache of frames 0 to 4 that no solver produced.
pub fn made() -> Job {
    let job = Job::of(&[("look.toml", LOOK)]);
    write_cache(&job.path("cache"), &Made::default());
    job
}

/// Returns what is wrong with the event stream of a command that ended with exit code `code`, or
/// `None` if nothing is.
pub fn fault(stdout: &str, code: i32) -> Option<String> {
    let mut seen = Vec::new();
    for line in stdout.lines() {
        let event: Value = match serde_json::from_str(line) {
            Ok(event) => event,
            Err(error) => return Some(format!("{error}: {line}")),
        };
        seen.push(event);
    }
    let is = |event: &Value, name: &str| event["event"] == name;
    let Some((end, before)) = seen.split_last() else {
        return Some("nothing was told".to_owned());
    };
    if !is(end, "end") || before.iter().any(|event| is(event, "end")) {
        return Some(format!("the last event alone has to be the end: {stdout}"));
    }
    if end["exit_code"] != code {
        return Some(format!("exit code {code}: {end}"));
    }
    let faults: Vec<&Value> = before.iter().filter(|event| is(event, "error")).collect();
    let is_fault = matches!(code, 2..=5);
    let told = faults.len() == usize::from(is_fault)
        && faults.iter().all(|event| {
            event["exit_code"] == code
                && event["message"]
                    .as_str()
                    .is_some_and(|text| !text.is_empty())
        });
    (!told).then(|| format!("{} errors for exit code {code}: {stdout}", faults.len()))
}

/// Runs a command, expects exit code `code` and a valid stream, and returns its events.
pub fn events(job: &Job, code: i32, words: &str) -> Vec<Value> {
    let output = job.run(&format!("{words} --progress json"));
    let stdout = String::from_utf8(output.stdout).unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(
        output.status.code(),
        Some(code),
        "{words}: {stdout}{stderr}"
    );
    assert_eq!(fault(&stdout, code), None, "{words}");
    stdout
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

pub fn named<'a>(events: &'a [Value], name: &str) -> Vec<&'a Value> {
    let named = events.iter().filter(|event| event["event"] == name);
    named.collect()
}

/// Numbers of frames done, skipped and failed, from the final event.
pub fn totals(events: &[Value]) -> [u64; 3] {
    let end = events.last().unwrap();
    ["frames_done", "frames_skipped", "frames_failed"].map(|key| end[key].as_u64().unwrap())
}

/// Total size of the files directly in a folder, bytes.
pub fn bytes(folder: &Path) -> u64 {
    let files = fs::read_dir(folder).unwrap();
    let files = files.map(|entry| entry.unwrap().metadata().unwrap());
    files
        .filter(fs::Metadata::is_file)
        .map(|meta| meta.len())
        .sum()
}

/// Asserts that each frame event has its number and the total count, and estimates the time left.
pub fn assert_counted(events: &[Value], count: u64) {
    let frames = named(events, "frame");
    assert_eq!(frames.len() as u64, count);
    let mut is_made = false;
    for (k, frame) in frames.iter().enumerate() {
        assert_eq!(frame["number"], k as u64 + 1, "{frame}");
        assert_eq!(frame["count"], count, "{frame}");
        is_made |= frame["status"] == "done";
        let is_last = k as u64 + 1 == count;
        assert_eq!(
            frame["seconds_left"].is_number(),
            is_made || is_last,
            "{frame}"
        );
    }
    assert_eq!(frames[frames.len() - 1]["seconds_left"], 0.0);
    assert_eq!(named(events, "ready")[0]["frames"], count);
}

/// Flips a bit in the last byte of a frame of the cache.
pub fn damage(job: &Job, frame: u32) {
    let file = job.path(&format!("cache/frames/small.{frame:04}.ply"));
    let mut bytes = fs::read(&file).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(file, bytes).unwrap();
}

/// Files of a folder and their bytes, without `render.json`, which records their origin.
pub fn pictures(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        assert!(path.is_file(), "{name} is left");
        if name != "render.json" {
            files.insert(name, fs::read(path).unwrap());
        }
    }
    files
}

/// Numbers of the frames whose event has this status.
pub fn frames(events: &[Value], status: &str) -> Vec<u64> {
    let frames = named(events, "frame").into_iter();
    let of = frames.filter(|event| event["status"] == status);
    of.map(|event| event["frame"].as_u64().unwrap()).collect()
}
