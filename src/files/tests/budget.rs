use std::path::Path;

use swell_domain::{
    budget::{Breach, Watched},
    solver::StepReport,
};
use swell_scene::{
    Budget, Scene,
    budget::{Before, SPEED_JUMP},
};

use crate::parse_scene;

/// Ten particles of 1 kg, 50 frames per second, d = 0.1 m: the least energy is that of
/// 0.5 m/s, 1.25 J.
fn scene(method: &str) -> Scene {
    let text = r#"
        [shot]
        name = "budget"
        frames = 1
        frames_per_second = 50
        [domain]
        min = [0.0, 0.0, 0.0]
        max = [2.0, 3.0, 6.0]
        [water]
        gravity = [0.0, -10.0, 0.0]
        [[water.block]]
        min = [0.0, 0.0, 0.0]
        max = [0.5, 0.5, 0.5]
        [[wave_maker]]
        wall = "-x"
        motion = { kind = "constant_velocity", velocity = 1.5, until = 0.01 }
        [solver]
        [solver.pbf]
        particle_spacing = 0.1
        [solver.flip]
        cell_size = 0.2
    "#;
    let method = [format!("solver.method={method}")];
    parse_scene(text, Path::new("budget.toml"), Path::new("."), &method).expect("a scene")
}

/// A limit a millionth below the measured value fails, one a millionth above passes.
fn measured(budget: impl Fn(&mut Budget, f64), report: &StepReport, expected: f64) {
    let scene = scene("pbf");
    let look = |limit: f64| {
        let mut held = Budget::default();
        budget(&mut held, limit);
        let before = Before {
            energy: 100.0,
            speed: 3.0,
            start_volume: Some(2.0),
        };
        held.check_frame(&scene, 3, 10, report, &before)
    };
    assert_eq!(look(expected * (1.0 + 1e-6)), Ok(()));
    let breach = look(expected * (1.0 - 1e-6)).unwrap_err();
    assert!((breach.measured / expected - 1.0).abs() < 1e-12, "{breach}");
}

fn report() -> StepReport {
    let scene = scene("pbf");
    StepReport {
        substeps: 4,
        capped: 3,
        kinetic_energy: 130.0,
        potential_energy: 20.0,
        boundary_work: 20.0,
        volume: Some(1.9),
        max_speed: 7.0,
        density_error_mean: 0.02,
        density_error_p99: 0.3,
        density_error_max: 0.9,
        ..scene.report(&Default::default(), [].into_iter())
    }
}

/// By hand: 3 clamped of 10 particles in 4 substeps; 1.9 m³ of 2. 150 J after 100 J and 20
/// J of work are 30 J too many, relative to 100 + 20 + 1.25; with −20 J of work 70 J,
/// relative to the same.
#[test]
fn frames_are_held_to_what_a_hand_counts() {
    let report = report();
    measured(|b, limit| b.capped = Some(limit), &report, 3.0 / 40.0);
    measured(|b, limit| b.volume = Some(limit), &report, 0.05);
    measured(|b, limit| b.speed = Some(limit), &report, 7.0);
    // 3 m/s, and 0.2 m/s from gravity in a fiftieth of a second; the wall has stopped by then.
    // The limit is a factor.
    let jump = |times: f64| {
        let held = Budget {
            speed_jump: Some(times),
            ..Budget::default()
        };
        let before = Before {
            speed: 3.0,
            ..Before::default()
        };
        held.check_frame(&scene("flip"), 3, 0, &report, &before)
    };
    assert_eq!(jump(7.0 / 3.2 * (1.0 + 1e-6)), Ok(()));
    let breach = jump(7.0 / 3.2 * (1.0 - 1e-6)).unwrap_err();
    assert_eq!(breach.watched, Watched::SpeedJump);
    assert!(
        breach.to_string().contains("budget.speed_jump allows"),
        "{breach}"
    );
    // From rest, 8 times 0.2 m/s is less than the front of a column of 3 m, 2 √30 m/s: 10 kg with
    // 150 J. Control: a jet as fast in shallow water with a tenth of that energy, in
    // a domain as high.
    let fall = |max_speed: f64, energy: f64| {
        let held = Budget {
            speed_jump: Some(SPEED_JUMP),
            ..Budget::default()
        };
        let report = StepReport {
            max_speed,
            ..report.clone()
        };
        let before = Before {
            energy,
            ..Before::default()
        };
        held.check_frame(&scene("flip"), 3, 10, &report, &before)
    };
    let jumps =
        |found: Result<(), Breach>| found.is_err_and(|breach| breach.watched == Watched::SpeedJump);
    assert!(!jumps(fall(120.0_f64.sqrt() * (1.0 - 1e-6), 150.0)));
    assert!(jumps(fall(120.0_f64.sqrt() * (1.0 + 1e-6), 150.0)));
    assert!(jumps(fall(120.0_f64.sqrt() * (1.0 - 1e-6), 15.0)));
    measured(|b, limit| b.density_error_mean = Some(limit), &report, 0.02);
    measured(|b, limit| b.density_error_p99 = Some(limit), &report, 0.3);
    measured(|b, limit| b.density_error_max = Some(limit), &report, 0.9);
    measured(|b, limit| b.energy = Some(limit), &report, 30.0 / 121.25);
    let against = StepReport {
        boundary_work: -20.0,
        ..report
    };
    measured(|b, limit| b.energy = Some(limit), &against, 70.0 / 121.25);
    let allowed = scene("pbf").allowed_energy(10, 100.0, 20.0, 0.2);
    assert!((allowed - (120.0 + 0.2 * 121.25)).abs() < 1e-12);
}

/// The divergence limit applies to the relative change of a cell's volume in a substep.
#[test]
fn projections_are_held_to_residual_and_divergence() {
    let budget = Budget {
        residual: Some(0.01),
        divergence: Some(0.1),
        ..Budget::default()
    };
    let look = |residual, divergence| budget.check_projection(1, 2, residual, divergence, 0.02);
    assert_eq!(look(0.01, 4.999), Ok(()));
    assert_eq!(look(0.010_001, 0.0).unwrap_err().substep, Some(2));
    let breach = look(0.0, 5.001).unwrap_err();
    assert_eq!(breach.watched, Watched::Divergence);
    assert!((breach.measured - 0.100_02).abs() < 1e-12);
}

/// Four times the speed of a fall through the box's diagonal of 7 m plus that of the wall: 4
/// (√140 + 1.5) m/s.
#[test]
fn the_speed_is_that_of_a_fall_and_a_push() {
    for (method, energy) in [("pbf", 0.25), ("flip", 0.1)] {
        let budget = scene(method).budget;
        let expected = 4.0 * (140.0f64.sqrt() + 1.5);
        let speed = budget.speed.expect("by default");
        // Ten spacings per frame are only 50 m/s.
        assert!((speed - expected).abs() < 1e-9 && speed > 50.0, "{speed}");
        assert_eq!(budget.energy, Some(energy));
        assert_eq!(budget.speed_jump, (method == "flip").then_some(8.0));
        assert_eq!(budget.density_error_max, (method == "flip").then_some(4.0));
        assert_eq!((budget.capped, budget.volume), (Some(0.01), None));
    }
}
