//! `swell wet CACHE`

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use swell_domain::wet::DRYING;
use swell_stage::wet::{WetEvent, WetRequest, expected, wet};

use super::{
    Failure, count,
    dry_run::DryRun,
    interrupt::Interrupt,
    output,
    progress::{Mode, Progress, Status},
    whitewater::{Ended, stream_name},
};

#[derive(Args, Debug)]
pub(super) struct WetArgs {
    /// Cache directory of a bake.
    cache: PathBuf,
    /// Drying time τ, seconds: away from the water, wetness falls as exp(−t/τ).
    #[arg(long, value_name = "SECONDS", default_value_t = DRYING)]
    dry: f64,
    /// Distance from a particle of water within which a surface is in contact, metres; a particle
    /// spacing where left out.
    #[arg(long, value_name = "METRES")]
    within: Option<f64>,
    /// Longest edge of the triangles that sample the surfaces, metres; a particle spacing where
    /// left out.
    #[arg(long, value_name = "METRES")]
    edge: Option<f64>,
    /// Name of the stream, which goes to CACHE/wet/NAME. An existing stream is resumed.
    #[arg(long, value_name = "NAME", default_value = "default")]
    name: String,
    /// Last frame to make; the bake's last where left out.
    #[arg(long, value_name = "N")]
    last: Option<u32>,
    /// Remove a stream of this name first.
    #[arg(long)]
    overwrite: bool,
    /// Say what would be made and where, and make nothing.
    #[arg(long)]
    dry_run: bool,
    /// How to tell progress.
    #[arg(long, value_enum, default_value_t)]
    pub(super) progress: Mode,
}

pub(super) fn run(args: &WetArgs, progress: &Progress) -> Result<u8, Failure> {
    let request = WetRequest {
        cache: args.cache.clone(),
        name: stream_name(args.name.clone(), "--name")?,
        drying: args.dry,
        contact: args.within,
        edge: args.edge,
        last: args.last,
        overwrite: args.overwrite,
    };
    if args.dry_run {
        return dry_run(&request, progress);
    }
    let interrupt = Interrupt::install_or_warn();
    let outcome = wet(&request, interrupt.flag(), &mut |event| {
        tell(progress, &event);
    })?;
    progress.finish();
    let ended = Ended {
        last_frame: outcome.last_frame,
        frames: outcome.frames,
        bytes: outcome.bytes,
        directory: &outcome.directory,
        interrupted: outcome.interrupted,
    };
    Ok(ended.conclude(progress, &ended.words()))
}

fn dry_run(request: &WetRequest, progress: &Progress) -> Result<u8, Failure> {
    let found = expected(request)?;
    let told = DryRun {
        frames: (found.first..=found.last).collect(),
        standing: found.standing as usize,
        bytes: found.bytes,
        place: output::path(&found.directory),
    };
    let words = format!("; the solids have {} vertices", found.vertices);
    told.tell(progress, &words, json!({ "vertices": found.vertices }));
    Ok(0)
}

fn tell(progress: &Progress, event: &WetEvent) {
    match event {
        WetEvent::Ready {
            directory,
            surfaces,
            vertices,
            settings: [drying, contact, edge],
            first,
            last,
            warnings,
        } => {
            for warning in warnings {
                let (text, json) = super::bake::warned(warning);
                progress.say(&text, json);
            }
            let frames = u64::from((last + 1).saturating_sub(*first));
            progress.begin(frames);
            progress.say(
                &format!(
                    "{} with {vertices} vertices, into {}\nin contact within {contact} m, dry with \
                     a time of {drying} s, edges up to {edge} m",
                    count(*surfaces as u64, "solid"),
                    directory.display(),
                ),
                json!({
                    "event": "ready", "directory": output::path(directory), "solids": surfaces,
                    "vertices": vertices, "drying": drying, "within": contact, "edge": edge,
                    "first": first, "last": last, "frames": frames,
                }),
            );
        }
        WetEvent::Frame {
            frame,
            contact,
            wet,
            seconds,
        } => progress.frame(
            &format!(
                "frame {frame:4}  {contact:.2} m² in contact, {wet:.2} m² wet, {seconds:.2} s"
            ),
            Status::Done,
            json!({
                "event": "frame", "frame": frame, "contact_area": contact, "wet_area": wet,
                "seconds": seconds,
            }),
        ),
        WetEvent::Written { bytes } => progress.wrote(*bytes),
    }
}
