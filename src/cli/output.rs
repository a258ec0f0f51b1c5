//! The one way in which a command writes to the terminal.
//!
//! A write that fails never ends the work that is under way. It is remembered, as by `close_stdout` of GNU coreutils, and at
//! the end the exit code says it: [`exit_code`]. A closed pipe (`swell inspect CACHE | head`) is no failure: its reader has
//! what it wanted, what is left is dropped, and the exit code is that of the result.

use std::{
    io::{self, ErrorKind, Write},
    path::Path,
    process::ExitCode,
    sync::{Mutex, PoisonError},
};

use crate::stage::time::Share;

/// The exit code where a file cannot be written; standard output is one.
const CANNOT_WRITE: u8 = 4;

/// The first write that failed: which stream, and the system's words.
static FAILED: Mutex<Option<(&str, io::Error)>> = Mutex::new(None);

/// Writes to standard output what a command is asked for.
pub(super) fn print(text: &str) {
    note("standard output", put(&mut io::stdout().lock(), text));
}

/// Prints a line a pass: milliseconds each, runs, seconds in all.
pub(super) fn print_pass_times(passes: &[(&'static str, f64, u64)]) {
    for (pass, seconds, runs) in passes {
        let each = 1e3 * seconds / *runs as f64;
        print(&format!(
            "{pass:28} {each:9.3} ms × {runs:6} = {seconds:8.3} s\n"
        ));
    }
}

/// A line for each thing that passes and buffers are there for: passes, bytes, and milliseconds of each of so many frames where they
/// were timed.
pub(super) fn shares(shares: &[Share], frames: Option<u32>) -> String {
    let all: f64 = shares.iter().map(|share| share.seconds).sum();
    let mut text = format!("{:24}  passes         bytes", "for");
    text += if frames.is_some() {
        "  ms a frame\n"
    } else {
        "\n"
    };
    for share in shares {
        text += &format!("{:24}  {:6}  {:12}", share.owner, share.passes, share.bytes);
        if let Some(frames) = frames {
            let each = 1e3 * share.seconds / f64::from(frames.max(1));
            let part = 100.0 * share.seconds / all.max(f64::MIN_POSITIVE);
            text += &format!("  {each:10.3}  {part:5.1} %");
        }
        text += "\n";
    }
    text
}

/// Writes a line to standard error: progress, and what a user has to know.
pub(super) fn say(line: &str) {
    note(
        "standard error",
        put(&mut io::stderr().lock(), &format!("{line}\n")),
    );
}

/// Remembers how a write to a stream went that was made elsewhere.
pub(super) fn note(stream: &'static str, written: io::Result<()>) {
    match written {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            let mut failed = FAILED.lock().unwrap_or_else(PoisonError::into_inner);
            failed.get_or_insert((stream, error));
        }
        _ => {}
    }
}

fn put(out: &mut impl Write, text: &str) -> io::Result<()> {
    out.write_all(text.as_bytes())?;
    out.flush()
}

/// Exit code of the process whose work ended with `code`: 4 in place of 0 and 1 where something could not be written. A
/// code of a graver fault stays.
pub(super) fn exit_code(code: u8) -> ExitCode {
    let failed = FAILED.lock().unwrap_or_else(PoisonError::into_inner).take();
    let Some((stream, error)) = failed else {
        return ExitCode::from(code);
    };
    // Where standard error itself fails, the exit code has to do.
    let said = format!("swell: cannot write to {stream}: {error}\n");
    let _ = put(&mut io::stderr().lock(), &said);
    ExitCode::from(if code <= 1 { CANNOT_WRITE } else { code })
}

/// A path for JSON, which holds UTF-8 alone: bytes that are none become U+FFFD.
pub(super) fn path(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}
