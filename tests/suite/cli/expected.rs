//! What is reported before anything is done: dry runs, and `swell inspect --json`.

use std::{collections::BTreeMap, fs, path::Path};

use serde_json::Value;

use crate::support::{
    events::{events, named},
    job::{Job, assert_has},
};

/// A folder's files with their contents, without locks, to compare before and after.
fn tree(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(folder).unwrap().display().to_string();
            match path.is_dir() {
                true => {
                    files.insert(name, Vec::new());
                    folders.push(path);
                }
                false => drop(files.insert(name, fs::read(path).unwrap())),
            }
        }
    }
    files
}

/// Returns what a dry run reports, and asserts that it changes nothing.
fn dry(job: &Job, words: &str) -> Value {
    let before = tree(job.folder.path());
    let told = events(job, 0, &format!("{words} --dry-run"));
    assert!(
        tree(job.folder.path()) == before,
        "{words}: something was written"
    );
    let told = named(&told, "dry_run");
    assert_eq!(told.len(), 1);
    told[0].clone()
}

#[test]
fn a_dry_run_tells_what_the_command_then_does() {
    let job = Job::new();
    let bake = "bake small.toml -o cache --device cpu --frames 1-3";
    let told = dry(&job, bake);
    assert_eq!((&told["frames"], &told["skipped"]), (&3.into(), &0.into()));
    let done = events(&job, 0, bake);
    // No water enters or leaves: each frame is as large as the start, except for the
    // numbers in its header.
    let [expected, written] = [&told, done.last().unwrap()].map(|it| it["bytes"].as_u64().unwrap());
    assert!(expected.abs_diff(written) < 3 * 40, "{expected} {written}");
    let told = dry(
        &job,
        "bake small.toml -o cache --device cpu --frames 1-5 --resume",
    );
    assert_eq!(told["numbers"], serde_json::json!([4, 5]));
    assert_eq!(told["skipped"], 3);
    // A dry run refuses what the command refuses.
    for words in [
        bake,
        "bake small.toml -o cache --resume --frames 6-8",
        "bake small.toml -o cache --resume --set water.gravity=[0,-9,0]",
        "bake none.toml",
        "bake small.toml -o . --frames 1",
        "render cache --look look.toml -o cache/in",
        "render cache --look look.toml --frames 3-9",
        "export cache --mesh m.ply",
        "whitewater cache --last 9",
    ] {
        let code = job.run(&format!("{words} --progress none")).status.code();
        let dry = job
            .run(&format!("{words} --dry-run --progress none"))
            .status;
        assert!(
            code != Some(0) && dry.code() == code,
            "{words}: {code:?} {dry:?}"
        );
    }

    let told = dry(&job, "whitewater cache --device cpu");
    assert_eq!((&told["frames"], &told["bytes"]), (&3.into(), &Value::Null));
    events(&job, 0, "whitewater cache --device cpu --last 2");
    let told = dry(&job, "whitewater cache --device cpu");
    assert_eq!(told["numbers"], serde_json::json!([3]));
    assert!(told["bytes"].as_u64().unwrap() > 100);

    // No device is opened, so a device that does not exist is no error.
    let render = "render cache --look look.toml -o day";
    let told = dry(&job, &format!("{render} --adapter 999"));
    assert_eq!((&told["frames"], &told["bytes"]), (&3.into(), &Value::Null));
    let done = events(&job, 0, &format!("{render} --frames 2"));
    let one = done.last().unwrap()["bytes"].as_u64().unwrap();
    let told = dry(&job, render);
    assert_eq!(told["numbers"], serde_json::json!([1, 3]));
    assert_eq!(
        (&told["skipped"], &told["bytes"]),
        (&1.into(), &(2 * one).into())
    );
    for (share, told) in [
        (
            1,
            "would make 1 frame (1), of unknown size; 0 already exist; in day",
        ),
        (2, "would make 0 frames, about 0 B; 1 already exist; in day"),
    ] {
        let said = job.expect(0, &format!("{render} --dry-run --chunk {share}/3"));
        assert_has(&said, &[told]);
    }
    assert_eq!(dry(&job, &format!("{render} --overwrite"))["frames"], 3);
    job.expect(4, "render cache --look wide.toml -o day --dry-run");

    let export = "export cache --npy p.%04d.npy --csv c.%04d.csv --usd s.usda";
    let told = dry(&job, export);
    assert_eq!((&told["frames"], &told["files"]), (&3.into(), &11.into()));
    let done = events(&job, 0, export);
    let [expected, written] = [&told, done.last().unwrap()].map(|it| it["bytes"].as_u64().unwrap());
    // Decimal numbers in tables vary in length.
    assert!(
        expected.abs_diff(written) * 10 < written,
        "{expected} {written}"
    );
    fs::remove_file(job.path("p.0002.npy")).unwrap();
    let told = dry(&job, export);
    let array = fs::metadata(job.path("p.0001.npy")).unwrap().len();
    assert_eq!((&told["files"], &told["bytes"]), (&1.into(), &array.into()));
}

#[test]
fn inspect_tells_programs_what_it_prints() {
    let job = Job::new();
    let scene = job.json(0, "inspect small.toml --time 1");
    let sum = |array: &Value| {
        let all = array.as_array().unwrap().iter();
        all.map(|it| it["bytes"].as_u64().unwrap()).sum::<u64>()
    };
    assert_eq!(
        (&scene["kind"], &scene["frames"]),
        (&"scene".into(), &8.into())
    );
    assert_eq!(sum(&scene["buffers"]), scene["device_bytes"]);
    assert_eq!(sum(&scene["parts"]), scene["device_bytes"]);
    let median = scene["time"]["seconds"]["median"].as_f64().unwrap();
    let shot = scene["time"]["shot_seconds"].as_f64().unwrap();
    assert!(median > 0.0 && (shot - 8.0 * median).abs() <= 1e-12 * shot);
    let passes = scene["passes"].as_array().unwrap();
    let printed = job.expect(0, "inspect small.toml");
    assert!(
        passes
            .iter()
            .all(|it| printed.contains(it["pass"].as_str().unwrap()))
    );
    assert!(passes.iter().any(|it| it["part"] == "viscosity"));
    assert_eq!(job.json(0, "inspect small.toml")["time"], Value::Null);

    job.expect(0, "bake small.toml -o cache --device cpu");
    job.expect(0, "whitewater cache --device cpu --last 2");
    let cache = job.json(0, "inspect cache");
    let frames = cache["frames"].as_array().unwrap();
    assert_eq!((frames.len(), &cache["last"]), (9, &8.into()));
    let on_disk: u64 = tree(&job.path("cache"))
        .values()
        .map(|it| it.len() as u64)
        .sum();
    assert_eq!(cache["disk_bytes"], on_disk);
    assert_eq!(cache["streams"][0]["bytes"], sum(&cache["frames"]));
    // The bake's size was known in advance, except for the numbers in the frames' headers.
    let expected = scene["disk_bytes"].as_u64().unwrap();
    assert!(expected.abs_diff(sum(&cache["frames"])) < 9 * 40);
    assert_eq!(cache["device_bytes"], scene["device_bytes"]);
    assert_eq!(
        (
            &cache["whitewater"][0]["name"],
            &cache["whitewater"][0]["last"]
        ),
        (&"default".into(), &2.into())
    );
    assert_eq!(cache["seconds"]["frames"], 8);
    let stream = job.json(0, "inspect cache/whitewater/default");
    assert_eq!(
        (&stream["kind"], &stream["device_bytes"]),
        (&"whitewater".into(), &Value::Null)
    );

    let look = job.json(0, "inspect look.toml --scene cache");
    assert_eq!(
        sum(&look["buffers"]) + sum(&look["textures"]),
        look["device_bytes"]
    );
    assert_eq!(
        (&look["kind"], &look["width"]),
        (&"look".into(), &64.into())
    );
    let adapters = job.json(0, "inspect --adapters");
    assert_eq!(adapters["adapters"][0]["index"], 0);
    assert!(adapters["adapters"][0]["limits"]["max_buffer_size"].is_u64());
    let rounding = &adapters["adapters"][0]["rounding"];
    assert!(
        (0.4..=2.5).contains(&rounding["division_ulp"].as_f64().unwrap()),
        "{rounding}"
    );
    assert_eq!(rounding["keeps_two_words"], true);
    // Faults are the same as without --json.
    job.expect(2, "inspect cache --json --time 1");
    job.expect(2, "inspect none.toml --json");
    job.expect(4, "inspect none --json");
    job.expect(2, "inspect cache --json --plot plots");
    let text = job.expect(2, "inspect small.toml --json --adapter 999");
    assert_has(&text, &["no adapter"]);
}
