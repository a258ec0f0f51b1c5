//! Sequences of frames to view, whatever their source.

use std::{
    collections::BTreeMap,
    fmt,
    path::{Path, PathBuf},
};

use super::{ViewError, particles::Balls, pictures};
use swell_render::Attributes;
use swell_scene::look::ViewSpec;
use swell_study::rgb::Rgb;

/// Identifies a picture of a strip.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Label {
    /// Number of the frame.
    Frame(u32),
    /// File name without its extension, if no picture of the folder has a number.
    Name(String),
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frame(frame) => write!(f, "{frame}"),
            Self::Name(name) => f.write_str(name),
        }
    }
}

impl Label {
    /// The label in words, for a sheet.
    pub(super) fn words(&self) -> String {
        match self {
            Self::Frame(frame) => format!("frame {frame}"),
            Self::Name(name) => name.clone(),
        }
    }
}

/// Pictures of one render or one cache.
pub(super) struct Strip {
    /// Path as given by the user.
    pub(super) path: PathBuf,
    /// Short name.
    pub(super) title: String,
    /// Description for sheet and page; may be empty.
    pub(super) note: String,
    /// Labels in order; at least one.
    pub(super) labels: Vec<Label>,
    /// Columns and rows of each picture.
    pub(super) size: [usize; 2],
    /// Frame rate, if the pictures or the cache specify it.
    pub(super) frames_per_second: Option<f64>,
    pub(super) source: PictureSource,
}

/// Source of the pictures.
pub(super) enum PictureSource {
    /// Files, and the view transform for EXR light.
    Files(BTreeMap<Label, PathBuf>, Box<ViewSpec>),
    /// Particles of a cache.
    Cache(Box<Balls>),
}

impl Strip {
    /// Description of the whole strip; may be empty.
    pub(super) fn said(&self) -> String {
        match &self.source {
            PictureSource::Files(..) => self.note.clone(),
            PictureSource::Cache(balls) => balls.note(),
        }
    }

    pub(super) fn has(&self, label: &Label) -> bool {
        self.labels.binary_search(label).is_ok()
    }

    /// Reads or draws the picture with one of its labels.
    pub(super) fn picture(&self, label: &Label) -> Result<Rgb, ViewError> {
        match &self.source {
            PictureSource::Files(files, view) => {
                let file = files.get(label).ok_or_else(|| self.lacks(label))?;
                let picture = pictures::read(file, view)?;
                if picture.size == self.size {
                    return Ok(picture);
                }
                Err(ViewError::Asked(format!(
                    "{} has changed meanwhile",
                    file.display()
                )))
            }
            PictureSource::Cache(balls) => match label {
                Label::Frame(frame) => balls.draw(*frame),
                Label::Name(_) => Err(self.lacks(label)),
            },
        }
    }

    /// Recorded origin of the picture with this label.
    pub(super) fn attributes(&self, label: &Label) -> Option<Attributes> {
        match &self.source {
            PictureSource::Files(files, _) => pictures::attributes(files.get(label)?),
            PictureSource::Cache(_) => None,
        }
    }

    pub(super) fn lacks(&self, label: &Label) -> ViewError {
        let path = self.path.display();
        if let (PictureSource::Cache(balls), Label::Frame(frame)) = (&self.source, label) {
            return balls.lacks(*frame);
        }
        ViewError::Asked(match label {
            Label::Frame(frame) => format!("{path} has no picture of frame {frame}"),
            Label::Name(name) => format!("{path} has no picture {name}"),
        })
    }
}

/// The last component of a path, also for `.` and `..`.
pub(super) fn name_of(path: &Path) -> String {
    let last = |path: &Path| Some(path.file_name()?.to_string_lossy().into_owned());
    let real = || path.canonicalize().ok().and_then(|real| last(&real));
    last(path)
        .or_else(real)
        .unwrap_or_else(|| "view".to_owned())
}
