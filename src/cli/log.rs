//! `--log FILE`: what goes to standard error, and progress, also into a file, a line with its time each.

use std::{
    fs::File,
    io::{self, Write as _},
    path::Path,
    sync::{Mutex, PoisonError},
    time::SystemTime,
};

/// The file, where one was asked for.
static LOG: Mutex<Option<File>> = Mutex::new(None);

/// Has everything from here on written behind what the file holds. Several processes may write into one.
///
/// # Errors
/// The system's.
pub(super) fn open(file: &Path) -> io::Result<()> {
    let file = File::options().append(true).create(true).open(file)?;
    *LOG.lock().unwrap_or_else(PoisonError::into_inner) = Some(file);
    Ok(())
}

/// Writes text, each of its lines with the time; nothing without a file.
///
/// # Errors
/// The system's.
pub(super) fn write(text: &str) -> io::Result<()> {
    let mut log = LOG.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(file) = &mut *log else {
        return Ok(());
    };
    let time = humantime::format_rfc3339_seconds(SystemTime::now());
    let lines = text.lines().map(|line| format!("{time} {line}\n"));
    // In one piece, so that lines of several processes do not mix.
    file.write_all(lines.collect::<String>().as_bytes())
}
