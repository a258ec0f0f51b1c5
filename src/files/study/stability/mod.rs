//! `kind = "stability"`: small scenes that are hard on a solver, the quantities measured in
//! each and the marks that they must pass, and searches for how far single settings can go
//! before a mark fails.
//!
//! ```toml
//! kind = "stability"
//!
//! [[case]]
//! number = 5                                  # several cases may share a number
//! name = "film one particle thick"
//! scene = "../../tests/hard_cases/05-film.toml"
//! set = ["shot.frames=30"]                    # applied to the scene
//! solvers = ["pbf", "flip"]                   # default: both
//! devices = ["gpu", "cpu"]                    # default: both
//! frames = 60                                 # default: the whole shot
//!
//! [[case.mark]]
//! of = "least_spacing"
//! at_least = 0.5                              # or at_most
//! after = 0.5                                 # initial seconds to ignore; default 0
//! since = 1.0                                 # compare with the state then, not with the start
//! known_failure = "why it is missed"          # reported as such; also reported if it passes
//!
//! [[case.against]]                            # another run to compare with, frame by frame
//! set = ["domain.max=[2.0, 1.0, 1.0]"]
//! device = "cpu"                              # default: that of the case
//! scale = 1.0                                 # its lengths over those of the case
//! shift = [0.0, 0.0, 0.0]                     # its origin, metres
//!
//! [[limit]]
//! name = "longest step"
//! scene = "../../tests/hard_cases/21-huge-step.toml"
//! set = ["shot.frames_per_second={1/}"]       # {} is the value, {2*} twice it, {2/} two over it
//! passes = 0.01                               # a value that passes
//! fails = 1.0                                 # a value that fails
//! ratio = 1.1                                 # stop once the two are this close
//! seconds = 1.0                               # of the shot
//! unit = "s"
//! [[limit.mark]]
//! of = "energy_gain"
//! at_most = 0.05
//! ```

mod quantity;
mod spec;

use glam::DVec3;

use super::RunsOn;
use swell_domain::bounds::Bounds;
use swell_scene::{Method, Scene, SceneError};

pub use quantity::{About, Over, Quantity};
pub(super) use spec::parse;

/// A validated stability study.
#[derive(Clone, Debug)]
pub struct Stability {
    /// Introduction for the page, in paragraphs.
    pub about: Vec<String>,
    /// Cases in the order of the file.
    pub cases: Vec<Case>,
    /// Limits in the order of the file.
    pub limits: Vec<Limit>,
}

impl Stability {
    /// Visits the scenes of its cases, and those of its limits at the value that should pass.
    pub(super) fn for_each_scene(&self, mut visit: impl FnMut(&Scene)) {
        for case in &self.cases {
            match &case.held {
                Held::Test(_) | Held::Refusal { .. } => {}
                Held::Runs(trials) => trials.iter().for_each(|trial| visit(&trial.scene)),
            }
        }
        for limit in &self.limits {
            let trials = limit
                .searches
                .iter()
                .map(|search| search.trial(limit.passes));
            trials.flatten().for_each(|trial| visit(&trial.scene));
        }
    }
}

/// A difficult case.
#[derive(Clone, Debug)]
pub struct Case {
    /// Number in the list of hard cases; several cases may share one.
    pub number: u32,
    /// Name in words.
    pub name: String,
    /// Note for the page.
    pub note: Option<String>,
    /// How the case is checked.
    pub held: Held,
}

/// Check of a case.
#[derive(Clone, Debug)]
pub enum Held {
    /// A command that runs a test.
    Test(String),
    /// Runs, one per solver and device.
    Runs(Vec<Trial>),
    /// Each scene must be rejected with a message that contains all of these words.
    Refusal {
        /// Attempts per solver and device.
        attempts: Vec<Attempt>,
        /// Parts of the message.
        words: Vec<String>,
    },
}

/// Attempt to load a scene that must be rejected.
#[derive(Clone, Debug)]
pub struct Attempt {
    /// Solver of the attempt.
    pub method: Method,
    /// Device of the run if the scene loads after all.
    pub device: RunsOn,
    /// The loaded scene, or the message of the error.
    pub scene: Result<Box<Scene>, String>,
}

/// A run with its pass marks.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Device of the run.
    pub device: RunsOn,
    /// The scene with all overrides.
    pub scene: Scene,
    /// Number of output frames to run.
    pub frames: u32,
    /// Runs to compare with.
    pub others: Vec<Other>,
    /// Marks that apply to its solver and device.
    pub marks: Vec<Mark>,
}

/// A run that another one is compared with.
#[derive(Clone, Debug)]
pub struct Other {
    /// Device of the run.
    pub device: RunsOn,
    /// Scene of the run.
    pub scene: Scene,
    /// Its lengths over those of the compared run.
    pub scale: f64,
    /// Its origin, metres.
    pub shift: DVec3,
}

/// A measured quantity and its required bound.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Measured quantity.
    pub of: Quantity,
    /// Bound that it has to satisfy.
    pub bound: Bound,
    /// Initial seconds of the shot that are ignored.
    pub after: f64,
    /// Time in seconds of the state to compare with in place of the start; earlier
    /// frames are ignored.
    pub since: Option<f64>,
    /// Box in which the measured particles start.
    pub region: Option<Bounds>,
    /// Reason for a known failure.
    pub known_failure: Option<String>,
}

/// A one-sided bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// Upper bound, inclusive.
    AtMost(f64),
    /// Lower bound, inclusive.
    AtLeast(f64),
}

impl Bound {
    /// Whether a number satisfies the bound; NaN does not.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::AtMost(most) => value <= most,
            Self::AtLeast(least) => value >= least,
        }
    }

    /// Returns the worse of two numbers; NaN is the worst.
    pub fn worse(self, a: f64, b: f64) -> f64 {
        match self {
            _ if a.is_nan() || b.is_nan() => f64::NAN,
            Self::AtMost(_) => a.max(b),
            Self::AtLeast(_) => a.min(b),
        }
    }

    /// Returns the bounding number.
    pub fn value(self) -> f64 {
        match self {
            Self::AtMost(value) | Self::AtLeast(value) => value,
        }
    }
}

/// A search for the range of a setting.
#[derive(Clone, Debug)]
pub struct Limit {
    /// Name in words.
    pub name: String,
    /// Note for the page.
    pub note: Option<String>,
    /// Unit of the setting.
    pub unit: String,
    /// Searches, one per solver.
    pub searches: Vec<Search>,
    /// A value expected to pass.
    pub passes: f64,
    /// A value expected to fail.
    pub fails: f64,
    /// Ratio of the bracket, above 1, at which the search stops.
    pub ratio: f64,
}

/// Search with one solver; scenes are built from the values as they are tried.
#[derive(Clone, Debug)]
pub struct Search {
    /// Solver of the search.
    pub method: Method,
    template: spec::Template,
}

impl Search {
    /// Builds the run for a value.
    ///
    /// # Errors
    /// If the value makes the scene invalid.
    pub fn trial(&self, value: f64) -> Result<Trial, SceneError> {
        self.template.trial(self.method, value)
    }
}
