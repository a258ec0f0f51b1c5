//! When a solve stops: at the first iteration whose true residual is within the tolerance, or at
//! the iteration limit.

use swell::{
    domain::poisson::cases::{Surface, tank, tank_rhs},
    reference::poisson::gradients::{Precondition, residual, solve},
    scene::flip::{Preconditioner, Pressure},
};

use crate::support::context;
use crate::support::pressure::{Rig, settings};

/// Relative distance of the tolerances above and below a residual. On the device, the residual of
/// the recursion may differ from the true one by 3e-7 ‖b‖ where that is 1e-4: some rounding errors
/// of 6e-8 per iteration.
const DEVICE: f64 = 0.003;
const REFERENCE: f64 = 1e-9;

/// Runs a solve with a tolerance and an iteration limit; returns its iterations, whether it missed
/// the tolerance, and the true residual.
type Ask<'a> = dyn FnMut(f64, u32) -> (u32, Option<bool>, f64) + 'a;

/// Checks the rule at every iteration whose residual is the least so far and not below 1e-4;
/// returns how many were checked.
fn hold(ask: &mut Ask<'_>, most: u32, part: f64) -> u32 {
    let mut least = 1.0;
    let mut held = 0;
    for count in 1..=most {
        // An unreachable tolerance: the solve stops at its limit.
        let (iterations, is_missed, here) = ask(1e-12, count);
        assert_eq!(iterations, count);
        assert!(is_missed != Some(false), "{count}");
        if here < 1e-4 {
            break;
        }
        if here > (1.0 - 4.0 * part) * least {
            least = f64::min(least, here);
            continue;
        }
        let (stopped, is_missed, left) = ask((1.0 + part) * here, most);
        assert_eq!(stopped, count, "{here:e}");
        assert!(is_missed != Some(true) && left <= (1.0 + part) * here);
        // With a tolerance just below that, a solve that has to end here misses it.
        let (_, is_missed, _) = ask((1.0 - part) * here, count);
        assert!(is_missed != Some(false), "{here:e}");
        let (stopped, is_missed, left) = ask((1.0 - part) * here, 4 * most);
        assert!(stopped > count, "{stopped} {here:e}");
        assert!(is_missed != Some(true) && left <= (1.0 - part) * here);
        least = here;
        held += 1;
    }
    held
}

#[test]
fn a_solve_stops_at_its_tolerance_and_at_its_last_iteration() {
    let context = context();
    let case = tank(16, Surface::GhostFluid, true);
    for (kind, most, least) in [
        (Preconditioner::Multigrid, 12, 4),
        (Preconditioner::Jacobi, 60, 8),
    ] {
        let asked = |tolerance: f64, max_iterations: u32| Pressure {
            max_iterations,
            ..settings(kind, tolerance)
        };
        let mut rig = Rig::new(&context, case.clone(), &asked(1e-6, 10));
        let b = tank_rhs(&case, &rig.system);
        // As the device has it.
        let rounded: Vec<f64> = b.iter().map(|&b| f64::from(b as f32)).collect();
        let mut ask = |tolerance: f64, most: u32| {
            rig.set(&asked(tolerance, most));
            let solved = rig.solve(&b);
            let left = residual(&rig.system, &rounded, &rig.solution());
            assert!((left - solved.residual).abs() < 0.5 * DEVICE * left);
            (solved.iterations, Some(solved.is_missed), left)
        };
        let held = hold(&mut ask, most, DEVICE);
        println!("{kind:?}: {held} tolerances");
        assert!(held >= least, "{kind:?} {held}");
    }
}

/// The same for the reference's conjugate gradients, which report only the residual.
#[test]
fn the_references_gradients_stop_likewise() {
    let system = tank(16, Surface::GhostFluid, true).system();
    let b = tank_rhs(&tank(16, Surface::GhostFluid, true), &system);
    for kind in [
        Precondition::None,
        Precondition::Jacobi,
        Precondition::Ipp,
        Precondition::IncompleteCholesky,
    ] {
        let mut ask = |tolerance: f64, most: u32| {
            let solved = solve(&system, &b, kind, tolerance, most);
            let left = residual(&system, &b, &solved.x);
            assert!((left - solved.residual).abs() <= 1e-12 * left);
            (solved.iterations, None, left)
        };
        let held = hold(&mut ask, 60, REFERENCE);
        println!("{kind:?}: {held} tolerances");
        assert!(held >= 8, "{kind:?} {held}");
    }
}
