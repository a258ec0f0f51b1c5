//! Both solvers stay within tolerance on a device as imprecise as Vulkan permits.

use swell::{
    gpu::{adapter::Context, imprecision::Imprecision},
    scene::Method,
    stage::check::CheckTable,
};

use super::{case, lines, over, run};
use crate::support::pbf_of;

/// Checks moving water with a solid: PBF with its projection, FLIP with ghost fluid and density
/// correction.
fn checked(context: &Context, method: Method) -> CheckTable {
    let (mut scene, start) = case(method);
    if method == Method::Pbf {
        pbf_of(&mut scene).grid_projection = true;
    }
    run(context, &scene, &start)
}

/// 30 seconds where the driver has not cached them: every pass is compiled anew for each seed.
#[test]
fn both_solvers_are_within_tolerance_as_imprecisely_as_vulkan_permits() {
    for seed in [1, 2] {
        let context = Context::open_imprecise(None, Imprecision::vulkan_worst(seed)).unwrap();
        for method in [Method::Pbf, Method::Flip] {
            let table = checked(&context, method);
            assert!(table.rows.len() > 80, "{}", table.rows.len());
            assert!(over(&table).is_empty(), "{method:?}: {}", lines(&table));
        }
    }
}

/// In this order an inverse square root, a quotient, a quotient, a root and a length are what a row
/// sees.
#[test]
fn rows_see_errors_beyond_what_vulkan_permits() {
    let gross = Imprecision {
        division: 16.0,
        // At 64 the only root of the surface stays within what its bound allows the densities.
        square_root: 128.0,
        inverse_square_root: 256.0,
        length: 64.0,
        ..Imprecision::NONE
    };
    let context = Context::open_imprecise(None, gross).unwrap();
    for (method, rows) in [
        (
            Method::Pbf,
            &[
                ("pbf/compute_delta", "corrected position"),
                ("pressure/build_system", "what air adds to the diagonal"),
            ][..],
        ),
        (
            Method::Flip,
            &[
                ("flip/extrapolate", "velocity at faces"),
                ("flip/find_water", "distance of the surface"),
                ("effects/grid_curl", "its length"),
            ],
        ),
    ] {
        let found = over(&checked(&context, method));
        for row in rows {
            assert!(found.contains(row), "{row:?} of {method:?}: {found:?}");
        }
    }
}
