//! All output of a command to the terminal.
//!
//! A failed write never ends the work in progress. Like `close_stdout` of GNU coreutils, it is
//! remembered and reflected in the exit code at the end: [`exit_code`]. A closed pipe (`swell
//! inspect CACHE | head`) is not a failure: its reader has what it wanted, the rest is dropped, and
//! the exit code is that of the result. Events are the exception, because they are guaranteed to be
//! complete.

use std::{
    io::{self, ErrorKind, Write},
    path::Path,
    process::ExitCode,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use serde_json::Value;

use super::{count, log, size};
use swell_scene::four_digits;
use swell_stage::prepare::{ShapeCost, Volume};

/// Exit code if a file cannot be written; standard output counts as one.
const CANNOT_WRITE: u8 = 4;

const STDOUT: &str = "standard output";
const STDERR: &str = "standard error";

/// The first write that failed: the stream and the system's error.
static FAILED: Mutex<Option<(&str, io::Error)>> = Mutex::new(None);
/// Whether an event could not be written.
static IS_SHORT: AtomicBool = AtomicBool::new(false);

/// Volume of water at a start, and the volume that the scene asks for.
pub(super) fn water(volume: Volume) -> String {
    let made = format!("{} m³", four_digits(volume.made));
    match volume.asked {
        Some(asked) => format!("{made} of water of {} m³ asked for", four_digits(asked)),
        None => format!("{made} of water"),
    }
}

/// What a solid whose shape changes takes.
pub(super) fn shape(cost: &ShapeCost) -> String {
    let from = match cost.files {
        0 => "moves with the waves".to_owned(),
        files => count(files as u64, "mesh file"),
    };
    format!(
        "{}: {from}; distances at {}, {} on the device and {} in memory, sampled again {} in the \
         shot",
        cost.name,
        count(cost.nodes as u64, "node"),
        size(cost.device_bytes() as u64),
        size(cost.bytes as u64),
        count(cost.times as u64, "time"),
    )
}

/// Writes an event to standard output as one line. A stream of events is complete up to a point:
/// none follows one that could not be written, and a closed pipe is an error, because the reader
/// missed events.
pub(super) fn event(event: &Value) {
    if IS_SHORT.load(Ordering::Relaxed) {
        return;
    }
    let written = put(&mut io::stdout().lock(), &format!("{event}\n"));
    if let Err(error) = written {
        IS_SHORT.store(true, Ordering::Relaxed);
        remember(STDOUT, error);
    }
}

/// Writes a command's result to standard output.
pub(super) fn print(text: &str) {
    note(STDOUT, put(&mut io::stdout().lock(), text));
}

/// Writes a line to standard error: progress and messages to the user.
pub(super) fn say(line: &str) {
    note(STDERR, put(&mut io::stderr().lock(), &format!("{line}\n")));
    log(line);
}

/// Writes lines only to the file of `--log`.
pub(super) fn log(text: &str) {
    if let Err(error) = log::write(text) {
        remember("the log", error);
    }
}

/// Records the result of a write to a stream that was made elsewhere.
pub(super) fn note(stream: &'static str, written: io::Result<()>) {
    match written {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => remember(stream, error),
        _ => {}
    }
}

fn remember(stream: &'static str, error: io::Error) {
    let mut failed = FAILED.lock().unwrap_or_else(PoisonError::into_inner);
    failed.get_or_insert((stream, error));
}

fn put(out: &mut impl Write, text: &str) -> io::Result<()> {
    out.write_all(text.as_bytes())?;
    out.flush()
}

/// The exit code of work that ended with `code`: 4 replaces 0 and 1 if something could not be
/// written. More serious codes stay.
pub(super) fn code(code: u8) -> u8 {
    let failed = FAILED.lock().unwrap_or_else(PoisonError::into_inner);
    match failed.is_some() && code <= 1 {
        true => CANNOT_WRITE,
        false => code,
    }
}

/// Exit code of the process whose work ended with `code`, as in [`code`]; reports what could not be
/// written.
pub(super) fn exit_code(code: u8) -> ExitCode {
    let failed = FAILED.lock().unwrap_or_else(PoisonError::into_inner).take();
    let Some((stream, error)) = failed else {
        return ExitCode::from(code);
    };
    // If standard error itself fails, only the exit code can tell.
    let said = format!("swell: cannot write to {stream}: {error}\n");
    let _ = put(&mut io::stderr().lock(), &said);
    ExitCode::from(if code <= 1 { CANNOT_WRITE } else { code })
}

/// A path for JSON, which must be UTF-8: invalid bytes become U+FFFD.
pub(super) fn path(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}
