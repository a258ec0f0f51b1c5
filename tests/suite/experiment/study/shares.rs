//! Shares of a study, and the command that joins them.

use std::{
    collections::BTreeMap,
    fs,
    io::{BufRead as _, BufReader, Write as _},
    process::{Command, Stdio},
    thread,
};

use serde_json::Value;

use super::{ITERATIONS, SCENE, stability::FALL};
use crate::support::{
    events::{events, named, totals},
    job::{Job, assert_has},
};

/// Three points per line, one run each.
fn sweep() -> String {
    let text = ITERATIONS.replace("[1, 4]", "[1, 4, 8]");
    text.replace("repeats = 2", "repeats = 1")
}

fn job(study: &str) -> Job {
    Job::of(&[("tiny.toml", SCENE), ("s.toml", study)])
}

/// All files that a study leaves, by name.
fn pages(job: &Job) -> BTreeMap<String, Vec<u8>> {
    let files = ["out", "out/curves"].map(|folder| fs::read_dir(job.path(folder)).unwrap());
    let files = files
        .into_iter()
        .flatten()
        .map(|entry| entry.unwrap().path());
    let is_left = |name: &str| name == "results.jsonl" || !name.ends_with(".jsonl");
    let read = |path: std::path::PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        (path.is_file() && is_left(&name)).then(|| (name, fs::read(&path).unwrap()))
    };
    files.filter_map(read).collect()
}

/// Lines of the study's own ledger, without wall-clock times and shares.
fn lines(job: &Job) -> Vec<Value> {
    let text = fs::read_to_string(job.path("out/results.jsonl")).unwrap();
    let line = |line: &str| {
        let mut line: Value = serde_json::from_str(line).unwrap();
        line["run"]["seconds"].take();
        line.as_object_mut().unwrap().remove("share");
        line
    };
    text.lines().map(line).collect()
}

fn statuses(told: &[Value]) -> Vec<&str> {
    let points = named(told, "point").into_iter();
    points
        .map(|point| point["status"].as_str().unwrap())
        .collect()
}

fn share(k: u32, of: u32) -> String {
    format!("study s.toml -o out --chunk {k}/{of}")
}

#[test]
fn shares_that_are_joined_are_the_study_that_one_process_ran() {
    let text = sweep();
    let whole = job(&text);
    whole.expect(0, "study s.toml -o out");

    // All shares start at once, in a folder that does not exist yet.
    let shared = job(&text);
    thread::scope(|scope| {
        for k in 1..=3 {
            let shared = &shared;
            scope.spawn(move || {
                let told = events(shared, 0, &share(k, 3));
                assert_eq!(totals(&told), [2, 0, 0]);
                let end = told.last().unwrap();
                assert_eq!((&end["ran"], &end["stood"]), (&2.into(), &0.into()));
                assert!(end["left"].as_u64().unwrap() <= 4, "{end}");
            });
        }
    });
    assert!(!shared.path("out/index.html").exists());
    let files = "results.1-of-3.jsonl, results.2-of-3.jsonl, results.3-of-3.jsonl";
    let words = format!("are not joined ({files}); `swell study s.toml -o out`, with the shares'");
    shared.expect_clear(4, "view out", &words);
    // Results are counted when all are done; another division into shares runs none of them again.
    let told = events(&shared, 0, &share(4, 5));
    assert_eq!(
        (statuses(&told), &told.last().unwrap()["left"]),
        (vec!["stands there"], &0.into())
    );
    let told = events(&shared, 0, "study s.toml -o out");
    assert_eq!(statuses(&told), ["stands there"; 6]);
    let joined: Vec<_> = (named(&told, "joined").iter())
        .map(|event| {
            (
                event["ledger"].as_str().unwrap(),
                event["points"].as_u64().unwrap(),
            )
        })
        .collect();
    let ledgers = [1, 2, 3].map(|k| format!("results.{k}-of-3.jsonl"));
    assert_eq!(joined, ledgers.each_ref().map(|name| (&**name, 2)));
    assert_eq!(lines(&shared), lines(&whole));
    // Results are taken over once, but reported again, in case the joining command was interrupted
    // before anyone saw its report.
    let ledger = fs::read(shared.path("out/results.jsonl")).unwrap();
    let told = events(&shared, 0, "study s.toml -o out");
    assert_eq!(named(&told, "joined").len(), 3);
    assert_eq!(fs::read(shared.path("out/results.jsonl")).unwrap(), ledger);

    // With the same times, all files have the same bytes except for the remarks about shares. The
    // lines of the single run are rewritten as shares would have written them.
    let dealt = job(&text);
    fs::create_dir(dealt.path("out")).unwrap();
    let text = fs::read_to_string(whole.path("out/results.jsonl")).unwrap();
    for (k, name) in ledgers.iter().enumerate() {
        let own: String = text
            .split_inclusive('\n')
            .rev()
            .skip(k)
            .step_by(3)
            .map(|line| line.replacen('{', &format!("{{\"share\":\"{}/3\",", k + 1), 1))
            .collect();
        dealt.write(&format!("out/{name}"), &own);
    }
    let told = events(&dealt, 0, "study s.toml -o out");
    assert_eq!(statuses(&told), ["stands there"; 6]);
    let (mut ours, mut theirs) = (pages(&dealt), pages(&whole));
    let page = String::from_utf8(ours.remove("index.html").unwrap()).unwrap();
    let words = "<p>Of 6 points, share 1/3 ran 2, share 2/3 ran 2, share 3/3 ran 2 (results.jsonl \
        names each point's share). ";
    let begin = page.find(words).unwrap_or_else(|| panic!("{page}"));
    let end = begin + page[begin..].find('\n').unwrap() + 1;
    assert!(
        page[begin..end].contains("several machines: compare the times"),
        "{page}"
    );
    let rest = page[..begin].to_owned() + &page[end..];
    assert_eq!(rest.as_bytes(), theirs.remove("index.html").unwrap());
    for pages in [&mut ours, &mut theirs] {
        pages.remove("results.jsonl");
    }
    assert_eq!(ours, theirs);
    let mut lines_of_both = [&dealt, &whole].map(lines);
    for lines in &mut lines_of_both {
        lines.sort_by_key(|line| line["hash"].to_string());
    }
    assert_eq!(lines_of_both[0], lines_of_both[1]);
    // Negative control: the table contains times.
    assert_ne!(pages(&shared)["results.csv"], pages(&whole)["results.csv"]);
}

#[test]
fn what_no_share_has_is_run_and_what_does_not_fit_is_named() {
    let shared = job(&sweep());
    for k in [1, 3] {
        shared.expect(0, &share(k, 3));
    }
    let second = share(2, 3);
    let copy = shared.path("other-build");
    let program = fs::read(env!("CARGO_BIN_EXE_swell")).unwrap();
    fs::copy(env!("CARGO_BIN_EXE_swell"), &copy).unwrap();
    fs::write(&copy, [&program[..], b"\0"].concat()).unwrap();
    let mut other = Command::new(&copy);
    let other = other
        .current_dir(shared.folder.path())
        .args(second.split(' '));
    assert!(other.output().unwrap().status.success());
    fs::remove_file(&copy).unwrap();

    // While a worker runs, a second worker of its share and a joining command are refused.
    let ledger = fs::OpenOptions::new()
        .append(true)
        .open(shared.path("out/results.2-of-3.jsonl"));
    let mut ledger = ledger.unwrap();
    ledger.lock().unwrap();
    shared.expect_clear(
        4,
        &second,
        "results.2-of-3.jsonl: another process writes here",
    );
    shared.expect_clear(
        4,
        "study s.toml -o out",
        "results.2-of-3.jsonl: a worker writes here",
    );
    ledger.write_all(b"{\"hash\":").unwrap();
    drop(ledger);

    let told = events(&shared, 0, "study s.toml -o out");
    // Dealt from the coarse end: 1 of both, 4 of both, 8 of both.
    let (run, stands) = ("done", "stands there");
    assert_eq!(statuses(&told), [stands, stands, run, run, stands, stands]);
    let warnings: Vec<_> = (named(&told, "warning").iter())
        .map(|event| event["text"].as_str().unwrap())
        .collect();
    assert!(
        warnings[0].contains("results.2-of-3.jsonl ends in an incomplete line"),
        "{warnings:?}"
    );
    let of_builds = warnings
        .iter()
        .filter(|text| text.contains("was run by another build of the program"));
    assert_eq!((of_builds.count(), warnings.len()), (2, 3), "{warnings:?}");

    // After a change of the scene no result is reused, and each line is reported.
    shared.edit("tiny.toml", "[0.6, 0.6, 0.6]", "[0.6, 0.5, 0.6]");
    let said = shared.expect(0, "study s.toml -o out");
    assert_eq!(
        said.matches("was run with another scene, or other settings")
            .count(),
        4,
        "{said}"
    );
    assert_eq!(said.matches("  done").count(), 6, "{said}");

    // A damaged line.
    let file = shared.path("out/results.1-of-3.jsonl");
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, text.replacen("\"name\"", "\"nome\"", 1)).unwrap();
    shared.expect_clear(
        4,
        "study s.toml -o out",
        "results.1-of-3.jsonl:1: missing field `name`",
    );
    fs::write(&file, text).unwrap();
    shared.expect(0, "study s.toml -o out");
}

#[test]
fn a_share_that_is_killed_goes_on() {
    let values: Vec<String> = (1..=16).map(|k| k.to_string()).collect();
    let text = sweep().replace("[1, 4, 8]", &format!("[{}]", values.join(", ")));
    let shared = job(&text);
    let mut command = shared.command(&format!("{} --progress json", share(2, 2)));
    let mut worker = command.stdout(Stdio::piped()).spawn().unwrap();
    let mut told = BufReader::new(worker.stdout.take().unwrap()).lines();
    assert!(told.next().unwrap().unwrap().contains("\"number\":1"));
    worker.kill().unwrap();
    assert!(!worker.wait().unwrap().success());
    let path = shared.path("out/results.2-of-2.jsonl");
    let mut text = fs::read_to_string(&path).unwrap();
    let whole = text.matches('\n').count();
    assert!((1..16).contains(&whole), "{whole} of 16 were done");
    // As a host that crashed may leave it.
    text.push_str("{\"hash\":\"12");
    fs::write(&path, text).unwrap();
    let told = events(&shared, 0, &share(2, 2));
    assert_eq!(totals(&told), [16 - whole as u64, whole as u64, 0]);
    assert_eq!(told.last().unwrap()["left"], 16);
}

#[cfg(unix)]
#[test]
fn what_joins_shares_is_a_command_that_a_shell_takes() {
    let shared = Job::of(&[("tiny.toml", SCENE), ("dt's sweep.toml", &sweep())]);
    let swell = |words: &[&str]| shared.command("").args(words).output().unwrap();
    let options = ["-o", "new results", "--chunk", "1/2"];
    let done = swell(&[&["study", "dt's sweep.toml"], &options[..]].concat());
    assert!(done.status.success());
    let said = String::from_utf8(swell(&["view", "new results"]).stderr).unwrap();
    let command = said.split('`').nth(1).unwrap();
    assert_eq!(
        command,
        r"swell study 'dt'\''s sweep.toml' -o 'new results'"
    );
    let joined = Command::new("sh")
        .args([
            "-c",
            &format!("swell() {{ \"$SWELL\" \"$@\"; }}; {command}"),
        ])
        .env("SWELL", env!("CARGO_BIN_EXE_swell"))
        .current_dir(shared.folder.path())
        .output()
        .unwrap();
    assert!(joined.status.success(), "{joined:?}");
    assert!(shared.path("new results/index.html").is_file());
}

#[test]
fn other_kinds_have_shares_or_say_that_they_have_none() {
    let shared = job(FALL);
    // Each share has a run of the case. The second also has a search, which takes two runs and is
    // counted so before it begins.
    for (k, counts, left) in [(1, vec![1], 3), (2, vec![3, 3, 3], 0)] {
        let told = events(&shared, 0, &share(k, 2));
        let found: Vec<_> = (named(&told, "point").iter())
            .map(|point| point["count"].as_u64().unwrap())
            .collect();
        assert_eq!(
            (found, &told.last().unwrap()["left"]),
            (counts, &left.into())
        );
    }
    let said = job(FALL).expect(0, &share(1, 2));
    assert_has(&said, &["left of the whole study: at most 3"]);
    let told = events(&shared, 0, &share(1, 2));
    assert_eq!(told.last().unwrap()["left"], 0, "limits as well");
    let told = events(&shared, 0, "study s.toml -o out");
    assert_eq!((named(&told, "joined").len(), lines(&shared).len()), (2, 4));
    let whole = job(FALL);
    whole.expect(0, "study s.toml -o out");
    assert_eq!(lines(&shared), lines(&whole));

    // A run that ends a search early removes the others from the count: this one misses
    // its mark at once.
    let early = FALL
        .replace("passes = 1.0", "passes = 1e-4")
        .replace("fails = 1e-4", "fails = 1e-5");
    let told = events(&job(&early), 0, &share(2, 2));
    let points = named(&told, "point");
    let counts = [0, 1].map(|k| points[k]["count"].as_u64().unwrap());
    assert_eq!((points.len(), counts), (2, [3, 2]));

    // More shares than points: some are empty.
    let told = events(&shared, 0, &share(9, 9));
    assert!(named(&told, "point").is_empty());
    shared.expect_clear(2, &share(10, 9), "there is no share 10 of 9");
    let job = Job::new();
    let said = job.expect(2, "study study.toml -o out --chunk 1/2");
    assert_has(
        &said,
        &["of kind solver_comparison has no shares", "without --chunk"],
    );
    assert!(!job.path("out").exists());
}
