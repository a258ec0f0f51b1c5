//! Runs of a tuning: variants of a shot that are coarser or have other settings, and a
//! finer reference run.
//!
//! This kind of study has no file. The scene's own settings are run
//! at several spacings, and one setting at a time is changed at the coarsest of them.

mod limit;

use std::path::{Path, PathBuf};

use crate::load_scene_within;
use swell_domain::{bounds::Bounds, sampling::block_size, text};

use super::super::{Reach, physics_hash};
use swell_scene::{
    Iteration, Method, Scene, SceneError, Solver, Stop,
    flip::{Flip, Preconditioner},
    words::shown,
};

pub use limit::{Bound, Limit, Quantity};

/// Spacings of the runs over that of the reference, from coarse to fine.
const LADDER: [f64; 4] = [2.5, 2.0, 1.6, 1.25];

/// Largest relative change of a spacing on the ladder to fit the water better, and the number of
/// steps tried in each direction.
const NEAR: f64 = 0.08;
const STEPS: i32 = 16;

/// Number of spacings that proposals choose from, before those that do not fit the
/// water are dropped.
const CHOICES: i32 = 1000;

/// Misfit that every spacing may have: 0.5 % of the height changes the energy by as much, which is
/// below the limits requested.
const FITS: f64 = 0.005;

/// Relative increase of gravity in the noise-floor run.
const SHAKEN: f64 = 1e-6;

/// Largest CFL number that scenes accept.
const MOST_CFL: f64 = 5.0;

/// Options of a tuning request.
#[derive(Clone, Debug)]
pub struct TuneRequest {
    /// Path of the scene file.
    pub scene: PathBuf,
    /// Solver in place of the scene's.
    pub solver: Option<Method>,
    /// Errors to limit; each quantity at most once.
    pub limits: Vec<Limit>,
    /// Largest time per frame, seconds.
    pub per_frame: Option<f64>,
    /// Largest time of the whole shot, seconds.
    pub seconds: Option<f64>,
    /// Number of frames to run from the first; the whole shot if left out.
    pub frames: Option<u32>,
    /// Spacing of the reference over the scene's own.
    pub reference: f64,
    /// Runs per variant; times are medians.
    pub repeats: u32,
    /// File to write the tuned scene to.
    pub target: PathBuf,
    /// How far the scene's paths may lead.
    pub reach: Reach,
}

/// Why a shot cannot be tuned.
#[derive(Debug, thiserror::Error)]
pub enum TuneError {
    /// Fault in the scene, or in a variant that tuning needs.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// An option of the request that does not fit the scene.
    #[error("{option}: {problem}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// What is wrong, and what is allowed.
        problem: String,
    },
}

/// One setting of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Dotted key.
    pub key: &'static str,
    /// The value as TOML.
    pub value: String,
}

impl Setting {
    fn number(key: &'static str, value: f64) -> Self {
        Self {
            key,
            value: shown(value),
        }
    }

    fn word(key: &'static str, value: &str) -> Self {
        Self {
            key,
            value: format!("{value:?}"),
        }
    }
}

/// A run of the shot with some settings changed.
#[derive(Clone, Debug)]
pub struct Variant {
    /// Settings applied to the scene.
    pub set: Vec<Setting>,
    /// The scene with these settings.
    pub scene: Scene,
}

impl Variant {
    /// Returns the settings as they would be written in a scene.
    pub fn name(&self) -> String {
        let words = self.set.iter();
        let words: Vec<_> = words.map(|s| format!("{} = {}", s.key, s.value)).collect();
        words.join(", ")
    }

    /// Returns PBF's particle spacing or FLIP's cell size, metres.
    pub fn spacing(&self) -> f64 {
        self.scene.solver.resolution()
    }
}

/// A setting other than the spacing, with runs at the coarsest spacing that change it.
#[derive(Clone, Debug)]
pub struct Knob {
    /// Dotted key.
    pub key: &'static str,
    /// The scene's own value as TOML.
    pub own: String,
    /// Other values: the settings for each, and its run at the coarsest spacing.
    pub others: Vec<(Vec<Setting>, Variant)>,
}

/// A shot and the runs that tune it.
#[derive(Clone, Debug)]
pub struct Tune {
    /// The request.
    pub request: TuneRequest,
    /// Text of the scene file.
    pub text: String,
    /// The scene of the file with the chosen solver.
    pub scene: Scene,
    /// Number of frames of each run.
    pub frames: u32,
    /// Runs with the scene's own settings at other spacings, from coarse to fine; at least two.
    pub ladder: Vec<Variant>,
    /// Run that the others are compared with: finer in every setting.
    pub reference: Variant,
    /// Run at the coarsest spacing with the reference's other settings; it isolates the error of
    /// the settings from that of the spacing.
    pub fine: Variant,
    /// Noise-floor run: the coarsest with a millionth more gravity. Its difference is one that no
    /// settings can undercut.
    pub noise_floor: Variant,
    /// Settings other than the spacing.
    pub knobs: Vec<Knob>,
    /// Descriptions of what is not tried.
    pub untried: Vec<String>,
}

impl Tune {
    /// Loads the scene and builds all runs.
    ///
    /// # Errors
    /// [`TuneError`].
    pub fn load(request: TuneRequest) -> Result<Self, TuneError> {
        let text = text::read(&request.scene).map_err(|source| SceneError::Read {
            file: request.scene.clone(),
            source,
        })?;
        let scene = laid(&request, &[], &[])?;
        check(&request, &scene)?;
        let frames = request.frames.unwrap_or(scene.shot.frames);
        let key = spacing_key(scene.solver.method());
        let at = |factor: f64| {
            let d = fitting(
                &scene,
                factor * request.reference * scene.solver.resolution(),
            );
            Setting::number(key, d)
        };
        let mut untried = Vec::new();
        let mut ladder = Vec::new();
        for factor in LADDER {
            match variant(&request, vec![at(factor)]) {
                Ok(variant) => ladder.push(variant),
                Err(error) => untried.push(format!("{key} = {}: {error}", at(factor).value)),
            }
        }
        let [coarsest, _, ..] = &ladder[..] else {
            return Err(TuneError::Option {
                option: "reference",
                problem: format!("fewer than two spacings can be run: {}", untried.join("; ")),
            });
        };
        let coarsest = coarsest.set.clone();
        let finer = finer(&scene.solver);
        let with = |set: &[Setting], more: &[Setting]| variant(&request, [set, more].concat());
        let reference = with(&[at(1.0)], &finer)?;
        let fine = with(&coarsest, &finer)?;
        let noise_floor = Variant {
            scene: laid(&request, &coarsest, &[shake(&scene)])?,
            set: coarsest.clone(),
        };
        let knobs = knobs(&request, &scene.solver, &coarsest, &mut untried);
        untried.extend(others(scene.solver.method()).map(str::to_owned));
        Ok(Self {
            text,
            frames,
            ladder,
            reference,
            fine,
            noise_floor,
            knobs,
            untried,
            scene,
            request,
        })
    }

    /// Builds the run with this spacing, metres, and the settings `more`.
    ///
    /// # Errors
    /// If the scene is invalid with them.
    pub fn variant(&self, spacing: f64, more: &[Setting]) -> Result<Variant, SceneError> {
        let key = spacing_key(self.scene.solver.method());
        let first = Setting::number(key, spacing);
        variant(&self.request, [&[first], more].concat())
    }

    /// Returns the spacings in a range, metres, that fit the water as well as those of the ladder;
    /// proposals choose from them.
    pub fn spacings(&self, [finest, coarsest]: [f64; 2]) -> Vec<f64> {
        let worst = self
            .ladder
            .iter()
            .map(|it| misfit(&self.scene, it.spacing()));
        let worst = worst.fold(FITS, f64::max);
        let ratio = (coarsest / finest).powf(1.0 / f64::from(CHOICES));
        let all = (0..=CHOICES).map(|k| four_digits(finest * ratio.powi(k)));
        let mut fitting: Vec<f64> = all.filter(|d| misfit(&self.scene, *d) <= worst).collect();
        fitting.dedup();
        fitting
    }

    /// Returns the scene's own spacing as TOML.
    pub fn own_spacing(&self) -> String {
        shown(self.scene.solver.resolution())
    }

    /// Returns all runs known in advance, each with the setting that it is for.
    pub fn variants(&self) -> impl Iterator<Item = (&'static str, &Variant)> {
        let ladder = self.ladder.iter().map(|variant| ("spacing", variant));
        let knobs = self.knobs.iter();
        let others =
            knobs.flat_map(|knob| knob.others.iter().map(|(_, variant)| (knob.key, variant)));
        let apart = [
            ("a millionth more gravity", &self.noise_floor),
            ("finer settings", &self.fine),
        ];
        let last = [("reference", &self.reference)];
        ladder.chain(apart).chain(others).chain(last)
    }

    /// Returns the largest time per frame that the request allows, seconds.
    pub fn most_seconds(&self) -> Option<f64> {
        let shot = self.request.seconds;
        let shot = shot.map(|seconds| seconds / f64::from(self.scene.shot.frames));
        let both = [self.request.per_frame, shot];
        both.into_iter().flatten().reduce(f64::min)
    }

    /// Whether pressures are compared.
    pub fn has_pressure(&self) -> bool {
        let mut limits = self.request.limits.iter();
        limits.any(|limit| limit.quantity == Quantity::Pressure)
    }
}

fn check(request: &TuneRequest, scene: &Scene) -> Result<(), TuneError> {
    let fault = |option, problem: String| Err(TuneError::Option { option, problem });
    for (k, limit) in request.limits.iter().enumerate() {
        let name = limit.quantity.name();
        let mut before = request.limits[..k].iter();
        if before.any(|other| other.quantity == limit.quantity) {
            return fault("errors", format!("{name} is listed twice"));
        }
    }
    let wants = |quantity| request.limits.iter().any(|l| l.quantity == quantity);
    if wants(Quantity::Pressure) && scene.pressure_points().is_empty() {
        return fault(
            "errors",
            "pressure: the scene has no [[probe]] of kind = \"pressure\"".into(),
        );
    }
    if let Some(frames) = request.frames
        && !(1..=scene.shot.frames).contains(&frames)
    {
        let problem = format!("the shot has frames 1 to {}", scene.shot.frames);
        return fault("frames", problem);
    }
    if !(0.1..=10.0).contains(&request.reference) {
        let problem = format!(
            "{} is not a factor on the spacing; allowed is a number from 0.1 to 10",
            shown(request.reference)
        );
        return fault("reference", problem);
    }
    for (option, value) in [
        ("seconds", request.seconds),
        ("per frame", request.per_frame),
    ] {
        if value.is_some_and(|value| !(value.is_finite() && value > 0.0)) {
            return fault(option, "allowed is a number above 0, seconds".into());
        }
    }
    if request.repeats == 0 {
        return fault("repeats", "allowed is a whole number from 1".into());
    }
    let folder = |file: &Path| file.parent().map(Path::to_owned).unwrap_or_default();
    if folder(&request.target) != folder(&request.scene) {
        let problem = "allowed is a file beside the scene, as its paths are relative to its folder";
        return fault("target", problem.into());
    }
    Ok(())
}

fn spacing_key(method: Method) -> &'static str {
    match method {
        Method::Pbf => "solver.pbf.particle_spacing",
        Method::Flip => "solver.flip.cell_size",
    }
}

/// Loads the scene with settings and further overrides.
fn laid(request: &TuneRequest, set: &[Setting], more: &[String]) -> Result<Scene, SceneError> {
    let solver = request.solver.map(Method::as_override);
    let set = set.iter().map(|s| format!("{}={}", s.key, s.value));
    let overrides: Vec<String> = solver.into_iter().chain(set).chain(more.to_vec()).collect();
    load_scene_within(&request.scene, &overrides, request.reach)
}

fn variant(request: &TuneRequest, set: Vec<Setting>) -> Result<Variant, SceneError> {
    let scene = laid(request, &set, &[])?;
    Ok(Variant { set, scene })
}

fn shake(scene: &Scene) -> String {
    let gravity = (1.0 + SHAKEN) * scene.water.gravity;
    format!(
        "water.gravity=[{}, {}, {}]",
        gravity.x, gravity.y, gravity.z
    )
}

/// Four digits are precise enough for a spacing, and readable.
fn four_digits(value: f64) -> f64 {
    let scale = 10f64.powi(3 - value.log10().floor() as i32);
    (value * scale).round() / scale
}

/// Returns the largest relative distance of the sides of the water's blocks from whole numbers of
/// particles. The lattice adds this error before anything moves, and it follows no convergence law.
fn misfit(scene: &Scene, spacing: f64) -> f64 {
    let lattice = spacing * scene.particle_spacing() / scene.solver.resolution();
    let sides = |block: &Bounds| {
        let filled = block_size(block, &scene.domain, lattice);
        (filled / block.size() - 1.0).abs().max_element()
    };
    scene.water.blocks.iter().map(sides).fold(0.0, f64::max)
}

/// Returns the spacing near `spacing` that fits the water best; the scene's own is kept.
fn fitting(scene: &Scene, spacing: f64) -> f64 {
    let own = scene.solver.resolution();
    if (spacing / own - 1.0).abs() < 1e-9 {
        return own;
    }
    let step = |k: i32| four_digits(spacing * (1.0 + f64::from(k) * NEAR / f64::from(STEPS)));
    // Misfits within a thousandth are equal; the nearest spacing wins.
    let badness = |k: &i32| ((1e3 * misfit(scene, step(*k))).round() as i64, k.abs());
    (-STEPS..=STEPS).min_by_key(badness).map_or(spacing, step)
}

/// Scales the CFL number; a smaller one raises the allowed number of substeps in proportion.
fn cfl(solver: &Solver, factor: f64) -> Vec<Setting> {
    let ([cfl, most], own) = match solver {
        Solver::Pbf(pbf) => (["solver.pbf.cfl", "solver.pbf.max_substeps"], pbf.cfl),
        Solver::Flip(flip) => (["solver.flip.cfl", "solver.flip.max_substeps"], flip.cfl),
    };
    let substeps = solver.max_substeps();
    let value = Setting::number(cfl, (factor * own).min(MOST_CFL));
    match factor < 1.0 {
        true => vec![
            value,
            Setting::number(most, (f64::from(substeps) / factor).ceil().min(10_000.0)),
        ],
        false => vec![value],
    }
}

/// Scales PBF's number of iterations, or divides the density error that ends them, by `factor`.
fn stop(stop: Stop, factor: f64) -> Vec<Setting> {
    match stop {
        Stop::Iterations(count) => {
            let count = (factor * f64::from(count)).round().clamp(1.0, 10_000.0);
            vec![Setting::number("solver.pbf.iterations", count)]
        }
        Stop::DensityError {
            density_error,
            max_iterations,
        } => {
            let most = (factor * f64::from(max_iterations)).round();
            vec![
                Setting::number("solver.pbf.density_error", density_error / factor),
                Setting::number("solver.pbf.max_iterations", most.clamp(1.0, 10_000.0)),
            ]
        }
    }
}

fn tolerance(flip: &Flip, factor: f64) -> Vec<Setting> {
    let own = flip.pressure.tolerance;
    // 1e-5 × 10 is not 1e-4 in binary.
    let value = format!("{:.3e}", own * factor).parse().unwrap_or(own);
    vec![Setting::number("solver.flip.pressure.tolerance", value)]
}

/// Settings of the reference beside its spacing: half the step, and twice the iterations or a tenth
/// of the tolerance.
fn finer(solver: &Solver) -> Vec<Setting> {
    let step = cfl(solver, 0.5);
    let solve = match solver {
        Solver::Pbf(pbf) => stop(pbf.stop, 2.0),
        Solver::Flip(flip) => tolerance(flip, 0.1),
    };
    [step, solve].concat()
}

/// Returns the settings that are changed one at a time. Values that make the scene invalid are
/// reported in `untried`; values that change nothing are dropped.
fn knobs(
    request: &TuneRequest,
    solver: &Solver,
    coarsest: &[Setting],
    untried: &mut Vec<String>,
) -> Vec<Knob> {
    let cfl = |factor| cfl(solver, factor);
    let values: Vec<(String, Vec<Vec<Setting>>)> = match solver {
        Solver::Pbf(pbf) => {
            let own = match pbf.stop {
                Stop::Iterations(count) => count.to_string(),
                Stop::DensityError { density_error, .. } => shown(density_error),
            };
            let kinds = Iteration::NAMED
                .iter()
                .filter(|(_, kind)| *kind != pbf.iteration);
            vec![
                (shown(pbf.cfl), vec![cfl(2.0), cfl(0.5)]),
                (own, vec![stop(pbf.stop, 0.5), stop(pbf.stop, 2.0)]),
                (
                    format!("{:?}", pbf.iteration.name()),
                    kinds
                        .map(|(name, _)| vec![Setting::word("solver.pbf.iteration", name)])
                        .collect(),
                ),
            ]
        }
        Solver::Flip(flip) => {
            let own = flip.pressure.preconditioner;
            let kinds = [
                Preconditioner::Jacobi,
                Preconditioner::Ipp,
                Preconditioner::Multigrid,
            ];
            let kinds = kinds.into_iter().filter(|kind| *kind != own);
            let key = "solver.flip.pressure.preconditioner";
            vec![
                (shown(flip.cfl), vec![cfl(2.0), cfl(0.5)]),
                (
                    shown(flip.pressure.tolerance),
                    vec![tolerance(flip, 100.0), tolerance(flip, 10.0)],
                ),
                (
                    format!("{:?}", own.name()),
                    kinds
                        .map(|kind| vec![Setting::word(key, kind.name())])
                        .collect(),
                ),
            ]
        }
    };
    let own = laid(request, coarsest, &[]).map(|scene| physics_hash(&scene));
    let mut of = |(own_value, settings): (String, Vec<Vec<Setting>>)| {
        let key = settings[0][0].key;
        let mut others = Vec::new();
        for set in settings {
            match variant(request, [coarsest, &set].concat()) {
                // For example, a CFL number that is already the largest.
                Ok(variant)
                    if own
                        .as_ref()
                        .is_ok_and(|own| *own == physics_hash(&variant.scene)) => {}
                Ok(variant) => others.push((set, variant)),
                Err(error) => untried.push(format!("{key} = {}: {error}", set[0].value)),
            }
        }
        Knob {
            key,
            own: own_value,
            others,
        }
    };
    values.into_iter().map(&mut of).collect()
}

/// Returns what tuning keeps as in the scene.
fn others(method: Method) -> impl Iterator<Item = &'static str> {
    const BOTH: [&str; 2] = [
        "the other solver: a tuning of its own covers it",
        "two settings at once other than those that were proposed; steps by another length of a \
         frame; effects, walls and what else the scene says of the water",
    ];
    const PBF: [&str; 2] = [
        "solver.pbf.support_ratio, relaxation, artificial_pressure, spectral_radius and \
         grid_projection stay as they are",
        "density_error in place of iterations, and the other way round",
    ];
    const FLIP: [&str; 2] = [
        "solver.flip.particles_per_cell, transfer, pic_blend, surface and \
         density_correction stay as they are",
        "solver.flip.pressure.precision; preconditioner = \"none\"; max_iterations, which ends no \
         solve that meets its tolerance",
    ];
    let own = match method {
        Method::Pbf => PBF,
        Method::Flip => FLIP,
    };
    own.into_iter().chain(BOTH)
}

#[cfg(test)]
mod tests;
