//! The projection with one f32 word, with two, and in f64.

use swell::{
    domain::poisson::{
        cases::{Case, Surface, manufactured, tank_rhs},
        remove_means,
    },
    gpu::{
        adapter::{Context, GpuError, Needs},
        program::Program,
    },
    reference::poisson::gradients::{Precondition, norm, solve},
    scene::flip::{Precision, Preconditioner, Pressure, Surface as SceneSurface},
    solve::{
        flip::buffers::DENSITY_EXCESS,
        pressure::{
            buffers::{RHS, SOLUTION},
            passes, planned,
        },
    },
    stage::Blame,
};

use super::{difference, pockets};
use crate::support::context;
use crate::support::pressure::{Rig, WITH_CORRECTION, settings};

fn in_precision(precision: Precision, tolerance: f64) -> Pressure {
    Pressure {
        precision,
        ..settings(Preconditioner::Multigrid, tolerance)
    }
}

/// One word stalls, two words get further, and f64 reaches the accuracy of a direct solution. In
/// all three the reported residual is that of the downloaded solution in the f64 system.
#[test]
fn each_precision_stalls_where_it_has_to() {
    let context = Context::open_for(None, Needs { f64: true })
        .expect("this test needs an adapter with f64, as lavapipe is");
    let (case, b, _) = manufactured(64);
    let b: Vec<f64> = b.iter().map(|&b| f64::from(b as f32)).collect();
    let solve_in = |precision, tolerance| {
        let mut rig = Rig::new(&context, case.clone(), &in_precision(precision, tolerance));
        let solved = rig.solve(&b);
        let x = rig.solution();
        let truth = norm(&difference(&b, &rig.system.apply(&x))) / norm(&b);
        (solved, truth, x, rig)
    };
    // ε ‖A‖ ‖x‖ / ‖b‖ with ε = 2⁻²⁴ and ‖A‖ ≤ 12.
    let (known, _, exact, rig) = solve_in(Precision::F64, 1e-12);
    assert!(!known.is_missed, "{known:?}");
    let stall = 12.0 * norm(&exact) / norm(&b) / f64::from(1 << 24);
    // The device's rows equal those of the f64 builder up to the f64 rounding of θ and of sums of
    // six.
    let (found, truth, _, _) = solve_in(Precision::F64, 1e-10);
    assert!(!found.is_missed && truth <= 1.1e-10, "{truth:e} {found:?}");
    let direct = solve(&rig.system, &b, Precondition::Ipp, 1e-12, 2000);
    // ‖x − x₆₄‖ ≤ κ (both residuals); κ of 64³ is below 1e4.
    let apart = norm(&difference(&exact, &direct.x)) / norm(&direct.x);
    assert!(apart < 2e-8, "{apart:e}");

    let (plain, plain_truth, _, _) = solve_in(Precision::F32, 1e-9);
    assert!(plain.is_missed, "{plain:?}");
    assert!(
        plain_truth < stall && plain_truth > 1e-2 * stall,
        "{plain_truth:e} {stall:e}"
    );
    assert!(
        (plain.residual / plain_truth - 1.0).abs() < 0.1,
        "{plain:?} {plain_truth:e}"
    );
    let (refined, refined_truth, _, _) = solve_in(Precision::F32Refined, 1e-9);
    // Two words hold x to ε², but the residual is a sum of f32 fluxes, rounded at ε of ‖b‖ a few
    // times.
    assert!(
        refined.is_missed && refined_truth < 0.1 * plain_truth && refined_truth > 1e-9,
        "{refined:?} {refined_truth:e} {plain_truth:e}"
    );
}

/// Pockets, and the density correction on the same system, in f64.
#[test]
fn f64_takes_pockets_and_corrections() {
    let context = Context::open_for(None, Needs { f64: true })
        .expect("this test needs an adapter with f64, as lavapipe is");
    let case = Case {
        surface: Surface::Voxel,
        ..pockets(24, &[[[2, 12, 2], [20, 21, 19]]], 10)
    };
    for preconditioner in [
        Preconditioner::None,
        Preconditioner::Jacobi,
        Preconditioner::Ipp,
        Preconditioner::Multigrid,
    ] {
        let settings = Pressure {
            precision: Precision::F64,
            ..settings(preconditioner, 1e-10)
        };
        let mut rig = Rig::new(&context, case.clone(), &settings);
        let known = rig.system.pockets();
        let mut b = tank_rhs(&case, &rig.system);
        remove_means(&mut b, &known);
        rig.set_rhs(&b);
        let projected = rig.project(None);
        assert!(
            !projected.solved.is_missed,
            "{preconditioner:?} {projected:?}"
        );
        assert_eq!(projected.pockets, 1);
        rig.program
            .upload(DENSITY_EXCESS, 0, &vec![0.01f32; rig.case.kind.len()]);
        let corrected = rig.solver.correct(&rig.program, None).unwrap();
        assert!(!corrected.is_missed, "{preconditioner:?} {corrected:?}");
    }
}

/// Buffers that a precision does not use take no bytes, and only `f64` requires 64-bit floats of
/// the device.
#[test]
fn a_precision_takes_its_own_bytes_and_features() {
    let slots = 10;
    let bytes = |precision| {
        let settings = in_precision(precision, 1e-5);
        let all = planned(&settings, WITH_CORRECTION, slots).specs();
        let of = |name: &str| all.iter().find(|spec| spec.name == name).unwrap().bytes;
        let total: u64 = all.iter().map(|spec| spec.bytes).sum();
        (of(SOLUTION.name()), of(RHS.name()), total)
    };
    let cells = 4 * 512 * slots as u64;
    let [plain, refined, double] =
        [Precision::F32, Precision::F32Refined, Precision::F64].map(bytes);
    assert_eq!((plain.0, plain.1), (cells, cells));
    assert_eq!((refined.0, refined.1), (2 * cells, cells));
    assert_eq!((double.0, double.1), (2 * cells, 2 * cells));
    assert_eq!(refined.2 - plain.2, cells);
    // Six vectors and the Dirichlet part of the rows, sums of pockets, four sums per workgroup, and
    // five scalars.
    assert_eq!(
        double.2 - plain.2,
        7 * cells + cells / 2 + 4 * 4 * (slots as u64 + 1024) + 20
    );

    let context = context();
    assert!(!context.has_f64);
    let error = Program::new(
        &context,
        &[],
        &passes(
            &in_precision(Precision::F64, 1e-5),
            SceneSurface::GhostFluid,
            WITH_CORRECTION,
            false,
        ),
        &[],
    );
    let error = error.unwrap_err();
    assert!(matches!(error, GpuError::NoF64 { .. }), "{error:?}");
    // The commands' exit code 2.
    assert_eq!(Blame::from(&error), Blame::Input);
}
