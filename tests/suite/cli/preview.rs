//! `swell render --preview`: a picture that follows the look file.
#![cfg(unix)]

use std::{
    fs,
    io::{BufRead as _, BufReader},
    process::{Child, ChildStdout, Command, Stdio},
};

use serde_json::Value;

use crate::support::job::Job;

/// A running preview of frame 1, and its events.
struct Shown {
    child: Child,
    events: BufReader<ChildStdout>,
}

impl Shown {
    fn begin(job: &Job) -> Self {
        let words = "render cache --look look.toml --frames 1 -o shown --preview --progress json";
        let mut child = (job.command(words))
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let events = BufReader::new(child.stdout.take().unwrap());
        Self { child, events }
    }

    /// The next event of this kind.
    fn next(&mut self, kind: &str) -> Value {
        let mut line = String::new();
        while self.events.read_line(&mut line).unwrap() > 0 {
            let event: Value = serde_json::from_str(&line).unwrap();
            if event["event"] == kind {
                return event;
            }
            line.clear();
        }
        panic!("the preview ended without {kind}");
    }

    /// Sizes and samples of the pictures until one is whole.
    fn steps(&mut self) -> Vec<[u64; 3]> {
        let mut steps = Vec::new();
        loop {
            let event = self.next("shown");
            steps.push(["width", "height", "samples"].map(|key| event[key].as_u64().unwrap()));
            if event["whole"] == true {
                return steps;
            }
        }
    }

    fn end(mut self) -> Option<i32> {
        let killed = Command::new("kill")
            .arg(self.child.id().to_string())
            .status();
        assert!(killed.unwrap().success());
        self.child.wait().unwrap().code()
    }
}

#[test]
fn a_preview_follows_the_look_and_ends_with_the_picture_of_a_render() {
    let job = Job::new();
    job.expect(0, "bake small.toml -o cache --frames 1-2");
    job.edit("look.toml", "samples = 1", "samples = 3");
    let all = [[16, 9, 1], [64, 36, 1], [64, 36, 3]];
    let picture = || fs::read(job.path("shown/preview.png")).unwrap();
    let rendered = |folder: &str| {
        job.expect(
            0,
            &format!("render cache --look look.toml --frames 1 -o {folder}"),
        );
        fs::read(job.path(folder).join("small.0001.png")).unwrap()
    };

    let mut shown = Shown::begin(&job);
    assert_eq!(shown.steps(), all);
    let first = picture();
    assert_eq!(first, rendered("first"));
    assert!(
        fs::read_to_string(job.path("shown/index.html"))
            .unwrap()
            .contains("preview.png")
    );

    // A comment changes nothing, another sun does.
    job.edit("look.toml", "[sun]", "# low\n[sun]");
    job.edit(
        "look.toml",
        "elevation_degrees = 35.0",
        "elevation_degrees = 15.0",
    );
    assert_eq!(shown.steps(), all);
    let low = picture();
    assert_ne!(low, first);
    assert_eq!(low, rendered("low"));

    // A look that cannot be read is told, and the picture stays until it can.
    job.edit("look.toml", "[sun]", "[sum]");
    let refused = shown.next("refused");
    assert!(
        refused["error"].as_str().unwrap().contains("sum"),
        "{refused}"
    );
    assert_eq!(picture(), low);
    // So is one that names a stream that is not there.
    job.edit(
        "look.toml",
        "[sum]",
        "[whitewater]\nstream = \"none\"\n[sun]",
    );
    let refused = shown.next("refused");
    assert!(
        refused["error"].as_str().unwrap().contains("none"),
        "{refused}"
    );
    assert_eq!(picture(), low);
    job.edit(
        "look.toml",
        "[whitewater]\nstream = \"none\"\n[sun]",
        "[sun]",
    );
    assert_eq!(shown.steps(), all);
    assert_eq!(picture(), low);
    assert_eq!(shown.end(), Some(130));
}

#[test]
fn a_preview_without_a_folder_or_of_several_frames_is_refused() {
    let job = Job::new();
    job.expect(0, "bake small.toml -o cache --frames 1-2");
    let preview = "render cache --look look.toml --preview";
    for (words, part) in [
        ("--frames 1", "--output"),
        ("-o shown", "--frames"),
        ("-o shown --frames 1-2", "--frames"),
        ("-o shown --frames 1 --overwrite", "--overwrite"),
        ("-o cache/shown --frames 1", "cache"),
    ] {
        let said = job.expect(2, &format!("{preview} {words}"));
        assert!(said.contains(part), "{words}: {said}");
    }
    assert!(!job.path("shown").exists() && !job.path("cache/shown").exists());
}
