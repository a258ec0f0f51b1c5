//! What emitters promise, against what enters.

use super::{
    tests::{D, block, nozzle, run, with},
    *,
};

/// Small boxes and velocities whose rows line up: what enters in 400 layers, to a layer of each
/// face at either end, and never more than is promised for the shot. Negative control: area times
/// velocity is off by up to a half.
#[test]
fn a_promise_holds_for_oblique_flows() {
    let mut worst = 0.0f64;
    // Rows that drift by a spacing in 400 layers, too.
    let drifting = ([0.4, 1.05, 0.2], [2.0, 0.005, 0.0]);
    let sizes = [[0.15, 0.15, 0.2], [0.2, 0.25, 0.3], [0.34, 0.27, 0.15]];
    let velocities = [[1.0, 1.0, 0.0], [1.0, -1.0, 0.5], [2.0, 1.0, 1.0]];
    let aligned = sizes.map(|size| velocities.map(|velocity| (size, velocity)));
    for (size, velocity) in aligned.into_iter().flatten().chain([drifting]) {
        let mut emitter = nozzle(DVec3::from(velocity));
        emitter.shape = block([0.0; 3], size);
        let sources = with(vec![emitter], Vec::new());
        let [Some(promise)] = sources.predicted_inflows(None)[..] else {
            panic!("one flow");
        };
        let frames = 1000;
        let (particles, ..) = run(&sources, frames);
        let seconds = f64::from(frames) / 25.0;
        assert_eq!(
            sources.most_entering(seconds),
            [Some(particles.len() as u64)]
        );
        let found = particles.len() as f64 * D.powi(3) / seconds;
        let size = DVec3::from(size);
        let layers = 2.0 * swept(size, DVec3::from(velocity).signum()) * D / seconds;
        assert!(
            (found - promise.rate).abs() < layers + promise.rate * 2.0 / 256.0,
            "{size} {velocity:?}: {found} {promise:?}"
        );
        let asked = promise.asked.unwrap();
        assert!((asked - swept(size, DVec3::from(velocity))).abs() < 1e-12);
        worst = worst.max((found / asked - 1.0).abs());
    }
    assert!(worst > 0.2, "{worst}");
}

/// A window as long as half a layer holds one layer or none, by when it begins.
#[test]
fn a_pulse_brings_whole_layers() {
    for (from, most) in [(0.01, 6), (0.03, 0)] {
        let mut emitter = nozzle(DVec3::new(2.0, 0.0, 0.0));
        emitter.window = Window {
            from,
            until: Some(from + 0.02),
        };
        let sources = with(vec![emitter], Vec::new());
        assert_eq!(sources.most_entering(4.0), [Some(most)]);
        assert_eq!(run(&sources, 100).0.len() as u64, most);
    }
}
