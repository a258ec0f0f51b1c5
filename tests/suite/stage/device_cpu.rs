//! `--device cpu`: bakes without a GPU, with the same bytes for any number of threads.

use std::fs;

use crate::support::job::Job;

/// Runs without any Vulkan driver on `threads` threads, asserts the exit code and
/// returns the output.
fn expect(job: &Job, code: i32, threads: u32, words: &str) -> String {
    let output = job
        .command(words)
        .env("VK_DRIVER_FILES", "/nonexistent")
        .env("VK_ICD_FILENAMES", "/nonexistent")
        .env("RAYON_NUM_THREADS", threads.to_string())
        .output()
        .unwrap();
    let said = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    let said = said.concat();
    assert_eq!(output.status.code(), Some(code), "swell {words}: {said}");
    said
}

/// `other` is a setting that changes the physics; `pass` one of the solver's passes.
fn bakes_without_a_driver(solver: &str, other: &str, pass: &str) {
    let job = Job::new();
    let bake = format!("bake small.toml --solver {solver} -o");
    // Negative control: there is no GPU here.
    expect(&job, 3, 1, &format!("{bake} gpu"));
    let bake = format!("bake small.toml --device cpu --solver {solver} -o");
    let said = expect(&job, 0, 1, &format!("{bake} one"));
    let device = format!("{solver} on CPU f64 reference");
    assert!(said.contains(&device) && !said.contains(pass), "{said}");
    expect(&job, 0, 2, &format!("{bake} two"));
    expect(&job, 0, 3, &format!("{bake} three"));
    assert_eq!(job.hash("one"), job.hash("two"));
    assert_eq!(job.hash("one"), job.hash("three"));
    for frames in ["1", "1-4", "1-7"] {
        let part = format!("{bake} parts --resume --frames {frames}");
        expect(&job, 0, 2, &part);
        assert_ne!(job.hash("one"), job.hash("parts"));
    }
    expect(&job, 0, 2, &format!("{bake} parts --resume"));
    assert_eq!(job.hash("one"), job.hash("parts"));
    // Negative control: other physics, other bytes.
    expect(&job, 0, 2, &format!("{bake} other --set {other}"));
    assert_ne!(job.hash("one"), job.hash("other"));

    expect(&job, 0, 1, "verify one");
    let manifest = fs::read_to_string(job.path("one/manifest.json")).unwrap();
    assert!(
        manifest.contains("\"device\": \"CPU f64 reference\""),
        "{manifest}"
    );
    let shown = expect(&job, 0, 1, "inspect one");
    assert!(shown.contains("on CPU f64 reference"), "{shown}");
    let timed = format!("{bake} timed --time-passes --frames 1");
    let said = expect(&job, 0, 1, &timed);
    assert!(said.contains(pass), "{said}");
}

#[test]
fn bakes_without_a_driver_are_the_same_bytes_on_any_threads_and_after_any_stop() {
    bakes_without_a_driver("pbf", "solver.pbf.iterations=5", "effects/viscosity_gather");
}

#[test]
fn flip_bakes_without_a_driver_are_the_same_bytes_on_any_threads_and_after_any_stop() {
    bakes_without_a_driver("flip", "solver.flip.pic_blend=0.06", "flip/advect");
}

#[test]
fn caches_of_gpu_and_cpu_are_not_mixed() {
    let job = Job::new();
    job.expect(0, "bake small.toml -o gpu --frames 1");
    job.expect(0, "bake small.toml -o cpu --frames 1 --device cpu");
    for (words, was) in [
        ("bake small.toml -o gpu --resume --device cpu", "gpu"),
        ("bake small.toml -o cpu --resume", "cpu"),
    ] {
        let before = job.hash(was);
        let said = job.expect(4, words);
        assert!(
            said.contains("device") && said.contains("CPU f64 reference"),
            "{said}"
        );
        assert_eq!(job.hash(was), before);
    }
}

#[test]
fn what_the_reference_cannot_do_is_said() {
    let job = Job::new();
    let said = job.expect(2, "bake small.toml --device cpu --adapter llvmpipe");
    assert!(said.contains("--adapter llvmpipe"), "{said}");
    let said = job.expect(2, "bake small.toml --device tpu");
    assert!(said.contains("gpu, cpu"), "{said}");
    assert!(!job.path("cache").exists());
    let fast = "--set solver.pbf.max_substeps=1 --set water.gravity=[0,-2000,0]";
    let said = job.expect(5, &format!("bake small.toml --device cpu -o fast {fast}"));
    assert!(
        said.contains("frame 1") && said.contains("max_substeps"),
        "{said}"
    );
    job.expect(0, "verify fast");
}
