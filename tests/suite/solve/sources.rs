//! Water from emitters compared with hand calculations: a jet's parabola, a full pipe, a tank that
//! fills.

use std::collections::BTreeMap;

use crate::support::job::Job;
use swell::{cache::CacheReader, domain::particles::Particles};

/// A nozzle 0.3 m wide, with particle spacings of 0.05 m, in air.
const JET: &str = r#"
[shot]
name = "jet"
frames = 120
frames_per_second = 240
[domain]
min = [0.0, 0.0, 0.0]
max = [3.0, 2.0, 0.8]
[water]
[[emitter]]
min = [0.1, 1.4, 0.25]
max = [0.5, 1.7, 0.55]
velocity = [2.0, 0.0, 0.0]
[solver]
method = "flip"
[solver.flip]
cell_size = 0.1
[solver.pbf]
particle_spacing = 0.05
"#;

const D: f64 = 0.05;

fn frames(job: &Job, cache: &str) -> Vec<Particles> {
    let reader = CacheReader::open(&job.path(cache)).unwrap();
    let all = reader.first_frame()..=reader.last_frame();
    all.map(|frame| reader.read(frame).unwrap()).collect()
}

/// Mean deviation from free fall at the end of the run, in spacings along x, y and z, over water
/// that is at least 0.2 s old; the last value is the number of those particles.
fn off_parabola(frames: &[Particles], rate: f64) -> [f64; 4] {
    let mut born: BTreeMap<u32, (usize, [f32; 3])> = BTreeMap::new();
    for (frame, particles) in frames.iter().enumerate() {
        for (id, x) in particles.id.iter().zip(&particles.position) {
            born.entry(*id).or_insert((frame, *x));
        }
    }
    let end = frames.last().unwrap();
    let (mut sums, mut count) = ([0.0; 3], 0.0);
    for (id, x) in end.id.iter().zip(&end.position) {
        let (frame, from) = born[id];
        let age = (frames.len() - 1 - frame) as f64 / rate;
        if age < 0.2 {
            continue;
        }
        let way = [2.0 * age, -0.5 * 9.81 * age * age, 0.0];
        for axis in 0..3 {
            sums[axis] += f64::from(x[axis]) - f64::from(from[axis]) - way[axis];
        }
        count += 1.0;
    }
    let [x, y, z] = sums.map(|sum| sum / count / D);
    [x, y, z, count]
}

/// Velocities are those of a step's end, so water falls ½ g t Δt too far in t; 0.35 s on average,
/// half a second at most.
#[test]
fn a_jet_falls_along_its_parabola() {
    let job = Job::of(&[("jet.toml", JET)]);
    let first_order = 0.5 * 9.81 * 0.5 / 240.0 / D;
    for solver in ["flip", "pbf"] {
        job.expect(0, &format!("bake jet.toml --solver {solver} -o {solver}"));
        let found = off_parabola(&frames(&job, solver), 240.0);
        println!("{solver}: {found:?}");
        let [x, y, z, count] = found;
        assert!(count > 300.0, "{found:?}");
        assert!(x.abs() < 0.1 && z.abs() < 0.1, "{solver}: {found:?}");
        assert!(y.abs() < first_order + 0.1, "{solver}: {found:?}");
    }
    // Negative control: 10 % more gravity is more than half a spacing.
    job.edit(
        "jet.toml",
        "[water]",
        "[water]\ngravity = [0.0, -10.8, 0.0]",
    );
    job.expect(0, "bake jet.toml -o heavy");
    let [_, y, ..] = off_parabola(&frames(&job, "heavy"), 240.0);
    assert!(y.abs() > first_order + 0.1, "{y}");
}

/// The domain is a pipe: full up to x = 1.2, closed behind the emitter, open in front of it.
const PIPE: &str = r#"
[shot]
name = "pipe"
frames = 24
frames_per_second = 48
[domain]
min = [0.0, 0.0, 0.0]
max = [2.8, 0.4, 0.4]
[water]
gravity = [0.0, 0.0, 0.0]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [1.2, 0.4, 0.4]
[[emitter]]
min = [0.3, 0.0, 0.0]
max = [0.6, 0.4, 0.4]
velocity = [1.0, 0.0, 0.0]
[solver]
method = "flip"
[solver.flip]
cell_size = 0.1
"#;

/// Speed of the foremost water over the last quarter of a second, in which five layers enter, and
/// the mean velocity of the water behind the emitter in that time, m/s.
fn flow(frames: &[Particles]) -> [f64; 2] {
    let last = &frames[frames.len() - 13..];
    let front = |frame: &Particles| frame.position.iter().map(|x| x[0]).fold(0.0, f32::max);
    let way = front(&last[12]) - front(&last[0]);
    let both = last
        .iter()
        .flat_map(|frame| frame.position.iter().zip(&frame.velocity));
    let behind = both.filter(|(x, _)| x[0] < 0.2);
    let all: Vec<f64> = behind.map(|(_, v)| f64::from(v[0])).collect();
    [
        f64::from(way) / 0.25,
        all.iter().sum::<f64>() / all.len() as f64,
    ]
}

/// Water that cannot flow back pushes the water in front of it out with its own velocity.
#[test]
fn what_enters_a_full_pipe_pushes_the_water_out() {
    let job = Job::of(&[("pipe.toml", PIPE)]);
    job.expect(0, "bake pipe.toml -o pipe");
    let [before, behind] = flow(&frames(&job, "pipe"));
    println!("{before} {behind}");
    assert!((before - 1.0).abs() < 0.1, "{before} m/s");
    assert!(behind.abs() < 0.1, "{behind} m/s");
    // Negative control: half the velocity is detected although only two or three layers enter.
    job.edit("pipe.toml", "velocity = [1.0", "velocity = [0.5");
    job.expect(0, "bake pipe.toml -o slow");
    let [before, _] = flow(&frames(&job, "slow"));
    assert!((before - 1.0).abs() > 0.1, "{before} m/s");
}

const TANK: &str = r#"
[shot]
name = "tank"
frames = 60
frames_per_second = 60
[domain]
min = [0.0, 0.0, 0.0]
max = [1.0, 1.2, 1.0]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [1.0, 0.5, 1.0]
[[emitter]]
min = [0.3, 0.1, 0.3]
max = [0.7, 0.25, 0.7]
velocity = [0.0, 0.5, 0.0]
[solver]
method = "flip"
[solver.flip]
cell_size = 0.1
[solver.pbf]
particle_spacing = 0.05
[[probe]]
kind = "volume"
"#;

/// 0.08 m³ enter from below in a second: the level of 1 m² rises by 0.08 m, minus water that has
/// not yet displaced any: at most as much as the emitter's volume holds, 0.024 m³.
#[test]
fn a_tank_fills_from_below() {
    let job = Job::of(&[("tank.toml", TANK)]);
    for solver in ["flip", "pbf"] {
        job.expect(0, &format!("bake tank.toml --solver {solver} -o {solver}"));
        let end = frames(&job, solver).pop().unwrap();
        assert_eq!(end.len(), 4000 + 640);
        let rows = std::fs::read_to_string(job.path(solver).join("probes/volume-1.csv")).unwrap();
        let last = rows.lines().last().unwrap().rsplit(',').next().unwrap();
        let found: f64 = last.parse().unwrap();
        println!("{solver}: {found} m³");
        assert!(
            (found - 0.58).abs() < 0.4 * 0.4 * 0.15,
            "{solver}: {found} m³"
        );
    }
}
