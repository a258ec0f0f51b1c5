//! Checks of water beside a solid that leans, whichever way is up.

use std::path::Path;

use swell::{
    files::parse_scene,
    stage::{check::check_frame, prepare::Start},
};

use super::{lines, over};
use crate::support::{context, device::spoiled, noise};

/// Corners of a block that is turned by 30° about one axis, then by 20° about another.
fn turned_block() -> String {
    let (a, b) = (30f64.to_radians(), 20f64.to_radians());
    let corner = |k: u32| {
        let [x, y, z] = [0, 1, 2].map(|axis| f64::from(k >> axis & 1) - 0.5);
        let [x, y] = [a.cos() * x - a.sin() * y, a.sin() * x + a.cos() * y];
        let [y, z] = [b.cos() * y - b.sin() * z, b.sin() * y + b.cos() * z];
        let [x, y, z] = [x, y, z].map(|x| 0.6 + 0.53 * x);
        format!("v {x} {y} {z}\n")
    };
    let corners: String = (0..8).map(corner).collect();
    corners + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
}

/// Gravity closest to each axis, both ways, along some, and none.
const GRAVITIES: [[f64; 3]; 7] = [
    [-9.0, -3.0, 2.0],
    [3.0, 2.0, 9.0],
    [2.0, 9.0, -3.0],
    [1.0, -9.0, 4.0],
    [9.0, 0.0, 0.0],
    [0.0, 0.0, -9.0],
    [0.0, 0.0, 0.0],
];

#[test]
fn water_beside_a_solid_that_leans_is_within_tolerance_whichever_way_is_up() {
    let context = context();
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("block.obj"), turned_block()).unwrap();
    for gravity in GRAVITIES {
        // The half of the box that gravity points to is full.
        let most = (0..3)
            .max_by(|a, b| gravity[*a].abs().total_cmp(&gravity[*b].abs()))
            .unwrap();
        let (mut min, mut max) = ([0.0; 3], [1.2; 3]);
        if gravity[most] > 0.0 {
            min[most] = 0.6;
        } else {
            max[most] = 0.6;
        }
        let text = format!(
            "[shot]\nname = \"up\"\nframes = 1\nframes_per_second = 24\n\
             [domain]\nmin = [0, 0, 0]\nmax = [1.2, 1.2, 1.2]\n\
             [water]\ngravity = {gravity:?}\n\
             [[water.block]]\nmin = {min:?}\nmax = {max:?}\n\
             [[solid]]\nmesh = \"block.obj\"\n\
             [solver]\nmethod = \"flip\"\n[solver.flip]\ncell_size = 0.1\n"
        );
        let scene = parse_scene(&text, Path::new("up.toml"), dir.path(), &[]).unwrap();
        let mut start = Start::of(&scene).unwrap();
        for (k, v) in start.particles.velocity.iter_mut().enumerate() {
            *v = std::array::from_fn(|axis| 0.3 * noise(3 * k as u64 + axis as u64) as f32);
        }
        let table = check_frame(&context, &scene, &start, 0, &start.particles).unwrap();
        assert_eq!(over(&table), [], "{gravity:?}: {}", lines(&table));
        // Negative controls: layers of one axis, and upside down.
        let rows = |from, to| {
            let spoiled = spoiled("flip/cut_cells", from, to);
            let table = check_frame(&spoiled, &scene, &start, 0, &start.particles).unwrap();
            over(&table)
        };
        let layers = ("flip/cut_cells", "open part of the hat's layers");
        let (of_up, of_y) = ("2u, is_z)", "2u, is_z) * 0u + 1u");
        assert_eq!(
            rows(of_up, of_y).contains(&layers),
            most != 1,
            "{gravity:?}"
        );
        let (upright, reversed) = ("half, 3u - half", "3u - half, half");
        assert!(rows(upright, reversed).contains(&layers), "{gravity:?}");
        // And a distance off by a tenth of a cell where a closed face's normal is looked for.
        let weight = ("flip/cut_cells", "weight of faces for particles");
        assert!(
            rows("= cell - a;", "= cell - 1.1 * a;").contains(&weight),
            "{gravity:?}"
        );
    }
}
