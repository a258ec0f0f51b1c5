//! Checks of paths that are straight in part of the water and bent elsewhere.

use std::path::Path;

use swell::{
    files::parse_scene,
    stage::{check::check_frame, prepare::Start},
};

use super::{lines, over};
use crate::support::{context, device::spoiled, noise};

const BEND: &str = "weight of the midpoint rule";

/// A current through eight bricks, in the first of which the water has noise: there it contracts by
/// five to ten hundredths on straight paths, which are bent in part as far as two bricks away.
#[test]
fn paths_that_are_straight_in_part_are_within_tolerance() {
    let context = context();
    let text = "[shot]\nname = \"straight\"\nframes = 1\nframes_per_second = 24\n\
                [domain]\nmin = [0, 0, 0]\nmax = [6.4, 0.8, 0.8]\nperiodic = [\"x\"]\n\
                [[water.block]]\nmin = [0, 0, 0]\nmax = [6.4, 0.4, 0.8]\n\
                [solver]\nmethod = \"flip\"\n[solver.flip]\ncell_size = 0.1\n";
    let scene = parse_scene(text, Path::new("straight.toml"), Path::new("."), &[]).unwrap();
    let mut start = Start::of(&scene).unwrap();
    for (k, v) in start.particles.velocity.iter_mut().enumerate() {
        let most = if start.particles.position[k][0] < 0.8 {
            1.3
        } else {
            0.05
        };
        *v = std::array::from_fn(|axis| most * noise(3 * k as u64 + axis as u64) as f32);
        v[0] += 2.0;
    }
    let check = |context: &_| check_frame(context, &scene, &start, 0, &start.particles).unwrap();
    let table = check(&context);
    assert_eq!(over(&table), [], "{}", lines(&table));
    let faults = [
        (
            "flip/find_strain",
            "abs(part) / MOST",
            "1.001 * abs(part) / MOST",
            BEND,
        ),
        (
            "flip/find_strain",
            "min(local, 26u)",
            "min(local, 25u)",
            BEND,
        ),
        (
            "flip/find_contraction",
            "abs(position - 4.0) / 8.0",
            "abs(position - 4.0) / 8.1",
            "flux that makes up for contraction",
        ),
        ("flip/bend_paths", "MOST = 0.05", "MOST = 0.0005", BEND),
        (
            "flip/advect",
            "abs(position - 4.0) / 8.0",
            "abs(position - 4.0) / 16.0",
            "position",
        ),
        (
            "flip/advect",
            "start + 0.5 * params.time_step * here",
            "start + 0.55 * params.time_step * here",
            "position",
        ),
    ];
    for (pass, from, to, field) in faults {
        let found = over(&check(&spoiled(pass, from, to)));
        assert!(found.contains(&(pass, field)), "{pass}: {from}: {found:?}");
    }
}
