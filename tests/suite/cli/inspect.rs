//! `swell inspect` as a user reads it.

use std::fs;

use crate::support::job::Job;

#[test]
fn inspect_shows_plan_and_frames() {
    let job = Job::new();
    let shown = |words: &str| String::from_utf8(job.run(words).stdout).unwrap();
    let plan = shown("inspect small.toml");
    assert!(
        plan.contains("effects/viscosity_gather") && plan.contains("solid_distance"),
        "{plan}"
    );
    assert!(!plan.contains("vorticity"), "{plan}");
    job.expect(0, "bake small.toml -o cache --frames 1-2");
    let frames = shown("inspect cache");
    assert!(
        frames.lines().filter(|line| line.contains("m/s")).count() >= 2,
        "{frames}"
    );
    assert!(shown("inspect --adapters").contains("max_storage_buffer_binding_size"));
}

/// What passes and buffers are there for: counts and bytes without a device's work, milliseconds with it; an effect that is not named
/// has no line.
#[test]
fn inspect_says_what_each_part_takes() {
    let job = Job::new();
    let shown = |words: &str| String::from_utf8(job.run(words).stdout).unwrap();
    let rows = |shown: &str| -> Vec<Vec<String>> {
        let rows = shown.lines().skip_while(|line| !line.starts_with("for  "));
        let words = rows.skip(1).map(|line| line.split_whitespace());
        let rows = words.map(|words| words.map(str::to_owned).collect());
        rows.collect()
    };
    let of = |rows: &[Vec<String>], part: &str| rows.iter().find(|row| row[0] == part).cloned();
    let planned = rows(&shown("inspect small.toml"));
    let viscosity = of(&planned, "viscosity").expect("a line");
    assert!(viscosity.len() == 3 && viscosity[1] == "2", "{viscosity:?}");
    assert!(viscosity[2].parse::<u64>().unwrap() > 0, "{viscosity:?}");
    let bare = rows(&shown("inspect small.toml --set effects={}"));
    assert_eq!(of(&bare, "viscosity"), None);
    assert_eq!(bare.len(), planned.len() - 1);
    let said = shown("inspect small.toml --time 2");
    assert!(
        said.contains("s a frame") && said.contains("over 2 frames after the first"),
        "{said}"
    );
    let timed = rows(&said);
    let parts: f64 = timed.iter().map(|row| row[4].parse::<f64>().unwrap()).sum();
    assert!(
        (parts - 100.0).abs() < 0.1 * timed.len() as f64,
        "{timed:?}"
    );
    let milliseconds = of(&timed, "viscosity").expect("a line")[3].clone();
    assert!(milliseconds.parse::<f64>().unwrap() > 0.0, "{milliseconds}");
    assert!(
        job.expect(2, "inspect look.toml --time 2")
            .contains("--time")
    );
    assert!(
        job.expect(2, "inspect small.toml --time 0")
            .contains("--time")
    );
    // Of 8 frames; the last that is possible was not refused above.
    let said = job.expect(2, "inspect small.toml --time 8");
    let expected = "--time 8: small.toml has 8 frames, and the first is not timed: up to 7 are possible; raise shot.frames";
    assert!(said.contains(expected), "{said}");
    shown("inspect small.toml --time 7");
}

/// Names in the first column of the table that begins with `heading`.
fn column(shown: &str, heading: &str) -> Vec<String> {
    let rows = shown.lines().skip_while(|line| !line.starts_with(heading));
    let rows = rows.skip(1).take_while(|line| !line.is_empty());
    rows.map(|line| line.split(' ').next().unwrap().to_owned())
        .collect()
}

#[test]
fn inspect_shows_the_passes_that_render_runs() {
    let job = Job::new();
    let bare = job.expect(0, "inspect look.toml");
    assert!(
        !bare.contains("ssfr/solid") && !bare.contains("triangles"),
        "{bare}"
    );
    let of_scene = job.expect(0, "inspect look.toml --scene small.toml");
    job.expect(0, "bake small.toml -o cache --frames 1-2");
    let of_cache = job.expect(0, "inspect look.toml --scene cache");
    let (passes, buffers) = (column(&of_cache, "pass "), column(&of_cache, "buffer "));
    for (found, wanted) in [
        (&passes, "ssfr/solid"),
        (&passes, "ssfr/shade_aovs"),
        (&buffers, "triangles"),
        (&buffers, "particles"),
    ] {
        assert!(found.iter().any(|name| name == wanted), "{of_cache}");
    }
    assert_eq!(column(&of_scene, "pass "), passes);
    assert_ne!(column(&bare, "pass "), passes, "the control");
    assert!(column(&of_cache, "texture ").contains(&"shadow_map".to_owned()));

    // What is timed is what was planned, and timing changes no picture.
    let render = "render cache --look look.toml --progress none";
    let timed = job.expect(0, &format!("{render} -o timed --time-passes"));
    assert_eq!(column(&format!("pass \n{timed}"), "pass "), passes);
    assert!(
        !job.expect(0, &format!("{render} -o plain"))
            .contains("ssfr/")
    );
    for name in ["small.0002.png", "small.0002.exr"] {
        let bytes = |folder: &str| fs::read(job.path(folder).join(name)).unwrap();
        assert!(bytes("timed") == bytes("plain"), "{name}");
    }

    for words in [
        "inspect small.toml --scene small.toml",
        "inspect look.toml --set shot.frames=2",
        "inspect look.toml --scene cache --solver flip",
        "inspect look.toml --scene look.toml",
    ] {
        job.expect(2, words);
    }
    job.expect(4, "inspect look.toml --scene missing");
}
