//! Checks of frames with a solid whose shape changes.

use std::path::Path;

use swell::{
    files::parse_scene,
    scene::Scene,
    stage::{check::check_frame, device::Opened, drive::Drive, prepare::Start},
};

use super::{lines, over};
use crate::support::{context, device::spoiled, noise};

/// A blob in a tank, which bulges and bends: quads of a box whose upper corners move, and in the last
/// file triangles of a box with one corner more.
fn scene(dir: &Path, method: &str) -> Scene {
    for k in 0..4 {
        let (a, b) = (0.06 * f64::from(k), 0.05 * f64::from(k * k));
        let more = if k == 3 {
            "f 4 8 7 9\nf 4 9 3\n"
        } else {
            "f 4 8 7 3\n"
        };
        let obj = format!(
            "v 0.4 0.1 0.4\nv 0.8 0.1 0.4\nv {0} 0.45 {1}\nv {2} 0.5 {1}\n\
             v 0.4 0.1 0.8\nv 0.8 0.1 0.8\nv {0} 0.5 0.8\nv 0.4 0.45 {3}\nv {0} 0.47 0.6\n\
             f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\n{more}f 1 5 8 4\nf 2 3 7 6\n",
            0.8 + a,
            0.4 - b / 4.0,
            0.4 - a,
            0.8 + b / 4.0,
        );
        std::fs::write(dir.join(format!("blob.{k:02}.obj")), obj).unwrap();
    }
    let text = format!(
        "[shot]\nname = \"blob\"\nframes = 4\nframes_per_second = 24\n\
         [domain]\nmin = [0, 0, 0]\nmax = [1.2, 1.0, 1.2]\n\
         [[water.block]]\nmin = [0, 0, 0]\nmax = [1.2, 0.7, 1.2]\n\
         [[solid]]\nsequence = {{ files = \"blob.##.obj\", frames_per_second = 20 }}\n\
         [solver]\nmethod = \"{method}\"\n[solver.flip]\ncell_size = 0.1\n\
         [solver.pbf]\nparticle_spacing = 0.05\n"
    );
    parse_scene(&text, Path::new("blob.toml"), dir, &[]).unwrap()
}

#[test]
fn a_shape_that_changes_is_within_tolerance_in_each_frame() {
    let context = context();
    let dir = tempfile::tempdir().unwrap();
    for method in ["flip", "pbf"] {
        let scene = scene(dir.path(), method);
        let breaks = &scene.moving_solids[0].sequence.as_ref().unwrap().shape;
        assert_eq!(breaks.breaks().collect::<Vec<_>>(), [3]);
        let mut start = Start::of(&scene).unwrap();
        for (k, v) in start.particles.velocity.iter_mut().enumerate() {
            *v = std::array::from_fn(|axis| 0.3 * noise(3 * k as u64 + axis as u64) as f32);
        }
        let opened = Opened::Gpu(Box::new((*context).clone()));
        let mut drive = Drive::new(&opened, &scene, &start, false).unwrap();
        let mut states = vec![start.particles.clone()];
        for frame in 0..4 {
            let table = check_frame(&context, &scene, &start, frame, &states[frame as usize]);
            let table = table.unwrap();
            assert_eq!(over(&table), [], "{method} {frame}: {}", lines(&table));
            states.push(drive.advance().unwrap().particles);
        }
        if method == "flip" {
            continue;
        }
        // Controls of passes that only PBF has: its solids at the substep's end.
        for (pass, from, to) in [
            (
                "pbf/predict",
                "start + solid_share * (",
                "start + 0.9 * solid_share * (",
            ),
            (
                "pbf/predict",
                "return rigid + shape_velocity_at(x);",
                "return rigid + 1.01 * shape_velocity_at(x);",
            ),
            (
                "pbf/compute_delta",
                "select(nodes, 5u * nodes, last.first >= SHAPE)",
                "select(nodes, 5u * nodes - 3u, last.first >= SHAPE)",
            ),
        ] {
            let spoiled = spoiled(pass, from, to);
            let table = check_frame(&spoiled, &scene, &start, 1, &states[1]).unwrap();
            let found = over(&table);
            assert!(!found.is_empty() && found[0].0 == pass, "{from}: {found:?}");
        }
    }
}
