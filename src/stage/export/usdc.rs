//! Binary USD, written by OpenUSD's own library through an optional Python. swell itself writes USD
//! as text.

use std::{
    path::Path,
    process::{Command, Stdio},
};

/// Exports the layer of the first file to the second one.
const CONVERT: &str = "import sys\nfrom pxr import Sdf\n\
    layer = Sdf.Layer.FindOrOpen(sys.argv[1])\n\
    sys.exit(0 if layer and layer.Export(sys.argv[2]) else 1)\n";

/// Why binary USD cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum UsdcError {
    /// There is no Python with usd-core.
    #[error(
        "a name that ends in .usdc needs Python with usd-core (pip install usd-core), and \
         `{python}` has none: {why}; name another Python, or write .usda"
    )]
    Missing {
        /// The program that was tried.
        python: String,
        /// Last line of its error output.
        why: String,
    },
    /// The conversion of a layer failed.
    #[error("{python} could not write {file}: {why}")]
    Failed {
        /// The program.
        python: String,
        /// The file.
        file: String,
        /// Last line of its error output.
        why: String,
    },
}

/// A Python interpreter that has usd-core.
#[derive(Clone, Debug)]
pub(super) struct Python(String);

impl Python {
    /// Checks that the interpreter can import usd-core.
    ///
    /// # Errors
    /// [`UsdcError::Missing`].
    pub(super) fn with_usd(python: &str) -> Result<Self, UsdcError> {
        match run(python, &["-c", "from pxr import Sdf"]) {
            Ok(()) => Ok(Self(python.to_owned())),
            Err(why) => Err(UsdcError::Missing {
                python: python.to_owned(),
                why,
            }),
        }
    }

    /// Converts a text layer.
    ///
    /// # Errors
    /// [`UsdcError::Failed`].
    pub(super) fn convert(&self, from: &Path, to: &Path) -> Result<(), UsdcError> {
        let [from, to] = [from, to].map(|path| path.to_string_lossy().into_owned());
        run(&self.0, &["-c", CONVERT, &from, &to]).map_err(|why| UsdcError::Failed {
            python: self.0.clone(),
            file: to,
            why,
        })
    }
}

/// Runs the interpreter; the last line of its error output if it fails.
fn run(python: &str, arguments: &[&str]) -> Result<(), String> {
    let ran = Command::new(python)
        .args(arguments)
        .stdin(Stdio::null())
        .output();
    match ran {
        Err(error) => Err(error.to_string()),
        Ok(output) if output.status.success() => Ok(()),
        Ok(output) => {
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            let last = said.lines().rfind(|line| !line.trim().is_empty());
            Err(last.unwrap_or("it said nothing").trim().to_owned())
        }
    }
}
