//! The one way in which a command writes to the terminal.
//!
//! A write that fails never ends the work that is under way. It is remembered, as by `close_stdout` of GNU coreutils, and at
//! the end the exit code says it: [`exit_code`]. A closed pipe (`swell inspect CACHE | head`) is no failure: its reader has
//! what it wanted, what is left is dropped, and the exit code is that of the result; but for events, which are promised whole.

use std::{
    io::{self, ErrorKind, Write},
    path::Path,
    process::ExitCode,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use serde_json::{Value, json};

use super::{log, progress::Progress};
use crate::{
    domain::solver::PassTime,
    stage::{device::PassTimes, time::Share},
};

/// The exit code where a file cannot be written; standard output is one.
const CANNOT_WRITE: u8 = 4;

const STDOUT: &str = "standard output";
const STDERR: &str = "standard error";

/// The first write that failed: which stream, and the system's words.
static FAILED: Mutex<Option<(&str, io::Error)>> = Mutex::new(None);
/// Whether an event could not be written.
static IS_SHORT: AtomicBool = AtomicBool::new(false);

/// Writes an event to standard output, a line. A stream of events is whole or short: behind one that could not be written comes
/// none, and a closed pipe is a fault as any other, for whoever asked for events has not got them.
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

/// Writes to standard output what a command is asked for.
pub(super) fn print(text: &str) {
    note(STDOUT, put(&mut io::stdout().lock(), text));
}

/// Tells what passes took: a line each with milliseconds, runs, seconds in all, bytes a second that they moved at least and which part of the
/// adapter's that is; behind them what each part took of so many frames.
pub(super) fn pass_times(progress: &Progress, times: &PassTimes, parts: &[Share], frames: u32) {
    let PassTimes { passes, bandwidth } = times;
    if passes.is_empty() {
        return;
    }
    if progress.is_json() {
        return progress.tell(json!({
            "event": "passes", "passes": passes.iter().map(pass_json).collect::<Vec<_>>(), "parts": parts_json(parts),
            "bandwidth": bandwidth,
        }));
    }
    print_pass_times(passes, *bandwidth);
    let runs: u64 = passes.iter().map(|time| time.runs).sum();
    let each = runs as f64 / f64::from(frames.max(1));
    print(&format!("\n{runs} runs of passes, {each:.0} a frame"));
    if let Some(all) = bandwidth {
        print(&format!(
            "; per cent are of {:.2} GB/s, at which a pass copies a buffer here, and a pass is taken to move what it binds once",
            1e-9 * all
        ));
    }
    print("\n");
    if !parts.is_empty() {
        print(&format!("\n{}", shares(parts, Some(frames))));
    }
}

fn pass_json(time: &PassTime) -> Value {
    let bytes = (time.bytes > 0).then_some(time.bytes);
    json!({ "pass": time.pass, "seconds": time.seconds, "runs": time.runs, "bytes": bytes })
}

/// What passes and buffers are there for, for programs.
pub(super) fn parts_json(parts: &[Share]) -> Vec<Value> {
    let part = |part: &Share| {
        json!({
            "part": part.owner, "passes": part.passes, "bytes": part.bytes, "seconds": part.seconds,
        })
    };
    parts.iter().map(part).collect()
}

fn print_pass_times(passes: &[PassTime], bandwidth: Option<f64>) {
    for time in passes {
        let PassTime {
            pass,
            seconds,
            runs,
            bytes,
        } = time;
        let each = 1e3 * seconds / *runs as f64;
        let rate = *bytes as f64 / seconds;
        let moved = match bandwidth {
            Some(all) if *bytes > 0 => {
                format!("  {:7.2} GB/s, {:3.0} %", 1e-9 * rate, 100.0 * rate / all)
            }
            _ => String::new(),
        };
        print(&format!(
            "{pass:28} {each:9.3} ms × {runs:6} = {seconds:8.3} s{moved}\n"
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
    note(STDERR, put(&mut io::stderr().lock(), &format!("{line}\n")));
    log(line);
}

/// Writes lines to the file of `--log` alone.
pub(super) fn log(text: &str) {
    if let Err(error) = log::write(text) {
        remember("the log", error);
    }
}

/// Remembers how a write to a stream went that was made elsewhere.
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

/// What the exit code is where work ended with `code`: 4 in place of 0 and 1 where something could not be written. A code of a
/// graver fault stays.
pub(super) fn code(code: u8) -> u8 {
    let failed = FAILED.lock().unwrap_or_else(PoisonError::into_inner);
    match failed.is_some() && code <= 1 {
        true => CANNOT_WRITE,
        false => code,
    }
}

/// Exit code of the process whose work ended with `code`, as [`code`]; says what could not be written.
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
