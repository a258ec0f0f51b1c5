//! `kind = "solver_comparison"`: two solvers on one scene, rendered with one look.

use std::path::Path;

use serde::Deserialize;
use toml::{Spanned, de::DeTable};

use super::{super::document::Document, SceneFile, StudyFileError, load_with};
use crate::load_look_within;
use swell_domain::frame_range::FrameRange;
use swell_scene::{
    Method, Scene, SceneError,
    look::{FormatSpec, Look},
};

/// Comparison of two solvers on one scene.
#[derive(Clone, Debug)]
pub struct SolverComparison {
    /// The scene with each solver, left and right.
    pub scenes: [Scene; 2],
    /// Look of both.
    pub look: Look,
    /// Frames to measure.
    pub frames: FrameRange,
    /// Frames to render.
    pub pictures: FrameRange,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ComparisonSpec {
    #[serde(rename = "kind")]
    _kind: String,
    scene: Spanned<String>,
    #[serde(default)]
    set: Vec<Spanned<String>>,
    look: Spanned<String>,
    solvers: Spanned<Vec<String>>,
    frames: Option<Spanned<String>>,
    pictures: Spanned<String>,
}

/// Parses the remaining keys of this kind; paths are relative to `base_dir`.
pub(super) fn parse(
    doc: &Document<'_>,
    root: Spanned<DeTable<'_>>,
    base_dir: &Path,
) -> Result<SolverComparison, StudyFileError> {
    let spec = ComparisonSpec::deserialize(toml::Deserializer::from(root))
        .map_err(|error| doc.translate(&error))?;
    let [left, right] = solvers(doc, &spec.solvers)?;
    let file = SceneFile::new(&spec.scene, base_dir);
    let scenes = [
        load(doc, &spec, &file, left)?,
        load(doc, &spec, &file, right)?,
    ];
    let look = load_look_within(&base_dir.join(spec.look.get_ref()), doc.reach())?;
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

fn load(
    doc: &Document<'_>,
    spec: &ComparisonSpec,
    file: &SceneFile<'_>,
    solver: Method,
) -> Result<Scene, SceneError> {
    let sets = spec
        .set
        .iter()
        .map(|set| (set.get_ref().clone(), set.span()));
    let chosen = (solver.as_override(), spec.solvers.span());
    let mut scene = load_with(doc, file, sets.chain([chosen]))?;
    // Every frame is measured, so all must be kept.
    scene.keep = None;
    Ok(scene)
}

fn solvers(doc: &Document<'_>, spec: &Spanned<Vec<String>>) -> Result<[Method; 2], SceneError> {
    let of = |name: &String| {
        let named = Method::NAMED.iter().find(|(known, _)| known == name);
        let fault = || doc.fault_at(spec.span(), format!("{name:?} is not a solver"));
        named.map(|(_, method)| *method).ok_or_else(fault)
    };
    match spec.get_ref().as_slice() {
        [a, b] if a != b => Ok([of(a)?, of(b)?]),
        other => Err(doc.fault_at(spec.span(), format!("{other:?} are not two solvers"))),
    }
}

/// Returns the range of all frames of a shot.
///
/// # Panics
/// Never: a shot has 1 to 10⁶ frames, and a range allows ten times as many.
fn whole_shot(last: u32) -> FrameRange {
    FrameRange::inclusive(1, last).expect("a validated shot")
}

/// Parses a range of frames within the shot.
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
