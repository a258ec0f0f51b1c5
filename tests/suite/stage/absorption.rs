//! Absorbing wave makers: how much of a tank's sloshing they leave, and their state in a cache.

use glam::{DVec2, DVec3};
use swell::{
    cache::CacheReader,
    domain::{
        absorber::{AbsorberState, AbsorberStates},
        bounds::Bounds,
        probe::elevation,
    },
};

use crate::support::job::Job;

/// A step of water that sloshes between walls 0.9 m apart: for the longest wave kh = π · 0.4 / 0.9
/// and a period of 1.14 s. 48 frames are 1.75 periods.
const TANK: &str = r#"
[shot]
name = "tank"
frames = 48
frames_per_second = 24
[domain]
min = [0.0, 0.0, 0.0]
max = [1.0, 0.8, 0.15]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [0.45, 0.425, 0.15]
[[water.block]]
min = [0.45, 0.0, 0.0]
max = [1.0, 0.375, 0.15]
[[wave_maker]]
wall = "+x"
motion = { kind = "still" }
absorption = { depth = 0.4, period = 1.14, room = 0.1 }
[solver]
method = "flip"
[solver.flip]
cell_size = 0.05
[solver.pbf]
particle_spacing = 0.025
grid_projection = true
"#;

/// The same between fixed walls.
const WALLED: &str =
    "--set wave_maker=[] --set domain.max=[0.9,0.8,0.15] --set water.block.1.max=[0.9,0.375,0.15]";

/// The absorber state of the single wall after each frame, from the ledger.
fn answers(reader: &CacheReader) -> Vec<Option<AbsorberState>> {
    let entries = reader.entries().iter();
    entries.map(|entry| entry.clock.walls[0]).collect()
}

/// Root mean square of the difference between the water levels at both ends over the last 1.1 s, m.
fn sloshing(reader: &CacheReader) -> f64 {
    let domain = Bounds {
        min: DVec3::ZERO,
        max: DVec3::new(1.0, 0.8, 0.15),
    };
    let last = reader.last_frame();
    let squares: Vec<f64> = (last - 26..=last)
        .map(|frame| {
            let state = reader.read(frame).unwrap();
            let at = |x: f64| elevation(&state, 0.025, &domain, DVec2::new(x, 0.075));
            (at(0.1).expect("water") - at(0.75).expect("water")).powi(2)
        })
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// The wave reaches the wall once within the first second; a fixed wall reflects it.
#[test]
fn sloshing_is_taken_out_by_a_wall_that_absorbs() {
    let job = Job::of(&[("tank.toml", TANK)]);
    for solver in ["flip", "pbf"] {
        let bake = format!("bake tank.toml --solver {solver}");
        let said = job.expect(0, &format!("{bake} -o {solver}"));
        assert!(!said.contains("absorption.room"), "{said}");
        job.expect(0, &format!("{bake} {WALLED} -o {solver}-walled"));
        let [absorbed, walled] = ["", "-walled"].map(|which| {
            sloshing(&CacheReader::open(&job.path(&format!("{solver}{which}"))).unwrap())
        });
        println!("{solver}: {absorbed} of {walled}");
        // Negative control: between fixed walls the sloshing continues.
        assert!(walled > 0.01, "{solver}: {walled}");
        // A step contains waves of all periods; the wall is tuned to the longest.
        assert!(absorbed < 0.4 * walled, "{solver}: {absorbed} of {walled}");
    }
}

#[test]
fn absorbing_wall_at_the_end_of_its_range_is_a_warning() {
    let job = Job::of(&[("tank.toml", TANK)]);
    let small = "--frames 1-20 --set wave_maker.0.absorption.room=0.002";
    let said = job.expect(0, &format!("bake tank.toml {small} -o small"));
    assert!(
        said.contains("wave_maker[0].absorption.room: the wall was at the end of its range in"),
        "{said}"
    );
}

/// The wall's displacement is part of the state: a bake that is resumed, begun from a frame or
/// checked continues from it.
#[test]
fn a_bake_goes_on_with_the_wall_where_it_stood() {
    let job = Job::of(&[("tank.toml", TANK)]);
    for (solver, device) in [
        ("flip", "gpu"),
        ("pbf", "gpu"),
        ("flip", "cpu"),
        ("pbf", "cpu"),
    ] {
        let name = format!("{solver}-{device}");
        let bake = format!("bake tank.toml --solver {solver} --device {device}");
        job.expect(0, &format!("{bake} --frames 1-12 -o {name}"));
        let reader = CacheReader::open(&job.path(&name)).unwrap();
        let whole = answers(&reader);
        assert_eq!(whole[0], None);
        let at_eight = whole[8].expect("it absorbs");
        assert!(at_eight.displacement.abs() > 1e-3, "{at_eight:?}");

        job.expect(0, &format!("{bake} --frames 1-8 -o {name}-parts"));
        job.expect(0, &format!("{bake} --frames 1-12 --resume -o {name}-parts"));
        assert_eq!(job.hash(&format!("{name}-parts")), job.hash(&name));
        job.expect(
            0,
            &format!("{bake} --frames 9-12 --from {name}:8 -o {name}-branch"),
        );
        let branch = CacheReader::open(&job.path(&format!("{name}-branch"))).unwrap();
        for frame in 8..=12 {
            let [there, here] = [&branch, &reader].map(|reader| reader.read(frame).unwrap());
            assert_eq!(there, here, "{name} {frame}");
        }
        if device == "gpu" {
            job.expect(0, &format!("check {name} --frames 8-9"));
        }
    }
    // Both devices have the wall at the same displacement, up to the rounding of a water level.
    for solver in ["flip", "pbf"] {
        let [gpu, cpu] = ["gpu", "cpu"].map(|device| {
            let reader = CacheReader::open(&job.path(&format!("{solver}-{device}"))).unwrap();
            answers(&reader)[8].unwrap().displacement
        });
        assert!(
            (gpu - cpu).abs() < 0.02 * gpu.abs(),
            "{solver}: {gpu} {cpu}"
        );
    }
}

/// A wall whose saved displacement is out of range starts at the scene's position, with a warning.
/// Saved states are matched by wall, not by the order of the wave makers.
#[test]
fn branch_matches_absorber_states_by_wall() {
    let job = Job::of(&[("tank.toml", TANK)]);
    job.expect(0, "bake tank.toml --frames 1-12 -o cache");
    let first = |cache: &str| {
        CacheReader::open(&job.path(cache)).unwrap().entries()[0]
            .clock
            .walls
    };
    let there = CacheReader::open(&job.path("cache")).unwrap();
    let [still, ours] = [
        r#"wall="-x",motion={kind="table",points=[[0,0],[9,0]]}"#,
        r#"wall="+x",motion={kind="still"},absorption={depth=0.4,period=1.14,room=0.1}"#,
    ];
    let both = format!("--set wave_maker=[{{{still}}},{{{ours}}}]");
    job.expect(
        0,
        &format!("bake tank.toml --frames 13-13 --from cache:12 {both} -o second"),
    );
    assert_eq!(first("second")[0], None);
    assert_eq!(first("second")[1], there.entries()[12].clock.walls[0]);
    let small = "--set wave_maker.0.absorption.room=0.001";
    let said = job.expect(
        0,
        &format!("bake tank.toml --frames 13-13 --from cache:12 {small} -o small"),
    );
    assert!(
        said.contains("wave_maker[0]: the wall +x was -0.0"),
        "{said}"
    );
    assert!(
        said.contains("away from its own path and begins on it"),
        "{said}"
    );
    assert_eq!(first("small"), AbsorberStates::default());
}

/// Water pushed against a wall that gives way up to the domain's face.
const PUSHED: &str = r#"
[shot]
name = "pushed"
frames = 39
frames_per_second = 24
[domain]
min = [0.0, 0.0, 0.0]
max = [2.0, 1.0, 0.2]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [2.0, 0.4, 0.2]
[[wave_maker]]
wall = "-x"
motion = { kind = "table", points = [[0.0, 0.0], [0.8, 0.4]] }
[[wave_maker]]
wall = "+x"
motion = { kind = "still" }
absorption = { depth = 0.4, period = 1.5, room = 0.3 }
[[probe]]
kind = "force"
solid = "+x"
[solver]
method = "flip"
[solver.flip]
cell_size = 0.05
"#;

/// A force probe integrates at the displaced wall: here the force equals that on the
/// domain's own face.
#[test]
fn forces_are_those_on_the_wall_where_it_stands() {
    let job = Job::of(&[("pushed.toml", PUSHED)]);
    job.expect(0, "bake pushed.toml --frames 1-38 -o cache");
    let reader = CacheReader::open(&job.path("cache")).unwrap();
    let answer = reader.entries()[38].clock.walls[1].unwrap();
    assert!((answer.displacement + 0.3).abs() < 1e-9 && answer.velocity.abs() < 1e-9);
    let bake = "bake pushed.toml --frames 39-39 --from cache:38";
    let table = r#"wave_maker=[{wall="-x",motion={kind="table",points=[[0,0],[0.8,0.4]]}}]"#;
    job.expect(0, &format!("{bake} -o absorbs"));
    job.expect(0, &format!("{bake} --set {table} -o face"));
    let [found, there] = ["absorbs", "face"].map(|cache| {
        let reader = CacheReader::open(&job.path(cache)).unwrap();
        reader.entry(39).unwrap().row("probes", 0)[0].expect("wet")
    });
    // On patches 0.3 m in front of the wall it would be 195 N.
    assert!((found / there - 1.0).abs() < 1e-3, "{found} N of {there}");
    assert!(found > 210.0, "{found} N");
}

/// Without absorption no line of the ledger names a wall.
#[test]
fn ledger_without_absorption_names_no_wall() {
    let job = Job::of(&[("tank.toml", TANK)]);
    job.expect(0, &format!("bake tank.toml --frames 1-2 {WALLED} -o plain"));
    job.expect(0, "bake tank.toml --frames 1-2 -o absorbs");
    let ledger =
        |cache: &str| std::fs::read_to_string(job.path(cache).join("frames.jsonl")).unwrap();
    assert!(!ledger("plain").contains("walls"));
    assert!(ledger("absorbs").contains("\"walls\""));
}

#[test]
fn walls_that_cannot_absorb_are_refused_with_their_key() {
    let job = Job::of(&[("tank.toml", TANK)]);
    job.expect(0, "inspect tank.toml");
    for (set, words) in [
        (
            "wave_maker.0.wall=+y",
            "wave_maker[0].absorption: a wall absorbs by",
        ),
        (
            "water.gravity=[1,-9,0]",
            "wave_maker[0].absorption: a wall absorbs by",
        ),
        ("shot.frames_per_second=5", "raise shot.frames_per_second"),
        (
            "wave_maker.0.absorption.room=0.6",
            "wave_maker[0].absorption.room: the wall +x crosses",
        ),
        (
            "wave_maker=[{wall=\"+x\",motion={kind=\"still\"}}]",
            "wave_maker[0].motion.kind: a wall that neither makes nor absorbs waves",
        ),
        (
            "wave_maker.0.absorption.gain=1",
            "wave_maker[0].absorption.gain",
        ),
    ] {
        let said = job.expect(2, &format!("inspect tank.toml --set {set}"));
        assert!(said.contains(words), "{set}: {said}");
    }
}
