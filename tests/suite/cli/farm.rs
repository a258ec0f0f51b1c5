//! The interface to render farms: events, exit codes, logs, environment variables.

use std::{
    fs,
    io::{BufRead, BufReader},
    process::Stdio,
};

use crate::support::{
    events::{assert_counted, bytes, damage, events, fault, made, named, totals},
    job::{Job, assert_has},
};

#[test]
fn events_end_with_the_totals_of_each_command() {
    let job = Job::new();
    let told = events(
        &job,
        0,
        "bake small.toml -o cache --frames 1-3 --device cpu",
    );
    assert_counted(&told, 3);
    assert_eq!(totals(&told), [3, 0, 0]);
    let frames: u64 = (1..=3)
        .map(|k| {
            let file = format!("cache/frames/small.{k:04}.ply");
            fs::metadata(job.path(&file)).unwrap().len()
        })
        .sum();
    assert_eq!(told.last().unwrap()["bytes"], frames);
    let told = events(
        &job,
        0,
        "bake small.toml -o cache --frames 1-3 --device cpu --resume",
    );
    assert_eq!((totals(&told), named(&told, "frame").len()), ([0; 3], 0));

    let told = events(&job, 0, "whitewater cache --device cpu");
    assert_counted(&told, 3);
    assert_eq!(totals(&told), [3, 0, 0]);

    let render = "render cache --look look.toml -o day";
    events(&job, 0, &format!("{render} --frames 1"));
    let told = events(&job, 0, &format!("{render} --time-passes"));
    assert_counted(&told, 3);
    assert_eq!(totals(&told), [2, 1, 0]);
    assert_eq!(named(&told, "frame")[0]["status"], "skipped");
    let event = &named(&told, "passes")[0];
    let passes = event["passes"].as_array().unwrap();
    let shade = passes.iter().find(|pass| pass["pass"] == "ssfr/shade_aovs");
    assert!(shade.unwrap()["bytes"].as_u64().unwrap() > 0);
    for ceiling in ["bandwidth", "arithmetic", "start"] {
        assert!(event[ceiling].as_f64().unwrap() > 0.0, "{ceiling}");
    }
    for kind in ["float_operations", "integer_operations"] {
        assert!(shade.unwrap()[kind].as_u64().unwrap() > 0, "{kind}");
    }
    let solid = passes.iter().find(|pass| pass["pass"] == "ssfr/solid");
    assert!(solid.unwrap()["waits_for"].is_null(), "a raster pass");
    let told = events(&job, 0, &format!("{render} --overwrite"));
    let record = fs::metadata(job.path("day/render.json")).unwrap().len();
    assert_eq!(
        told.last().unwrap()["bytes"],
        bytes(&job.path("day")) - record
    );

    fs::create_dir(job.path("out")).unwrap();
    let told = events(&job, 0, "export cache --npy out/p.%04d.npy");
    assert_counted(&told, 3);
    assert_eq!(told.last().unwrap()["bytes"], bytes(&job.path("out")));

    let told = events(&job, 0, "check cache --frames 1,2");
    assert_counted(&told, 2);
    let rows = named(&told, "result")[0]["rows"].as_array().unwrap();
    assert!(rows.len() > 5);
    let code = job.run("check cache --render --look look.toml").status;
    let told = events(
        &job,
        code.code().unwrap(),
        "check cache --render --look look.toml",
    );
    assert_counted(&told, 1);
    assert_eq!(named(&told, "result")[0]["frames"][0], 3);
}

/// A frame reports its start and its number of parts before its own event; frames that already
/// exist report none.
#[test]
fn parts_of_a_frame_are_told() {
    let job = Job::new();
    job.expect(0, "bake small.toml -o cache --frames 1-3 --device cpu");
    job.edit("look.toml", "samples = 1", "samples = 3");
    job.edit("look.toml", "[sky]", "[renderer]\nmethod = \"ray\"\n[sky]");
    let render = "render cache --look look.toml -o rays --frames 1-3";
    let told = events(&job, 0, render);
    assert_counted(&told, 3);
    for frame in 1..=3u64 {
        let of_frame = |name: &str| {
            let found =
                |event: &serde_json::Value| event["event"] == name && event["frame"] == frame;
            told.iter().position(found)
        };
        let begun = of_frame("part").unwrap();
        assert!(begun < of_frame("frame").unwrap());
        // Three samples, and one for the channel beside the picture.
        let begun = &told[begun];
        assert_eq!((&begun["of"], &begun["done"]), (&"frame".into(), &0.into()));
        assert_eq!(begun["count"], 4);
    }
    assert!(named(&events(&job, 0, render), "part").is_empty());
}

#[test]
fn events_of_a_study_end_with_the_totals_of_its_points() {
    let job = Job::new();
    job.write(
        "refusal.toml",
        "kind = \"stability\"\n[[case]]\nnumber = 1\nname = \"a name that is none\"\n\
         scene = \"small.toml\"\ndevices = [\"cpu\"]\n\
         set = [\"shot.name=../up\"]\nrefused = [\"not a safe file name\"]\n",
    );
    let told = events(&job, 0, "study refusal.toml -o s");
    let points = named(&told, "point");
    assert_eq!(totals(&told), [points.len() as u64, 0, 0]);
    for (k, point) in points.iter().enumerate() {
        assert_eq!(point["count"], points.len(), "{point}");
        assert_eq!(point["number"], k + 1, "{point}");
        assert!(point["status"] == "done" && point["seconds_left"].is_number());
    }
}

#[test]
fn a_fault_is_an_event_with_its_exit_code() {
    let job = made();
    let told = |code: i32, words: &str, part: &str| {
        let told = events(&job, code, words);
        let error = named(&told, "error")[0]["message"].as_str().unwrap();
        assert!(error.contains(part), "{words}: {error}");
        told
    };
    told(2, "bake none.toml", "none.toml");
    told(4, "render none --look look.toml", "none");
    told(2, "study none.toml", "none.toml");
    told(2, "check none.toml", "none.toml");
    told(4, "whitewater none", "none");
    // Faults found while the arguments are parsed.
    told(2, "render cache", "--look");
    told(
        2,
        "export cache --npy p.%04d.npy --chunk 5/4",
        "no share 5 of 4",
    );
    told(2, "render cache --look look.toml --nonsense", "--nonsense");
    damage(&job, 3);
    let all = told(4, "export cache --npy p.%04d.npy", "small.0003.ply");
    assert_eq!(totals(&all), [2, 0, 0], "what was done before");
    assert_eq!(all.last().unwrap()["bytes"], bytes_of(&job, &[1, 2]));

    // Negative controls: streams that are not complete.
    let good = "{\"event\":\"error\",\"exit_code\":2,\"message\":\"m\"}\n\
        {\"event\":\"end\",\"exit_code\":2}\n";
    assert_eq!(fault(good, 2), None);
    let end = "{\"event\":\"end\",\"exit_code\":2}\n";
    for bad in [
        "",
        end,
        &good[..good.len() - 9],
        &good.replace("\"end\"", "\"frame\""),
        &format!("{end}{good}"),
        &format!("{good}done\n"),
        &good.replace("code\":2,", "code\":4,"),
    ] {
        assert!(fault(bad, 2).is_some(), "{bad}");
    }
    assert!(fault(good, 0).is_some());
}

/// Total size of exported arrays, bytes.
fn bytes_of(job: &Job, frames: &[u32]) -> u64 {
    let length = |frame: &u32| {
        let file = job.path(&format!("p.{frame:04}.npy"));
        fs::metadata(file).unwrap().len()
    };
    frames.iter().map(length).sum()
}

/// A reader that closes the pipe costs no picture, and the exit code reports it.
#[cfg(unix)]
#[test]
fn events_that_cannot_be_written_are_exit_code_4() {
    let job = made();
    let mut command = job.command("render cache --look look.toml -o day --progress json");
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(lines.next().unwrap().unwrap().contains("ready"));
    drop(lines);
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "{said}");
    assert_has(&said, &["cannot write to standard output"]);
    let told = events(&job, 0, "render cache --look look.toml -o day");
    assert_eq!(totals(&told), [0, 4, 0], "all were rendered");
}

/// A log's lines without their times, whose format is checked.
fn logged(job: &Job, file: &str) -> Vec<String> {
    let text = fs::read_to_string(job.path(file)).unwrap();
    let lines = text.lines().map(|line| {
        let (time, rest) = line.split_once(' ').unwrap();
        let form: String = time
            .chars()
            .map(|c| if c.is_ascii_digit() { '0' } else { c })
            .collect();
        assert_eq!(form, "0000-00-00T00:00:00Z", "{line}");
        rest.to_owned()
    });
    lines.collect()
}

#[test]
fn a_log_has_what_was_said_and_how_it_ended() {
    let job = made();
    let words = "export cache --npy p.%04d.npy --frames 1-2 --log farm.log";
    let output = job.run(words);
    let said = String::from_utf8(output.stderr).unwrap();
    let first = logged(&job, "farm.log");
    let wanted: Vec<String> = [format!("swell {words}")]
        .into_iter()
        .chain(said.lines().map(str::to_owned))
        .chain(["exit code 0".to_owned()])
        .collect();
    assert_eq!(first, wanted);
    assert!(said.lines().any(|line| line.starts_with("frame    2")));
    // Later runs append to the log, whatever goes to the terminal, including errors.
    for (code, words) in [
        (
            0,
            "--log farm.log export cache --npy p.%04d.npy --progress none",
        ),
        (
            0,
            "export cache --npy p.%04d.npy --progress json --log farm.log",
        ),
        (2, "inspect none.toml --log farm.log"),
    ] {
        let before = logged(&job, "farm.log");
        job.expect(code, words);
        let now = logged(&job, "farm.log");
        assert_eq!(now[..before.len()], before);
        let new = &now[before.len()..];
        assert_eq!(new[0], format!("swell {words}"));
        assert_eq!(new[new.len() - 1], format!("exit code {code}"));
        let part = if code == 0 { "frame    3" } else { "none.toml" };
        let text = new[1..].join("\n");
        assert!(text.contains(part), "{words}: {text}");
    }
    let said = job.expect(
        4,
        "export cache --npy q.%04d.npy --log gone/farm.log --progress none",
    );
    assert_has(&said, &["--log gone/farm.log"]);
    assert!(!job.path("q.0001.npy").exists());
    #[cfg(target_os = "linux")]
    {
        let said = job.expect(
            4,
            "export cache --npy q.%04d.npy --log /dev/full --progress none",
        );
        assert_has(&said, &["cannot write to the log"]);
        assert!(job.path("q.0004.npy").exists(), "the work was done");
    }
}

/// Runs a command with variables set and returns its output.
fn with(job: &Job, variables: &[(&str, &str)], code: i32, words: &str) -> String {
    let mut command = job.command(words);
    let output = command.envs(variables.iter().copied()).output().unwrap();
    let said = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    assert_eq!(output.status.code(), Some(code), "{words}: {said}");
    said
}

#[test]
fn the_environment_names_adapter_and_caches() {
    let job = Job::new();
    let root = job.path("farm");
    let caches = [("SWELL_CACHE", root.to_str().unwrap())];
    let bake = "bake small.toml --device cpu --frames 1";
    with(&job, &caches, 0, bake);
    assert!(root.join("small/pbf/manifest.json").exists() && !job.path("cache").exists());
    // -o takes precedence, and an empty variable counts as unset.
    with(&job, &caches, 0, &format!("{bake} -o other"));
    assert!(job.path("other/manifest.json").exists());
    with(&job, &[("SWELL_CACHE", "")], 0, bake);
    assert!(job.path("cache/small/pbf/manifest.json").exists());

    let none = [("SWELL_ADAPTER", "999")];
    for words in [
        "bake small.toml -o new",
        "check small.toml",
        "render other --look look.toml -o new",
        "inspect small.toml",
        "inspect look.toml",
    ] {
        let said = with(&job, &none, 2, words);
        assert_has(&said, &["no adapter matches `999`"]);
        // The flag takes precedence.
        if !words.contains("new") {
            with(&job, &none, 0, &format!("{words} --adapter 0"));
        }
    }
    assert!(!job.path("new").exists());
    // Commands that use no adapter ignore it.
    for words in [
        "bake small.toml --device cpu --frames 1 -o third",
        "inspect other",
        "inspect --adapters",
        "verify other",
    ] {
        with(&job, &none, 0, words);
    }
    with(&job, &[("SWELL_ADAPTER", "")], 0, "check small.toml");
}

/// On request a software adapter is refused with the device's exit code, and nothing is written.
/// Controls: the same commands without the request, and on an adapter that is hardware.
#[test]
fn software_adapters_are_refused_on_request() {
    let job = Job::new();
    job.expect(0, "bake small.toml -o cache --device cpu --frames 1");
    let adapters = job.json(0, "inspect --adapters");
    let all = adapters["adapters"].as_array().unwrap();
    let is_software = |it: &&serde_json::Value| it["kind"].as_str().unwrap().ends_with(", Cpu");
    let commands = [
        "inspect small.toml",
        "inspect look.toml",
        "check small.toml",
        "bake small.toml --frames 1 -o new",
        "render cache --look look.toml -o new",
        "whitewater cache",
    ];
    let required = |value| [("SWELL_REQUIRE_GPU", value)];
    if let Some(software) = all.iter().find(is_software) {
        let (index, name) = (&software["index"], software["name"].as_str().unwrap());
        for words in commands {
            let words = format!("{words} --adapter {index}");
            let said = with(&job, &[], 3, &format!("{words} --require gpu"));
            let expected = format!("adapter {name} is software, and a GPU is required");
            assert_has(&said, &[&expected, "(--require, SWELL_REQUIRE_GPU)"]);
            assert_has(&with(&job, &required("1"), 3, &words), &[&expected]);
            assert!(!job.path("new").exists() && !job.path("cache/whitewater").exists());
        }
        for words in &commands[..3] {
            let words = format!("{words} --adapter {index}");
            for value in ["", "0"] {
                let said = with(&job, &required(value), 0, &words);
                assert!(!said.contains("is required"), "{said}");
            }
        }
    }
    if let Some(hardware) = all.iter().find(|it| !is_software(it)) {
        for words in commands {
            let words = format!("{words} --adapter {} --require gpu", hardware["index"]);
            job.expect(0, &words);
            if words.contains("new") {
                fs::remove_dir_all(job.path("new")).unwrap();
            }
        }
    }
    // The reference on the processor is asked for by name, and a dry run opens no device.
    for words in [
        "bake small.toml --device cpu --frames 1 -o third",
        "bake small.toml --frames 1 -o fourth --dry-run",
        "inspect cache",
    ] {
        with(&job, &required("1"), 0, words);
    }
    let said = job.expect(2, "bake small.toml --device cpu --require gpu -o fifth");
    assert_has(&said, &["--require asks for a GPU, and --device is cpu"]);
    job.expect(2, "bake small.toml --require cpu -o fifth");
    for words in [
        "inspect cache --require gpu",
        "inspect --adapters --require gpu",
    ] {
        assert_has(&job.expect(2, words), &["--require", "scenes"]);
    }
}

/// Without any driver a plan is made for common limits, unless a GPU is required.
#[cfg(target_os = "linux")]
#[test]
fn a_required_gpu_has_to_be_there() {
    let job = Job::new();
    let none = [
        ("VK_DRIVER_FILES", "/nonexistent"),
        ("VK_ICD_FILENAMES", "/nonexistent"),
    ];
    for words in ["inspect small.toml", "inspect look.toml"] {
        assert_has(&with(&job, &none, 0, words), &["no adapter here"]);
        let said = with(&job, &none, 3, &format!("{words} --require gpu"));
        assert_has(&said, &["no GPU adapter found"]);
    }
}
