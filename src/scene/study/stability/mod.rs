//! `kind = "stability"`: small scenes that are hard on a solver, what is measured of each, and the mark that it has to
//! pass; and how far single settings go before a mark is missed.
//!
//! ```toml
//! kind = "stability"
//!
//! [[case]]
//! number = 5                                  # several cases may have one number
//! name = "film one particle thick"
//! scene = "../../tests/hard_cases/05-film.toml"
//! set = ["shot.frames=30"]                    # laid over the scene, as --set does
//! solvers = ["pbf", "flip"]                   # both where left out
//! devices = ["gpu", "cpu"]                    # both where left out
//! frames = 60                                 # the whole shot where left out
//!
//! [[case.mark]]
//! of = "least_spacing"
//! at_least = 0.5                              # or at_most
//! after = 0.5                                 # seconds that do not count; 0 where left out
//! since = 1.0                                 # against the state then, not that of the start
//! known_failure = "why it is missed"          # shown as such; a known failure that passes is told as well
//!
//! [[case.against]]                            # another run beside it, frame by frame
//! set = ["domain.max=[2.0, 1.0, 1.0]"]
//! device = "cpu"                              # the case's own where left out
//! scale = 1.0                                 # its lengths over the case's
//! shift = [0.0, 0.0, 0.0]                     # its origin, metres
//!
//! [[limit]]
//! name = "longest step"
//! scene = "../../tests/hard_cases/21-huge-step.toml"
//! set = ["shot.frames_per_second={1/}"]       # {} is the value, {2*} twice it, {2/} two over it
//! passes = 0.01                               # from a value that passes
//! fails = 1.0                                 # to one that fails,
//! ratio = 1.1                                 # until they are that near
//! seconds = 1.0                               # of the shot
//! unit = "s"
//! [[limit.mark]]
//! of = "energy_gain"
//! at_most = 0.05
//! ```

mod quantity;
mod spec;

use glam::DVec3;

use super::{
    super::{Method, Scene, error::SceneError},
    RunsOn,
};
use swell_domain::bounds::Bounds;

pub use quantity::{About, Over, Quantity};
pub(super) use spec::parse;

/// A validated study of stability.
#[derive(Clone, Debug)]
pub struct Stability {
    /// In the reader's words, for the page; paragraphs.
    pub about: Vec<String>,
    /// In the order of the file.
    pub cases: Vec<Case>,
    /// In the order of the file.
    pub limits: Vec<Limit>,
}

impl Stability {
    /// Visits the scenes of its cases, and of its limits where they should pass.
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

/// Something hard.
#[derive(Clone, Debug)]
pub struct Case {
    /// Of the list that it is from; several may have one.
    pub number: u32,
    /// In words.
    pub name: String,
    /// Further words, for the page.
    pub note: Option<String>,
    /// How it is held.
    pub held: Held,
}

/// By what a case is held.
#[derive(Clone, Debug)]
pub enum Held {
    /// By the test that this command runs.
    Test(String),
    /// By runs, one a solver and device.
    Runs(Vec<Trial>),
    /// By a refusal of each scene; all of these words stand in the message.
    Refusal {
        /// By solver.
        attempts: Vec<Attempt>,
        /// Parts of the message.
        words: Vec<String>,
    },
}

/// A scene that is to be refused.
#[derive(Clone, Debug)]
pub struct Attempt {
    /// The solver.
    pub method: Method,
    /// What it runs on where it loads after all.
    pub device: RunsOn,
    /// What loading it came to, in words where it failed.
    pub scene: Result<Box<Scene>, String>,
}

/// A run with its pass marks.
#[derive(Clone, Debug)]
pub struct Trial {
    /// What it runs on.
    pub device: RunsOn,
    /// With every override laid over it.
    pub scene: Scene,
    /// Output frames to run.
    pub frames: u32,
    /// Runs beside it.
    pub others: Vec<Other>,
    /// Those of its solver and device.
    pub marks: Vec<Mark>,
}

/// A run that another is held against.
#[derive(Clone, Debug)]
pub struct Other {
    /// What it runs on.
    pub device: RunsOn,
    /// Its scene.
    pub scene: Scene,
    /// Its lengths over those of the run.
    pub scale: f64,
    /// Its origin, metres.
    pub shift: DVec3,
}

/// What is measured, and what it has to be.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// What is measured.
    pub of: Quantity,
    /// What it has to be.
    pub bound: Bound,
    /// Seconds of the shot that do not count.
    pub after: f64,
    /// Seconds of the shot from which what is held against the start is held against the state then; sooner does not
    /// count.
    pub since: Option<f64>,
    /// Only what starts in this box.
    pub region: Option<Bounds>,
    /// Why it is missed.
    pub known_failure: Option<String>,
}

/// A side that a number has to be on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// Not more.
    AtMost(f64),
    /// Not less.
    AtLeast(f64),
}

impl Bound {
    /// Whether a number is on the right side; what is no number is not.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::AtMost(most) => value <= most,
            Self::AtLeast(least) => value >= least,
        }
    }

    /// The one of two that is farther on the wrong side; what is no number is the farthest.
    pub fn worse(self, a: f64, b: f64) -> f64 {
        match self {
            _ if a.is_nan() || b.is_nan() => f64::NAN,
            Self::AtMost(_) => a.max(b),
            Self::AtLeast(_) => a.min(b),
        }
    }

    /// The number itself.
    pub fn value(self) -> f64 {
        match self {
            Self::AtMost(value) | Self::AtLeast(value) => value,
        }
    }
}

/// How far a setting goes.
#[derive(Clone, Debug)]
pub struct Limit {
    /// In words.
    pub name: String,
    /// Further words, for the page.
    pub note: Option<String>,
    /// Of the setting.
    pub unit: String,
    /// One a solver.
    pub searches: Vec<Search>,
    /// A value that should pass.
    pub passes: f64,
    /// A value that should fail.
    pub fails: f64,
    /// How near the two come, above 1.
    pub ratio: f64,
}

/// A limit of one solver; values make scenes as they are tried.
#[derive(Clone, Debug)]
pub struct Search {
    /// The solver.
    pub method: Method,
    template: spec::Template,
}

impl Search {
    /// The run at a value.
    ///
    /// # Errors
    /// A scene that the value makes impossible.
    pub fn trial(&self, value: f64) -> Result<Trial, SceneError> {
        self.template.trial(self.method, value)
    }
}
