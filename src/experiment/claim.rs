//! Which study a folder of results belongs to: pages and lines of two studies in one folder would mix.

use std::{fs, io, path::Path};

use serde::{Deserialize, Serialize};

use super::StudyError;

/// Names the study, beside its results.
pub(super) const FILE: &str = "study.json";

#[derive(Serialize, Deserialize)]
struct Claim {
    /// Of the study, as its file is called.
    study: String,
}

/// Takes an empty folder, or one with results that name no study, for the study `name`.
///
/// # Errors
/// [`StudyError::OtherStudy`]; a file that cannot be read or written.
pub(super) fn take(directory: &Path, name: &str) -> Result<(), StudyError> {
    let file = directory.join(FILE);
    let fault = |source| StudyError::File {
        file: file.clone(),
        source,
    };
    match fs::read(&file) {
        Ok(text) => {
            let claim: Claim = serde_json::from_slice(&text)
                .map_err(|error| fault(io::Error::other(error.to_string())))?;
            if claim.study == name {
                return Ok(());
            }
            Err(StudyError::OtherStudy {
                directory: directory.to_owned(),
                found: claim.study,
                name: name.to_owned(),
            })
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            fs::create_dir_all(directory).map_err(fault)?;
            let is_used = fs::read_dir(directory).map_err(fault)?.next().is_some();
            if is_used && !directory.join("results.jsonl").exists() {
                // Whoever opens the results says what is off.
                return Ok(());
            }
            let claim = Claim {
                study: name.to_owned(),
            };
            let text = serde_json::to_string(&claim).map_err(|error| fault(error.into()))?;
            fs::write(&file, text + "\n").map_err(fault)
        }
        Err(error) => Err(fault(error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_one_study_s() {
        let folder = tempfile::tempdir().expect("a folder");
        let directory = folder.path().join("new");
        take(&directory, "dt").expect("new");
        take(&directory, "dt").expect("its own");
        let error = take(&directory, "resolution").expect_err("another's");
        let said = error.to_string();
        assert!(
            said.contains("the study dt, not of resolution") && said.contains("-o"),
            "{said}"
        );
        // Results of a program that named no study are gone on with.
        fs::remove_file(directory.join(FILE)).expect("there");
        fs::write(directory.join("results.jsonl"), "").expect("written");
        take(&directory, "dt").expect("older results");
        take(&directory, "resolution").expect_err("taken now");
        // Others' files are left alone.
        let other = folder.path().join("other");
        fs::create_dir(&other).expect("new");
        fs::write(other.join("notes.txt"), "mine").expect("written");
        take(&other, "dt").expect("left to others");
        assert!(!other.join(FILE).exists());
    }
}
