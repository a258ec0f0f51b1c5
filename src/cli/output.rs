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
use swell_domain::solver::PassTime;
use swell_scene::four_digits;
use swell_stage::{
    device::{Ceilings, PassTimes, Reached},
    prepare::Volume,
    time::Share,
};

/// The exit code where a file cannot be written; standard output is one.
const CANNOT_WRITE: u8 = 4;

const STDOUT: &str = "standard output";
const STDERR: &str = "standard error";

/// The first write that failed: which stream, and the system's words.
static FAILED: Mutex<Option<(&str, io::Error)>> = Mutex::new(None);
/// Whether an event could not be written.
static IS_SHORT: AtomicBool = AtomicBool::new(false);

/// How much water there is at a start, and how much the scene asks for.
pub(super) fn water(volume: Volume) -> String {
    let made = format!("{} m³", four_digits(volume.made));
    match volume.asked {
        Some(asked) => format!("{made} of water of {} m³ asked for", four_digits(asked)),
        None => format!("{made} of water"),
    }
}

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

/// Tells what passes took: a line each with milliseconds, runs, seconds in all, bytes that they moved at least and operations that they did a
/// second, which part of the adapter's that is, and what it waits for; behind them what each part took of so many frames.
pub(super) fn pass_times(progress: &Progress, times: &PassTimes, parts: &[Share], frames: u32) {
    let PassTimes { passes, ceilings } = times;
    if passes.is_empty() {
        return;
    }
    if progress.is_json() {
        let rows = passes.iter().map(|time| pass_json(time, ceilings.as_ref()));
        return progress.tell(json!({
            "event": "passes", "passes": rows.collect::<Vec<_>>(), "parts": parts_json(parts),
            "bandwidth": ceilings.map(|of| of.bandwidth), "arithmetic": ceilings.map(|of| of.arithmetic),
            "start": ceilings.map(|of| of.start),
        }));
    }
    print_pass_times(passes, ceilings.as_ref());
    let runs: u64 = passes.iter().map(|time| time.runs).sum();
    let each = runs as f64 / f64::from(frames.max(1));
    print(&format!("\n{runs} runs of passes, {each:.0} a frame"));
    if let Some(Ceilings {
        bandwidth,
        arithmetic,
        start,
    }) = ceilings
    {
        print(&format!(
            "; per cent are of {:.2} GB/s, at which a pass copies a buffer here, where a pass is taken to move what it binds once, and of {:.1} \
             Gop/s, which one does that only multiplies and adds; one without work takes {:.3} ms",
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

/// What passes and buffers are there for, for programs.
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
