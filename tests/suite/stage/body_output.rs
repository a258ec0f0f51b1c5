//! What a bake of bodies gives to others: their tables, USD, and pictures with an open shutter.

use std::fs;

use glam::{DQuat, DVec3};
use swell::{
    cache::CacheReader, domain::body::BodyState, files::parse_scene, render::image::read_exr,
};

use crate::support::job::Job;

/// Far from the world's origin, two cubes that are thrown above a pool; the second one falls into
/// it.
const SCENE: &str = r#"
[shot]
name = "float"
frames = 5
frames_per_second = 24

[domain]
min = [1000.0, 20.0, -300.0]
max = [1001.0, 21.0, -299.0]

[[water.block]]
min = [1000.0, 20.0, -300.0]
max = [1001.0, 20.3, -299.0]

[[body]]
mesh = "cube.obj"
scale = 0.2
translate = [1000.1, 20.7, -299.6]
rotate_degrees = [0.0, 20.0, 0.0]
density = 700.0
velocity = [3.0, 0.5, 0.0]
spin = [40.0, 90.0, -200.0]

[[body]]
mesh = "cube.obj"
scale = [0.2, 0.1, 0.2]
translate = [1000.6, 20.3, -299.4]
density = 400.0
velocity = [0.0, -1.0, 0.0]

[solver]
method = "flip"

[solver.flip]
cell_size = 0.1
"#;

fn job() -> Job {
    let cube = include_str!("../../hard_cases/cube.obj");
    Job::of(&[("float.toml", SCENE), ("cube.obj", cube)])
}

/// Time of a frame, seconds, and the states of the bodies after it.
type Moment = (f64, Vec<BodyState>);

fn states(job: &Job, cache: &str) -> Vec<Moment> {
    let reader = CacheReader::open(&job.path(cache)).unwrap();
    let entries = reader.entries().iter();
    entries
        .map(|entry| (entry.clock.time, entry.bodies.clone()))
        .collect()
}

fn origin(job: &Job, cache: &str) -> DVec3 {
    let reader = CacheReader::open(&job.path(cache)).unwrap();
    let origin = DVec3::from(reader.manifest().origin);
    assert_eq!(origin.x, 999.0, "a metre before the domain");
    origin
}

/// Largest difference of a table from the states of a body, from the first frame on.
fn off(csv: &str, body: usize, states: &[Moment], origin: DVec3) -> f64 {
    let mut lines = csv.lines();
    let header = "frame,time_s,x_m,y_m,z_m,turn_x,turn_y,turn_z,turn_w,\
        velocity_x_m/s,velocity_y_m/s,velocity_z_m/s,spin_x_rad/s,spin_y_rad/s,spin_z_rad/s";
    assert_eq!(lines.next(), Some(header));
    let rows: Vec<Vec<f64>> = lines
        .map(|line| line.split(',').map(|x| x.parse().unwrap()).collect())
        .collect();
    assert_eq!(rows.len(), states.len());
    let row = |frame: usize| {
        let (row, (time, bodies)) = (&rows[frame], &states[frame]);
        let state = &bodies[body];
        let expected = [
            &[frame as f64, *time][..],
            &(state.centre + origin).to_array(),
            &state.turn.to_array(),
            &state.velocity.to_array(),
            &state.spin.to_array(),
        ];
        let expected = expected.concat();
        assert_eq!(row.len(), expected.len());
        let pairs = row.iter().zip(&expected);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    (0..rows.len()).map(row).fold(0.0, f64::max)
}

#[test]
fn states_are_in_tables_that_are_rebuilt_verified_and_compared() {
    let job = job();
    job.expect(0, "bake float.toml -o whole");
    let (all, origin) = (states(&job, "whole"), origin(&job, "whole"));
    let table = |cache: &str, name: &str| {
        fs::read_to_string(job.path(&format!("{cache}/bodies/{name}.csv"))).unwrap()
    };
    for (index, name) in ["cube", "cube-2"].into_iter().enumerate() {
        let csv = table("whole", name);
        assert_eq!(off(&csv, index, &all, origin), 0.0, "{name}");
        // Controls: the other body, and coordinates that are not the world's.
        assert!(off(&csv, 1 - index, &all, origin) > 0.1, "{name}");
        assert!(off(&csv, index, &all, DVec3::ZERO) > 100.0, "{name}");
    }
    // Resumed after a stop, with a table lost meanwhile: the same bytes.
    job.expect(0, "bake float.toml -o parts --frames 1-2");
    assert_ne!(table("parts", "cube"), table("whole", "cube"));
    fs::remove_file(job.path("parts/bodies/cube.csv")).unwrap();
    job.expect(0, "bake float.toml -o parts --resume");
    assert_eq!(job.hash("parts"), job.hash("whole"));
    // A branch begins with the frame that it is of.
    job.expect(0, "bake float.toml -o branch --from whole:3 --frames 4-5");
    let tail = |csv: &str| {
        csv.lines()
            .rev()
            .take(2)
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    assert_eq!(table("branch", "cube").lines().count(), 4);
    assert_eq!(
        tail(&table("branch", "cube")),
        tail(&table("whole", "cube"))
    );
    // A digit changed.
    job.expect(0, "verify parts");
    let wrong = table("parts", "cube-2").replacen("\n3,", "\n3,1", 1);
    job.write("parts/bodies/cube-2.csv", &wrong);
    let said = job.expect(4, "verify parts");
    assert!(
        said.contains("cube-2.csv") && said.contains("line 5"),
        "{said}"
    );
    job.expect(0, "bake float.toml -o parts --resume");
    job.expect(0, "verify parts");
    // Compared column by column.
    job.expect(0, "diff whole parts");
    job.expect(
        0,
        "bake float.toml -o other --set body.1.density=410 --frames 1-3",
    );
    let said = job.expect(1, "diff whole other --frames 1-3");
    assert!(said.contains("body cube-2"), "{said}");
    // A scene without bodies has no such folder.
    let (dry, _) = SCENE.split_once("[[body]]").unwrap();
    let solver = &SCENE[SCENE.find("[solver]").unwrap()..];
    job.write("still.toml", &format!("{dry}{solver}"));
    job.expect(0, "bake still.toml -o still --frames 1");
    assert!(job.path("whole/bodies").is_dir() && !job.path("still/bodies").exists());
    let manifest = fs::read_to_string(job.path("still/manifest.json")).unwrap();
    assert!(!manifest.contains("bodies"));
}

/// Numbers of the samples of an attribute within a part of a USD text.
fn samples(part: &str, attribute: &str) -> Vec<Vec<f64>> {
    let (_, behind) = part
        .split_once(&format!("{attribute}.timeSamples = {{"))
        .unwrap();
    let (values, _) = behind.split_once('}').unwrap();
    let lines = values
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty());
    let numbers = |line: &str| {
        let words = line.split(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c)));
        let words = words.filter(|word| !word.is_empty());
        words.map(|word| word.parse().unwrap()).collect()
    };
    lines.map(numbers).collect()
}

#[test]
fn usd_has_the_bodies_where_their_states_are() {
    let job = job();
    job.expect(0, "bake float.toml -o cache");
    job.expect(0, "export cache --usd s.usda --frames 0-5");
    let (all, origin) = (states(&job, "cache"), origin(&job, "cache"));
    let text = fs::read_to_string(job.path("s.usda")).unwrap();
    let root = format!(
        "double3 xformOp:translate = ({}, {}, {})",
        origin.x, origin.y, origin.z
    );
    assert!(text.contains(&root), "{root}");
    for (index, name) in ["cube", "cube_2"].into_iter().enumerate() {
        // As text: the numbers of the ledger, but for the rounding of a frame's time.
        let (_, part) = text.split_once(&format!("def Mesh \"{name}\"")).unwrap();
        let places = samples(part, "xformOp:translate");
        let turns = samples(part, "xformOp:orient");
        assert_eq!([places.len(), turns.len()], [all.len(); 2]);
        let apart = |body: usize| {
            let rows = places.iter().zip(&turns).zip(&all).enumerate();
            let off = rows.map(|(frame, ((place, turn), (_, bodies)))| {
                let (at, q) = (bodies[body].centre, bodies[body].turn);
                let truth = [
                    &[frame as f64, at.x, at.y, at.z][..],
                    &[frame as f64, q.w, q.x, q.y, q.z],
                ];
                let found = [&place[..], turn].concat();
                let pairs = found.into_iter().zip(truth.concat());
                pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            });
            off.fold(0.0, f64::max)
        };
        assert!(apart(index) < 1e-13, "{name}: {}", apart(index));
        assert!(apart(1 - index) > 0.1, "{name}");
        // As a reader of USD has it: a solid that follows the prim does what the body did.
        let solid = format!(
            "{}\n[[solid]]\nmesh = \"cube.obj\"\nscale = 0.1\ntranslate = [1000.8, 20.9, -299.9]\n\
             track = {{ file = \"s.usda\", node = \"/float/solids/{name}\" }}\n{}",
            &SCENE[..SCENE.find("[[body]]").unwrap()],
            &SCENE[SCENE.find("[solver]").unwrap()..]
        );
        let scene = parse_scene(&solid, "s.toml".as_ref(), job.folder.path(), &[]).unwrap();
        let solid = &scene.moving_solids[0];
        let corner = DVec3::new(2.1, 0.4, 0.3) + all[0].1[index].centre;
        let wrong = |body: usize| {
            let (_, start) = &all[0];
            let off = all.iter().map(|(time, bodies)| {
                let (from, to) = (start[body], bodies[body]);
                let turn: DQuat = to.turn * from.turn.conjugate();
                let truth = to.centre + turn * (corner - from.centre);
                solid.pose(&[], *time).place(corner).distance(truth)
            });
            off.fold(0.0, f64::max)
        };
        // f64 in metres 1000 m from the world's origin.
        assert!(wrong(index) < 1e-9, "{name}: {}", wrong(index));
        assert!(wrong(1 - index) > 0.05, "{name}");
    }
}

/// Seen from the front and slightly below, so that only sky is behind the first cube.
const LOOK: &str = r#"
[camera]
focal_length_mm = 50.0
film_back_mm = [10.0, 10.0]
position = [1000.5, 20.3, -296.5]
target = [1000.5, 20.8, -299.5]
[image]
width = 128
height = 128
samples = 16
shutter = 1.0
[renderer]
method = "METHOD"
[sky]
model = "hosek_wilkie"
[sun]
azimuth_degrees = 120.0
elevation_degrees = 35.0
[output]
formats = ["exr"]
background = false
"#;

#[test]
fn a_picture_of_a_cache_blurs_its_bodies() {
    let job = job();
    job.expect(0, "bake float.toml -o cache");
    let all = states(&job, "cache");
    // Pixels to the left and right of the first frame's cube, with both of its neighbours known.
    let pixels = |t: f64| 128.0 * 50.0 / 10.0 * 3.0 * t / 24.0 / 3.0;
    assert!(
        (all[1].1[0].velocity.x - 3.0).abs() < 1e-9,
        "it flies freely"
    );
    for method in ["ssfr", "ray"] {
        let width = |name: &str, look: &str| {
            job.write("look.toml", &look.replace("METHOD", method));
            job.expect(
                0,
                &format!("render cache --look look.toml --frames 2 -o {name}-{method}"),
            );
            let file = job.path(&format!("{name}-{method}/float.0002.exr"));
            let (pixels, _) = read_exr(&file).unwrap();
            let alphas = pixels.2.iter().enumerate();
            let seen = alphas
                .filter(|(_, value)| value[3] > 0.0)
                .map(|(i, _)| i % 128);
            let seen: Vec<usize> = seen.collect();
            let [low, high] = [seen.iter().min().unwrap(), seen.iter().max().unwrap()];
            assert!(*low > 0 && *high < 127, "{method}: {low} to {high}");
            (high - low) as f64
        };
        let open = width("open", LOOK);
        let closed = width("closed", &LOOK.replace("shutter = 1.0", "shutter = 0.0"));
        // The first and last of 16 instants are 15/16 of a frame apart. The cube turns by 8 degrees
        // meanwhile, and edges are known to a pixel.
        let expected = pixels(15.0 / 16.0);
        assert!(expected > 20.0);
        let found = open - closed;
        assert!(
            (found - expected).abs() < 6.0,
            "{method}: {found} {expected}"
        );
    }
}
