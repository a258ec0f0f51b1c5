//! `swell export CACHE`

use std::path::PathBuf;
use swell_files::load_look_within;

use clap::{Args, ValueEnum};
use serde_json::json;

use swell_domain::{chunk::Chunk, frame_range::FrameRange, whitewater::WhitewaterKind};
use swell_stage::export::{
    ExportEvent, ExportRequest, Pattern, Target, UsdWater, VOXELS, expected, export,
};

use super::{
    Failure, bake, count,
    dry_run::DryRun,
    failed::{failed_in_all, frame_failed, refuse_failed},
    interrupt::{self, Interrupt},
    output,
    progress::{Mode, Progress, Recurring, Status},
    size,
    whitewater::stream_name,
};

#[derive(Args, Debug)]
pub(super) struct ExportArgs {
    /// Cache directory.
    cache: PathBuf,
    /// The water's surface, closed, with velocities: a file a frame, such as m.%04d.ply (.obj,
    /// .usda, .usd, .usdc).
    #[arg(long, value_name = "FILES")]
    mesh: Option<Pattern>,
    /// A shot for USD, such as shot.usda (.usd, which is text too, .usdc): water, solids and wave
    /// makers, with a layer a frame beside it.
    #[arg(long, value_name = "FILE")]
    usd: Option<PathBuf>,
    /// How the shot has its water.
    #[arg(
        long,
        value_enum,
        default_value_t,
        value_name = "WATER",
        requires = "usd"
    )]
    usd_water: WaterForm,
    /// A stream of whitewater as points beside the shot's water.
    #[arg(
        long,
        value_name = "NAME",
        num_args = 0..=1,
        default_missing_value = "default",
        requires = "usd",
        conflicts_with = "stream"
    )]
    usd_whitewater: Option<String>,
    /// Particles as NumPy arrays, such as p.%04d.npy.
    #[arg(long, value_name = "FILES")]
    npy: Option<Pattern>,
    /// Particles as tables, such as p.%04d.csv.
    #[arg(long, value_name = "FILES")]
    csv: Option<Pattern>,
    /// Particles as Houdini's classic BGEO, such as p.%04d.bgeo.
    #[arg(long, value_name = "FILES")]
    bgeo: Option<Pattern>,
    /// Level set and velocity grid, such as g.%04d.vdb.
    #[arg(long, value_name = "FILES")]
    vdb: Option<Pattern>,
    /// Density and velocity of the stream that --stream names, such as fog.%04d.vdb: of its spray,
    /// or of the kinds that --kinds lists.
    #[arg(long, value_name = "FILES")]
    fog: Option<Pattern>,
    /// Edge length of the fog's voxels, metres; a particle spacing where left out.
    #[arg(long, value_name = "METRES", requires = "fog")]
    fog_voxel: Option<f64>,
    /// Foam of a stream of whitewater on the vertices of meshes: coverage and age.
    #[arg(
        long,
        value_name = "NAME",
        num_args = 0..=1,
        default_missing_value = "default"
    )]
    foam: Option<String>,
    /// Frames to export, such as 1-240x2; all that are cached where left out.
    #[arg(long, value_name = "RANGE")]
    frames: Option<FrameRange>,
    /// Share of the frames, such as 1/4 for the first of four: several machines may fill one
    /// folder.
    #[arg(long, value_name = "I/N")]
    chunk: Option<Chunk>,
    /// Number of the first of the frames in the names of files, such as 1001; the others follow by
    /// their distance. The cache's own where left out.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(..=1_000_000_000))]
    number_from: Option<u32>,
    /// A stream of whitewater in place of the water, as particles.
    #[arg(long, value_name = "NAME")]
    stream: Option<String>,
    /// Kinds of whitewater to export of a stream's particles, such as spray,foam; all where left
    /// out, but as fog only spray.
    #[arg(long, value_enum, value_name = "KINDS", value_delimiter = ',')]
    kinds: Option<Vec<Kind>>,
    /// A stream of wetness (`swell wet`), which the solids of --usd get as primvars:wetness; their
    /// meshes are then the refined ones.
    #[arg(long, value_name = "NAME", requires = "usd")]
    wet: Option<String>,
    /// Look whose camera, materials and light --usd gets.
    #[arg(long, value_name = "LOOK")]
    look: Option<PathBuf>,
    /// Take a panorama or a camera that lies outside of the look's folder.
    #[arg(long)]
    allow_outside: bool,
    /// Voxels a particle spacing that the surface is found on.
    #[arg(long, value_name = "N", default_value_t = VOXELS, value_parser = voxels)]
    voxels: f64,
    /// Python with usd-core, which names that end in .usdc need.
    #[arg(long, value_name = "PROGRAM", default_value = "python3")]
    python: String,
    /// Export files again that exist, also those of another cache, and files that are none of
    /// swell's.
    #[arg(long)]
    overwrite: bool,
    /// Where frames of the cache are damaged, export the others; exit code 4 in the end.
    #[arg(long)]
    keep_going: bool,
    /// Say what would be made, how large and where, and make nothing.
    #[arg(long)]
    dry_run: bool,
    /// How to tell progress.
    #[arg(long, value_enum, default_value_t)]
    pub(super) progress: Mode,
}

#[derive(ValueEnum, Clone, Copy, Debug, Default)]
enum WaterForm {
    #[default]
    Points,
    Mesh,
}

#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Spray,
    Foam,
    #[value(alias = "bubbles")]
    Bubble,
}

impl From<Kind> for WhitewaterKind {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::Spray => Self::Spray,
            Kind::Foam => Self::Foam,
            Kind::Bubble => Self::Bubble,
        }
    }
}

/// Voxels per spacing, with the same range as in looks.
fn voxels(text: &str) -> Result<f64, String> {
    let allowed = 1.0..=4.0;
    let found = text.parse().ok().filter(|x| allowed.contains(x));
    found.ok_or_else(|| "write a number from 1 to 4".to_owned())
}

impl ExportArgs {
    fn targets(&self) -> Vec<Target> {
        let water = match self.usd_water {
            WaterForm::Points => UsdWater::Points,
            WaterForm::Mesh => UsdWater::Mesh,
        };
        let all = [
            self.mesh.clone().map(Target::Mesh),
            self.npy.clone().map(Target::Npy),
            self.csv.clone().map(Target::Csv),
            self.bgeo.clone().map(Target::Bgeo),
            self.vdb.clone().map(Target::Vdb),
            self.fog.clone().map(Target::Fog),
            self.usd.clone().map(|file| Target::Usd(file, water)),
        ];
        all.into_iter().flatten().collect()
    }

    /// The chosen kinds, each once and in the order of their numbers.
    fn kinds(&self) -> Option<Vec<WhitewaterKind>> {
        let asked: Vec<WhitewaterKind> = self.kinds.as_ref()?.iter().map(|&it| it.into()).collect();
        let is_asked = |kind: &WhitewaterKind| asked.contains(kind);
        Some(WhitewaterKind::ALL.into_iter().filter(is_asked).collect())
    }
}

pub(super) fn run(args: &ExportArgs, progress: &Progress) -> Result<u8, Failure> {
    let look = match &args.look {
        Some(look) => Some(load_look_within(look, bake::reach(args.allow_outside))?),
        None => None,
    };
    let named = |name: &Option<String>, option| {
        (name.clone().map(|name| stream_name(name, option))).transpose()
    };
    let request = ExportRequest {
        cache: args.cache.clone(),
        stream: named(&args.stream, "--stream")?,
        kinds: args.kinds(),
        foam: named(&args.foam, "--foam")?,
        whitewater: named(&args.usd_whitewater, "--usd-whitewater")?,
        wet: named(&args.wet, "--wet")?,
        targets: args.targets(),
        frames: args.frames.clone(),
        chunk: args.chunk,
        voxels: args.voxels,
        fog_voxel: args.fog_voxel,
        look,
        python: args.python.clone(),
        number_from: args.number_from,
        overwrite: args.overwrite,
        keep_going: args.keep_going,
    };
    if args.dry_run {
        return dry_run(&request, progress);
    }
    let interrupt = Interrupt::install_or_warn();
    let outcome = export(&request, interrupt.flag(), &mut |event| {
        tell(progress, event);
    })?;
    progress.finish();
    let elsewhere = match outcome.elsewhere {
        0 => String::new(),
        many => format!(", {many} being made by other processes"),
    };
    progress.conclude(
        &format!(
            "{} {} made ({}), {} already existed{elsewhere}{}",
            if outcome.interrupted {
                "ended by a signal:"
            } else {
                "done:"
            },
            count(outcome.made as u64, "file"),
            size(outcome.bytes),
            outcome.standing,
            failed_in_all(&outcome.failed),
        ),
        json!({
            "made": outcome.made, "standing": outcome.standing,
            "elsewhere": outcome.elsewhere, "failed": outcome.failed,
            "interrupted": outcome.interrupted,
        }),
    );
    if outcome.interrupted {
        return Ok(interrupt::EXIT_CODE as u8);
    }
    refuse_failed(&outcome.failed)
}

fn dry_run(request: &ExportRequest, progress: &Progress) -> Result<u8, Failure> {
    let found = expected(request)?;
    let is_made = |frame: &u32| !found.standing.contains(frame);
    let told = DryRun {
        frames: found.frames.iter().copied().filter(is_made).collect(),
        standing: found.standing.len(),
        bytes: found.bytes,
        place: places(request).join(", "),
    };
    let words = format!(", {}", count(found.files as u64, "file"));
    told.tell(progress, &words, json!({ "files": found.files }));
    Ok(0)
}

/// The output folders, without duplicates.
fn places(request: &ExportRequest) -> Vec<String> {
    let file = |target: &Target| match target {
        Target::Mesh(files)
        | Target::Npy(files)
        | Target::Csv(files)
        | Target::Bgeo(files)
        | Target::Vdb(files)
        | Target::Fog(files) => files.file(0),
        Target::Usd(file, _) => file.clone(),
    };
    let folder = |file: PathBuf| match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => output::path(folder),
        _ => ".".to_owned(),
    };
    let mut places: Vec<String> = request.targets.iter().map(file).map(folder).collect();
    places.sort();
    places.dedup();
    places
}

fn tell(progress: &Progress, event: ExportEvent) {
    match event {
        ExportEvent::Ready {
            frames,
            files,
            warnings,
        } => {
            progress.begin(frames as u64);
            progress.say(
                &format!(
                    "{}, {} each",
                    count(frames as u64, "frame"),
                    count(files as u64, "file")
                ),
                json!({ "event": "ready", "frames": frames, "files": files }),
            );
            for warning in &warnings {
                progress.say(
                    &format!("warning: {warning}"),
                    json!({ "event": "warning", "what": "look", "text": warning }),
                );
            }
        }
        ExportEvent::Warning { frame, off, text } => {
            progress.recur(Recurring {
                what: "volume",
                frame,
                size: off,
                text,
                event: json!({}),
            });
        }
        ExportEvent::Frame {
            frame,
            made,
            bytes,
            seconds,
            volume,
        } => {
            let held = volume.map_or_else(String::new, |volume| {
                format!(", {:.2} % of the particles' volume", 100.0 * volume)
            });
            let (text, status) = match made {
                0 => ("already exists".to_owned(), Status::Skipped),
                _ => (
                    format!("{} in {seconds:.2} s{held}", size(bytes)),
                    Status::Done,
                ),
            };
            progress.wrote(bytes);
            progress.frame(
                &format!("frame {frame:4}  {text}"),
                status,
                json!({
                    "event": "frame", "frame": frame, "made": made, "bytes": bytes,
                    "seconds": seconds, "volume": volume,
                }),
            );
        }
        ExportEvent::Failed { frame, error } => frame_failed(progress, frame, &*error),
    }
}
