//! The pass that a replay names, in each precision of the projection.

use swell::{
    domain::budget::Watched,
    gpu::adapter::{Context, Needs},
    stage::replay::Failure,
};

use super::{SOLVERS, bake, load, not_a_number::is_caught, opened, spoil};

/// A solve's scalars and arrays have another layout in f64. Read as f32, some of their words would
/// be NaNs, and none a residual. And a solve that takes more than one batch of iterations runs the
/// later passes more than once, with no work.
#[test]
fn a_replay_names_the_pass_of_a_residual_in_each_precision() {
    let needs = Needs { f64: true };
    let context = Context::open_for(None, needs).expect("an adapter with f64, as lavapipe is");
    // One iteration, which is never enough; and more than one batch, to a tolerance that the same
    // number of plain iterations does not reach.
    let single = (
        "budget.residual=1e-5",
        ["max_iterations=1", "preconditioner=none", "tolerance=1e-5"],
    );
    let batches = (
        "budget.residual=1e-12",
        [
            "max_iterations=20",
            "preconditioner=none",
            "tolerance=1e-14",
        ],
    );
    for (precision, (budget, settings)) in [
        ("f32", single),
        ("f32_refined", batches),
        ("f64", single),
        ("f64", batches),
    ] {
        let precision = format!("solver.flip.pressure.precision={precision}");
        let [a, b, c] = settings.map(|set| format!("solver.flip.pressure.{set}"));
        let sets = [SOLVERS[1], budget, &precision, &a, &b, &c];
        let broken = bake(&opened(&context), &load("34-not-a-number", &sets), "1-2");
        let Failure { breach, place } = broken.failure();
        assert_eq!(breach.watched, Watched::Residual, "{sets:?}: {breach}");
        assert!(breach.substep.is_some(), "{breach}");
        let place = (place.as_ref()).unwrap_or_else(|| panic!("{sets:?}: {breach}"));
        let found = (Some(place.substep), place.pass, place.buffer.as_str());
        let expected = (breach.substep, "pressure/reduce", "pressure_control");
        assert_eq!(found, expected, "{sets:?}: {breach}");
    }
}

/// PBF's projection has a precision of its own, which is not that of FLIP's settings.
#[test]
fn a_replay_of_pbf_names_the_pass_of_a_residual() {
    let context = crate::support::context();
    for precision in ["f32", "f64"] {
        let precision = format!("solver.flip.pressure.precision={precision}");
        let sets = [
            SOLVERS[0],
            "budget.residual=1e-9",
            "solver.pbf.grid_projection=true",
            "solver.flip.pressure.tolerance=1e-12",
            &precision,
        ];
        let broken = bake(&opened(&context), &load("34-not-a-number", &sets), "1-2");
        let Failure { breach, place } = broken.failure();
        assert_eq!(breach.watched, Watched::Residual, "{sets:?}: {breach}");
        let found = place
            .as_ref()
            .map(|place| (place.pass, place.buffer.as_str()));
        let expected = ("pressure/reduce", "pressure_control");
        assert_eq!(found, Some(expected), "{sets:?}: {breach}");
    }
}

/// The pass that writes a NaN is found where its words are those of f64.
#[test]
fn a_replay_names_the_pass_of_a_number_that_is_none_in_f64() {
    let needs = Needs { f64: true };
    let context = Context::open_for(None, needs).expect("an adapter with f64, as lavapipe is");
    let sets = [SOLVERS[1], "solver.flip.pressure.precision=f64"];
    let scene = load("34-not-a-number", &sets);
    let sound = bake(&opened(&context), &scene, "1-2");
    let spoil = spoil(
        "pressure/divergence",
        "pressure_rhs[own + 64u * c] = -b.lo[c]",
        "pressure_rhs[own + 64u * c] = b.lo[c] * real(bitcast<f32>(0x7fc00000u | min(local, 1u)))",
    );
    is_caught(&context, &scene, &sound.cache(), spoil);
}
