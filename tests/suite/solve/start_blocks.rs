//! Blocks of water at the start.

use std::path::Path;

use swell::{
    files::parse_scene,
    stage::{device::Opened, drive::Drive, prepare::Start},
};

use crate::support::context;

/// Largest speed in the last of 24 frames of a tank whose water ends `gap` metres from its far walls.
fn speed(on: &Opened, method: &str, gap: f64) -> f64 {
    let text = format!(
        "[shot]\nname = \"tank\"\nframes = 24\nframes_per_second = 24\n\
         [domain]\nmin = [0, 0, 0]\nmax = [1.0, 0.5, 0.4]\n\
         [[water.block]]\nmin = [0, 0, 0]\nmax = [{}, 0.3, {}]\n\
         [solver]\nmethod = \"{method}\"\n[solver.flip]\ncell_size = 0.06\n\
         [solver.pbf]\nparticle_spacing = 0.03\n",
        1.0 - gap,
        0.4 - gap
    );
    let scene = parse_scene(&text, Path::new("tank.toml"), Path::new("."), &[]).unwrap();
    let start = Start::of(&scene).unwrap();
    let mut drive = Drive::new(on, &scene, &start, false).unwrap();
    let frames = (0..24).map(|_| drive.advance().unwrap().report.max_speed);
    frames.last().unwrap()
}

/// A tank that is no whole number of spacings wide and long rests, on the GPU and in f64. The mark
/// is that of water at rest beside solids (hard case 36).
#[test]
fn a_tank_of_any_width_rests() {
    let context = context();
    let on_gpu = Opened::Gpu(Box::new((*context).clone()));
    for method in ["flip", "pbf"] {
        for on in [&on_gpu, &Opened::Cpu] {
            let found = speed(on, method, 0.0);
            assert!(found < 0.02, "{method}: {found} m/s");
        }
        // Negative control: a gap of 0.6 spacings, which no layer fills.
        let found = speed(&on_gpu, method, 0.018);
        assert!(found > 0.02, "{method}: {found} m/s");
    }
}
