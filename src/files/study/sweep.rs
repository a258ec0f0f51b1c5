//! `kind = "sweep"`: one scene run repeatedly, with one setting changed at a time, by one
//! or more methods.
//!
//! ```toml
//! kind = "sweep"
//! scene = "../dam-break.toml"
//! set = ["solver.pbf.particle_spacing=0.1"]   # applied to the scene in every run
//! key = "solver.pbf.iterations"               # changes from run to run
//! values = [2, 4, 8, 16]                      # from coarse to fine
//! seconds = 2.0                               # of the shot; or steps = 120, output frames
//! repeats = 3                                 # times are medians over this many runs
//! errors = ["density_error_mean"]
//!
//! [[method]]                                  # one curve each
//! name = "red/black"
//! set = ["solver.pbf.iteration=red_black"]    # key and values may also be set here, for this line
//! device = "gpu"                              # or "cpu", the f64 reference
//! against = "jacobi"                          # compare with that method, not the own finest run
//! ```
//!
//! `key = "device"` with the values `"cpu"` and `"gpu"` sweeps the device. `coarser =
//! ["solver.flip.cell_size=0.4"]`, for all methods or for one, is applied to the run of the
//! last value; the difference estimates the discretisation error, which is reported with the
//! knee of the curve.

mod fit;

use std::{collections::BTreeSet, ops::Range, path::Path};

use serde::Deserialize;
use toml::{Spanned, Value, de::DeTable};

use super::{
    super::{document::Document, physics_hash},
    RunsOn, SceneFile, StudyFileError, load_with,
};
use fit::{check_coarser, check_converged, check_fit, check_weighed};
use swell_scene::{Method, Scene, SceneError, Solver, words::shown};

/// Key that changes the length of a frame.
pub const FRAME_RATE: &str = "shot.frames_per_second";

/// Key that changes the device of a run and nothing in the scene.
const DEVICE: &str = "device";

/// Number of equally spaced times at which a run is compared with the finest.
pub const SAMPLES: u32 = 10;

const MOST_POINTS: usize = 1000;

/// A validated sweep, with the scene of every point loaded.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// Introduction for the page, in paragraphs.
    pub about: Vec<String>,
    /// Curves.
    pub lines: Vec<Line>,
    /// Number of times that each point runs.
    pub repeats: u32,
    /// Measured errors: at least one, all with the same [`Measure`].
    pub errors: Vec<ErrorMeasure>,
    /// State on which projections are measured, after its frames; only with
    /// [`Measure::Projection`].
    pub state: Option<Point>,
    /// Whether to determine the convergence point of the paper's Table 1.
    pub has_convergence_point: bool,
}

/// One method: a curve.
#[derive(Clone, Debug)]
pub struct Line {
    /// Name for the legend.
    pub name: String,
    /// Index of the line whose runs these are compared with, value by value; `None` compares with
    /// the own finest run. Only with [`Measure::Finest`].
    pub against: Option<usize>,
    /// Key that is swept.
    pub key: String,
    /// Points from coarse to fine.
    pub points: Vec<Point>,
    /// A coarser run at the last value, which estimates the discretisation error. Only with
    /// [`Measure::Finest`] and [`Measure::Projection`].
    pub coarser: Option<Point>,
}

impl Sweep {
    /// Returns the points of all methods, without the coarser ones.
    pub fn points(&self) -> impl Iterator<Item = &Point> {
        self.lines.iter().flat_map(|line| &line.points)
    }
}

/// One setting of one method.
#[derive(Clone, Debug)]
pub struct Point {
    /// The value as written in the file.
    pub label: String,
    /// The scene with all overrides.
    pub scene: Scene,
    /// Number of output frames to run.
    pub frames: u32,
    /// Device of the run.
    pub device: RunsOn,
}

/// How errors are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// From each frame's report or pressures, averaged over the frames or their second half.
    Report,
    /// At the same times, against the finest run of the same line (the last value) or the run
    /// of another line.
    Finest,
    /// After the last frame: distance of the particles from the solution of their constraints.
    Converged,
    /// One projection of a fixed state, against the exact solution of the same system in `f64`.
    Projection,
}

/// An error, as plotted by the curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorMeasure {
    /// Mean of max(0, ρ/ρ0 − 1).
    DensityMean,
    /// 99th percentile of the same.
    DensityP99,
    /// Maximum of the same.
    DensityMax,
    /// Largest speed of a particle in the second half of the run.
    TopSpeed,
    /// |p / (ρ g depth) − 1| at the scene's pressure probes in the second half of the run, where
    /// depth is below the initial level.
    Weight,
    /// Height of the crest, against the finest run.
    Crest,
    /// Position of the front, against the finest run.
    Front,
    /// Energy per mass, against the finest run.
    Energy,
    /// Elevation along the direction of the wave, against the finest run.
    Profile,
    /// ‖p − p64‖ / ‖p64‖.
    Pressure,
    /// ‖u − u64‖ / ‖u64‖ over the faces that the projection changes.
    Velocity,
    /// Largest |∇·u| Δt after the projection.
    Divergence,
    /// RMS distance of the particles from where Newton's method satisfies their
    /// constraints, in spacings.
    DistanceToConverged,
}

impl ErrorMeasure {
    /// All errors with the names used in studies.
    pub const NAMED: [(&'static str, Self); 13] = [
        ("density_error_mean", Self::DensityMean),
        ("density_error_p99", Self::DensityP99),
        ("density_error_max", Self::DensityMax),
        ("top_speed", Self::TopSpeed),
        ("weight_error", Self::Weight),
        ("crest_error", Self::Crest),
        ("front_error", Self::Front),
        ("energy_error", Self::Energy),
        ("profile_error", Self::Profile),
        ("pressure_error", Self::Pressure),
        ("velocity_error", Self::Velocity),
        ("divergence", Self::Divergence),
        ("distance_to_converged", Self::DistanceToConverged),
    ];

    /// Returns the name used in studies.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }

    /// Returns how the error is measured.
    pub fn measure(self) -> Measure {
        match self {
            Self::DensityMean
            | Self::DensityP99
            | Self::DensityMax
            | Self::TopSpeed
            | Self::Weight => Measure::Report,
            Self::Crest | Self::Front | Self::Energy | Self::Profile => Measure::Finest,
            Self::Pressure | Self::Velocity | Self::Divergence => Measure::Projection,
            Self::DistanceToConverged => Measure::Converged,
        }
    }

    /// Returns the title of an axis, with its unit.
    pub fn title(self) -> &'static str {
        match self {
            Self::DensityMean => "density error, mean",
            Self::DensityP99 => "density error, 99th percentile",
            Self::DensityMax => "density error, maximum",
            Self::TopSpeed => "largest speed in the second half, m/s",
            Self::Weight => "pressure against ρ g depth, relative",
            Self::Crest => "height of the crest against the finest run, m",
            Self::Front => "place of the front against the finest run, m",
            Self::Energy => "energy against the finest run, relative",
            Self::Profile => "elevation against the finest run, RMS, m",
            Self::Pressure => "pressure, ‖p − p64‖ / ‖p64‖",
            Self::Velocity => "velocity, ‖u − u64‖ / ‖u64‖",
            Self::Divergence => "largest |∇·u| Δt",
            Self::DistanceToConverged => "distance from converged, RMS, spacings",
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SweepSpec {
    #[serde(rename = "kind")]
    _kind: String,
    about: Option<Vec<String>>,
    scene: Spanned<String>,
    #[serde(default)]
    set: Vec<Spanned<String>>,
    key: Option<Spanned<String>>,
    values: Option<Spanned<Vec<Spanned<Value>>>>,
    coarser: Option<Spanned<Vec<Spanned<String>>>>,
    steps: Option<u32>,
    seconds: Option<Spanned<f64>>,
    repeats: u32,
    errors: Spanned<Vec<Spanned<String>>>,
    convergence_point: bool,
    method: Spanned<Vec<Spanned<MethodSpec>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MethodSpec {
    name: Spanned<String>,
    #[serde(default)]
    set: Vec<Spanned<String>>,
    key: Option<Spanned<String>>,
    values: Option<Spanned<Vec<Spanned<Value>>>>,
    coarser: Option<Spanned<Vec<Spanned<String>>>>,
    device: Option<Spanned<String>>,
    against: Option<Spanned<String>>,
}

/// Parses the remaining keys of this kind; paths are relative to `base_dir`.
pub(super) fn parse(
    doc: &Document<'_>,
    root: Spanned<DeTable<'_>>,
    base_dir: &Path,
) -> Result<Sweep, StudyFileError> {
    let spec = SweepSpec::deserialize(toml::Deserializer::from(root))
        .map_err(|error| doc.translate(&error))?;
    let errors = errors(doc, &spec.errors)?;
    let state = match errors[0].measure() {
        Measure::Projection => Some(state(doc, &spec, base_dir)?),
        Measure::Report | Measure::Finest | Measure::Converged => None,
    };
    let mut lines: Vec<Line> = Vec::new();
    for method in spec.method.get_ref() {
        let line = line(doc, &spec, method, base_dir)?;
        if lines.iter().any(|other| other.name == line.name) {
            let problem = format!("{:?} is the name of another method", line.name);
            return Err(doc.fault_at(method.get_ref().name.span(), problem).into());
        }
        check_fit(doc, &spec, &line, errors[0], state.as_ref())?;
        if errors.contains(&ErrorMeasure::Weight) {
            check_weighed(doc, &spec, &line)?;
        }
        if errors[0].measure() == Measure::Converged {
            check_converged(doc, &spec, &line)?;
        }
        lines.push(line);
    }
    for (place, method) in spec.method.get_ref().iter().enumerate() {
        if let Some(name) = &method.get_ref().against {
            lines[place].against = Some(against(doc, name, &lines, place, errors[0])?);
            if lines[place].coarser.is_some() {
                let problem = "together with coarser, which is for errors that are compared with \
                    the method's own finest run";
                return Err(doc.fault_at(name.span(), problem).into());
            }
        }
    }
    let points: usize = lines.iter().map(|line| line.points.len()).sum();
    if points == 0 || points > MOST_POINTS {
        let problem = format!("{points} runs in all, and a study has 1 to {MOST_POINTS}");
        return Err(doc.fault_at(spec.method.span(), problem).into());
    }
    Ok(Sweep {
        about: spec.about.unwrap_or_default(),
        lines,
        repeats: spec.repeats,
        errors,
        state,
        has_convergence_point: spec.convergence_point,
    })
}

fn errors(
    doc: &Document<'_>,
    spec: &Spanned<Vec<Spanned<String>>>,
) -> Result<Vec<ErrorMeasure>, SceneError> {
    let mut errors: Vec<ErrorMeasure> = Vec::new();
    for word in spec.get_ref() {
        let fault =
            |problem: &str| doc.fault_at(word.span(), format!("{:?} {problem}", word.get_ref()));
        let named = ErrorMeasure::NAMED
            .iter()
            .find(|(name, _)| name == word.get_ref());
        let (_, error) = named.ok_or_else(|| fault("is not an error that is measured"))?;
        if errors
            .iter()
            .any(|other| other.measure() != error.measure())
        {
            return Err(fault("is not measured in the same run as those before it"));
        }
        if errors.contains(error) {
            return Err(fault("is listed twice"));
        }
        errors.push(*error);
    }
    if errors.is_empty() {
        return Err(doc.fault_at(spec.span(), "empty"));
    }
    Ok(errors)
}

/// Loads the state that projections start from: the scene with the common settings.
fn state(doc: &Document<'_>, spec: &SweepSpec, base_dir: &Path) -> Result<Point, SceneError> {
    let fixed: Vec<_> = spec.set.iter().collect();
    let scene = load(doc, spec, base_dir, &fixed, None)?;
    if scene.solver.method() != Method::Flip {
        let problem = "these are measured with solver.method flip, which set does not choose";
        return Err(doc.fault_at(spec.errors.span(), problem));
    }
    Ok(Point {
        label: String::new(),
        frames: frames(doc, spec, &scene)?,
        scene,
        device: RunsOn::Gpu,
    })
}

/// Returns the index of the line that the line at `place` is compared with.
fn against(
    doc: &Document<'_>,
    name: &Spanned<String>,
    lines: &[Line],
    place: usize,
    error: ErrorMeasure,
) -> Result<usize, SceneError> {
    let fault =
        |problem: &str| doc.fault_at(name.span(), format!("{:?} {problem}", name.get_ref()));
    if error.measure() != Measure::Finest {
        return Err(fault("is needed by none of these errors"));
    }
    let found = lines.iter().position(|line| &line.name == name.get_ref());
    let found = found.filter(|&found| found != place);
    let found = found.ok_or_else(|| fault("is not the name of another method"))?;
    let setting = |line: &Line| {
        let points = line.points.iter();
        let values: Vec<_> = points.map(|p| (p.label.clone(), p.frames)).collect();
        (line.key.clone(), values)
    };
    if setting(&lines[found]) != setting(&lines[place]) {
        return Err(fault("has another key, other values or other frames"));
    }
    Ok(found)
}

/// Returns the device named by `word`, which is at `at` in the study.
fn device(
    doc: &Document<'_>,
    spec: &SweepSpec,
    word: &str,
    at: Range<usize>,
) -> Result<RunsOn, SceneError> {
    let fault = |problem: &str| Err(doc.fault_at(at.clone(), problem));
    let named = |wanted: &str| spec.errors.get_ref().iter().any(|e| e.get_ref() == wanted);
    let is_projection = ErrorMeasure::NAMED
        .iter()
        .any(|(name, error)| error.measure() == Measure::Projection && named(name));
    match RunsOn::named(word) {
        Some(RunsOn::Cpu) if is_projection => {
            fault("the reference's projection is what these errors are measured against")
        }
        Some(device) => Ok(device),
        None => fault(&format!("{word:?} is not a device")),
    }
}

fn line(
    doc: &Document<'_>,
    spec: &SweepSpec,
    method: &Spanned<MethodSpec>,
    base_dir: &Path,
) -> Result<Line, SceneError> {
    let at = method.span();
    let method = method.get_ref();
    let key = method.key.as_ref().or(spec.key.as_ref());
    let key = key.ok_or_else(|| doc.missing(at.clone(), "key"))?;
    let values = method.values.as_ref().or(spec.values.as_ref());
    let values = values.ok_or_else(|| doc.missing(at, "values"))?;
    let fixed: Vec<_> = spec.set.iter().chain(&method.set).collect();
    // The scene's own rate, to which quantities per frame are tied.
    let own_rate = load(doc, spec, base_dir, &fixed, None)?
        .shot
        .frames_per_second;
    let loaded = |fixed: &[&Spanned<String>], swept| {
        let mut scene = load(doc, spec, base_dir, fixed, swept)?;
        if key.get_ref() == FRAME_RATE {
            tie_pic_blend(&mut scene, own_rate);
        }
        Ok::<_, SceneError>(scene)
    };
    let is_device = key.get_ref() == DEVICE;
    let own_device = match &method.device {
        None => RunsOn::Gpu,
        Some(word) if is_device => {
            return Err(doc.fault_at(word.span(), "the key is the device itself"));
        }
        Some(word) => device(doc, spec, word.get_ref(), word.span())?,
    };
    let on = |value: &Spanned<Value>| match is_device {
        true => {
            let word = value.get_ref().as_str().unwrap_or_default();
            device(doc, spec, word, value.span())
        }
        false => Ok(own_device),
    };
    let swept = |value: &Spanned<Value>| {
        let text = || format!("{}={}", key.get_ref(), value.get_ref());
        (!is_device).then(|| (text(), value.span()))
    };
    let mut seen = BTreeSet::new();
    let mut points = Vec::new();
    for value in values.get_ref() {
        let scene = loaded(&fixed, swept(value))?;
        let device = on(value)?;
        let is_new = seen.insert((physics_hash(&scene), device));
        if !is_new {
            let problem = format!(
                "the scene is the same as with a value before it: {} changes nothing with \
                 solver.method {:?}, or the value is listed twice",
                key.get_ref(),
                scene.solver.method().name()
            );
            return Err(doc.fault_at(value.span(), problem));
        }
        points.push(Point {
            label: doc.text_at(value.span()).trim_matches('"').to_owned(),
            frames: frames(doc, spec, &scene)?,
            scene,
            device,
        });
    }
    let last = match values.get_ref().last() {
        Some(last) if points.len() >= 2 => last,
        _ => return Err(doc.fault_at(values.span(), "a sweep has two values or more")),
    };
    let coarser = match method.coarser.as_ref().or(spec.coarser.as_ref()) {
        None => None,
        Some(set) => {
            let fixed: Vec<_> = fixed.iter().copied().chain(set.get_ref()).collect();
            let scene = loaded(&fixed, swept(last))?;
            check_coarser(doc, spec, set, &scene, &points[points.len() - 1].scene)?;
            let texts: Vec<_> = set
                .get_ref()
                .iter()
                .map(|text| text.get_ref().as_str())
                .collect();
            Some(Point {
                label: texts.join(" and "),
                frames: frames(doc, spec, &scene)?,
                scene,
                device: on(last)?,
            })
        }
    };
    Ok(Line {
        name: method.name.get_ref().clone(),
        against: None,
        key: key.get_ref().clone(),
        points,
        coarser,
    })
}

/// Loads the scene with fixed and swept settings.
fn load(
    doc: &Document<'_>,
    spec: &SweepSpec,
    base_dir: &Path,
    fixed: &[&Spanned<String>],
    swept: Option<(String, Range<usize>)>,
) -> Result<Scene, SceneError> {
    let fixed = fixed.iter().map(|set| (set.get_ref().clone(), set.span()));
    let file = SceneFile::new(&spec.scene, base_dir);
    load_with(doc, &file, fixed.chain(swept))
}

/// Rescales FLIP's `pic_blend`, a fraction per frame, so that every frame rate takes the
/// same part per second: α = 1 − (1 − α_ref)^(Δt / Δt_ref). Otherwise halving Δt would
/// double the dissipation.
fn tie_pic_blend(scene: &mut Scene, own_rate: f64) {
    let exponent = own_rate / scene.shot.frames_per_second;
    for solver in [Some(&mut scene.solver), scene.unchosen.as_mut()]
        .into_iter()
        .flatten()
    {
        if let Solver::Flip(flip) = solver {
            flip.pic_blend = 1.0 - (1.0 - flip.pic_blend).powf(exponent);
        }
    }
}

/// Returns the number of output frames of a run of this scene.
fn frames(doc: &Document<'_>, spec: &SweepSpec, scene: &Scene) -> Result<u32, SceneError> {
    let rate = scene.shot.frames_per_second;
    let Some(seconds) = &spec.seconds else {
        let missing = || {
            let message = doc.with_allowed("missing".into(), "steps");
            doc.fault(None, "steps".into(), message)
        };
        return spec.steps.ok_or_else(missing);
    };
    let frames = seconds.get_ref() * rate;
    let is_whole = (frames - frames.round()).abs() <= 1e-6 * frames;
    if !is_whole || !(1.0..=1e6).contains(&frames.round()) {
        let problem = format!(
            "at {} frames a second these are {} frames",
            shown(rate),
            shown(frames)
        );
        return Err(doc.fault_at(seconds.span(), problem));
    }
    Ok(frames.round() as u32)
}
