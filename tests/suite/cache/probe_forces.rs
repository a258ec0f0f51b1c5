//! Force and moment of the water on solids and walls, against water at rest.

use std::{fs, path::Path};
use swell::files::parse_scene;

use crate::support::job::Job;

/// The unit cube from 0 to 1.
const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n";

/// 1.1 m deep. The first solid hangs in the water and moves by a millionth of a cell, so that it
/// counts as a moving solid; the second one rests on the floor.
const SCENE: &str = r#"
[shot]
name = "tank"
frames = 4
frames_per_second = 100

[domain]
min = [0.0, 0.0, 0.0]
max = [1.6, 1.6, 1.2]

[[water.block]]
min = [0.0, 0.0, 0.0]
max = [1.6, 1.1, 1.2]

[[solid]]
mesh = "cube.obj"
translate = [0.4, 0.3, 0.4]
scale = 0.4
direction = [0.0, 1.0, 0.0]
motion = { kind = "constant_velocity", velocity = 1e-6 }

[[solid]]
mesh = "cube.obj"
translate = [1.1, 0.0, 0.4]
scale = 0.3

[solver]
method = "flip"
[solver.flip]
cell_size = 0.1
[solver.pbf]
particle_spacing = 0.05
"#;

const PROBES: &str = r#"
[[probe]]
name = "hung"
kind = "force"
solid = 0
[[probe]]
name = "standing"
kind = "force"
solid = 1
rate_hz = "substep"
[[probe]]
name = "wall"
kind = "force"
solid = "-x"
about = [0.0, 0.0, 0.0]
"#;

/// The whole floor, in the tank without solids.
const FLOOR: &str = r#"
[[probe]]
name = "floor"
kind = "force"
solid = "-y"
"#;

/// The tank without its solids.
fn bare() -> String {
    let still = SCENE.split("[[solid]]").next().unwrap();
    format!("{still}{}", &SCENE[SCENE.find("[solver]").unwrap()..])
}

/// Specific weight of water ρ g, N/m³.
const WEIGHT: f64 = 9810.0;

/// Relative error of a wall's force, in terms of Δx² / H². Between the centre of the topmost
/// water cell and that of the air cell above, the pressure falls linearly to zero, while the
/// exact pressure is zero from the surface, halfway, upwards: an excess of Δx² / 16 over H² / 2.
/// It ends there with a step of Δx / 4, which patches up to a cell high may count half a patch
/// too far: Δx² / 8.
const TOLERANCE: f64 = 2.0 * (1.0 / 16.0 + 1.0 / 8.0) * (0.1 / 1.1) * (0.1 / 1.1);

fn water_at_rest_bears(device: &str) {
    let scene = format!("{SCENE}{PROBES}");
    let empty = format!("{}{FLOOR}", bare());
    let job = Job::of(&[
        ("tank.toml", &scene),
        ("empty.toml", &empty),
        ("cube.obj", CUBE),
    ]);
    let bake = format!("bake tank.toml {device} -o");
    job.expect(0, &format!("{bake} whole"));
    job.expect(0, &format!("bake empty.toml {device} -o empty"));
    let rows = |name: &str| -> Vec<Vec<Option<f64>>> {
        let cache = if name == "floor" { "empty" } else { "whole" };
        let file = job.path(cache).join(format!("probes/{name}.csv"));
        let text = fs::read_to_string(file).unwrap();
        let number = |field: &str| (!field.is_empty()).then(|| field.parse().unwrap());
        let rows = text.lines().skip(1);
        rows.map(|line| line.split(',').map(number).collect())
            .collect()
    };
    let depth = 1.1;
    // The displaced water; the water above the solid, as none gets under it; ½ ρ g H² B; the whole
    // weight on the floor.
    let lift = WEIGHT * 0.4f64.powi(3);
    let load = -WEIGHT * (depth - 0.3) * 0.3 * 0.3;
    let push = -0.5 * WEIGHT * depth * depth * 1.2;
    let weight = -WEIGHT * depth * 1.6 * 1.2;
    let expected = [
        ("hung", [0.0, lift, 0.0], [0.0, 0.0, 0.0]),
        ("standing", [0.0, load, 0.0], [0.0, 0.0, 0.0]),
        // At half the width and a third of the depth: z × −x is −y, and −(y × −x) is z.
        (
            "wall",
            [push, 0.0, 0.0],
            [0.0, 0.6 * push, -depth / 3.0 * push],
        ),
        ("floor", [0.0, weight, 0.0], [0.0, 0.0, 0.0]),
    ];
    for (name, force, moment) in expected {
        let rows = rows(name);
        assert!(rows[0][2..].iter().all(Option::is_none), "{name}: {rows:?}");
        assert!(rows.len() >= 5, "{name}: {rows:?}");
        // The rounding of the pressures on all faces of a body adds up in the net force.
        let scale = match name {
            "hung" => WEIGHT * depth * 0.16,
            "standing" => WEIGHT * depth * 0.09,
            _ => force.iter().fold(0.0, |most: f64, f| most.max(f.abs())),
        };
        for row in &rows[1..] {
            let found: Vec<f64> = row[2..].iter().map(|value| value.unwrap()).collect();
            for axis in 0..3 {
                let (off, lever) = (found[axis] - force[axis], found[3 + axis] - moment[axis]);
                assert!(off.abs() < TOLERANCE * scale, "{name}: {found:?} {force:?}");
                assert!(
                    lever.abs() < TOLERANCE * scale,
                    "{name}: {found:?} {moment:?}"
                );
            }
        }
        println!(
            "{device} {name}: {:?} of {force:?} {moment:?}",
            rows[rows.len() - 1]
        );
        // Negative control: gravity that is off by 1 % is detected.
        let found = rows[4][3].unwrap() - 1.01 * force[1];
        assert!(
            name == "wall" || found.abs() > TOLERANCE * scale,
            "{name}: {found}"
        );
    }
    // The written scene lists the solids in another order, and the bake resumes all the same.
    job.expect(0, &format!("{bake} stopped --frames 1-2"));
    job.expect(0, &format!("{bake} stopped --resume"));
    assert_eq!(job.hash("stopped"), job.hash("whole"));
    job.expect(0, "inspect whole --plot plots");
}

#[test]
fn water_at_rest_bears_on_solids_and_walls() {
    water_at_rest_bears("");
}

#[test]
fn water_at_rest_bears_on_solids_and_walls_in_the_reference() {
    water_at_rest_bears("--device cpu");
}

#[test]
fn impossible_force_probe_is_refused_by_key() {
    let job = Job::of(&[("cube.obj", CUBE)]);
    let parse = |line: &str, set: &[&str]| {
        let text = format!("{SCENE}\n[[probe]]\nkind = \"force\"\n{line}\n");
        let set: Vec<_> = set.iter().map(|&s| s.to_owned()).collect();
        parse_scene(&text, Path::new("a.toml"), &job.path(""), &set)
    };
    let cases: &[(&str, &[&str], &str, &str)] = &[
        ("", &[], "probe[0].solid", "missing"),
        (
            "solid = 2",
            &[],
            "probe[0].solid",
            "2: the scene has 2 [[solid]]",
        ),
        (
            "solid = \"left\"",
            &[],
            "probe[0].solid",
            "the number of a [[solid]]",
        ),
        (
            "solid = -1",
            &[],
            "probe[0].solid",
            "the number of a [[solid]]",
        ),
        (
            "solid = 0\nat = [1.0, 1.0]",
            &[],
            "probe[0].at",
            "does not go with kind = \"force\"",
        ),
        (
            "solid = 0\nabout = [1.0]",
            &[],
            "probe[0].about",
            "three numbers",
        ),
    ];
    for (line, set, key, words) in cases {
        let error = parse(line, set).unwrap_err().to_string();
        assert!(
            error.contains(key) && error.contains(words),
            "{line}: {error}"
        );
    }
    // PBF has no force probe, and the message says so.
    let text = format!("{}\n[[probe]]\nkind = \"force\"\nsolid = \"-x\"\n", bare());
    let parse = |set: &[String]| parse_scene(&text, Path::new("a.toml"), &job.path(""), set);
    let error = parse(&["solver.method=pbf".to_owned()])
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("probe[0].kind") && error.contains("solver.method = \"flip\""),
        "{error}"
    );
    assert!(parse(&[]).is_ok());
}
