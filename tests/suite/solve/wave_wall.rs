//! Water in front of a wave-making wall has the wave's depth, whatever fraction of a cell the wall
//! moves in a step.

use swell::cache::CacheReader;

use crate::support::job::Job;

const SCENE: &str = r#"
[shot]
name = "solitary"
frames = 23
frames_per_second = 6
[domain]
min = [0.0, 0.0, 0.0]
max = [1.5, 0.5, 0.075]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [1.5, 0.25, 0.075]
[[wave_maker]]
wall = "-x"
motion = { kind = "solitary", height = 0.025, depth = 0.25 }
[solver]
[solver.flip]
cell_size = 0.025
[solver.pbf]
particle_spacing = 0.0125
"#;
const HEIGHT: f64 = 0.025;
const DEPTH: f64 = 0.25;
const SPACING: f64 = 0.0125;
/// By then the crest has passed the wall and not yet reached the other end of the domain; seconds.
const UNTIL: f64 = 3.8;

/// Relative tolerance of the depth between frames and theory: 0.4 spacings. The topmost particle
/// locates the surface to half a spacing.
const TOLERANCE: f64 = 0.02;

/// Position of the wall and depth in front of it at time `t` (Goring 1978), m.
fn goring(t: f64) -> (f64, f64) {
    let k = (0.75 * HEIGHT / DEPTH).sqrt();
    let celerity = (9.81 * (DEPTH + HEIGHT)).sqrt();
    // The crest starts at χ = −6.
    let phase = |x: f64| k / DEPTH * (celerity * t - x) - 6.0;
    let (mut low, mut high) = (0.0, 2.0 * HEIGHT / k);
    for _ in 0..60 {
        let x = 0.5 * (low + high);
        if x < HEIGHT / k * (phase(x).tanh() + 6.0_f64.tanh()) {
            low = x;
        } else {
            high = x;
        }
    }
    (low, DEPTH + HEIGHT / phase(low).cosh().powi(2))
}

/// Largest relative deviation of the depth in the two cells in front of the wall from theory, and
/// from still water.
fn deviations(job: &Job, name: &str, rate: u32) -> [f64; 2] {
    let reader = CacheReader::open(&job.path(name)).unwrap();
    let mut most = [0.0f64; 2];
    for frame in 1..=reader.last_frame() {
        let (wall, depth) = goring(f64::from(frame) / f64::from(rate));
        let state = reader.read(frame).unwrap();
        let near = state.position.iter().map(|x| x.map(f64::from));
        let near = near.filter(|x| x[0] < wall + 4.0 * SPACING);
        let top = near.map(|x| x[1]).fold(f64::NEG_INFINITY, f64::max) + 0.5 * SPACING;
        for (most, truth) in most.iter_mut().zip([depth, DEPTH]) {
            *most = most.max((top / truth - 1.0).abs());
        }
    }
    most
}

/// Bakes the wave by both solvers and compares. Control: the depth of still water does not fit.
fn assert_depth_is_the_waves(device: &str, rate: u32) {
    let job = Job::of(&[("solitary.toml", SCENE)]);
    let frames = (UNTIL * f64::from(rate)).floor();
    for solver in ["flip", "pbf"] {
        job.expect(
            0,
            &format!(
                "bake solitary.toml --solver {solver} --device {device} -o {solver} \
                 --set shot.frames_per_second={rate} --set shot.frames={frames}"
            ),
        );
        let [off, still] = deviations(&job, solver, rate);
        println!("{solver}: {off:.4}");
        assert!(off < TOLERANCE, "{solver}: {off}");
        assert!(still > 3.0 * TOLERANCE, "{solver}: {still}");
    }
}

// Each takes half a minute: the crest needs 3.4 s to pass a wall that starts from rest.

/// The wall moves by 1.0 cell per frame.
#[test]
fn water_before_a_wall_of_long_frames_has_the_waves_depth() {
    assert_depth_is_the_waves("gpu", 6);
}

/// The wall moves by a quarter of a cell per frame.
#[test]
fn water_before_a_wall_of_short_frames_has_the_waves_depth() {
    assert_depth_is_the_waves("gpu", 24);
}

/// As on the GPU, by the f64 reference.
#[test]
fn water_of_the_reference_before_a_wall_has_the_waves_depth() {
    assert_depth_is_the_waves("cpu", 6);
}
