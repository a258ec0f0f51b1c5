//! `swell whitewater CACHE`

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use swell_domain::whitewater::WhitewaterKind;
use swell_files::whitewater::WhitewaterSettings;
use swell_stage::whitewater::{
    LimitForecast, WhitewaterEvent, WhitewaterRequest, expected, whitewater,
};

use super::{
    DeviceArgs, Failure, bake, count,
    dry_run::DryRun,
    interrupt::{self, Interrupt},
    output, pass_times,
    progress::{Mode, Progress, Status},
    size,
};

#[derive(Args, Debug)]
pub(super) struct WhitewaterArgs {
    /// Cache directory of a bake.
    cache: PathBuf,
    /// Settings file (TOML); what it leaves out has defaults, or follows from the shot's water.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Take meshes that lie outside of the settings file's folder.
    #[arg(long)]
    allow_outside: bool,
    /// Name of the stream, which goes to CACHE/whitewater/NAME; the settings file's own where left
    /// out, or `default`. An existing stream is resumed.
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
    /// Say what would be made, how large and where, and make nothing. No device is opened.
    #[arg(long)]
    dry_run: bool,
    /// Time each pass and print a table; passes then run one by one.
    #[arg(long)]
    time_passes: bool,
    /// How to tell progress.
    #[arg(long, value_enum, default_value_t)]
    pub(super) progress: Mode,
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
        stream_name(name, "--name")
    }
}

/// Checks the name of a stream, which is that of its folder, given by an option.
pub(super) fn stream_name(name: String, option: &str) -> Result<String, Failure> {
    let is_plain = |b: u8| b.is_ascii_alphanumeric() || b"._-".contains(&b);
    if !name.is_empty() && !name.starts_with(['.', '-']) && name.bytes().all(is_plain) {
        return Ok(name);
    }
    Err(Failure {
        code: 2,
        error: format!(
            "`{name}` is not a name for a stream; allowed are letters, digits, `.`, `_` and `-` \
             ({option})"
        )
        .into(),
    })
}

pub(super) fn run(args: &WhitewaterArgs, progress: &Progress) -> Result<u8, Failure> {
    let settings = match &args.settings {
        Some(file) => WhitewaterSettings::load_within(file, bake::reach(args.allow_outside))?,
        None => WhitewaterSettings::parse("", &PathBuf::from("no settings file"))?,
    };
    let request = WhitewaterRequest {
        cache: args.cache.clone(),
        name: args.name()?,
        settings,
        last: args.last,
        overwrite: args.overwrite,
        device: args.device.read()?,
        time_passes: args.time_passes,
    };
    if args.dry_run {
        return dry_run(&request, progress);
    }
    let interrupt = Interrupt::install_or_warn();
    let outcome = whitewater(&request, interrupt.flag(), &mut |event| {
        tell(progress, event)
    })?;
    progress.finish();
    let ended = Ended {
        last_frame: outcome.last_frame,
        frames: outcome.frames,
        bytes: outcome.bytes,
        directory: &outcome.directory,
        interrupted: outcome.interrupted,
    };
    let code = ended.conclude(progress, &ended.words());
    pass_times::report(progress, &outcome.passes, &[], outcome.frames);
    Ok(code)
}

/// How a job that makes a stream ended.
pub(super) struct Ended<'a> {
    pub(super) last_frame: u32,
    pub(super) frames: u32,
    pub(super) bytes: u64,
    pub(super) directory: &'a Path,
    pub(super) interrupted: bool,
}

impl Ended<'_> {
    pub(super) fn words(&self) -> String {
        let end = match self.interrupted {
            true => "ended by a signal after",
            false => "done:",
        };
        format!(
            "{end} frame {} in {} ({}, {} written now)",
            self.last_frame,
            self.directory.display(),
            count(self.frames.into(), "frame"),
            size(self.bytes),
        )
    }

    /// Tells it in `words`; returns the exit code.
    pub(super) fn conclude(&self, progress: &Progress, words: &str) -> u8 {
        progress.conclude(
            words,
            json!({
                "last_frame": self.last_frame, "frames": self.frames,
                "interrupted": self.interrupted, "directory": output::path(self.directory),
            }),
        );
        match self.interrupted {
            true => interrupt::EXIT_CODE as u8,
            false => 0,
        }
    }
}

fn dry_run(request: &WhitewaterRequest, progress: &Progress) -> Result<u8, Failure> {
    let found = expected(request)?;
    let told = DryRun {
        frames: (found.first..=found.last).collect(),
        standing: found.standing as usize,
        bytes: found.bytes,
        place: output::path(&found.directory),
    };
    told.tell(progress, "", json!({}));
    Ok(0)
}

fn tell(progress: &Progress, event: WhitewaterEvent) {
    match event {
        WhitewaterEvent::Ready {
            device,
            software_warning,
            warnings,
            water,
            directory,
            rates: [air, crest],
            is_of_shot,
            first,
            last,
        } => {
            let frames = u64::from((last + 1).saturating_sub(first));
            progress.begin(frames);
            progress.warn_of_adapter(software_warning.as_deref());
            for text in warnings {
                progress.say(
                    &format!("warning: {text}"),
                    json!({ "event": "warning", "what": "settings", "text": text }),
                );
            }
            let source = match is_of_shot {
                true => "of the shot's water where none is given",
                false => "as given",
            };
            progress.say(
                &format!(
                    "on {device}\n{} of water, into {}\nrates, {source}: {air} of a cubic metre \
                     that water closes, {crest} a second of one in crests",
                    count(water as u64, "particle"),
                    directory.display(),
                ),
                json!({
                    "event": "ready", "device": device.to_string(), "water": water,
                    "directory": output::path(&directory),
                    "trapped_air_rate": air, "wave_crest_rate": crest,
                    "of_shot": is_of_shot, "first": first, "last": last, "frames": frames,
                }),
            );
        }
        WhitewaterEvent::Frame {
            frame,
            census,
            born,
            seconds,
        } => {
            let kinds = WhitewaterKind::ALL.into_iter().zip(census);
            let words: Vec<String> = kinds
                .map(|(kind, many)| format!("{many} {}", kind.name()))
                .collect();
            let [spray, foam, bubbles] = census;
            progress.frame(
                &format!(
                    "frame {frame:4}  {}, {born} new, {seconds:.2} s",
                    words.join(", ")
                ),
                Status::Done,
                json!({
                    "event": "frame", "frame": frame, "spray": spray, "foam": foam,
                    "bubbles": bubbles, "born": born,
                    "seconds": seconds,
                }),
            );
        }
        WhitewaterEvent::LimitForecast(LimitForecast {
            frame,
            at_end,
            end,
            over,
            allowed,
        }) => {
            let text = format!(
                "frame {frame} will have more whitewater particles than max_particles, {allowed}, \
                 and end the job, if they grow as in these {over} frames, and frame {end} about \
                 {at_end}: raise max_particles, or lower emission.trapped_air_rate and \
                 emission.wave_crest_rate"
            );
            progress.say(
                &format!("warning: {text}"),
                json!({
                    "event": "warning", "what": "max_particles", "text": text, "frame": frame,
                    "at_end": at_end,
                }),
            );
        }
        WhitewaterEvent::Written { bytes } => progress.wrote(bytes),
    }
}
