//! `swell check --render CACHE --look LOOK`

use std::{fmt::Write as _, path::PathBuf};

use clap::Args;
use serde_json::json;

use crate::{
    domain::frame_range::FrameRange,
    scene::look::Look,
    stage::render::surfaces::{DEPTH, NORMAL, Outcome, Request, check_render},
};

use super::{
    Failure, GpuArgs, count,
    interrupt::{self, Interrupt},
    output,
};

#[derive(Args, Debug)]
pub(super) struct SurfaceArgs {
    /// Check the water's surface in pictures: depth and normals of splats and of rays against rays cast in f64 through the
    /// particles' own field.
    #[arg(long, requires = "look")]
    render: bool,
    /// With --render: whose camera is taken, and whose surface.
    #[arg(long, value_name = "LOOK", requires = "render")]
    look: Option<PathBuf>,
}

impl SurfaceArgs {
    /// The look, where pictures are to be checked.
    pub(super) fn look(&self) -> Option<&PathBuf> {
        self.look.as_ref().filter(|_| self.render)
    }
}

/// Checks the pictures that a look makes of a cache.
pub(super) fn run(
    (cache, look): (PathBuf, &PathBuf),
    frames: Option<FrameRange>,
    gpu: &GpuArgs,
    json: bool,
) -> Result<u8, Failure> {
    let request = Request {
        cache,
        look: Look::load(look)?,
        frames,
        gpu: gpu.read()?,
    };
    let interrupt = Interrupt::install_or_warn();
    let outcome = check_render(&request, interrupt.flag())?;
    let is_within = outcome.rows.iter().all(|row| row.is_within());
    output::print(&match json {
        true => format!("{}\n", to_json(&outcome, is_within)),
        false => show(&outcome, is_within),
    });
    Ok(match outcome.interrupted {
        true => interrupt::EXIT_CODE as u8,
        false => u8::from(!is_within),
    })
}

fn to_json(outcome: &Outcome, is_within: bool) -> serde_json::Value {
    json!({
        "device": outcome.device,
        "frames": outcome.frames,
        "interrupted": outcome.interrupted,
        "outside": outcome.outside,
        "truth_seconds": outcome.truth_seconds,
        "allowed": { "method": "ray", "depth_p95": DEPTH, "normal_median": NORMAL },
        "within": is_within,
        "rows": outcome.rows,
    })
}

fn show(outcome: &Outcome, is_within: bool) -> String {
    let mut text = format!(
        "{} on {} against rays in f64 ({:.1} s a frame)\n{:6} {:>9} {:>15} {:>15} {:>15} {:>15} {:>8} {:>10}\n",
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
