//! `kind = "surface"`: frames of a scene rendered repeatedly, with one setting of the look
//! changed at a time.
//!
//! ```toml
//! kind = "surface"
//! scene = "../quickstart.toml"            # baked first, up to the last of the frames
//! look = "../looks/day.toml"              # camera and light; also renders the reference
//! frames = "40,68"
//! repeats = 3                             # times are medians over this many runs
//! errors = ["normal_off", "silhouette"]
//!
//! [[line]]                                # one curve each
//! name = "curvature flow"
//! set = ["surface.filter=curvature_flow"] # applied to the look
//! key = "surface.smoothing_width_m"       # changes from point to point
//! values = [0.0, 0.1, 0.2]
//! ```

use std::{ops::Range, path::Path};

use serde::Deserialize;
use toml::{Spanned, Value, de::DeTable};

use super::{super::document::Document, SceneFile, StudyFileError, in_study, load_with};
use crate::{load_look_with, load_look_within};
use swell_domain::frame_range::FrameRange;
use swell_scene::{
    Scene, SceneError,
    look::{Look, LookError},
};

/// Keys of a look that change the rendering of the water but not its reference.
const SWEPT: [&str; 7] = [
    "surface.filter",
    "surface.splat",
    "surface.radius_m",
    "surface.smoothing_width_m",
    "surface.voxels_per_spacing",
    "renderer.method",
    "image.samples",
];

const MOST_POINTS: usize = 1000;

/// A validated study of the rendered surface.
#[derive(Clone, Debug)]
pub struct SurfaceStudy {
    /// Introduction for the page, in paragraphs.
    pub about: Vec<String>,
    /// Scene to bake.
    pub scene: Scene,
    /// Camera and light; also renders the reference.
    pub look: Look,
    /// Frames to render and measure.
    pub frames: FrameRange,
    /// Number of times that each point is rendered.
    pub repeats: u32,
    /// Measured errors, at least one.
    pub errors: Vec<PictureError>,
    /// Curves.
    pub lines: Vec<Line>,
}

/// One curve.
#[derive(Clone, Debug)]
pub struct Line {
    /// Name for the legend.
    pub name: String,
    /// Key that changes from point to point.
    pub key: String,
    /// Points in the order of the file.
    pub points: Vec<Point>,
}

/// One setting of a curve.
#[derive(Clone, Debug)]
pub struct Point {
    /// The value as written in the file.
    pub label: String,
    /// The look with all overrides.
    pub look: Look,
}

impl SurfaceStudy {
    /// Returns the points of all curves.
    pub fn points(&self) -> impl Iterator<Item = &Point> {
        self.lines.iter().flat_map(|line| &line.points)
    }
}

/// Error of a picture, as plotted by the curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureError {
    /// Median difference of depths from `f64` ray casting, spacings.
    Depth,
    /// Median angle between normals and those of `f64` ray casting, degrees.
    Normal,
    /// Roughness of silhouettes relative to those of `f64` ray casting, spacings.
    Silhouette,
    /// Mean distance of silhouettes from those of `f64` ray casting, spacings.
    Offset,
    /// 100 − SSIMULACRA 2 score against finer rays.
    Colour,
}

impl PictureError {
    /// All errors with the names used in studies.
    pub const NAMED: [(&'static str, Self); 5] = [
        ("depth_off", Self::Depth),
        ("normal_off", Self::Normal),
        ("silhouette", Self::Silhouette),
        ("silhouette_offset", Self::Offset),
        ("colour", Self::Colour),
    ];

    /// Returns the name used in studies.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }

    /// Returns the title of an axis, with its unit.
    pub fn title(self) -> &'static str {
        match self {
            Self::Depth => "depth off rays in f64, median, spacings",
            Self::Normal => "normal off rays in f64, median, degrees",
            Self::Silhouette => "roughness of silhouettes, spacings",
            Self::Offset => "silhouettes off rays in f64, mean, spacings",
            Self::Colour => "100 − SSIMULACRA 2 against finer rays",
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SurfaceSpec {
    #[serde(rename = "kind")]
    _kind: String,
    about: Option<Vec<String>>,
    scene: Spanned<String>,
    #[serde(default)]
    set: Vec<Spanned<String>>,
    look: Spanned<String>,
    frames: Spanned<String>,
    repeats: u32,
    errors: Spanned<Vec<Spanned<String>>>,
    line: Spanned<Vec<LineSpec>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LineSpec {
    name: Spanned<String>,
    #[serde(default)]
    set: Vec<Spanned<String>>,
    key: Spanned<String>,
    values: Spanned<Vec<Spanned<Value>>>,
}

/// Parses the remaining keys of this kind; paths are relative to `base_dir`.
pub(super) fn parse(
    doc: &Document<'_>,
    root: Spanned<DeTable<'_>>,
    base_dir: &Path,
) -> Result<SurfaceStudy, StudyFileError> {
    let spec = SurfaceSpec::deserialize(toml::Deserializer::from(root))
        .map_err(|error| doc.translate(&error))?;
    let sets = spec
        .set
        .iter()
        .map(|set| (set.get_ref().clone(), set.span()));
    let mut scene = load_with(doc, &SceneFile::new(&spec.scene, base_dir), sets)?;
    // Frames to render must be kept.
    scene.keep = None;
    let frames = frames(doc, &spec.frames, scene.shot.frames)?;
    let file = base_dir.join(spec.look.get_ref());
    let look = load_look_within(&file, doc.reach())?;
    let mut lines: Vec<Line> = Vec::new();
    for line in spec.line.get_ref() {
        if lines.iter().any(|other| &other.name == line.name.get_ref()) {
            let problem = format!("{:?} is the name of another line", line.name.get_ref());
            return Err(doc.fault_at(line.name.span(), problem).into());
        }
        lines.push(read_line(doc, line, &file)?);
    }
    let points: usize = lines.iter().map(|line| line.points.len()).sum();
    if points == 0 || points > MOST_POINTS {
        let problem = format!("{points} points in all, and a study has 1 to {MOST_POINTS}");
        return Err(doc.fault_at(spec.line.span(), problem).into());
    }
    Ok(SurfaceStudy {
        about: spec.about.unwrap_or_default(),
        scene,
        look,
        frames,
        repeats: spec.repeats,
        errors: errors(doc, &spec.errors)?,
        lines,
    })
}

fn frames(doc: &Document<'_>, text: &Spanned<String>, last: u32) -> Result<FrameRange, SceneError> {
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

fn errors(
    doc: &Document<'_>,
    spec: &Spanned<Vec<Spanned<String>>>,
) -> Result<Vec<PictureError>, SceneError> {
    let mut errors: Vec<PictureError> = Vec::new();
    for word in spec.get_ref() {
        let fault =
            |problem: &str| doc.fault_at(word.span(), format!("{:?} {problem}", word.get_ref()));
        let mut named = PictureError::NAMED.iter();
        let named = named.find(|(name, _)| name == word.get_ref());
        let (_, error) = named.ok_or_else(|| fault("is not an error of a picture"))?;
        if errors.contains(error) {
            return Err(fault("is listed twice"));
        }
        errors.push(*error);
    }
    match errors.is_empty() {
        true => Err(doc.fault_at(spec.span(), "empty")),
        false => Ok(errors),
    }
}

fn read_line(doc: &Document<'_>, line: &LineSpec, file: &Path) -> Result<Line, SceneError> {
    let key = line.key.get_ref();
    let known = |text: &str| SWEPT.iter().any(|swept| text.starts_with(swept));
    if !SWEPT.contains(&key.as_str()) {
        let problem = format!("{key:?} is not one of {}", SWEPT.join(", "));
        return Err(doc.fault_at(line.key.span(), problem));
    }
    for set in &line.set {
        if !known(set.get_ref()) {
            let problem = format!("{:?} sets none of {}", set.get_ref(), SWEPT.join(", "));
            return Err(doc.fault_at(set.span(), problem));
        }
    }
    let mut points: Vec<Point> = Vec::new();
    for value in line.values.get_ref() {
        let fixed = line
            .set
            .iter()
            .map(|set| (set.get_ref().clone(), set.span()));
        let swept = (format!("{key}={}", value.get_ref()), value.span());
        let look = load_look(doc, file, fixed.chain([swept]))?;
        if points.iter().any(|point| point.look.hash() == look.hash()) {
            let problem = "the look is the same as with a value before it";
            return Err(doc.fault_at(value.span(), problem));
        }
        points.push(Point {
            label: doc.text_at(value.span()).trim_matches('"').to_owned(),
            look,
        });
    }
    Ok(Line {
        name: line.name.get_ref().clone(),
        key: key.clone(),
        points,
    })
}

/// Loads the look with overrides. Faults in an override are located in the study file.
fn load_look(
    doc: &Document<'_>,
    file: &Path,
    overrides: impl Iterator<Item = (String, Range<usize>)>,
) -> Result<Look, SceneError> {
    let (overrides, spans): (Vec<_>, Vec<_>) = overrides.unzip();
    load_look_with(file, &overrides, doc.reach())
        .map_err(|LookError(error)| in_study(doc, (&overrides, &spans), error))
}
