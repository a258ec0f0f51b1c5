//! Study files: what is to be compared, on which scene, seen with which look.

use std::{fs, path::Path};

use serde::Deserialize;
use toml::Spanned;

use super::{
    Method, Scene,
    document::Document,
    error::SceneError,
    look::{FormatSpec, Look, LookError},
};
use crate::domain::frame_range::FrameRange;

/// A validated study: every file that it names read.
#[derive(Clone, Debug)]
pub enum Study {
    /// `kind = "solver_comparison"`.
    SolverComparison(Box<SolverComparison>),
}

/// Two solvers on one scene, side by side.
#[derive(Clone, Debug)]
pub struct SolverComparison {
    /// The scene with each solver, left and right.
    pub scenes: [Scene; 2],
    /// Same for both.
    pub look: Look,
    /// Frames that are measured.
    pub frames: FrameRange,
    /// Frames that are rendered.
    pub pictures: FrameRange,
}

/// Why a study could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum StudyFileError {
    /// The study file itself, or its scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Its look.
    #[error(transparent)]
    Look(#[from] LookError),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StudySpec {
    kind: Spanned<String>,
    scene: Spanned<String>,
    look: Spanned<String>,
    solvers: Spanned<Vec<String>>,
    frames: Option<Spanned<String>>,
    pictures: Spanned<String>,
}

/// Kinds of study.
const KINDS: [&str; 1] = ["solver_comparison"];

impl Study {
    /// Loads a study file, its scene and its look, whose paths are relative to it.
    ///
    /// # Errors
    /// [`StudyFileError`], with file, line and key.
    pub fn load(path: &Path) -> Result<Self, StudyFileError> {
        let text = fs::read_to_string(path).map_err(|source| SceneError::Read {
            file: path.to_owned(),
            source,
        })?;
        Self::parse(&text, path, path.parent().unwrap_or(Path::new("")))
    }

    /// [`Self::load`] on a text; `file` names it in messages, `base_dir` is where relative paths
    /// start.
    ///
    /// # Errors
    /// Those of [`Self::load`].
    pub fn parse(text: &str, file: &Path, base_dir: &Path) -> Result<Self, StudyFileError> {
        let (doc, root) = Document::parse(text, file, &[])?;
        let spec = StudySpec::deserialize(toml::Deserializer::from(root))
            .map_err(|error| doc.translate(&error))?;
        if !KINDS.contains(&spec.kind.get_ref().as_str()) {
            let problem = format!("{:?} is no kind of study", spec.kind.get_ref());
            return Err(doc.fault_at(spec.kind.span(), problem).into());
        }
        let comparison = comparison(&doc, &spec, base_dir)?;
        Ok(Self::SolverComparison(Box::new(comparison)))
    }
}

fn comparison(
    doc: &Document<'_>,
    spec: &StudySpec,
    base_dir: &Path,
) -> Result<SolverComparison, StudyFileError> {
    let [left, right] = solvers(doc, &spec.solvers)?;
    let file = base_dir.join(spec.scene.get_ref());
    let scenes = [
        Scene::load(&file, &[left.as_override()])?,
        Scene::load(&file, &[right.as_override()])?,
    ];
    let look = Look::load(&base_dir.join(spec.look.get_ref()))?;
    if !look.spec().output.formats.contains(&FormatSpec::Png) {
        let problem = "its output.formats has no \"png\"";
        return Err(doc.fault_at(spec.look.span(), problem).into());
    }
    let last = scenes[0].shot.frames;
    let frames = match &spec.frames {
        Some(text) => range(doc, text, last)?,
        None => whole_shot(last),
    };
    Ok(SolverComparison {
        frames,
        pictures: range(doc, &spec.pictures, last)?,
        scenes,
        look,
    })
}

fn solvers(doc: &Document<'_>, spec: &Spanned<Vec<String>>) -> Result<[Method; 2], SceneError> {
    let of = |name: &String| {
        let named = Method::NAMED.iter().find(|(known, _)| known == name);
        let fault = || doc.fault_at(spec.span(), format!("{name:?} is no solver"));
        named.map(|(_, method)| *method).ok_or_else(fault)
    };
    match spec.get_ref().as_slice() {
        [a, b] if a != b => Ok([of(a)?, of(b)?]),
        other => Err(doc.fault_at(spec.span(), format!("{other:?} are not two solvers"))),
    }
}

/// Every frame of a shot of `last` frames.
///
/// # Panics
/// Never: a scene's shot has 1 to 10⁶ frames, and a range takes ten times as many.
fn whole_shot(last: u32) -> FrameRange {
    FrameRange::inclusive(1, last).expect("a validated shot")
}

/// Frames from 1 to the shot's last.
fn range(doc: &Document<'_>, text: &Spanned<String>, last: u32) -> Result<FrameRange, SceneError> {
    let fault = |problem: String| doc.fault_at(text.span(), problem);
    let frames: FrameRange = text
        .get_ref()
        .parse()
        .map_err(|error| fault(format!("{error}")))?;
    if frames.first() == 0 || frames.last() > last {
        return Err(fault(format!("the shot has frames 1 to {last}")));
    }
    Ok(frames)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_studies_that_ship_fit_their_scenes() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/studies");
        let mut names = Vec::new();
        for entry in fs::read_dir(folder).expect("studies") {
            let file = entry.expect("a study").path();
            let Study::SolverComparison(comparison) = Study::load(&file).expect("valid");
            let methods = comparison.scenes.map(|scene| scene.solver.method);
            assert_eq!(methods, [Method::Pbf, Method::Flip], "{}", file.display());
            names.push(file);
        }
        assert_eq!(names.len(), 2);
    }
}
