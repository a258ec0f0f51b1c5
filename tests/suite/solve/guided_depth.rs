//! Deep water of which a part is simulated: the floor moves as the water there would.

use std::{
    f64::consts::{PI, TAU},
    path::Path,
    sync::atomic::AtomicBool,
};

use swell::{
    domain::{particles::Particles, shape::WaveFloor},
    files::parse_scene,
    scene::Scene,
    stage::{
        device::{Opened, SolverError},
        drive::Drive,
        prepare::Start,
    },
};

use crate::support::{context, job::Job};

/// Waves 2 m long on water ten radians deep, of which two are simulated, over one of their lengths.
/// Two cells are below the floor.
fn scene() -> Scene {
    let text = format!(
        r#"
[shot]
name = "deep"
frames = {FRAMES}
frames_per_second = 24
[domain]
min = [-1.0, 3.0, 0.0]
max = [1.0, 4.0, 0.1875]
periodic = ["x"]
[[water.wave]]
kind = "stokes"
height = 0.08
period = 1.1318
depth = 3.1831
simulated_depth = 0.7616
[solver]
method = "flip"
[solver.flip]
cell_size = 0.0625
"#
    );
    parse_scene(&text, Path::new("deep.toml"), Path::new(""), &[]).unwrap()
}

/// Four periods.
const FRAMES: u32 = 109;

/// Angle by which waves are ahead of theory after the shot, degrees.
fn ahead(scene: &Scene, device: &Opened) -> f64 {
    let start = Start::of(scene).unwrap();
    let mut drive = Drive::new(device, scene, &start, false).unwrap();
    let mut last = None;
    let end = drive.run(FRAMES, &AtomicBool::new(false), |step| {
        last = Some(step.particles);
        Ok::<_, SolverError>(())
    });
    end.unwrap();
    let found = angle(&last.unwrap());
    let turned = TAU * f64::from(FRAMES) / 24.0 / 1.1318;
    let ahead = (angle(&start.particles) - turned - found).rem_euclid(TAU);
    (if ahead > PI { ahead - TAU } else { ahead }).to_degrees()
}

/// Phase of the water's horizontal velocity, which is Re (c exp(i k x)).
fn angle(state: &Particles) -> f64 {
    let [mut real, mut imaginary] = [0.0; 2];
    for (x, v) in state.position.iter().zip(&state.velocity) {
        let (sin, cos) = (PI * f64::from(x[0])).sin_cos();
        real += f64::from(v[0]) * cos;
        imaginary -= f64::from(v[0]) * sin;
    }
    imaginary.atan2(real)
}

/// A floor that moves with deep water lets its waves run as fast as theory has them, and one at
/// rest holds them back by 1 − √tanh 2 = 1.8 % of four turns, 26 degrees.
#[test]
fn waves_run_over_a_guided_floor_as_on_deep_water() {
    let gpu = Opened::Gpu(Box::new(context().clone()));
    let mut scene = scene();
    for device in [&gpu, &Opened::Cpu] {
        let found = ahead(&scene, device);
        println!("{found}");
        assert!(found.abs() < 9.0, "{found} degrees");
    }
    // Negative control: the floor rests.
    let still = WaveFloor::new(&[], &scene.domain, scene.particle_spacing());
    scene.moving_solids[0].floor = Some(still);
    let found = ahead(&scene, &gpu);
    println!("{found}");
    assert!((-40.0..-15.0).contains(&found), "{found} degrees");
}

/// A frame goes on from the cache alone, and its passes are those of the reference, also in zones
/// that carry the waves on.
#[test]
fn a_guided_floor_is_resumed_and_checked() {
    let text = |solver: &str| {
        format!(
            r#"
[shot]
name = "deep"
frames = 6
frames_per_second = 12
[domain]
min = [-1.0, 3.0, 0.0]
max = [2.0, 4.4, 0.375]
[[water.wave]]
kind = "stokes"
height = 0.1
period = 1.1318
depth = 3.1831
simulated_depth = 1.0
[effects.generation_zone]
walls = ["-x", "+x"]
length = 1.4
[effects.generation_zone.waves]
kind = "stokes"
height = 0.1
period = 1.1318
depth = 3.1831
simulated_depth = 1.0
ramp = 0.0
[solver]
method = "{solver}"
[solver.flip]
cell_size = 0.125
[solver.pbf]
particle_spacing = 0.0625
"#
        )
    };
    for solver in ["flip", "pbf"] {
        let text = text(solver);
        let job = Job::of(&[("deep.toml", &text)]);
        job.expect(0, "bake deep.toml -o whole");
        job.expect(0, "bake deep.toml -o part --frames 1-3");
        job.expect(0, "bake deep.toml -o part --resume");
        job.expect(0, "diff whole part");
        job.expect(0, "check whole --frames 5");
    }
}
