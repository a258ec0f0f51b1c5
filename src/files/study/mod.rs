//! Study files: comparisons to run on scenes.
//!
//! Each kind has a module: [`comparison`] compares two solvers, [`sweep`] runs a scene repeatedly
//! with one setting changed at a time, [`stability`] runs scenes that are hard on a solver,
//! [`validation`] runs scenes with known solutions, and [`surface`] renders a scene's frames with
//! one setting of the look changed at a time. [`tune`] is requested on the command line.

pub mod comparison;
pub mod stability;
pub mod surface;
pub mod sweep;
pub mod tune;
pub mod validation;

use std::{
    ops::Range,
    path::{Path, PathBuf},
};

use serde::Deserialize;
use toml::Spanned;

use super::{Reach, document::Document, keys, reach};
use crate::load_scene_within;
use swell_scene::{Fault, Place, Scene, SceneError, look::LookError};

use swell_domain::text;

use comparison::SolverComparison;
use stability::Stability;
use surface::SurfaceStudy;
use sweep::Sweep;
use tune::Tune;
use validation::Validation;

/// A validated study, with every referenced file read.
#[derive(Clone, Debug)]
pub enum Study {
    /// `kind = "solver_comparison"`.
    SolverComparison(Box<SolverComparison>),
    /// `kind = "sweep"`.
    Sweep(Box<Sweep>),
    /// `kind = "stability"`.
    Stability(Box<Stability>),
    /// `kind = "surface"`.
    Surface(Box<SurfaceStudy>),
    /// Study that tunes a scene, which has no file.
    Tune(Box<Tune>),
    /// `kind = "validation"`.
    Validation(Box<Validation>),
}

/// Device of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RunsOn {
    /// The study's GPU adapter, in `f32`.
    Gpu,
    /// The `f64` reference on the CPU.
    Cpu,
}

impl RunsOn {
    /// Returns the name used in studies.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gpu => "gpu",
            Self::Cpu => "cpu",
        }
    }

    /// Returns the device with this name.
    fn named(word: &str) -> Option<Self> {
        [Self::Gpu, Self::Cpu]
            .into_iter()
            .find(|device| device.name() == word)
    }
}

/// Why a study could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum StudyFileError {
    /// Fault in the study file or in its scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Fault in its look.
    #[error(transparent)]
    Look(#[from] LookError),
}

/// The key common to all kinds, which selects the parser of the others.
#[derive(Deserialize)]
struct KindSpec {
    kind: String,
}

impl Study {
    /// Loads a study file and the files that it names, relative to it. Its scene and look may be
    /// anywhere; files that these name must be below their folders.
    ///
    /// # Errors
    /// [`StudyFileError`] with file, line and key.
    pub fn load(path: &Path) -> Result<Self, StudyFileError> {
        Self::load_within(path, Reach::Folder)
    }

    /// Loads as [`Self::load`] does, with the files of scenes and looks resolved within `reach`.
    ///
    /// # Errors
    /// Those of [`Self::load`].
    pub fn load_within(path: &Path, reach: Reach) -> Result<Self, StudyFileError> {
        let text = text::read(path).map_err(|source| SceneError::Read {
            file: path.to_owned(),
            source,
        })?;
        let base_dir = path.parent().unwrap_or(Path::new(""));
        Self::parse_within(&text, path, base_dir, reach)
    }

    /// Parses a study as [`Self::load`] does; `file` names it in messages, and relative paths
    /// start at `base_dir`.
    ///
    /// # Errors
    /// Those of [`Self::load`].
    pub fn parse(text: &str, file: &Path, base_dir: &Path) -> Result<Self, StudyFileError> {
        Self::parse_within(text, file, base_dir, Reach::Folder)
    }

    fn parse_within(
        text: &str,
        file: &Path,
        base_dir: &Path,
        reach: Reach,
    ) -> Result<Self, StudyFileError> {
        let (doc, mut root) = Document::parse(text, file, &[], keys::STUDY)?;
        let doc = doc.within(reach);
        doc.settle(&mut root)?;
        let told = KindSpec::deserialize(toml::Deserializer::from(root.clone()))
            .map_err(|error| doc.translate(&error))?;
        match told.kind.as_str() {
            "solver_comparison" => {
                let comparison = comparison::parse(&doc, root, base_dir)?;
                Ok(Self::SolverComparison(Box::new(comparison)))
            }
            "sweep" => Ok(Self::Sweep(Box::new(sweep::parse(&doc, root, base_dir)?))),
            "stability" => {
                let stability = stability::parse(&doc, root, base_dir)?;
                Ok(Self::Stability(Box::new(stability)))
            }
            "surface" => {
                let surface = surface::parse(&doc, root, base_dir)?;
                Ok(Self::Surface(Box::new(surface)))
            }
            // The table of keys allows no other kind.
            _ => {
                let validation = validation::parse(&doc, root, base_dir)?;
                Ok(Self::Validation(Box::new(validation)))
            }
        }
    }
}

impl Study {
    /// Returns the warnings of its scenes, without duplicates.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings: Vec<String> = Vec::new();
        let mut of = |scene: &Scene| {
            for warning in scene.warnings() {
                if !warnings.contains(&warning) {
                    warnings.push(warning);
                }
            }
        };
        match self {
            Self::SolverComparison(comparison) => comparison.scenes.iter().for_each(of),
            Self::Sweep(sweep) => {
                let points = sweep.points();
                let points = points.chain(&sweep.state);
                points.for_each(|point| of(&point.scene));
            }
            Self::Stability(stability) => stability.for_each_scene(of),
            Self::Surface(surface) => of(&surface.scene),
            Self::Tune(tune) => of(&tune.scene),
            Self::Validation(validation) => {
                let runs = validation.benchmarks.iter().flat_map(|b| &b.runs);
                runs.for_each(|run| of(&run.scene));
            }
        }
        warnings
    }
}

/// Error that the scene named by a study cannot be read, located in the study.
fn unreadable(
    doc: &Document<'_>,
    named: &Spanned<String>,
    file: &Path,
    source: &std::io::Error,
) -> SceneError {
    let cannot = || format!("cannot read {}: {source}", file.display());
    doc.fault_at(
        named.span(),
        reach::odd(named.get_ref()).unwrap_or_else(cannot),
    )
}

/// A scene file named by a study.
struct SceneFile<'a> {
    named: &'a Spanned<String>,
    path: PathBuf,
}

impl<'a> SceneFile<'a> {
    fn new(named: &'a Spanned<String>, base_dir: &Path) -> Self {
        let path = base_dir.join(named.get_ref());
        Self { named, path }
    }
}

/// Loads the scene with overrides. Faults in an override or in the name of the file are located
/// in the study file.
fn load_with(
    doc: &Document<'_>,
    file: &SceneFile<'_>,
    overrides: impl Iterator<Item = (String, Range<usize>)>,
) -> Result<Scene, SceneError> {
    let (overrides, spans): (Vec<_>, Vec<_>) = overrides.unzip();
    load_scene_within(&file.path, &overrides, doc.reach()).map_err(|error| match &error {
        SceneError::Read { source, .. } => unreadable(doc, file.named, &file.path, source),
        _ => in_study(doc, (&overrides, &spans), error),
    })
}

/// Locates a fault of an override in the study file, which sets it at one of `spans`; returns other
/// errors as they are.
fn in_study(
    doc: &Document<'_>,
    (overrides, spans): (&[String], &[Range<usize>]),
    error: SceneError,
) -> SceneError {
    let (text, message) = match &error {
        SceneError::Fault(fault) => match fault.as_ref() {
            Fault {
                place: Place::Override(text),
                key,
                message,
                ..
            } => (text, format!("{key}: {message}")),
            _ => return error,
        },
        SceneError::Override { text, reason } => (text, reason.clone()),
        _ => return error,
    };
    let place = overrides.iter().position(|known| known == text);
    place.map_or(error, |place| {
        doc.fault_plain(spans[place].clone(), message)
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use swell_scene::Method;

    #[test]
    fn the_studies_that_ship_fit_their_scenes() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/studies");
        let (mut comparisons, mut sweeps, mut stabilities, mut validations) = (0, 0, 0, 0);
        let mut surfaces = 0;
        for entry in fs::read_dir(folder).expect("studies") {
            let file = entry.expect("a study").path();
            match Study::load(&file).unwrap_or_else(|error| panic!("{error}")) {
                Study::SolverComparison(comparison) => {
                    let methods = comparison.scenes.map(|scene| scene.solver.method());
                    assert_eq!(methods, [Method::Pbf, Method::Flip], "{}", file.display());
                    comparisons += 1;
                }
                Study::Sweep(sweep) => {
                    assert!(sweep.lines.iter().all(|line| line.points.len() >= 2));
                    sweeps += 1;
                }
                Study::Stability(stability) => {
                    assert!(!stability.cases.is_empty());
                    // Over the whole search, values stay within the ranges of the keys.
                    for limit in &stability.limits {
                        for value in [limit.passes, limit.fails] {
                            let loaded = limit.searches.iter().map(|search| search.trial(value));
                            let loaded: Result<Vec<_>, _> = loaded.collect();
                            loaded.unwrap_or_else(|e| panic!("{} at {value}: {e}", limit.name));
                        }
                    }
                    stabilities += 1;
                }
                Study::Surface(surface) => {
                    assert!(surface.points().count() >= 2);
                    surfaces += 1;
                }
                Study::Tune(_) => unreachable!("no file has this kind"),
                Study::Validation(validation) => {
                    let mut benchmarks = validation.benchmarks.iter();
                    assert!(benchmarks.all(|benchmark| !benchmark.gates.is_empty()));
                    validations += 1;
                }
            }
        }
        assert_eq!(
            (comparisons, sweeps, stabilities, validations, surfaces),
            (2, 12, 1, 2, 1)
        );
    }
}
