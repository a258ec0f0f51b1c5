//! Times of passes and resources by purpose, as text and as JSON.

use serde_json::{Value, json};

use super::{output::print, progress::Progress};
use swell_domain::solver::PassTime;
use swell_stage::{
    device::{Ceilings, PassTimes, Reached},
    time::Share,
};

/// Reports times of passes, one line each: milliseconds, runs, total seconds, least bytes moved and
/// operations per second, their fractions of the adapter's ceilings, and what limits the pass; then
/// the share of each part per frame, over `frames` frames.
pub(super) fn report(progress: &Progress, times: &PassTimes, parts: &[Share], frames: u32) {
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
            "\na frame without timing: {:.1} submissions, {:.1} waits for the device, {:.0} bytes \
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
            "\nper cent are of {:.2} GB/s, at which a pass copies a buffer here, where a pass is \
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
