//! `swell check --render CACHE --look LOOK`

use std::{fmt::Write as _, path::PathBuf};
use swell_files::load_look;

use clap::Args;
use serde_json::json;

use swell_domain::frame_range::FrameRange;
use swell_stage::render::surfaces::{
    DEPTH, NORMAL, SurfaceOutcome, SurfaceRequest, SurfacesEvent, check_render,
};

use super::{
    Failure, GpuArgs, count,
    interrupt::{self, Interrupt},
    output,
    progress::{Progress, Status},
};

#[derive(Args, Debug)]
pub(super) struct SurfaceArgs {
    /// Check the water's surface in pictures: depth and normals of splats and of rays against rays
    /// cast in f64 through the particles' own field.
    #[arg(long, requires = "look")]
    render: bool,
    /// With --render: whose camera is taken, and whose surface.
    #[arg(long, value_name = "LOOK", requires = "render")]
    look: Option<PathBuf>,
    /// With --render: score each method's picture against one by finer rays.
    #[arg(long, requires = "render")]
    colour: bool,
    /// With --render: measure what flickers, from each frame and its two neighbours, against finer
    /// rays.
    #[arg(long, requires = "render")]
    flicker: bool,
}

impl SurfaceArgs {
    /// The look, if pictures are to be checked.
    pub(super) fn look(&self) -> Option<&PathBuf> {
        self.look.as_ref().filter(|_| self.render)
    }
}

/// Checks the pictures that a look makes of a cache.
pub(super) fn run(
    (cache, look): (PathBuf, &PathBuf),
    surface: &SurfaceArgs,
    frames: Option<FrameRange>,
    gpu: &GpuArgs,
    (json, progress): (bool, &Progress),
) -> Result<u8, Failure> {
    let request = SurfaceRequest {
        cache,
        look: load_look(look)?,
        frames,
        colour: surface.colour,
        flicker: surface.flicker,
        gpu: gpu.read()?,
    };
    let interrupt = Interrupt::install_or_warn();
    let outcome = check_render(&request, interrupt.flag(), &mut |event| {
        tell(progress, event);
    })?;
    progress.finish();
    let is_within = outcome.rows.iter().all(|row| row.is_within());
    match (progress.is_json(), json) {
        (true, _) => progress.result(to_json(&outcome, is_within)),
        (_, true) => output::print(&format!("{}\n", to_json(&outcome, is_within))),
        (_, false) => output::print(&show(&outcome, is_within)),
    }
    progress.tell_end(json!({ "interrupted": outcome.interrupted }));
    Ok(match outcome.interrupted {
        true => interrupt::EXIT_CODE as u8,
        false => u8::from(!is_within),
    })
}

fn tell(progress: &Progress, event: SurfacesEvent) {
    match event {
        SurfacesEvent::Ready {
            device,
            software_warning,
            frames,
        } => {
            progress.begin(frames as u64);
            progress.warn_of_adapter(software_warning.as_deref());
            progress.say(
                &format!(
                    "{} on {device} against rays in f64",
                    count(frames as u64, "frame")
                ),
                json!({ "event": "ready", "device": device, "frames": frames }),
            );
        }
        SurfacesEvent::Frame { frame, seconds } => progress.frame(
            &format!("frame {frame:4}  {seconds:.2} s"),
            Status::Done,
            json!({ "event": "frame", "frame": frame, "seconds": seconds }),
        ),
    }
}

fn to_json(outcome: &SurfaceOutcome, is_within: bool) -> serde_json::Value {
    json!({
        "device": outcome.device,
        "frames": outcome.frames,
        "interrupted": outcome.interrupted,
        "outside": outcome.outside,
        "truth_seconds": outcome.truth_seconds,
        "truth_residual": outcome.truth_residual,
        "allowed": { "method": "ray", "depth_p95": DEPTH, "normal_median": NORMAL },
        "within": is_within,
        "rows": outcome.rows,
    })
}

fn show(outcome: &SurfaceOutcome, is_within: bool) -> String {
    let mut text = format!(
        "{} on {} against rays in f64 ({:.1} s a frame)\n\
         {:6} {:>9} {:>15} {:>15} {:>15} {:>15} {:>8} {:>10}\n",
        count(outcome.frames.len() as u64, "frame"),
        outcome.device,
        outcome.truth_seconds,
        "method",
        "pixels",
        "depth, median",
        "95 %, spacings",
        "normal, median",
        "95 %, degrees",
        "overlap",
        "s a frame"
    );
    for row in &outcome.rows {
        let line = match &row.surface {
            Some(it) => format!(
                "{:6} {:>9} {:>15.4} {:>15.4} {:>15.3} {:>15.3} {:>8.4} {:>10.2}",
                row.method,
                it.pixels,
                it.depth[0],
                it.depth[1],
                it.normal[0],
                it.normal[1],
                it.overlap,
                row.seconds
            ),
            None => format!("{:6} no water in picture and truth", row.method),
        };
        let _ = writeln!(text, "{line}{}", if row.is_within() { "" } else { "  OUT" });
    }
    outlines(&mut text, outcome);
    pictures(&mut text, outcome);
    let _ = writeln!(
        text,
        "particles outside of the surface: {:.2} %",
        100.0 * outcome.outside
    );
    let verdict = match (is_within, outcome.interrupted) {
        (_, true) => "ended by a signal".to_owned(),
        (true, _) => format!(
            "rays within {DEPTH} spacings at the 95th percentile and {NORMAL}° at the median"
        ),
        (false, _) => format!(
            "rays out of {DEPTH} spacings at the 95th percentile or {NORMAL}° at the median"
        ),
    };
    let _ = writeln!(text, "{verdict}");
    text
}

/// The water's edges: their offset and roughness.
fn outlines(text: &mut String, outcome: &SurfaceOutcome) {
    let _ = writeln!(
        text,
        "{:17} {:>9} {:>15} {:>15} {:>15} {:>15}",
        "edges", "points", "offset", "rough, spacings", "a pixel", "astray"
    );
    // Some pixels of the rays with an open shutter are compared, which have no outlines.
    for row in outcome.rows.iter().filter(|row| row.method != "open") {
        let Some(surface) = &row.surface else {
            continue;
        };
        let kinds = [
            ("silhouette", &surface.silhouette),
            ("waterline", &surface.waterline),
        ];
        for (kind, outline) in kinds {
            let name = format!("{:6} {kind}", row.method);
            let _ = match outline {
                Some(it) => writeln!(
                    text,
                    "{name:17} {:>9} {:>15.4} {:>15.4} {:>15.4} {:>15.4}",
                    it.points, it.offset, it.roughness, it.pixel, it.astray
                ),
                None => writeln!(text, "{name:17} none in picture and truth"),
            };
        }
    }
}

/// Scores and flicker of the pictures, as far as requested.
fn pictures(text: &mut String, outcome: &SurfaceOutcome) {
    for row in &outcome.rows {
        if let Some(score) = row.score {
            let _ = writeln!(
                text,
                "{:6} colour against finer rays: SSIMULACRA 2 of {score:.1}",
                row.method
            );
        }
        if let (Some(flicker), Some(residual)) = (row.flicker, row.residual) {
            let _ = writeln!(
                text,
                "{:6} flicker beyond finer rays: {:.3} % of white; off the mean of \
                 their neighbours by {:.3} %",
                row.method,
                100.0 * flicker,
                100.0 * residual
            );
        }
    }
    if let Some(residual) = outcome.truth_residual {
        let _ = writeln!(
            text,
            "finer rays themselves are {:.3} % of white off the mean of their neighbours",
            100.0 * residual
        );
    }
}
