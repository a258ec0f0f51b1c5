//! `--log FILE`: copies standard error and progress to a file, each line with its time.

use std::{
    fs::File,
    io::{self, Write as _},
    path::Path,
    sync::{Mutex, PoisonError},
    time::SystemTime,
};

/// The log file, if one was requested.
static LOG: Mutex<Option<File>> = Mutex::new(None);

/// Opens the log; everything from now on is appended to it. Several processes may write to one
/// file.
///
/// # Errors
/// The system's error.
pub(super) fn open(file: &Path) -> io::Result<()> {
    let file = File::options().append(true).create(true).open(file)?;
    *LOG.lock().unwrap_or_else(PoisonError::into_inner) = Some(file);
    Ok(())
}

/// Appends text with the time on each line; does nothing without a log file.
///
/// # Errors
/// The system's error.
pub(super) fn write(text: &str) -> io::Result<()> {
    let mut log = LOG.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(file) = &mut *log else {
        return Ok(());
    };
    let time = humantime::format_rfc3339_seconds(SystemTime::now());
    let lines = text.lines().map(|line| format!("{time} {line}\n"));
    // In a single write, so that lines of several processes do not mix.
    file.write_all(lines.collect::<String>().as_bytes())
}
