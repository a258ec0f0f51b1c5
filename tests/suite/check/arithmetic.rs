//! Arithmetic of the device by itself.

use swell::{
    check::{CheckTable, arithmetic},
    gpu::adapter::InjectedFault,
};

use super::{lines, over};
use crate::support::{context, job::Job};

const PASS: &str = "measure/accuracy";

fn spoiled(from: &'static str, to: &'static str) -> CheckTable {
    let mut context = context();
    let pass = PASS;
    context.spoil = Some(InjectedFault { pass, from, to });
    arithmetic::check(&context).unwrap()
}

#[test]
fn operations_are_as_exact_as_tolerances_assume_and_each_row_fails_where_it_should() {
    let clean = arithmetic::check(&context()).unwrap();
    assert!(over(&clean).is_empty(), "{}", lines(&clean));
    assert_eq!(clean.rows.len(), 4);
    // Sums and products that are cut off in place of rounded, and 64 u more or less.
    for (from, to, row) in [
        ("x + y", "bitcast<f32>(bitcast<u32>(x + y) - 1u)", "sum"),
        ("x * y", "bitcast<f32>(bitcast<u32>(x * y) - 1u)", "product"),
        ("x / y", "x / y * 1.0000038", "quotient"),
        (
            "inverseSqrt(x)",
            "inverseSqrt(x) * 1.0000038",
            "inverse square root",
        ),
        (
            "inverseSqrt(x)",
            "inverseSqrt(x) * 0.9999962",
            "inverse square root",
        ),
    ] {
        let found = spoiled(from, to);
        assert_eq!(over(&found), [(PASS, row)], "{to}: {}", lines(&found));
    }
}

/// A check of water begins with these rows.
#[test]
fn a_check_fails_on_an_inverse_square_root_that_is_off_by_64_roundings() {
    let job = Job::new();
    job.copy_shaders("shaders");
    job.expect(0, "check small.toml --shaders shaders");
    job.edit(
        "shaders/measure/accuracy.wgsl",
        "inverseSqrt(x)",
        "inverseSqrt(x) * 1.0000038",
    );
    let said = job.expect(1, "check small.toml --shaders shaders");
    assert!(said.contains("inverse square root"), "{said}");
}
