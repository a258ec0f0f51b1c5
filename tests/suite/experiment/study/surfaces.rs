//! Studies of the drawn surface: baked once, drawn, resumed, refused.

use super::{Job, stands};

const LOOK: &str = "[camera]\nfocal_length_mm = 35.0\nfilm_back_mm = [36.0, 24.0]\n\
    position = [-1.0, 1.2, 1.5]\n\
    target = [0.5, 0.3, 0.3]\n[image]\nwidth = 72\nheight = 48\nsamples = 1\n[sky]\n\
    model = \"hosek_wilkie\"\n";

const SURFACE: &str = r#"
kind = "surface"
about = ["Why <this> is drawn."]
scene = "tiny.toml"
look = "look.toml"
frames = "2,4"
repeats = 2
errors = ["normal_off", "silhouette", "colour"]
[[line]]
name = "by width"
key = "surface.smoothing_width_m"
values = [0.0, 0.1]
[[line]]
name = "by voxels"
set = ["renderer.method=ray"]
key = "surface.voxels_per_spacing"
values = [1.0, 2.0]
"#;

fn job() -> Job {
    let job = Job::new();
    std::fs::write(job.folder.path().join("look.toml"), LOOK).unwrap();
    job
}

#[test]
fn surface_study_draws_each_point_once_and_reports_it() {
    let job = job();
    let (outcome, points) = job.run(SURFACE, false).unwrap();
    assert_eq!((points.len(), stands(&points)), (4, 0));
    assert!(
        outcome
            .findings
            .iter()
            .any(|f| f.starts_with("normal_off, by width: "))
    );
    assert_eq!(
        job.column("line"),
        ["by width", "by width", "by voxels", "by voxels"]
    );
    assert_eq!(job.column("setting"), ["0.0", "0.1", "1.0", "2.0"]);
    assert_eq!(job.column("repeats"), ["2"; 4]);
    // Rays are closer to the truth than splats, and rays with finer voxels are closer still; the
    // flat sides of the box hide that from the median of normals.
    let [normal, colour] = ["normal_off", "colour"].map(|column| job.numbers(column));
    assert!(normal[3] < normal[0], "{normal:?}");
    assert!(colour[3] < colour[2] && colour[3] < colour[0], "{colour:?}");
    let page = job.read("index.html");
    assert_eq!(page.matches("<svg").count(), 3);
    assert!(page.contains("Why &lt;this&gt; is drawn.") && page.contains("<h2>Knees</h2>"));
    // Existing results are reused; a new value is drawn.
    let (_, again) = job.run(SURFACE, false).unwrap();
    assert_eq!(stands(&again), 4);
    let (_, more) = job
        .run(&SURFACE.replace("[0.0, 0.1]", "[0.0, 0.2]"), false)
        .unwrap();
    assert_eq!(stands(&more), 3);
}

#[test]
fn what_a_surface_study_cannot_be_is_named() {
    let job = job();
    for (from, to, expected) in [
        (
            "key = \"surface.smoothing_width_m\"",
            "key = \"camera.focal_length_mm\"",
            "s.toml:11: line[0].key: \"camera.focal_length_mm\" is not one of surface.filter",
        ),
        (
            "values = [0.0, 0.1]",
            "values = [0.0, -0.1]",
            "surface.smoothing_width_m: -0.1 is out of range",
        ),
        (
            "values = [0.0, 0.1]",
            "values = [0.1, 0.1]",
            "the same as with a value before it",
        ),
        ("\"2,4\"", "\"2,9\"", "frames: the shot has frames 1 to 8"),
        (
            "\"colour\"",
            "\"taste\"",
            "errors[2]: \"taste\" is not an error of a picture",
        ),
        (
            "\"by voxels\"",
            "\"by width\"",
            "is the name of another line",
        ),
        (
            "renderer.method=ray",
            "sun.intensity=2",
            "\"sun.intensity=2\" sets none of",
        ),
        ("repeats = 2", "steps = 2", "steps"),
    ] {
        assert!(SURFACE.contains(from), "{from}");
        let said = job.load(&SURFACE.replace(from, to)).unwrap_err();
        assert!(said.contains(expected), "{said}");
    }
}
