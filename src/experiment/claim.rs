//! Which study a folder of results belongs to: pages and lines of two studies in one folder would mix.

use std::{
    fs,
    io::{self, Read as _, Write as _},
    path::Path,
};

use serde::{Deserialize, Serialize};

use crate::stage::locked;

use super::{
    StudyError,
    ledger::{is_ledger, names},
};

/// Names the study, beside its results.
pub(super) const FILE: &str = "study.json";

#[derive(Serialize, Deserialize)]
struct Claim {
    /// Of the study, as its file is called.
    study: String,
}

/// Takes an empty folder, or one with results that name no study, for the study `name`. Any number of processes may do so at
/// once: the file is locked while it is read and written.
///
/// # Errors
/// [`StudyError::OtherStudy`]; a file that cannot be read or written.
pub(super) fn take(directory: &Path, name: &str) -> Result<(), StudyError> {
    let file = directory.join(FILE);
    let fault = |source| StudyError::File {
        file: file.clone(),
        source,
    };
    fs::create_dir_all(directory).map_err(fault)?;
    let names = names(directory).map_err(fault)?;
    if !names.is_empty() && !names.iter().any(|name| name == FILE || is_ledger(name)) {
        // Whoever opens the results says what is off.
        return Ok(());
    }
    let mut record = locked::open(&file).map_err(fault)?;
    record.lock().map_err(fault)?;
    let mut text = String::new();
    record.read_to_string(&mut text).map_err(fault)?;
    if text.is_empty() {
        let claim = Claim {
            study: name.to_owned(),
        };
        let text = serde_json::to_string(&claim).map_err(|error| fault(error.into()))?;
        return record.write_all((text + "\n").as_bytes()).map_err(fault);
    }
    let claim: Claim =
        serde_json::from_str(&text).map_err(|error| fault(io::Error::other(error.to_string())))?;
    if claim.study == name {
        return Ok(());
    }
    Err(StudyError::OtherStudy {
        directory: directory.to_owned(),
        found: claim.study,
        name: name.to_owned(),
    })
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
