//! `swell whitewater CACHE`

use std::{cell::OnceCell, path::PathBuf};

use clap::Args;
use serde_json::json;

use crate::{
    domain::whitewater::Kind,
    scene::whitewater::WhitewaterSettings,
    stage::whitewater::{Event, Request, whitewater},
};

use super::{
    DeviceArgs, Failure, count,
    interrupt::{self, Interrupt},
    output,
    progress::{Mode, Progress},
    size,
};

#[derive(Args, Debug)]
pub(super) struct WhitewaterArgs {
    /// Cache directory of a bake.
    cache: PathBuf,
    /// Settings file (TOML); what it leaves out has defaults or is calibrated on the shot.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Name of the stream, which goes to CACHE/whitewater/NAME; the settings file's own where left out, or `default`. A stream
    /// that stands there is gone on with.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Last frame to make; the bake's last where left out.
    #[arg(long, value_name = "N")]
    last: Option<u32>,
    /// Remove a stream of this name first.
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    device: DeviceArgs,
    /// Time each pass and print a table; passes then run one by one.
    #[arg(long)]
    time_passes: bool,
    /// How to tell progress.
    #[arg(long, value_enum, default_value_t)]
    progress: Mode,
}

impl WhitewaterArgs {
    fn name(&self) -> Result<String, Failure> {
        let of_file = || {
            Some(
                self.settings
                    .as_ref()?
                    .file_stem()?
                    .to_string_lossy()
                    .into(),
            )
        };
        let name: String = self
            .name
            .clone()
            .or_else(of_file)
            .unwrap_or("default".into());
        let is_plain = |b: u8| b.is_ascii_alphanumeric() || b"._-".contains(&b);
        if !name.is_empty() && !name.starts_with(['.', '-']) && name.bytes().all(is_plain) {
            return Ok(name);
        }
        Err(Failure {
            code: 2,
            error: format!(
                "`{name}` names no stream: letters, digits, `.`, `_` and `-` do (--name)"
            )
            .into(),
        })
    }
}

pub(super) fn run(args: &WhitewaterArgs) -> Result<u8, Failure> {
    let settings = match &args.settings {
        Some(file) => WhitewaterSettings::load(file)?,
        None => WhitewaterSettings::parse("", &PathBuf::from("no settings file"))?,
    };
    let request = Request {
        cache: args.cache.clone(),
        name: args.name()?,
        settings,
        last: args.last,
        overwrite: args.overwrite,
        device: args.device.read()?,
        time_passes: args.time_passes,
    };
    let interrupt = Interrupt::install_or_warn();
    let progress = OnceCell::new();
    let outcome = whitewater(&request, interrupt.flag(), &mut |event| {
        tell(args.progress, &progress, event)
    });
    let progress = progress
        .into_inner()
        .unwrap_or_else(|| Progress::new(args.progress, 0));
    progress.finish();
    let outcome = outcome?;
    let end = match outcome.interrupted {
        true => "ended by a signal after",
        false => "done:",
    };
    progress.say(
        &format!(
            "{end} frame {} in {} ({}, {} written now)",
            outcome.last_frame,
            outcome.directory.display(),
            count(outcome.frames.into(), "frame"),
            size(outcome.bytes),
        ),
        json!({
            "event": "end", "last_frame": outcome.last_frame, "frames": outcome.frames, "bytes": outcome.bytes,
            "interrupted": outcome.interrupted, "directory": output::path(&outcome.directory),
        }),
    );
    output::print_pass_times(&outcome.passes);
    Ok(match outcome.interrupted {
        true => interrupt::EXIT_CODE as u8,
        false => 0,
    })
}

fn tell(mode: Mode, progress: &OnceCell<Progress>, event: Event) {
    match event {
        Event::Ready {
            device,
            water,
            directory,
            thresholds,
            calibrated_on,
            first,
            last,
        } => {
            let frames = u64::from((last + 1).saturating_sub(first));
            let progress = progress.get_or_init(|| Progress::new(mode, frames));
            let [air, crest, energy] = [
                thresholds.trapped_air,
                thresholds.wave_crest,
                thresholds.energy,
            ]
            .map(|[least, greatest]| format!("{least} to {greatest}"));
            let source = match calibrated_on {
                Some(frames) => format!("calibrated on {}", count(frames as u64, "frame")),
                None => "as given".to_owned(),
            };
            progress.say(
                &format!(
                    "on {device}\n{} of water, into {}\nthresholds, {source}: trapped air {air} m/s, wave crest {crest}, energy \
                     {energy} J/kg",
                    count(water as u64, "particle"),
                    directory.display(),
                ),
                json!({
                    "event": "ready", "device": device.to_string(), "water": water, "directory": output::path(&directory),
                    "thresholds": thresholds, "calibrated_on": calibrated_on, "first": first, "last": last,
                }),
            );
        }
        Event::Frame {
            frame,
            census,
            born,
            seconds,
        } => {
            if let Some(progress) = progress.get() {
                let kinds = Kind::ALL.into_iter().zip(census);
                let words: Vec<String> = kinds
                    .map(|(kind, many)| format!("{many} {}", kind.name()))
                    .collect();
                let [spray, foam, bubbles] = census;
                progress.frame(
                    &format!("frame {frame:4}  {}, {born} new, {seconds:.2} s", words.join(", ")),
                    json!({
                        "event": "frame", "frame": frame, "spray": spray, "foam": foam, "bubbles": bubbles, "born": born,
                        "seconds": seconds,
                    }),
                );
            }
        }
    }
}
