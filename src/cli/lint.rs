//! `--deny lint`

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use swell_scene::Scene;
use swell_stage::prepare::Start;

use super::Failure;

#[derive(Args, Debug)]
pub(super) struct DenyArgs {
    /// Refuse a scene, with exit code 2, where it is allowed but hardly what was meant; otherwise
    /// such findings are warnings.
    #[arg(long, value_name = "WHAT")]
    deny: Option<Denied>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Denied {
    /// What `swell inspect SCENE` warns of, each with the number that it was judged by.
    Lint,
}

/// A scene that was refused.
#[derive(Debug, thiserror::Error)]
#[error("{}: denied by --deny lint:\n  {}", source_file.display(), lints.join("\n  "))]
struct Refused {
    source_file: PathBuf,
    lints: Vec<String>,
}

impl DenyArgs {
    /// Refuses `scene` of `file` if `--deny lint` is given and there are lints. `is_start` says
    /// whether it begins with its own water.
    pub(super) fn check(&self, file: &Path, scene: &Scene, is_start: bool) -> Result<(), Failure> {
        let mut lints = match self.deny {
            Some(Denied::Lint) => scene.lints(),
            None => return Ok(()),
        };
        let start = Start::of(scene)?;
        lints.extend(match is_start {
            true => start.lints(scene),
            false => start.lint_emitters(scene),
        });
        if lints.is_empty() {
            return Ok(());
        }
        let error = Refused {
            source_file: file.to_owned(),
            lints,
        };
        Err(Failure {
            code: 2,
            error: Box::new(error),
        })
    }
}
