//! Computes the numbers and curves of a benchmark from the frames of a run.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use swell_domain::motion::{Motion, wave_number};
use swell_files::study::validation::Measure;
use swell_scene::{Scene, WaveMaker};
use swell_study::waves;

use super::{
    BenchmarkMeasurements, beach, body,
    record::{FrameRecord, Record},
    ship_waves,
};

/// Gravity of the published numbers, m/s², regardless of the scene.
pub(super) const GRAVITY: f64 = 9.81;

/// Density of the published numbers, kg/m³, regardless of the scene.
const DENSITY: f64 = 1000.0;

/// Averaging time of the pressures of SPHERIC benchmark 2, seconds.
const WINDOW: f64 = 0.01;

/// Averaging time of a splash at a height gauge, seconds; single drops come and go within it.
const SPLASH: f64 = 0.05;

/// Fraction of a crest's height above which a parabola is fitted to it.
const CREST: f64 = 0.8;

/// Largest shift of T that is tried for a dam break's front.
const SHIFT: f64 = 1.0;

/// Range of T in which water running out over a dry bed is evaluated.
const DRY_BED: [f64; 2] = [4.0, 8.0];

/// Largest number of points of a stored curve.
const CURVE: usize = 400;

pub(super) type Curve = Vec<(f64, f64)>;

pub(super) fn of(record: &Record<'_>) -> BenchmarkMeasurements {
    let mut out = BenchmarkMeasurements::default();
    match record.benchmark.measure {
        Measure::RegularWaves => regular_waves(record, &mut out),
        Measure::WavesByTheory => waves_by_theory(record, &mut out),
        Measure::SolitaryWave => solitary_wave(record, &mut out),
        Measure::SolitaryBeach => beach::of(record, &mut out),
        Measure::DamBreak => dam_break(record, &mut out),
        Measure::DryBed => dry_bed(record, &mut out),
        Measure::BlockImpact => block_impact(record, &mut out),
        Measure::JetImpact => jet_impact(record, &mut out),
        Measure::StandingWave => standing_wave(record, &mut out),
        Measure::Hydrostatic => hydrostatic(record, &mut out),
        Measure::TaylorGreen => taylor_green(record, &mut out),
        Measure::Slide => slide(record, &mut out),
        Measure::Body => body::of(record, &mut out),
        Measure::ShipWaves => ship_waves::of(record, &mut out),
    }
    out.numbers.retain(|_, value| value.is_finite());
    for curve in out.curves.values_mut() {
        curve.retain(|(x, y)| x.is_finite() && y.is_finite());
        let every = curve.len().div_ceil(CURVE).max(1);
        *curve = std::mem::take(curve).into_iter().step_by(every).collect();
    }
    out
}

impl BenchmarkMeasurements {
    pub(super) fn put(&mut self, name: &str, value: Option<f64>) {
        if let Some(value) = value {
            self.numbers.insert(name.to_owned(), value);
        }
    }

    pub(super) fn draw(&mut self, name: &str, curve: Curve) {
        self.curves.insert(name.to_owned(), curve);
    }
}

/// Value of each frame over its time in seconds; frames without a value are left out.
fn over_time(rows: &[FrameRecord], of: impl Fn(&FrameRecord) -> Option<f64>) -> Curve {
    rows.iter()
        .filter_map(|row| Some((row.time, of(row)?)))
        .collect()
}

/// Level of a gauge over time, metres.
fn level(record: &Record<'_>, gauge: usize) -> Curve {
    over_time(&record.rows, |row| *row.levels.get(gauge)?)
}

pub(super) fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values
        .into_iter()
        .fold((0.0, 0), |(sum, n), v| (sum + v, n + 1));
    (count > 0).then(|| sum / f64::from(count))
}

fn regular_waves(record: &Record<'_>, out: &mut BenchmarkMeasurements) {
    let scale = record.benchmark.scale;
    let omega = TAU / scale.period;
    let gauges = record.gauges();
    let fitted = |gauge: usize| {
        let samples = level(record, gauge);
        let window = waves::whole_periods(&samples, scale.period, scale.after);
        waves::harmonic(window, omega)
    };
    let fits: Option<Vec<_>> = (0..gauges.len()).map(fitted).collect();
    let fits = fits.unwrap_or_default();
    let heights = fits.iter().map(|fit| 2.0 * fit.amplitude / scale.stroke);
    out.put("height_ratio", mean(heights));
    if let ([first, .., last], [from, .., to]) = (&fits[..], &gauges[..]) {
        let length = waves::wave_length(first.phase, last.phase, to.x - from.x);
        out.put("wave_length", Some(length));
    }
    if let Some(depth) = mean(fits.iter().map(|fit| fit.mean)) {
        let at: Vec<_> = gauges
            .iter()
            .map(|at| at.x)
            .zip(fits.iter().copied())
            .collect();
        out.put(
            "reflection",
            waves::reflection(&at, wave_number(omega, depth, GRAVITY)),
        );
    }
    let paddle = PI * scale.stroke / scale.period;
    let ratio = |speeds: &mut dyn Iterator<Item = f64>| Some(speeds.fold(0.0, f64::max) / paddle);
    let rows = || record.rows.iter();
    let up_to_gauge = ratio(&mut rows().flat_map(|row| row.of_water.iter().copied()));
    out.put("speed_ratio", up_to_gauge);
    out.put("speed_anywhere", ratio(&mut rows().map(|row| row.speed)));
    // Time relative to a crest of the fit, so that crests are at whole periods.
    if let Some(fit) = fits.first() {
        let at = |t: f64| t / scale.period - fit.phase / TAU;
        let first = level(record, 0).into_iter();
        let curve = first.map(|(t, y)| (at(t), (y - fit.mean) / scale.stroke));
        out.draw("elevation", curve.collect());
    }
}

/// Theoretical elevation of a scene's waves.
struct Theory<'a> {
    /// Elevation, metres, at x and z in metres from the domain's least corner and a time in
    /// seconds.
    elevation: Box<dyn Fn(DVec2, f64) -> f64 + 'a>,
    /// Period of regular waves, seconds.
    period: Option<f64>,
}

impl<'a> Theory<'a> {
    /// Theory of the first wall that moves by one, else of a generation zone.
    fn of(scene: &'a Scene) -> Option<Self> {
        let of_wall = |maker: &'a WaveMaker| -> Option<Self> {
            let rest = maker.room();
            let (elevation, period): (Box<dyn Fn(DVec2, f64) -> f64>, _) = match &maker.motion {
                Motion::Sea(sea) => (Box::new(move |at, t| sea.elevation(at.x - rest, t)), None),
                Motion::Stokes(waves) => (
                    Box::new(move |at, t| waves.elevation(at.x - rest, t)),
                    Some(waves.waves().period),
                ),
                Motion::Cnoidal(waves) => (
                    Box::new(move |at, t| waves.elevation(at.x - rest, t)),
                    Some(waves.waves().period),
                ),
                _ => return None,
            };
            Some(Self { elevation, period })
        };
        let makers = scene.wave_makers.iter();
        let mut makers = makers.filter_map(of_wall);
        makers.next().or_else(|| {
            let waves = scene.effects.waves(scene.water.gravity)?;
            Some(Self {
                period: waves.period,
                elevation: Box::new(move |at, t| waves.elevation(at, t)),
            })
        })
    }
}

/// Evaluated samples of a gauge: seconds, measured elevation and theoretical elevation, metres.
type Both = Vec<[f64; 3]>;

/// Compares with theory from `after` on, relative to the mean level, which is above the still-water
/// level by the volume that a wall displaces.
fn waves_by_theory(record: &Record<'_>, out: &mut BenchmarkMeasurements) {
    let Some(theory) = Theory::of(record.scene) else {
        return;
    };
    let gauge = |(gauge, at): (usize, &DVec2)| -> Option<Both> {
        let mut samples = level(record, gauge);
        samples.retain(|sample| sample.0 >= record.benchmark.scale.after);
        let still = mean(samples.iter().map(|sample| sample.1))?;
        let of_theory = samples.iter().map(|&(t, _)| (theory.elevation)(*at, t));
        let of_theory: Vec<f64> = of_theory.collect();
        let offset = mean(of_theory.iter().copied())?;
        let both = samples.iter().zip(of_theory);
        Some(
            both.map(|(&(t, y), of)| [t, y - still, of - offset])
                .collect(),
        )
    };
    let gauges: Option<Vec<_>> = record.gauges().iter().enumerate().map(gauge).collect();
    let gauges = gauges.unwrap_or_default();
    let square = |of: &dyn Fn(&[f64; 3]) -> f64, samples: &Both| -> f64 {
        samples.iter().map(|sample| of(sample).powi(2)).sum()
    };
    let ratios = gauges
        .iter()
        .map(|samples| (square(&|s| s[1], samples) / square(&|s| s[2], samples)).sqrt());
    out.put("variance_ratio", mean(ratios));
    let errors = gauges
        .iter()
        .map(|samples| (square(&|s| s[1] - s[2], samples) / square(&|s| s[2], samples)).sqrt());
    out.put("elevation_error", errors.reduce(f64::max));
    if let Some(period) = theory.period {
        second_harmonic(period, record.benchmark.scale.after, &gauges, out);
    }
    if let Some(last) = gauges.last() {
        let crest = |k: usize| last.iter().max_by(|a, b| a[k].total_cmp(&b[k]));
        if let (Some(found), Some(theory)) = (crest(1), crest(2)) {
            out.put("crest", Some(found[1] / theory[2]));
            out.put("crest_time", Some((found[0] - theory[0]).abs()));
        }
        out.draw("elevation", last.iter().map(|s| (s[0], s[1])).collect());
    }
}

/// Second harmonic of regular waves: bound to them, it is constant along the flume; a free wave,
/// which travels more slowly, makes it vary.
fn second_harmonic(period: f64, after: f64, gauges: &[Both], out: &mut BenchmarkMeasurements) {
    let omega = 2.0 * TAU / period;
    let amplitude = |samples: &Both, k: usize| -> Option<f64> {
        let curve: Curve = samples.iter().map(|s| (s[0], s[k])).collect();
        let window = waves::whole_periods(&curve, period, after);
        Some(waves::harmonic(window, omega)?.amplitude)
    };
    let of_theory = mean(gauges.iter().filter_map(|gauge| amplitude(gauge, 2)));
    let found: Option<Vec<f64>> = gauges.iter().map(|gauge| amplitude(gauge, 1)).collect();
    let (Some(of_theory), Some(found)) = (of_theory, found) else {
        return;
    };
    let ratio = mean(found.iter().copied()).map(|found| found / of_theory);
    out.put("second_harmonic", ratio);
    let [least, most] = found
        .iter()
        .fold([f64::INFINITY, 0.0], |[a, b], v| [v.min(a), v.max(b)]);
    out.put("second_harmonic_spread", Some((most - least) / of_theory));
}

fn solitary_wave(record: &Record<'_>, out: &mut BenchmarkMeasurements) {
    let scale = record.benchmark.scale;
    let gauges = record.gauges();
    let above = |gauge: usize| -> Curve {
        let samples = level(record, gauge).into_iter();
        samples.map(|(t, y)| (t, y - scale.depth)).collect()
    };
    let found: Vec<_> = (0..gauges.len())
        .map(|gauge| waves::crest(&above(gauge), CREST))
        .collect();
    let whole = found.iter().flatten().count() as f64;
    out.put("crests", Some(whole / gauges.len() as f64));
    let crests: Option<Vec<_>> = found.into_iter().collect();
    let crests = crests.unwrap_or_default();
    // Celerity from a straight line through the arrivals at all gauges.
    let arrivals = crests.iter().zip(&gauges).map(|((t, _), at)| (*t, at.x));
    out.put("celerity", waves::slope(&arrivals.collect::<Vec<_>>()));
    out.put("height", mean(crests.iter().map(|(_, y)| y / scale.depth)));
    run_up(record, out);
    if let Some((at, _)) = crests.last() {
        let unit = (scale.depth / GRAVITY).sqrt();
        let curve = above(gauges.len() - 1).into_iter();
        let curve = curve.map(|(t, y)| ((t - at) / unit, y / scale.depth));
        out.draw("elevation", curve.filter(|(t, _)| t.abs() < 12.0).collect());
    }
}

/// The highest water connected to the body over time.
pub(super) fn run_up(record: &Record<'_>, out: &mut BenchmarkMeasurements) {
    let heights = record.rows.iter().filter_map(|row| row.run_up);
    let highest = heights.fold(f64::NAN, f64::max);
    out.put("run_up", Some(highest / record.benchmark.scale.depth - 1.0));
}

fn dam_break(record: &Record<'_>, out: &mut BenchmarkMeasurements) {
    let benchmark = record.benchmark;
    let a = benchmark.scale.length;
    let front = over_time(&record.rows, |row| row.of_water.first().map(|x| x / a));
    let unit = (GRAVITY / a).sqrt();
    let front: Curve = front
        .into_iter()
        .map(|(t, z)| (2f64.sqrt() * unit * t, z))
        .collect();
    let column = level(record, 0).into_iter();
    let column: Curve = column.map(|(t, h)| (unit * t, h / (2.0 * a))).collect();
    for points in &benchmark.points {
        match points.of.as_str() {
            "front" => {
                out.put("front_error", waves::mean_error(&front, &points.at, 0.0));
                let shifted = waves::fitted_shift(&front, &points.at, SHIFT);
                out.put("front_shift", shifted.map(|(shift, _)| shift));
                out.put("front_error_shifted", shifted.map(|(_, error)| error));
            }
            _ => out.put("column_error", waves::mean_error(&column, &points.at, 0.0)),
        }
    }
    out.put("front_time", waves::reaches(&front, 3.0));
    out.draw("front", front);
    out.draw("column", column);
}

fn dry_bed(record: &Record<'_>, out: &mut BenchmarkMeasurements) {
    let scale = record.benchmark.scale;
    let celerity = (GRAVITY * scale.depth).sqrt();
    let time = |row: &FrameRecord| row.time * celerity / scale.depth;
    let [from, until] = DRY_BED;
    let looked_at = |row: &&FrameRecord| (from - 1e-9..=until + 1e-9).contains(&time(row));
    let rows: Vec<&FrameRecord> = record.rows.iter().filter(looked_at).collect();
    let Some(bins) = rows.first().map(|row| row.of_water.len()) else {
        return;
    };
    let width = record.scene.domain.size().x / bins as f64;
    let middle = |bin: usize| (bin as f64 + 0.5) * width - scale.length;
    // The dam is between two bins, whose mean is the depth there to second order.
    let dam = (scale.length / width).round() as usize;
    let depths = rows
        .iter()
        .map(|row| 0.5 * (row.of_water[dam - 1] + row.of_water[dam]));
    out.put(
        "depth_at_dam",
        mean(depths).map(|depth| depth / scale.depth),
    );
    let beyond = |row: &&FrameRecord| (row.time, width * row.of_water[dam..].iter().sum::<f64>());
    let flow = waves::slope(&rows.iter().map(beyond).collect::<Vec<_>>());
    out.put(
        "flow_at_dam",
        flow.map(|flow| flow / (scale.depth * celerity)),
    );
    // Between the still water and the tip, because near the tip the solution holds only for water
    // without friction.
    let gaps = |row: &FrameRecord| -> Vec<f64> {
        let of_bin = |(bin, depth): (usize, &f64)| {
            let exact = waves::ritter(middle(bin), row.time, scale.depth, GRAVITY);
            let is_between = middle(bin) > -celerity * row.time && exact > 0.1 * scale.depth;
            is_between.then(|| (depth - exact).abs() / scale.depth)
        };
        let bins = row.of_water.iter().enumerate();
        bins.filter_map(of_bin).collect()
    };
    let mean_gap = rows.iter().filter_map(|row| mean(gaps(row)));
    out.put("profile_error", mean(mean_gap));
    let largest = |row: &&FrameRecord| gaps(row).into_iter().fold(0.0, f64::max);
    let worst: Vec<f64> = rows.iter().map(largest).collect();
    // Means over one unit of T at either end.
    let part = |from: f64| {
        let within = |row: &FrameRecord| (from - 1e-9..=from + 1.0 + 1e-9).contains(&time(row));
        let both = rows.iter().zip(&worst);
        mean(both.filter(|(row, _)| within(row)).map(|(_, gap)| *gap))
    };
    out.put("profile_worst", mean(worst.iter().copied()));
    if let (Some(early), Some(late)) = (part(from), part(until - 1.0)) {
        out.put("profile_worst_falls", Some(late / early));
    }
    let middle_row = rows.iter().min_by(|a, b| {
        let far = |row: &FrameRecord| (time(row) - 0.5 * (from + until)).abs();
        far(a).total_cmp(&far(b))
    });
    if let Some(row) = middle_row {
        let x = |bin: usize| middle(bin) / (row.time * celerity);
        let depths = row.of_water.iter().enumerate();
        let profile = depths.map(|(bin, depth)| (x(bin), depth / scale.depth));
        out.draw(
            "profile",
            profile.filter(|(x, _)| (-1.5..2.2).contains(x)).collect(),
        );
    }
}

fn block_impact(record: &Record<'_>, out: &mut BenchmarkMeasurements) {
    // The scene's probes are in the order H1 to H4 and P1 to P4.
    let levels: Vec<Curve> = (0..4).map(|gauge| level(record, gauge)).collect();
    out.put("arrival", levels[1].first().map(|(t, _)| *t));
    out.put("height_2", waves::largest_mean(&levels[1], SPLASH));
    for (name, time) in [
        ("height_4_1s", 1.0),
        ("height_4_2s", 2.0),
        ("height_4_4s", 4.0),
    ] {
        out.put(name, waves::value_at(&levels[3], time));
    }
    let pressure = |probe: usize| {
        // A dry probe has no pressure.
        over_time(&record.rows, |row| {
            Some(row.pressures.get(probe)?.unwrap_or(0.0))
        })
    };
    for probe in 0..4 {
        let name = format!("peak_{}", probe + 1);
        out.put(&name, waves::largest_mean(&pressure(probe), WINDOW));
    }
    // The following probes repeat P1 to P4 half a cell off the face; P1 to P3 are compared.
    for probe in 0..3 {
        let on = waves::largest_mean(&pressure(probe), WINDOW);
        let off = waves::largest_mean(&pressure(probe + 4), WINDOW);
        let apart = on.zip(off).map(|(on, off)| (off / on - 1.0).abs());
        out.put(&format!("apart_{}", probe + 1), apart);
    }
    let volumes = || record.rows.iter().filter_map(|row| row.of_water.first());
    let first = volumes().next().copied().unwrap_or(f64::NAN);
    let off = volumes().map(|volume| (volume / first - 1.0).abs());
    out.put("volume_error", Some(off.fold(0.0, f64::max)));
    let wet = |row: &&FrameRecord| row.pressures.iter().take(4).flatten().any(|p| *p > 0.0);
    out.put("onset", record.rows.iter().find(wet).map(|row| row.time));
    out.draw("height_2", levels[1].clone());
    out.draw("height_4", levels[3].clone());
    out.draw("pressure_1", pressure(0));
}

/// A wall that deflects a jet of cross-section A absorbs all of its momentum, ρ A v² per second.
fn jet_impact(record: &Record<'_>, out: &mut BenchmarkMeasurements) {
    let scale = record.benchmark.scale;
    let whole = DENSITY * scale.length.powi(2) * scale.speed.powi(2);
    let force = over_time(&record.rows, |row| Some(row.force? / whole));
    let steady = force.iter().filter(|(time, _)| *time > scale.after);
    out.put("force_ratio", mean(steady.map(|(_, force)| *force)));
    out.draw("force", force);
}

fn standing_wave(record: &Record<'_>, out: &mut BenchmarkMeasurements) {
    let amplitude = over_time(&record.rows, |row| row.of_water.first().copied());
    let start = amplitude.first().map_or(f64::NAN, |(_, a)| *a);
    out.put("period", waves::period(&amplitude, 0.1 * start.abs()));
    let k = TAU / record.benchmark.scale.length;
    let period = TAU / (GRAVITY * k * (k * record.benchmark.scale.depth).tanh()).sqrt();
    let third = amplitude
        .iter()
        .filter(|(t, _)| (2.6..3.4).contains(&(t / period)));
    let most = third.map(|(_, a)| *a).fold(f64::NAN, f64::max);
    out.put("amplitude_left", Some(most / start));
    out.draw(
        "amplitude",
        amplitude.into_iter().map(|(t, a)| (t, a / start)).collect(),
    );
}

fn hydrostatic(record: &Record<'_>, out: &mut BenchmarkMeasurements) {
    let scale = record.benchmark.scale;
    let floor = record.scene.domain.min.y;
    let points = record.scene.pressure_points();
    let counted = || record.rows.iter().filter(|row| row.time > scale.after);
    let of_probe = |probe: usize| {
        let all: Option<Vec<f64>> = counted().map(|row| *row.pressures.get(probe)?).collect();
        let depth = scale.depth - (points[probe].y - floor);
        Some((depth, mean(all?)? / (DENSITY * GRAVITY * depth)))
    };
    let ratios: Option<Curve> = (0..points.len()).map(of_probe).collect();
    let mut ratios = ratios.unwrap_or_default();
    ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
    if let Some(((_, lowest), others)) = ratios.split_last() {
        out.put("pressure", mean(others.iter().map(|(_, ratio)| *ratio)));
        out.put("pressure_at_floor", Some(*lowest));
    }
    out.put(
        "speed",
        Some(counted().map(|row| row.speed).fold(0.0, f64::max)),
    );
    out.draw("pressure", ratios);
}

fn taylor_green(record: &Record<'_>, out: &mut BenchmarkMeasurements) {
    let scale = record.benchmark.scale;
    let energy = over_time(&record.rows, |row| row.of_water.first().copied());
    // Turnover time at the vortex centre, where the vorticity is 2 k U.
    let k = PI / scale.length;
    let turn = TAU / (k * scale.speed);
    if let (Some((_, first)), Some((end, last))) = (energy.first(), energy.last()) {
        let diffusion = numerical_diffusion(record.scene, record.substeps, *end);
        // The energy of a Taylor–Green vortex decays as e^(−4 ν k² t).
        let decay = -(last / first).ln();
        out.put(
            "dissipation_ratio",
            Some(decay / (4.0 * diffusion * k * k * end)),
        );
        let first = *first;
        let curve = energy.iter().map(|(t, e)| (t / turn, e / first));
        out.draw("energy", curve.collect());
    }
}

/// Whatever the water does on it, a slope without friction pushes at right angles to itself: the
/// momentum along it grows by g sin θ.
fn slide(record: &Record<'_>, out: &mut BenchmarkMeasurements) {
    let scale = record.benchmark.scale;
    let down = DVec3::new(scale.length, -scale.height, 0.0).normalize();
    let ratio = |row: &FrameRecord| {
        let speed = DVec3::from_slice(row.of_water.get(..3)?).dot(down);
        (row.time > 0.0).then(|| speed / (-GRAVITY * down.y * row.time))
    };
    let curve = over_time(&record.rows, ratio);
    out.put("slide_ratio", curve.last().map(|(_, ratio)| *ratio));
    out.draw("speed", curve);
}

/// Numerical diffusion of the PIC fraction, m²/s: α Δx² / (6 Δt) (Zhu and Bridson 2005).
fn numerical_diffusion(scene: &Scene, substeps: u32, seconds: f64) -> f64 {
    let Some(scene) = scene.with_flip() else {
        return f64::NAN;
    };
    let step = seconds / f64::from(substeps.max(1));
    let blend = scene.substep_pic_blend(step);
    blend * scene.settings().cell_size.powi(2) / (6.0 * step)
}
