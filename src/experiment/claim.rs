//! Records which study a results folder belongs to, because pages and lines of two studies must not
//! mix.

use std::{fs, io, path::Path};

use swell_domain::output::{AtPath as _, FileError, Lock, names};
use swell_study::folder::{CLAIM, Claim, is_ledger};

use super::StudyError;

/// Claims a folder for the study `name`, which `command` runs as a whole. The folder may be empty
/// or hold results without a claim. Any number of processes may call this at once: the claim file
/// is locked while it is read and written.
///
/// # Errors
/// [`StudyError::OtherStudy`] if another study owns the folder, and [`StudyError::File`] if a file
/// cannot be read or written.
pub(super) fn take(directory: &Path, name: &str, command: &str) -> Result<(), StudyError> {
    let file = directory.join(CLAIM);
    let names = names(directory)?;
    if !names.is_empty() && !names.iter().any(|name| name == CLAIM || is_ledger(name)) {
        // Opening the results reports what is wrong with the folder.
        return Ok(());
    }
    // An existing claim is only read, because the file may belong to another user.
    let written = fs::read(&file).ok();
    let written = written.and_then(|text| serde_json::from_slice(&text).ok());
    let claim: Claim = match written {
        Some(claim) => claim,
        None => write(&file, name, command)?,
    };
    if claim.study == name {
        return Ok(());
    }
    Err(StudyError::OtherStudy {
        directory: directory.to_owned(),
        found: claim.study,
        name: name.to_owned(),
    })
}

/// Writes the claim, or reads it if another process has just written it.
fn write(file: &Path, name: &str, command: &str) -> Result<Claim, FileError> {
    let record = Lock::wait(file)?;
    let text = record.read()?;
    if !text.is_empty() {
        let claim = serde_json::from_str(&text).map_err(|error| {
            io::Error::other(format!(
                "{error}: it was truncated or changed; remove it if the folder holds results of \
                 {name}, or choose another folder"
            ))
        });
        return claim.at(file);
    }
    let claim = Claim {
        study: name.to_owned(),
        command: Some(command.to_owned()),
    };
    let text = serde_json::to_string(&claim).map_err(io::Error::from);
    record.write(&(text.at(file)? + "\n"))?;
    Ok(claim)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_one_study_s() {
        let folder = tempfile::tempdir().expect("a folder");
        let directory = folder.path().join("new");
        let take =
            |directory: &Path, name: &str| take(directory, name, &format!("swell study {name}"));
        take(&directory, "dt").expect("new");
        take(&directory, "dt").expect("its own");
        let error = take(&directory, "resolution").expect_err("another's");
        let said = error.to_string();
        assert!(
            said.contains("the study dt, not of resolution") && said.contains("another folder"),
            "{said}"
        );
        let claim = |directory: &Path| -> Claim {
            let text = fs::read_to_string(directory.join(CLAIM)).expect("there");
            serde_json::from_str(&text).expect("whole")
        };
        assert_eq!(claim(&directory).command.as_deref(), Some("swell study dt"));
        // The error about a truncated claim says how to fix it.
        fs::write(directory.join(CLAIM), "{\"study\":\"d").expect("written");
        let error = take(&directory, "dt").expect_err("cut off");
        let said = std::error::Error::source(&error)
            .expect("a cause")
            .to_string();
        assert!(
            said.contains("remove it if the folder holds results of dt"),
            "{said}"
        );
        // Results without a claim are resumed.
        fs::remove_file(directory.join(CLAIM)).expect("there");
        fs::write(directory.join("results.jsonl"), "").expect("written");
        take(&directory, "dt").expect("older results");
        take(&directory, "resolution").expect_err("taken now");
        // A folder with foreign files is left alone.
        let other = folder.path().join("other");
        fs::create_dir(&other).expect("new");
        fs::write(other.join("notes.txt"), "mine").expect("written");
        take(&other, "dt").expect("left to others");
        assert!(!other.join(CLAIM).exists());
    }
}
