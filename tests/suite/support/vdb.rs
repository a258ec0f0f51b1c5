//! OpenVDB's own reader.
use std::{collections::BTreeMap, fs, process::Command};

/// Parses what `vdb_print -l` prints about each grid, by key, or returns its error output.
pub fn vdb_print(bytes: &[u8]) -> Result<BTreeMap<String, BTreeMap<String, String>>, String> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.vdb");
    fs::write(&path, bytes).unwrap();
    let output = Command::new("vdb_print")
        .arg("-l")
        .arg(&path)
        .output()
        .expect("tests need OpenVDB's vdb_print; tools/test installs it (libopenvdb-tools)");
    if !output.status.success() || !output.stderr.is_empty() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned());
    }
    let text = String::from_utf8(output.stdout).unwrap();
    let grids = text.split("Name: ").skip(1).map(|part| {
        let (name, rest) = part.split_once('\n').unwrap();
        let keys = rest
            .lines()
            .filter_map(|line| line.split_once(':'))
            .map(|(key, value)| (key.trim().to_owned(), value.trim().to_owned()));
        (name.to_owned(), keys.collect())
    });
    Ok(grids.collect())
}
