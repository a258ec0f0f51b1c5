//! The cases of scenes/studies/hard-cases.toml, by the study's own engine.
#![allow(missing_docs, clippy::unwrap_used, reason = "tests")]

use std::{
    path::Path,
    sync::{LazyLock, atomic::AtomicBool},
};

use swell::{
    gpu::adapter::Context,
    scene::study::{
        Study,
        stability::{Bound, Case, Held, Mark, Quantity, Stability, Trial},
    },
    stage::{
        device::Opened,
        study::stability::{Devices, Run, Verdict, refusal, run_trial},
    },
};

static STUDY: LazyLock<Stability> = LazyLock::new(|| {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/studies/hard-cases.toml");
    match Study::load(&file).unwrap() {
        Study::Stability(stability) => *stability,
        other => panic!("{other:?}"),
    }
});

static CONTEXT: LazyLock<Context> = LazyLock::new(|| {
    Context::open(None).expect("tests need a Vulkan adapter; tools/test installs one")
});

fn devices() -> Devices {
    Devices {
        gpu: Some(Opened::Gpu(Box::new(CONTEXT.clone()))),
        cpu: Opened::Cpu,
    }
}

fn run(trial: &Trial) -> Run {
    run_trial(&devices(), trial, &AtomicBool::new(false))
        .unwrap()
        .unwrap()
}

/// What does not come out as the study says: marks that are missed, known failures that hold, and what is not refused.
fn wrong(case: &Case) -> Vec<String> {
    let mut wrong = Vec::new();
    match &case.held {
        Held::Test(_) => {}
        Held::Refusal { attempts, words } => {
            for attempt in attempts {
                let said = refusal(&devices(), attempt).unwrap().unwrap_or_default();
                if !words.iter().all(|word| said.contains(word)) {
                    wrong.push(format!("{}, {:?}: {said:?}", case.name, attempt.method));
                }
            }
        }
        Held::Runs(trials) => {
            for trial in trials {
                let run = run(trial);
                let verdicts = run.verdicts(trial);
                for (k, mark) in trial.marks.iter().enumerate() {
                    let value = run.measured.get(k).and_then(|measured| measured.value);
                    let of = format!(
                        "{}, {}, {}: {} is {value:?}, mark {:?}, {}",
                        case.name,
                        trial.scene.solver.method.name(),
                        trial.device.name(),
                        mark.of.name(),
                        mark.bound,
                        verdicts[k].words()
                    );
                    println!("{of}");
                    // A known failure may hold on one of two devices.
                    if verdicts[k] == Verdict::Misses {
                        wrong.push(format!("{of}{}", run.ended.as_deref().unwrap_or("")));
                    }
                }
            }
        }
    }
    wrong
}

fn cases(number: u32) -> impl Iterator<Item = &'static Case> {
    STUDY.cases.iter().filter(move |case| case.number == number)
}

fn hold(number: u32) {
    let wrong: Vec<String> = cases(number).flat_map(wrong).collect();
    assert!(cases(number).count() > 0, "no case {number}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

macro_rules! cases {
    ($($name:ident: $number:literal,)*) => {
        $(#[test]
        fn $name() {
            hold($number);
        })*

        #[test]
        fn every_case_of_the_study_has_its_test() {
            let listed = [$($number),*];
            for case in &STUDY.cases {
                let is_held = matches!(case.held, Held::Test(_)) || listed.contains(&case.number);
                assert!(is_held, "{} {}", case.number, case.name);
            }
        }
    };
}

cases! {
    case_01_coincident_particles: 1,
    case_02_no_particles: 2,
    case_03_one_particle: 3,
    case_04_isolated_drops: 4,
    case_05_film: 5,
    case_06_free_surface: 6,
    case_18_a_minute: 18,
    case_19_deep_tank: 19,
    case_21_huge_steps: 21,
    case_30_over_dense: 30,
}

/// Negative control of the engine: whatever a mark measures, one beyond that is missed, and so is one of a run that ends
/// early.
#[test]
fn a_mark_beyond_what_is_measured_is_missed() {
    let mut seen = 0;
    for case in cases(1).chain(cases(2)) {
        let Held::Runs(trials) = &case.held else {
            panic!("{}", case.name)
        };
        for trial in trials {
            let run = run(trial);
            let mut strict = trial.clone();
            for (mark, measured) in strict.marks.iter_mut().zip(&run.measured) {
                let value = measured.value.unwrap();
                mark.known_failure = None;
                mark.bound = match mark.bound {
                    Bound::AtMost(_) => Bound::AtMost(value - 1e-9),
                    Bound::AtLeast(_) => Bound::AtLeast(value + 1e-9),
                };
                seen += 1;
            }
            let is_missed = |verdict: &Verdict| *verdict == Verdict::Misses;
            assert!(run.verdicts(&strict).iter().all(is_missed), "{}", case.name);
            let known = |mark: &Mark| mark.known_failure.is_some();
            if !trial.marks.iter().any(known) {
                assert!(run.passes(trial), "{}", case.name);
            }
            let ended = Run {
                ended: Some("too fast".into()),
                ..run
            };
            assert!(!ended.passes(trial));
        }
    }
    assert!(seen > 20);
    assert!(Quantity::ALWAYS.len() == 3);
}
