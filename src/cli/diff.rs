//! `swell diff A B`

mod streams;

use std::{fmt::Write as _, path::PathBuf};

use clap::Args;
use serde_json::json;

use swell_domain::frame_range::{FrameRange, ranges};
use swell_files::tolerance;
use swell_stage::diff::{
    AggregatePeak, BaselineDiff, Basis, CacheDiff, DiffOutcome, DiffRequest, Fault, Images,
    PairDiff, PicturesDiff, WrittenBaseline, aggregate_peaks, diff, write_baseline,
};

use super::{Failure, OUT_OF_TOLERANCE, output};

/// Lines of one kind that are printed before the rest is only counted.
const MOST_LINES: usize = 10;

#[derive(Args, Debug)]
pub(super) struct DiffArgs {
    /// A cache, a folder of PNG or EXR pictures, or one picture.
    a: PathBuf,
    /// The reference: the same kind of thing, or a baseline (.json) where A is a cache.
    #[arg(required_unless_present = "write_baseline")]
    b: Option<PathBuf>,
    /// Frames to compare, such as 1-240x2; all where left out.
    #[arg(long, value_name = "RANGE")]
    frames: Option<FrameRange>,
    /// Limits (TOML); where left out, equal in every bit on one device, and within the limits of a
    /// new baseline on two.
    #[arg(long, value_name = "FILE")]
    tolerance: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
    /// Write difference images of two renders: a PNG for two pictures, a folder for two folders.
    #[arg(short, long, value_name = "PATH")]
    output: Option<PathBuf>,
    /// What differences are multiplied by in difference images.
    #[arg(long, default_value = "10", requires = "output", value_parser = gain)]
    gain: f64,
    /// Judge a baseline's aggregates alone, as on an adapter that it has no hashes of.
    #[arg(long)]
    ignore_hashes: bool,
    /// Write cache A as a baseline, or add its adapter to the one that stands there.
    #[arg(
        long,
        value_name = "FILE",
        conflicts_with_all = ["b", "tolerance", "output", "ignore_hashes"]
    )]
    write_baseline: Option<PathBuf>,
    /// With --write-baseline: a bake that differs from cache A in roundings alone; the limits are
    /// taken from how far these come apart.
    #[arg(long, value_name = "CACHE", requires = "write_baseline")]
    spread: Vec<PathBuf>,
}

fn gain(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(gain) if gain > 0.0 && f64::is_finite(gain) => Ok(gain),
        _ => Err("allowed: a finite number above 0".to_owned()),
    }
}

pub(super) fn run(args: &DiffArgs) -> Result<u8, Failure> {
    let b = match (&args.b, &args.write_baseline) {
        (Some(b), _) => b,
        (None, Some(file)) => {
            let written = write_baseline(&args.a, file, args.frames.as_ref(), &args.spread)?;
            let text = show_written(file, &written);
            print(&text, args.json.then(|| json!(written)));
            return Ok(0);
        }
        (None, None) => unreachable!("clap asks for one of them"),
    };
    let request = DiffRequest {
        a: args.a.clone(),
        b: b.clone(),
        frames: args.frames.clone(),
        tolerance: args.tolerance.as_deref().map(tolerance::load).transpose()?,
        images: args.output.clone().map(|path| Images {
            path,
            gain: args.gain,
        }),
        ignores_hashes: args.ignore_hashes,
    };
    let outcome = diff(&request)?;
    let mut text = format!(
        "A {}\nB {} (the reference)\n",
        request.a.display(),
        request.b.display()
    );
    // Writing to a String cannot fail.
    let _ = match &outcome {
        DiffOutcome::Caches(diff) => show_caches(&mut text, diff),
        DiffOutcome::Baseline(diff) => show_baseline(&mut text, diff),
        DiffOutcome::Pictures(diff) => show_pictures(&mut text, diff, args.gain),
    };
    let is_within = outcome.is_within();
    let verdict = match (is_within, &request.tolerance, &outcome) {
        (false, ..) => "OUT OF TOLERANCE",
        (true, None, DiffOutcome::Caches(diff))
            if diff.device_limits.is_none() && !diff.without_particles.is_empty() =>
        {
            "the same in all that both keep"
        }
        (true, None, DiffOutcome::Caches(diff)) if diff.device_limits.is_some() => {
            "aggregates within the limits for different devices"
        }
        (true, None, DiffOutcome::Caches(_) | DiffOutcome::Pictures(_)) => "the same, bit for bit",
        _ => "within tolerance",
    };
    let _ = writeln!(text, "\n{verdict}");
    let (a, b) = (output::path(&request.a), output::path(&request.b));
    let object = || json!({ "a": a, "b": b, "is_within": is_within, "diff": outcome });
    print(&text, args.json.then(object));
    Ok(if is_within { 0 } else { OUT_OF_TOLERANCE })
}

fn print(text: &str, object: Option<serde_json::Value>) {
    match object {
        Some(object) => output::print(&format!("{object}\n")),
        None => output::print(text),
    }
}

fn show_caches(out: &mut String, diff: &CacheDiff) -> std::fmt::Result {
    let [a, b] = &diff.bakes;
    let [a_begins, b_begins] = diff.begins;
    writeln!(out, "A is {a}\nB is {b}")?;
    show_physics(out, diff.physics.as_deref())?;
    if diff.device_limits.is_some() {
        writeln!(
            out,
            "by aggregates: on different devices roundings differ, so that bits cannot match; a \
             tolerance file judges by other limits"
        )?;
    }
    for (side, other, [own, begins]) in [
        ("A", "B", [a_begins, b_begins]),
        ("B", "A", [b_begins, a_begins]),
    ] {
        if own < begins {
            writeln!(
                out,
                "{other} begins with frame {begins}: earlier frames of {side} are not compared"
            )?;
        }
    }
    show_lone(out, "frames", "A", &ranges(&diff.only_a))?;
    show_lone(out, "frames", "B", &ranges(&diff.only_b))?;
    let numbers: Vec<u32> = diff.frames.iter().map(|frame| frame.frame).collect();
    writeln!(out, "compared frames {}", ranges(&numbers))?;
    if !diff.without_particles.is_empty() {
        writeln!(
            out,
            "particles not kept on both sides: frames {}, of which the other data are compared",
            ranges(&diff.without_particles)
        )?;
    }
    let lone = |frame: &&swell_stage::diff::FrameDiff| frame.only_a.count + frame.only_b.count > 0;
    for frame in diff.frames.iter().filter(lone).take(1) {
        writeln!(
            out,
            "particles in frame {}: {} in both, {} only in A{}, {} only in B{}",
            frame.frame,
            frame.matched,
            frame.only_a.count,
            first_id(frame.only_a.first),
            frame.only_b.count,
            first_id(frame.only_b.first)
        )?;
    }
    show_fields(out, diff)?;
    let pairs: Vec<_> = diff
        .frames
        .iter()
        .map(|f| (f.frame, f.aggregates))
        .collect();
    show_aggregates(out, &aggregate_peaks(&pairs), |peak| {
        let limit = diff.device_limits.as_ref()?.get(peak.name)?;
        Some(limit.allowed(peak.b.unwrap_or(0.0)))
    })?;
    show_first_difference(out, diff)?;
    streams::show(out, diff)?;
    let faults = diff.frames.iter().flat_map(|frame| {
        let describe = |fault| describe(frame.frame, fault);
        frame.faults.iter().map(describe)
    });
    show_faults(out, faults)
}

fn first_id(id: Option<u32>) -> String {
    id.map_or(String::new(), |id| format!(" (first id {id})"))
}

fn show_physics(out: &mut String, difference: Option<&str>) -> std::fmt::Result {
    match difference {
        Some(difference) => writeln!(out, "other physics, B then A: {difference}"),
        None => writeln!(out, "the same physics"),
    }
}

fn show_lone(out: &mut String, what: &str, side: &str, names: &str) -> std::fmt::Result {
    if names.is_empty() {
        return Ok(());
    }
    writeln!(out, "{what} only in {side}: {names}")
}

/// The largest deviation of each field over all frames, each measure with its frame.
fn show_fields(out: &mut String, diff: &CacheDiff) -> std::fmt::Result {
    let Some(first) = diff.frames.first() else {
        return Ok(());
    };
    writeln!(
        out,
        "\nfield      unit        largest  frame  particle         RMS  frame        99 %  frame  \
         RMS / RMS of B"
    )?;
    for (index, field) in first.fields.iter().enumerate() {
        let peak = |measure: fn(&swell_stage::diff::FieldDiff) -> f64| {
            let values = diff.frames.iter().map(|f| (f.frame, &f.fields[index]));
            values
                .map(|(frame, field)| (measure(field), frame, field))
                .reduce(|most, next| if next.0 > most.0 { next } else { most })
        };
        let measures = (
            peak(|f| f.deviation.max),
            peak(|f| f.deviation.rms),
            peak(|f| f.deviation.p99),
            peak(|f| f.deviation.relative_rms()),
        );
        let (Some(max), Some(rms), Some(p99), Some(relative)) = measures else {
            continue;
        };
        let particle = max
            .2
            .worst
            .as_ref()
            .map_or("-".to_owned(), |w| w.particle.to_string());
        let unit = match field.field.as_str() {
            "position" => "m",
            "velocity" => "m/s",
            _ => "",
        };
        writeln!(
            out,
            "{:9}  {unit:4}  {:>13}  {:5}  {particle:>8}  {:>10}  {:5}  {:>10}  {:5}  {:>14}",
            field.field,
            number(max.0),
            max.1,
            number(rms.0),
            rms.1,
            number(p99.0),
            p99.1,
            number(relative.0)
        )?;
    }
    Ok(())
}

/// For each aggregate the frame with the largest difference.
fn show_aggregates(
    out: &mut String,
    peaks: &[AggregatePeak],
    limit: impl Fn(&AggregatePeak) -> Option<f64>,
) -> std::fmt::Result {
    writeln!(
        out,
        "\naggregate         unit  largest difference  relative  frame           A           B     \
         allowed"
    )?;
    let optional = |value: Option<f64>| value.map_or("-".to_owned(), number);
    for peak in peaks {
        writeln!(
            out,
            "{:16}  {:4}  {:>18}  {:>8}  {:5}  {:>10}  {:>10}  {:>10}",
            peak.name,
            peak.unit,
            number(peak.difference),
            number(peak.relative),
            peak.frame,
            optional(peak.a),
            optional(peak.b),
            optional(limit(peak))
        )?;
    }
    Ok(())
}

fn show_first_difference(out: &mut String, diff: &CacheDiff) -> std::fmt::Result {
    let first = diff.frames.iter().find_map(|frame| {
        let field = frame
            .fields
            .iter()
            .find(|field| field.first_different.is_some())?;
        Some((frame.frame, &field.field, field.first_different.as_ref()?))
    });
    match first {
        Some((frame, field, parting)) => writeln!(
            out,
            "\nfirst differing bit: frame {frame}, {field} of particle {}: A {:?}, B {:?}",
            parting.particle, parting.a, parting.b
        ),
        None => writeln!(out, "\nno differing bit in the particles that both have"),
    }
}

/// One line per fault, for the first ones only.
fn show_faults(out: &mut String, faults: impl Iterator<Item = String>) -> std::fmt::Result {
    let faults: Vec<_> = faults.collect();
    for fault in faults.iter().take(MOST_LINES) {
        writeln!(out, "out: {fault}")?;
    }
    match faults.len().saturating_sub(MOST_LINES) {
        0 => Ok(()),
        more => writeln!(out, "out: {more} more; --json has them all"),
    }
}

fn describe(frame: u32, fault: &Fault) -> String {
    let what = &fault.what;
    let place = fault.parting.as_ref().map_or(String::new(), |parting| {
        format!(
            "; particle {}: A {:?}, B {:?}",
            parting.particle, parting.a, parting.b
        )
    });
    let value = number(fault.value);
    let fault = match fault.measure {
        "bits" => format!("{what}: {value} particles are not the same{place}"),
        "hash" => "the particles' hash differs".to_owned(),
        "on one side alone" => format!("{what}: {value} on only one side"),
        measure => format!(
            "{what}: {measure} {value}, allowed {}{place}",
            number(fault.limit)
        ),
    };
    format!("frame {frame}, {fault}")
}

fn show_baseline(out: &mut String, diff: &BaselineDiff) -> std::fmt::Result {
    writeln!(out, "A is {}", diff.bake)?;
    show_physics(out, diff.physics.as_deref())?;
    match diff.basis {
        Basis::Hashes => writeln!(
            out,
            "by hashes, and by aggregates: the baseline knows this adapter"
        )?,
        Basis::Aggregates if diff.ignores_hashes => {
            writeln!(out, "by aggregates: hashes are ignored, as asked")?;
        }
        Basis::Aggregates => writeln!(
            out,
            "by aggregates: the baseline has no hashes of this adapter, but of {}",
            diff.known_adapters.join("; ")
        )?,
    }
    writeln!(out, "aggregates of B are from {}", diff.aggregates_from)?;
    show_lone(out, "frames", "B", &ranges(&diff.only_baseline))?;
    let numbers: Vec<u32> = diff.frames.iter().map(|frame| frame.frame).collect();
    writeln!(out, "compared frames {}", ranges(&numbers))?;
    let pairs: Vec<_> = diff
        .frames
        .iter()
        .map(|f| (f.frame, f.aggregates))
        .collect();
    show_aggregates(out, &aggregate_peaks(&pairs), |peak| {
        let frame = diff.frames.iter().find(|f| f.frame == peak.frame)?;
        let limit = frame.limits.get(peak.name)?;
        Some(limit.allowed(peak.b.unwrap_or(0.0)))
    })?;
    show_faults(out, diff.faults.iter().map(|f| describe(f.frame, &f.fault)))?;
    if !diff.faults.is_empty() && diff.faults.iter().all(|f| f.fault.measure == "hash") {
        writeln!(
            out,
            "the aggregates are within their limits: different bits, much the same water"
        )?;
    }
    Ok(())
}

fn show_written(file: &std::path::Path, written: &WrittenBaseline) -> String {
    let mut text = format!(
        "{}: {} frames of {}{}\n",
        file.display(),
        written.frames,
        written.adapter,
        if written.is_unchanged {
            ", unchanged"
        } else {
            ""
        }
    );
    let adapters = [
        ("hashes taken before and kept", &written.kept),
        (
            "hashes of another scene or other frames dropped",
            &written.dropped,
        ),
    ];
    for (what, names) in adapters {
        if !names.is_empty() {
            text += &format!("{what}: {}\n", names.join("; "));
        }
    }
    if !written.spread_from.is_empty() {
        let from = written.spread_from.join("; ");
        text += &format!("limits from the spread of bakes with: {from}\n");
    }
    if written.is_spread_dropped {
        text += "spreads of another scene or other frames dropped: the limits are those of any \
            scene; --spread measures them again\n";
    }
    text
}

fn show_pictures(out: &mut String, diff: &PicturesDiff, gain: f64) -> std::fmt::Result {
    show_lone(out, "pictures", "A", &diff.only_a.join(", "))?;
    show_lone(out, "pictures", "B", &diff.only_b.join(", "))?;
    let longest = diff.pairs.iter().map(|pair| pair.name.len()).max();
    let width = longest.unwrap_or(0).max("picture".len());
    writeln!(
        out,
        "\n{:width$}        mean        99 %     largest           at  perceptual (100: no \
         difference)",
        "picture"
    )?;
    for pair in &diff.pairs {
        show_pair(out, pair, width)?;
    }
    let images = diff.pairs.iter().filter_map(|pair| pair.image.as_ref());
    for image in images.take(1) {
        let more = if diff.pairs.len() > 1 {
            " and beside it"
        } else {
            ""
        };
        let image = image.display();
        writeln!(out, "difference image, |A − B| × {gain}: {image}{more}")?;
    }
    let faults = diff.pairs.iter().flat_map(|pair| {
        pair.faults.iter().map(|fault| {
            let (name, value, limit) = (&pair.name, number(fault.value), number(fault.limit));
            match fault.measure {
                "bits" => format!("{name} is not the same"),
                measure => format!("{name}: {measure} {value}, allowed {limit}"),
            }
        })
    });
    show_faults(out, faults)
}

fn show_pair(out: &mut String, pair: &PairDiff, width: usize) -> std::fmt::Result {
    let Some(diff) = &pair.diff else {
        let part = |k: usize| {
            let ([width, height], [x, y]) = (pair.sizes[k], pair.corners[k]);
            match [x, y] == [0, 0] {
                true => format!("{width} × {height}"),
                false => format!("{width} × {height} from {x}, {y}"),
            }
        };
        let [a, b] = [part(0), part(1)];
        return writeln!(
            out,
            "{:width$}  A is {a}, B is {b}: not compared",
            pair.name
        );
    };
    let at = diff
        .max_at
        .map_or("-".to_owned(), |[x, y]| format!("{x}, {y}"));
    let score = diff
        .perceptual
        .map_or("-".to_owned(), |score| format!("{score:.3}"));
    writeln!(
        out,
        "{:width$}  {:>10}  {:>10}  {:>10}  {at:>11}  {score}",
        pair.name,
        number(diff.mean),
        number(diff.p99),
        number(diff.max)
    )
}

/// Four significant digits, without exponent if that is short.
fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if !(1e-3..1e5).contains(&size) {
        format!("{value:.3e}")
    } else if value.fract() == 0.0 {
        format!("{value}")
    } else {
        let digits = (3 - size.log10().floor() as i32).max(0) as usize;
        format!("{value:.digits$}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (3.0, "3"),
            (1234.56, "1235"),
            (0.012345, "0.01235"),
            (1.5e-7, "1.500e-7"),
            (2.5e6, "2.500e6"),
            (-0.5, "-0.5000"),
            (f64::INFINITY, "inf"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
