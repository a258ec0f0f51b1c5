//! A profile of imprecision errs as much as it says, and a device that errs more than two words of
//! a number permit is refused.

use swell::{
    domain::boundary::Boundary,
    gpu::{
        adapter::{Context, InjectedFault},
        imprecision::Imprecision,
        rounding::Rounding,
    },
    scene::flip::Precision,
    solve::{
        flip::{Flip, capacity},
        plan::{Counts, Plan, device_limits},
    },
};

use crate::support::{
    context,
    flip::{block, flip, scene},
};

fn measured(profile: Imprecision) -> Rounding {
    Rounding::measure(&Context::open_imprecise(None, profile).unwrap()).unwrap()
}

#[test]
fn a_profile_errs_by_more_than_the_device_and_no_more_than_it_says() {
    let plain = context().rounding().unwrap();
    println!("{plain:?}");
    let profile = Imprecision {
        contraction: 1.0,
        ..Imprecision::vulkan_worst(1)
    };
    let worst = measured(profile);
    println!("{worst:?}");
    // The errors of exponentials, sine and cosine are added to the device's.
    for (name, plain, worst, [least, most]) in [
        ("division", plain.division, worst.division, [2.0, 2.5]),
        ("sqrt", plain.square_root, worst.square_root, [5.5, 6.5]),
        (
            "inverseSqrt",
            plain.inverse_square_root,
            worst.inverse_square_root,
            [1.5, 2.0],
        ),
        ("length", plain.length, worst.length, [7.0, 8.0]),
        ("exp", plain.exponential, worst.exponential, [4.0, 7.0]),
        (
            "log",
            plain.logarithm,
            worst.logarithm,
            [2.5, 3.0 + plain.logarithm],
        ),
        ("pow", plain.power, worst.power, [5.0, 16.0]),
        ("sine", plain.sine, worst.sine, [4e-4, 4.9e-4 + plain.sine]),
    ] {
        assert!(plain < least, "{name}: {plain} by itself");
        assert!((least..=most).contains(&worst), "{name}: {worst}");
    }
    assert!(worst.contracts && worst.flushes_inputs && worst.flushes_results);
    assert!(!plain.contracts);
    // What is guarded against fusing survives it.
    assert!(plain.keeps_two_words() && worst.keeps_two_words());

    // Each error by itself, and other errors by another seed.
    let none = measured(Imprecision::NONE);
    assert_eq!(none, plain);
    let division = measured(Imprecision {
        division: 16.0,
        ..Imprecision::NONE
    });
    assert!((12.0..=16.0).contains(&division.division), "{division:?}");
    assert_eq!(
        Rounding {
            division: plain.division,
            ..division
        },
        plain
    );
    let other = measured(Imprecision { seed: 2, ..profile });
    assert_ne!(other, worst);
    assert_eq!(measured(profile), worst);
}

/// FLIP with `f32_refined` on a device with this fault in the measuring pass.
fn refusal(precision: Precision, spoil: InjectedFault) -> Option<String> {
    let mut context = context();
    context.spoil = Some(spoil);
    let mut scene = scene([4.0; 3]);
    flip(&mut scene).pressure.precision = precision;
    let scene = scene.with_flip().unwrap();
    let particles = block([0; 3], [2; 3]);
    let counts = Counts {
        particles: particles.len(),
        bricks: capacity(&scene, &particles),
        ..Counts::default()
    };
    let plan = Plan::new(&scene, counts, device_limits(&context));
    match Flip::new(&context, &scene, plan, &Boundary::default(), false) {
        Ok(_) => None,
        Err(error) => Some(error.to_string()),
    }
}

#[test]
fn two_words_are_refused_where_a_device_loses_what_the_second_is_for() {
    let spoil = |from, to| InjectedFault {
        pass: "measure/rounding",
        from,
        to,
    };
    let simplified = spoil("(a - rounded_a) + (b - rounded_b)", "0.0");
    let rounded = spoil(", a_large * b_large, small)", ", a * b, 0.0)");
    for (fault, words) in [
        (simplified, "loses the rounding errors of sums"),
        (rounded, "loses the rounding errors of products"),
    ] {
        let said = refusal(Precision::F32Refined, fault).unwrap();
        assert!(
            said.contains(words) && said.contains("f32_refined"),
            "{said}"
        );
        assert_eq!(refusal(Precision::F32, fault), None);
    }
    let harmless = spoil("small = a_large", "small = 1.0 * a_large");
    assert_eq!(refusal(Precision::F32Refined, harmless), None);
    let unknown = "vulkan-best"
        .parse::<Imprecision>()
        .unwrap_err()
        .to_string();
    assert!(unknown.contains("vulkan-worst:SEED"), "{unknown}");
    assert_eq!(
        "vulkan-worst:7".parse::<Imprecision>().unwrap(),
        Imprecision::vulkan_worst(7)
    );
}
