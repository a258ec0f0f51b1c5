//! `--deny lint`

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use swell_stage::bake::BakePlan;

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
    /// Refuses the planned scene of `file` if `--deny lint` is given and there are lints.
    pub(super) fn check(&self, file: &Path, plan: &BakePlan<'_>) -> Result<(), Failure> {
        let lints = match self.deny {
            Some(Denied::Lint) => plan.lints(),
            None => return Ok(()),
        };
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
