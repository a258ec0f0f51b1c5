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

use serde_json::{Value, json};

use super::{log, progress::Progress};
use swell_domain::solver::PassTime;
use swell_scene::four_digits;
use swell_stage::{
    device::{Ceilings, PassTimes, Reached},
    prepare::Volume,
    time::Share,
};

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

/// Reports times of passes, one line each: milliseconds, runs, total seconds, least bytes moved and
/// operations per second, their fractions of the adapter's ceilings, and what limits the pass; then
/// the share of each part per frame, over `frames` frames.
pub(super) fn pass_times(progress: &Progress, times: &PassTimes, parts: &[Share], frames: u32) {
    let PassTimes {
        passes,
        ceilings,
        traffic,
    } = times;
    if passes.is_empty() {
        return;
    }
    if progress.is_json() {
        let rows = passes.iter().map(|time| pass_json(time, ceilings.as_ref()));
        return progress.tell(json!({
            "event": "passes", "passes": rows.collect::<Vec<_>>(), "parts": parts_json(parts),
            "bandwidth": ceilings.map(|of| of.bandwidth),
            "arithmetic": ceilings.map(|of| of.arithmetic),
            "start": ceilings.map(|of| of.start),
            "submissions": traffic.map(|of| of.submissions), "waits": traffic.map(|of| of.waits),
            "bytes_read": traffic.map(|of| of.bytes_read),
        }));
    }
    print_pass_times(passes, ceilings.as_ref());
    let runs: u64 = passes.iter().map(|time| time.runs).sum();
    let per_frame = |count: u64| count as f64 / f64::from(frames.max(1));
    print(&format!(
        "\n{runs} runs of passes, {:.0} a frame",
        per_frame(runs)
    ));
    if let Some(traffic) = traffic {
        print(&format!(
            "; without timing {:.1} submissions a frame, {:.1} waits for the device, {:.0} bytes \
             read back",
            per_frame(traffic.submissions),
            per_frame(traffic.waits),
            per_frame(traffic.bytes_read)
        ));
    }
    if let Some(Ceilings {
        bandwidth,
        arithmetic,
        start,
    }) = ceilings
    {
        print(&format!(
            "; per cent are of {:.2} GB/s, at which a pass copies a buffer here, where a pass is \
             taken to move what it binds once, and of {:.1} Gop/s, which one does that only \
             multiplies and adds; one without work takes {:.3} ms",
            1e-9 * bandwidth,
            1e-9 * arithmetic,
            1e3 * start
        ));
    }
    print("\n");
    if !parts.is_empty() {
        print(&format!("\n{}", shares(parts, Some(frames))));
    }
}

fn pass_json(time: &PassTime, ceilings: Option<&Ceilings>) -> Value {
    let bytes = (time.bytes > 0).then_some(time.bytes);
    let [floats, integers] = [0, 1].map(|kind| time.operations.map(|counted| counted[kind]));
    let waits_for = ceilings.and_then(|ceilings| Reached::of(time, ceilings).waits_for);
    json!({
        "pass": time.pass, "seconds": time.seconds, "runs": time.runs, "bytes": bytes,
        "float_operations": floats, "integer_operations": integers, "waits_for": waits_for,
    })
}

/// Passes and buffers by purpose, for programs.
pub(super) fn parts_json(parts: &[Share]) -> Vec<Value> {
    let part = |part: &Share| {
        json!({
            "part": part.owner, "passes": part.passes, "bytes": part.bytes, "seconds": part.seconds,
        })
    };
    parts.iter().map(part).collect()
}

fn print_pass_times(passes: &[PassTime], ceilings: Option<&Ceilings>) {
    for time in passes {
        let PassTime {
            pass,
            seconds,
            runs,
            ..
        } = time;
        let each = 1e3 * seconds / *runs as f64;
        let of = ceilings.map(|ceilings| (ceilings, Reached::of(time, ceilings)));
        let reached = of.map_or(String::new(), |(ceilings, reached)| {
            let part = |part: Option<f64>, ceiling: f64, unit: &str| {
                let text = |part: f64| {
                    let rate = 1e-9 * part * ceiling;
                    format!("  {rate:7.2} {unit}, {:3.0} %", 100.0 * part)
                };
                part.map_or(String::new(), text)
            };
            let memory = part(reached.memory, ceilings.bandwidth, "GB/s");
            let arithmetic = part(reached.arithmetic, ceilings.arithmetic, "Gop/s");
            let waits_for = reached
                .waits_for
                .map_or(String::new(), |what| format!("  {what}"));
            format!("{memory}{arithmetic}{waits_for}")
        });
        print(&format!(
            "{pass:28} {each:9.3} ms × {runs:6} = {seconds:8.3} s{reached}\n"
        ));
    }
}

/// One line per purpose: passes, bytes and, if passes were timed, milliseconds per frame over
/// `frames` frames.
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
