//! The cases of scenes/studies/hard-cases.toml, run by the study's own engine.
use std::{
    fs,
    path::{Path, PathBuf},
    sync::{LazyLock, atomic::AtomicBool},
    thread,
};

use crate::support::context;
use swell::{
    experiment::{
        Devices,
        stability::{StabilityRun, Verdict, refusal, run_trial},
    },
    files::study::{
        RunsOn, Study,
        stability::{Bound, Case, Held, Mark, Quantity, Stability, Trial},
    },
    gpu::{adapter::Context, imprecision::Imprecision},
    scene::Method,
    stage::device::Opened,
};

static STUDY: LazyLock<Stability> = LazyLock::new(|| load("scenes/studies/hard-cases.toml"));

fn load(file: &str) -> Stability {
    match Study::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap() {
        Study::Stability(stability) => *stability,
        other => panic!("{other:?}"),
    }
}

fn devices(context: &Context) -> Devices {
    Devices {
        gpu: Some(Opened::Gpu(Box::new(context.clone()))),
        cpu: Opened::Cpu,
    }
}

/// Trials of more frames than this are cut short.
const LONG: u32 = 240;

/// What the suite runs of a case's trials: those on the GPU, whose passes `check` compares with
/// the f64 reference, or all where none is on the GPU. A long one is cut short, to a quarter more
/// than until the last of its marks begins to count, and the reference runs it at full length
/// where one of its marks is passed. The study runs all of them, and so does `tools/test --all`,
/// which sets SWELL_ALL.
fn in_suite(trials: &[Trial]) -> Vec<Trial> {
    if std::env::var_os("SWELL_ALL").is_some() {
        return trials.to_vec();
    }
    let has_gpu = trials.iter().any(|trial| trial.device == RunsOn::Gpu);
    let is_due = |trial: &&Trial| {
        let is_always = |mark: &Mark| Quantity::ALWAYS.contains(&mark.of);
        let mut own = trial.marks.iter().filter(|mark| !is_always(mark));
        let can_fail = own.any(|mark| mark.known_failure.is_none());
        trial.device == RunsOn::Gpu || !has_gpu || trial.frames > LONG && can_fail
    };
    let cut = |trial: &Trial| {
        let mut trial = trial.clone();
        if trial.device == RunsOn::Gpu {
            let from = |mark: &Mark| mark.after.max(mark.since.unwrap_or(0.0));
            let last = trial.marks.iter().map(from).fold(0.0, f64::max);
            let frames = (1.25 * last / trial.scene.shot.frame_seconds()) as u32;
            trial.frames = trial.frames.min(frames.max(LONG));
        }
        trial
    };
    trials.iter().filter(is_due).map(cut).collect()
}

fn run(trial: &Trial) -> StabilityRun {
    run_trial(&devices(&context()), trial, &AtomicBool::new(false)).unwrap()
}

/// Lists the deviations from the study: missed marks and attempts that were not refused.
fn wrong(case: &Case) -> Vec<String> {
    let mut wrong = Vec::new();
    match &case.held {
        Held::Test(_) => {}
        Held::Refusal { attempts, words } => {
            for attempt in attempts {
                let said = refusal(&devices(&context()), attempt)
                    .unwrap()
                    .unwrap_or_default();
                if !words.iter().all(|word| said.contains(word)) {
                    wrong.push(format!("{}, {:?}: {said:?}", case.name, attempt.method));
                }
            }
        }
        Held::Runs(trials) => {
            let trials = in_suite(trials);
            assert!(!trials.is_empty(), "{}", case.name);
            // In parallel, because the longest case bounds the time of the whole suite.
            let runs: Vec<StabilityRun> = thread::scope(|scope| {
                let begun: Vec<_> = (trials.iter())
                    .map(|trial| scope.spawn(|| run(trial)))
                    .collect();
                begun.into_iter().map(|it| it.join().unwrap()).collect()
            });
            for (trial, run) in trials.iter().zip(&runs) {
                let verdicts = run.verdicts(trial);
                for (k, mark) in trial.marks.iter().enumerate() {
                    let value = run.measured.get(k).and_then(|measured| measured.value);
                    let of = format!(
                        "{}, {}, {}: {} is {value:?}, mark {:?}, {}",
                        case.name,
                        trial.scene.solver.method().name(),
                        trial.device.name(),
                        mark.of.name(),
                        mark.bound,
                        verdicts[k].words()
                    );
                    println!("{of}");
                    // A known failure may pass on one of two devices.
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
    ($($(#[$long:meta])? $name:ident: $number:literal,)*) => {
        $(#[test]
        $(#[$long])?
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
    case_07_closed_box: 7,
    case_08_pockets: 8,
    case_09_sealed_cell: 9,
    case_10_nothing_to_solve_for: 10,
    case_11_surface_at_centres: 11,
    case_13_fast_piston: 13,
    case_16_thin_wall: 16,
    case_17_narrow_gap: 17,
    case_18_a_minute: 18,
    case_19_deep_tank: 19,
    case_20_long_tank: 20,
    case_21_huge_steps: 21,
    case_22_tiny_steps: 22,
    case_25_far_from_the_origin: 25,
    case_26_world_scale: 26,
    case_30_over_dense: 30,
    case_31_resolution: 31,
    case_36_at_rest_beside_solids: 36,
    case_37_short_steps: 37,
    case_38_falling_slab: 38,
    case_39_onto_a_roof: 39,
    case_40_light_and_heavy_bodies: 40,
    case_41_a_plank_on_posts: 41,
    case_42_pressed_bodies: 42,
    case_43_a_body_on_the_floor: 43,
    case_44_bodies_that_leave: 44,
    #[ignore = "two minutes: tools/test --all"]
    case_45_ten_crates: 45,
    #[ignore = "half a minute alone, two beside others: tools/test --all"]
    case_46_two_hundred_bodies: 46,
    case_47_a_raft_beside_a_wall: 47,
    case_48_ten_crates_at_first: 48,
    case_49_a_body_on_a_slope: 49,
    case_50_a_film_on_a_current: 50,
}

/// FLIP at rest, its surface on cell centres, where it divides by what is nearly 0, and a particle
/// that lands.
#[test]
fn marks_are_passed_as_imprecisely_as_vulkan_permits() {
    let context = Context::open_imprecise(None, Imprecision::vulkan_worst(1)).unwrap();
    let mut passed = 0;
    for case in cases(3).chain(cases(11)) {
        let Held::Runs(trials) = &case.held else {
            panic!("{}", case.name)
        };
        let is_meant = |trial: &&Trial| {
            trial.device == RunsOn::Gpu && trial.scene.solver.method() == Method::Flip
        };
        for trial in trials.iter().filter(is_meant) {
            let run = run_trial(&devices(&context), trial, &AtomicBool::new(false)).unwrap();
            assert!(run.passes(trial), "{}: {:?}", case.name, run.measured);
            passed += 1;
        }
    }
    assert_eq!(passed, 5);
}

/// Negative control of the engine: a mark just beyond the measured value is missed, and a run that
/// ends early does not pass.
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
                    Bound::AtMost(_) => Bound::AtMost(value.next_down()),
                    Bound::AtLeast(_) => Bound::AtLeast(value.next_up()),
                };
                seen += 1;
            }
            let is_missed = |verdict: &Verdict| *verdict == Verdict::Misses;
            assert!(run.verdicts(&strict).iter().all(is_missed), "{}", case.name);
            let known = |mark: &Mark| mark.known_failure.is_some();
            if !trial.marks.iter().any(known) {
                assert!(run.passes(trial), "{}", case.name);
            }
            let ended = StabilityRun {
                ended: Some("too fast".into()),
                ..run
            };
            assert!(!ended.passes(trial));
        }
    }
    assert!(seen > 20);
}

/// Quantities that no scene can violate: particles are clamped to moving walls and pushed out of
/// solids. Both are tested where they are computed.
const NOT_SPOILED: [Quantity; 2] = [Quantity::Behind, Quantity::InSolid];

/// Negative control of each quantity: a spoiled simulation misses its mark, with a measured value.
#[test]
fn every_measure_is_missed_by_water_that_is_spoiled() {
    let controls = load("tests/hard_cases/controls.toml");
    let mut spoiled: Vec<Quantity> = NOT_SPOILED.into();
    spoiled.extend(Quantity::ALWAYS);
    for case in &controls.cases {
        let Held::Runs(trials) = &case.held else {
            panic!("{}", case.name)
        };
        for trial in trials {
            let run = run(trial);
            assert_eq!(run.ended, None, "{}", case.name);
            let all = trial.marks.iter().zip(run.verdicts(trial));
            for ((mark, verdict), measured) in all.zip(&run.measured) {
                let is_always = Quantity::ALWAYS.contains(&mark.of);
                let wanted = match is_always {
                    true => Verdict::Passes,
                    false => Verdict::Misses,
                };
                let of = format!("{}, {}", case.name, mark.of.name());
                assert_eq!(verdict, wanted, "{of}: {:?}", measured.value);
                assert!(measured.value.is_some(), "{of}");
                spoiled.push(mark.of);
            }
        }
    }
    for case in &STUDY.cases {
        if let Held::Runs(trials) = &case.held {
            let marks = trials.iter().flat_map(|trial| &trial.marks);
            for of in marks.map(|mark| mark.of) {
                assert!(spoiled.contains(&of), "{} has no control", of.name());
            }
        }
    }
}

/// Whether the test in a command of the study exists: `--test suite MODULES::NAME`, or
/// `--workspace --lib NAME`.
fn is_there(command: &str) -> bool {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let words: Vec<&str> = command.split(' ').collect();
    let (files, name) = match words[..] {
        ["cargo", "test", "--release", "--test", "suite", path] => {
            let Some((modules, name)) = path.rsplit_once("::") else {
                return false;
            };
            let module = root.join("tests/suite").join(modules.replace("::", "/"));
            (
                vec![module.with_extension("rs"), module.join("mod.rs")],
                name,
            )
        }
        ["cargo", "test", "--release", "--workspace", "--lib", name] => {
            (sources(&root.join("src")), name)
        }
        _ => return false,
    };
    let head = format!("fn {name}() {{");
    let has = |text: String| {
        let mut lines = text.lines().map(str::trim).peekable();
        std::iter::from_fn(|| lines.next().map(|line| (line, lines.peek().copied())))
            .any(|(line, next)| line == "#[test]" && next == Some(&head))
    };
    files
        .iter()
        .any(|file| fs::read_to_string(file).is_ok_and(has))
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => files.extend(sources(&path)),
            false => files.push(path),
        }
    }
    files
}

#[test]
fn tests_that_hold_a_case_are_there() {
    let mut seen = 0;
    for case in &STUDY.cases {
        if let Held::Test(command) = &case.held {
            assert!(
                is_there(command),
                "{} {}: {command}",
                case.number,
                case.name
            );
            seen += 1;
        }
    }
    assert!(seen > 8);
    for absent in [
        "--test suite stage::budget::no_such_test",
        "--test suite no_such_module::run",
        "--test suite water_in_a_solid_is_left_out_and_counted",
    ] {
        assert!(!is_there(&format!("cargo test --release {absent}")));
    }
}

#[test]
fn no_number_of_the_list_is_left_out() {
    for number in 1..=35 {
        assert!(cases(number).count() > 0, "case {number}");
    }
}
