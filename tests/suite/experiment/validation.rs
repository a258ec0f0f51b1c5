//! Coarse runs of the benchmarks with known answers, by the study's own engine, and their results
//! in deliberately wrong physics.
use std::{
    f64::consts::TAU,
    fs,
    path::{Path, PathBuf},
    sync::{LazyLock, atomic::AtomicBool},
};

use swell::{
    domain::{
        motion::{Motion, piston_height_ratio, wave_number},
        solitary_wave::SolitaryWave,
    },
    experiment::{
        Devices,
        stability::Verdict,
        validation::{BenchmarkRun, judge, run_benchmark},
    },
    files::study::{
        Study,
        validation::{Benchmark, Bound, Measure, Validation},
    },
    gpu::adapter::Context,
    scene::{Scene, probe::ProbeKind},
    stage::device::Opened,
};

fn studies() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/studies")
}

static COARSE: LazyLock<String> =
    LazyLock::new(|| fs::read_to_string(studies().join("validation-coarse.toml")).unwrap());

fn parsed(text: &str) -> Validation {
    let folder = studies();
    match Study::parse(text, &folder.join("validation-coarse.toml"), &folder).unwrap() {
        Study::Validation(validation) => *validation,
        other => panic!("{other:?}"),
    }
}

fn runs(context: &Context, benchmark: &Benchmark) -> Vec<BenchmarkRun> {
    let devices = Devices {
        gpu: Some(Opened::Gpu(Box::new(context.clone()))),
        cpu: Opened::Cpu,
    };
    let run = |trial| run_benchmark(&devices, benchmark, trial, &AtomicBool::new(false)).unwrap();
    let runs: Vec<_> = benchmark.runs.iter().map(run).collect();
    for run in &runs {
        println!(
            "{}: {:?} {:?}",
            benchmark.name, run.ended, run.measured.numbers
        );
    }
    runs
}

/// Lists the gates of a benchmark that its runs miss on `context`.
fn missed(context: &Context, benchmark: &Benchmark) -> Vec<String> {
    missed_by(benchmark, &runs(context, benchmark))
}

/// Lists the gates of a benchmark that these runs miss.
fn missed_by(benchmark: &Benchmark, runs: &[BenchmarkRun]) -> Vec<String> {
    let mut missed = Vec::new();
    for judged in judge(benchmark, runs) {
        if !matches!(judged.verdict, Verdict::Passes | Verdict::KnownFailure) {
            let (of, is) = (&judged.gate.of, judged.measured);
            missed.push(format!("{of} is {is:?}: {:?}", judged.verdict));
        }
    }
    missed
}

fn benchmark(text: &str, name: &str) -> Benchmark {
    let mut all = parsed(text).benchmarks.into_iter();
    all.find(|benchmark| benchmark.name == name).unwrap()
}

fn hold(name: &str) {
    let missed = missed(&crate::support::context(), &benchmark(&COARSE, name));
    assert!(missed.is_empty(), "{name}: {}", missed.join("\n"));
}

/// Like [`hold`], with a negative control on the same runs: waves lower by the factor `lower`
/// miss the gate. In linear theory, those are the waves of a wall or flap with a stroke
/// shorter by that factor.
fn hold_height(name: &str, lower: f64) {
    let mut benchmark = benchmark(&COARSE, name);
    let runs = runs(&crate::support::context(), &benchmark);
    let missed = missed_by(&benchmark, &runs);
    assert!(missed.is_empty(), "{name}: {}", missed.join("\n"));
    let mut gates = benchmark.gates.iter_mut();
    let gate = gates.find(|gate| gate.of == "height_ratio").unwrap();
    gate.published = gate.published.map(|published| published / lower);
    let missed = missed_by(&benchmark, &runs);
    assert_eq!(missed.len(), 1, "{name}: {missed:?}");
    assert!(missed[0].starts_with("height_ratio"), "{missed:?}");
}

#[test]
fn a_piston_makes_the_waves_of_linear_theory() {
    hold_height("piston, kh = 1", 0.95);
}

#[test]
fn a_flap_makes_the_waves_of_biesels_theory() {
    hold_height("flap, kh = 1.8", 2.0 / 3.0);
}

/// Negative control on the same run: waves a fifth lower or higher would run up by their height to
/// the power 5/4.
#[test]
fn a_solitary_wave_runs_up_a_slope() {
    let mut benchmark = benchmark(&COARSE, SLOPE);
    let runs = runs(&crate::support::context(), &benchmark);
    let missed = missed_by(&benchmark, &runs);
    assert!(missed.is_empty(), "{}", missed.join("\n"));
    let gates = benchmark.gates.clone();
    for height in [0.8_f64, 1.2] {
        for (gate, as_read) in benchmark.gates.iter_mut().zip(&gates) {
            gate.bound = match as_read.bound {
                Bound::AtLeast(least) => Bound::AtLeast(least / height.powf(1.25)),
                Bound::AtMost(most) => Bound::AtMost(most / height.powf(1.25)),
                other => other,
            };
        }
        assert_eq!(missed_by(&benchmark, &runs).len(), 1, "{height}");
    }
}

const SLOPE: &str = "solitary wave on a slope of 15°";

macro_rules! benchmarks {
    ($($(#[$long:meta])? $test:ident: $name:literal,)*) => {
        $(#[test]
        $(#[$long])?
        fn $test() {
            hold($name);
        })*

        #[test]
        fn every_benchmark_has_its_test() {
            let listed = ["piston, kh = 1", "flap, kh = 1.8", SLOPE, $($name),*];
            for benchmark in &parsed(&COARSE).benchmarks {
                assert!(listed.contains(&benchmark.name.as_str()), "{}", benchmark.name);
            }
        }
    };
}

benchmarks! {
    a_zone_absorbs_the_waves_of_a_piston: "absorbing zone, kh = 2",
    waves_come_in_from_a_zone_as_theory_has_them: "generation zone, kh = 2",
    #[ignore = "two minutes: tools/test --all"]
    a_packet_meets_where_and_when_it_was_asked_to: "focused packet",
    a_solitary_wave_keeps_its_height_and_celerity: "solitary wave",
    a_column_collapses_as_in_the_experiment: "dam break of a column",
    a_dry_bed_is_run_over_as_ritter_has_it: "dam break on a dry bed",
    a_dam_breaks_onto_a_block: "dam break onto a block",
    a_jet_presses_on_a_wall_with_its_momentum: "jet on a wall",
    a_standing_wave_has_its_period: "standing wave",
    a_column_at_rest_weighs_what_it_weighs: "column at rest",
    a_vortex_turns_on: "Taylor–Green vortex",
    water_slides_down_a_slope_without_drag: "water slides down a slope of 20°",
    a_heavy_ball_begins_to_sink_with_its_added_mass: "ball of 7000 kg/m³ released under water",
    a_ball_shares_its_momentum_with_its_added_mass: "ball as heavy as water, set in motion",
    a_raft_rolls_with_its_added_inertia: "roll of a raft",
}

/// Returns a benchmark's text with one passage replaced.
fn spoiled(from: &str, to: &str) -> String {
    assert!(COARSE.contains(from), "{from}");
    COARSE.replace(from, to)
}

/// Negative controls: without the part of the pressure solve in which a body gives way, and with the
/// moment about z left out.
#[test]
fn bodies_that_the_pressure_moves_wrongly_fail_benchmarks() {
    for (pass, from, to, name, of) in [
        (
            "pressure/couple",
            "let added = select(0.0, body_flux",
            "let added = 0.0 * select(0.0, body_flux",
            "ball as heavy as water, set in motion",
            "speed_left",
        ),
        (
            "flip/couple_bodies",
            "let way = cross(arm, area)",
            "let way = vec3f(1.0, 1.0, 0.0) * cross(arm, area)",
            "roll of a raft",
            "roll_period",
        ),
    ] {
        let context = crate::support::device::spoiled(pass, from, to);
        let mut benchmark = benchmark(&COARSE, name);
        benchmark.runs.truncate(1);
        let missed = missed(&context, &benchmark);
        assert_eq!(missed.len(), 1, "{name}: {missed:?}");
        assert!(missed[0].starts_with(of), "{missed:?}");
    }
}

/// Negative control: 1 % more or less gravity is 1 % more or less pressure.
#[test]
fn gravity_that_is_off_by_a_hundredth_fails_a_benchmark() {
    let context = crate::support::context();
    for gravity in [-9.81 * 1.01, -9.81 * 0.99] {
        let set = format!("    \"shot.frames=45\",\n    \"water.gravity=[0.0, {gravity:?}, 0.0]\"");
        let text = spoiled("    \"shot.frames=45\"", &set);
        let missed = missed(&context, &benchmark(&text, "column at rest"));
        assert_eq!(missed.len(), 2, "{gravity}: {missed:?}");
    }
}

/// Negative control: a wall in place of the zone reflects most of a wave.
#[test]
#[ignore = "a minute: tools/test --all; reflections are measured in swell-study's own tests"]
fn a_flume_without_its_zone_fails_a_benchmark() {
    let mut zone = benchmark(&COARSE, "absorbing zone, kh = 2");
    zone.runs[0].scene.effects = Default::default();
    let missed = missed(&crate::support::context(), &zone);
    let [only] = &missed[..] else {
        panic!("{missed:?}")
    };
    let found = only.strip_prefix("reflection is Some(").unwrap();
    let found: f64 = found.split(')').next().unwrap().parse().unwrap();
    assert!(found > 0.5, "{missed:?}");
}

/// Negative control: 5 % less speed is 10 % less force.
#[test]
fn a_jet_that_is_slower_by_a_twentieth_fails_a_benchmark() {
    let mut jet = benchmark(&COARSE, "jet on a wall");
    jet.runs[0].scene.emitters[0].velocity *= 0.95;
    let missed = missed(&crate::support::context(), &jet);
    assert_eq!(missed.len(), 1, "{missed:?}");
    let found = missed[0].strip_prefix("force_ratio is Some(").unwrap();
    let found: f64 = found.split(')').next().unwrap().parse().unwrap();
    assert!((0.85..0.95).contains(&found), "{missed:?}");
}

/// Negative control: in a zone of a fifth of a wavelength, the wall at its end spoils the waves.
#[test]
#[ignore = "a minute: tools/test --all"]
fn waves_from_too_short_a_zone_fail_a_benchmark() {
    let mut zone = benchmark(&COARSE, "generation zone, kh = 2");
    let settings = &mut zone.runs[0].scene.effects.generation_zone;
    settings.as_mut().unwrap().length = 0.6;
    let missed = missed(&crate::support::context(), &zone);
    assert_eq!(missed.len(), 2, "{missed:?}");
    assert!(
        missed.iter().all(|words| words.contains("is Some(0.")),
        "{missed:?}"
    );
}

/// Measurement begins after the full wave's energy, at the group velocity, would be back at the
/// first gauge from a reflecting wall.
#[test]
fn reflections_are_measured_when_they_would_be_there() {
    let text = fs::read_to_string(studies().join("validation.toml")).unwrap();
    let mut held = 0;
    for benchmark in [parsed(&text), parsed(&COARSE)]
        .iter()
        .flat_map(|v| &v.benchmarks)
        .filter(|benchmark| benchmark.name.starts_with("absorbing "))
    {
        let scale = benchmark.scale;
        for run in &benchmark.runs {
            let Motion::Sine { ramp, .. } = run.scene.wave_makers[0].motion else {
                panic!("{:?}", run.scene.wave_makers)
            };
            let k = wave_number(TAU / scale.period, 1.0, 9.81);
            let group = (0.5 + k / (2.0 * k).sinh()) * TAU / scale.period / k;
            let first = match run.scene.probes[0].kind {
                ProbeKind::Elevation { at } => at.x,
                ref other => panic!("{other:?}"),
            };
            let way = 2.0 * run.scene.domain.size().x - first;
            let back = ramp + way / group;
            assert!(back <= scale.after, "{}: {back} s", benchmark.name);
            let end = f64::from(run.scene.shot.frames) * run.scene.shot.frame_seconds();
            assert!(end - scale.after > 3.0 * scale.period, "{}", benchmark.name);
            held += 1;
        }
    }
    assert_eq!(held, 11);
}

/// Negative control: with θ = 1 everywhere, the surface lies a whole cell above the centre
/// of the last water cell. The column's true surface lies at that centre, so its water
/// weighs one cell more.
#[test]
fn a_ghost_fluid_with_the_wrong_theta_fails_a_benchmark() {
    let set = "    \"shot.frames=45\",\n    \"solver.flip.surface=voxel\"";
    let text = spoiled("    \"shot.frames=45\"", set);
    let missed = missed(
        &crate::support::context(),
        &benchmark(&text, "column at rest"),
    );
    assert_eq!(missed.len(), 2, "{missed:?}");
    // A wrong value, not a run that ended.
    assert!(
        missed.iter().all(|words| words.contains("Some(1.")),
        "{missed:?}"
    );
}

/// Ratio of wave height to the stroke at the still water level, of a flap hinged at the floor, in
/// linear theory (Biésel 1951; Dean and Dalrymple 1991, 6.2), from kh.
fn flap_height_ratio(kh: f64) -> f64 {
    let (sinh, cosh) = (kh.sinh(), kh.cosh());
    4.0 * sinh / kh * (kh * sinh - cosh + 1.0) / ((2.0 * kh).sinh() + 2.0 * kh)
}

/// Published values that theory gives are those of its formulas at 9.81 m/s², in both studies.
/// What potential flow without walls, and Archimedes, say of a scene's first body.
fn of_body(scene: &Scene, of: &str) -> Option<f64> {
    let density = scene.bodies().next()?.given.density? / 1000.0;
    match of {
        "acceleration" => Some((1.0 - density) * 9.81 / (density + 0.5)),
        "speed_left" => Some(density / (density + 0.5)),
        "draft" => Some(0.2 * density),
        _ => None,
    }
}

#[test]
fn published_numbers_are_those_of_theory() {
    let text = fs::read_to_string(studies().join("validation.toml")).unwrap();
    let mut held = 0;
    for benchmark in [parsed(&text), parsed(&COARSE)]
        .iter()
        .flat_map(|v| &v.benchmarks)
    {
        let scale = benchmark.scale;
        let scene = &benchmark.runs[0].scene;
        let depth = scene.water.blocks.first().map_or(f64::NAN, |it| it.max.y);
        let theory = |of: &str| {
            let k = |period: f64, depth| wave_number(TAU / period, depth, 9.81);
            Some(match (benchmark.measure, of) {
                (Measure::RegularWaves, "height_ratio") if scene.wave_makers.is_empty() => {
                    flap_height_ratio(k(scale.period, depth) * depth)
                }
                (Measure::RegularWaves, "height_ratio") => {
                    piston_height_ratio(k(scale.period, depth), depth)
                }
                (Measure::RegularWaves, "wave_length") => TAU / k(scale.period, depth),
                (Measure::SolitaryWave, "celerity") if !scene.water.waves.is_empty() => {
                    SolitaryWave {
                        height: scale.height,
                        depth: scale.depth,
                        gravity: 9.81,
                    }
                    .celerity()
                }
                (Measure::SolitaryWave, "celerity") => (9.81 * (scale.depth + scale.height)).sqrt(),
                (Measure::SolitaryWave, "run_up") => {
                    let e = scale.height / scale.depth;
                    2.0 * e + 0.5 * e.powi(2) + 0.75 * e.powi(3)
                }
                (Measure::SolitaryWave, "height") => scale.height / scale.depth,
                (Measure::DryBed, "depth_at_dam") => 4.0 / 9.0,
                (Measure::DryBed, "flow_at_dam") => 8.0 / 27.0,
                (Measure::Body, of) => return of_body(scene, of),
                (Measure::StandingWave, "period") => {
                    let k = TAU / scale.length;
                    TAU / (9.81 * k * (k * scale.depth).tanh()).sqrt()
                }
                _ => return None,
            })
        };
        for gate in &benchmark.gates {
            if let Some((theory, published)) = theory(&gate.of).zip(gate.published) {
                let off = (published / theory - 1.0).abs();
                assert!(off < 2e-4, "{}: {published} {theory}", benchmark.name);
                held += 1;
            }
        }
    }
    assert!(held > 20, "{held}");
}

/// The points of a sea's curve are linear theory's for the wall motion of its scene, about their
/// mean over the measured time, which is below a millimetre.
#[test]
fn points_of_seas_are_those_of_linear_theory() {
    let text = fs::read_to_string(studies().join("validation.toml")).unwrap();
    let mut held = 0;
    for benchmark in [parsed(&text), parsed(&COARSE)]
        .iter()
        .flat_map(|v| &v.benchmarks)
        .filter(|benchmark| benchmark.measure == Measure::WavesByTheory)
        .filter(|benchmark| !benchmark.points.is_empty())
    {
        let scene = &benchmark.runs[0].scene;
        let Motion::Sea(sea) = &scene.wave_makers[0].motion else {
            panic!("{:?}", scene.wave_makers)
        };
        let gauge = match scene.probes.last().unwrap().kind {
            ProbeKind::Elevation { at } => at.x,
            ref other => panic!("{other:?}"),
        };
        for &[t, elevation] in &benchmark.points[0].at {
            let theory = sea.elevation(gauge, t);
            assert!(
                (theory - elevation).abs() < 1e-3,
                "{t}: {theory} {elevation}"
            );
            held += 1;
        }
    }
    assert!(held > 100, "{held}");
}
