//! `swell study` on a terminal and for render farms.

use std::{fs, process::Command};

use super::{ITERATIONS, Job};

#[test]
fn study_command_reports_each_point() {
    let job = Job::new();
    fs::write(job.folder.path().join("s.toml"), ITERATIONS).unwrap();
    let run = |progress: &str| {
        Command::new(env!("CARGO_BIN_EXE_swell"))
            .current_dir(job.folder.path())
            .args(["study", "s.toml", "-o", "out", "--progress", progress])
            .output()
            .unwrap()
    };
    let output = run("plain");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(
        said.contains("point 1 of 4  jacobi, solver.pbf.iterations = 1  done"),
        "{said}"
    );
    // The finding depends on timings, its presence does not.
    assert!(
        said.contains("density_error_mean, jacobi: ") && said.contains("page: out"),
        "{said}"
    );
    // A failure is reported once.
    let failing = ITERATIONS.replace(
        "name = \"red_black\"",
        "name = \"red_black\"\nset = [\"solver.pbf.cfl=1e-4\", \"solver.pbf.max_substeps=1\"]",
    );
    fs::write(job.folder.path().join("s.toml"), failing).unwrap();
    let said = run("plain").stderr;
    let said = String::from_utf8_lossy(&said);
    assert_eq!(said.matches("point 3 of 4").count(), 1, "{said}");
    assert!(
        said.contains("red_black, solver.pbf.iterations = 1  failed: frame 1"),
        "{said}"
    );
    fs::write(job.folder.path().join("s.toml"), ITERATIONS).unwrap();
    let output = run("json");
    let lines = String::from_utf8(output.stdout).unwrap();
    let events: Vec<serde_json::Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(events[3]["status"], "stands there");
    assert_eq!(events[3]["count"], 4);

    // Another build of the program runs every point again.
    let program = fs::read(env!("CARGO_BIN_EXE_swell")).unwrap();
    for (name, more, status) in [
        ("copy", &b""[..], "stands there"),
        ("other", &b"\0"[..], "done"),
    ] {
        let path = job.folder.path().join(name);
        fs::copy(env!("CARGO_BIN_EXE_swell"), &path).unwrap();
        fs::write(&path, [&program[..], more].concat()).unwrap();
        let output = Command::new(&path)
            .current_dir(job.folder.path())
            .args(["study", "s.toml", "-o", "out", "--progress", "json"])
            .output()
            .unwrap();
        let lines = String::from_utf8(output.stdout).unwrap();
        let first: serde_json::Value = serde_json::from_str(lines.lines().next().unwrap()).unwrap();
        assert_eq!(first["status"], status, "{name}: {first}");
    }

    // A study does not begin while another process writes into the folder, or where the folder
    // holds anything else.
    let results = fs::File::open(job.folder.path().join("out/results.jsonl")).unwrap();
    results.lock().unwrap();
    let output = run("plain");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "{said}");
    assert!(said.contains("another process writes here"), "{said}");
    results.unlock().unwrap();
    assert!(run("plain").status.success());
    fs::remove_file(job.folder.path().join("out/results.jsonl")).unwrap();
    let page = job.folder.path().join("out/index.html");
    fs::write(&page, "mine").unwrap();
    let output = run("plain");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "{said}");
    assert!(said.contains("do not belong to a study"), "{said}");
    assert_eq!(fs::read_to_string(page).unwrap(), "mine");
}
