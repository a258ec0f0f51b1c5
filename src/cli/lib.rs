//! The command line: parses arguments and prints results, one module per command.

mod bake;
mod check;
mod check_render;
mod diff;
mod dry_run;
mod export;
mod failed;
mod hint;
mod inspect;
pub mod interrupt;
mod keys;
mod lint;
mod log;
mod output;
mod pass_times;
mod progress;
mod render;
mod shell;
mod study;
mod tune;
pub mod verify;
mod view;
mod wet;
mod whitewater;

use std::{
    error::Error,
    ffi::OsString,
    io::{self, Write as _},
    path::{Path, PathBuf},
    process::ExitCode,
};

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum, error::ErrorKind};

use self::progress::{Mode, Progress};
use swell_domain::posix;
use swell_stage::{
    Blame,
    device::{Device, Gpu, Shaders},
};

/// Exit code if something is out of tolerance.
const OUT_OF_TOLERANCE: u8 = 1;

const AFTER: &str = "Exit codes: 0 done; 1 a comparison is out of tolerance; 2 usage, scene or \
    look at fault; 3 no usable device, or device lost; 4 a cache or picture is damaged, missing, \
    in use, of another scene or look, or cannot be read or written, standard output included (a \
    closed pipe, as of `| head`, is no fault); 5 the numbers failed, last good frame kept; 130 \
    ended by a signal, resumable.";

/// Offline, film-quality fluid pipeline for ocean-wave shots.
#[derive(Parser, Debug)]
#[command(name = "swell", version, after_help = AFTER)]
struct Cli {
    /// Add what goes to standard error, and progress, to the end of this file too, each line with
    /// its time.
    #[arg(long, global = true, value_name = "FILE")]
    log: Option<PathBuf>,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Simulate a scene into a particle cache.
    Bake(bake::BakeArgs),
    /// Render a particle cache with a look into an image sequence.
    Render(render::RenderArgs),
    /// Export a cache for other programs: meshes, USD shots, tables of particles, grids.
    Export(Box<export::ExportArgs>),
    /// Bake, render and measure what a study compares, and write one page about it.
    Study(study::StudyArgs),
    /// Find the cheapest settings of a scene that hold an error, and write the scene with them.
    Tune(Box<tune::TuneArgs>),
    /// Make spray, foam and bubbles from a finished bake, as a stream beside it.
    Whitewater(whitewater::WhitewaterArgs),
    /// Make the wetness of solids from a finished bake, as a stream beside it: what stays wet.
    Wet(wet::WetArgs),
    /// Hold a step on the GPU against the f64 reference, pass by pass.
    Check(check::CheckArgs),
    /// Show a scene's plan, a look's plan, what a study runs, a cache's frames, what a file is, or
    /// this machine's adapters.
    Inspect(inspect::InspectArgs),
    /// Compare two caches, a cache and a baseline, or two renders: where they part, and by how
    /// much.
    Diff(diff::DiffArgs),
    /// Print the keys of scenes, looks, studies, tolerance and whitewater files, with what each
    /// allows and its default.
    Keys(keys::KeysArgs),
    /// Look at a cache, rendered pictures or a study: a contact sheet, a movie, a page that plays
    /// the frames.
    View(Box<view::ViewArgs>),
    /// Check every checksum of a cache.
    Verify(verify::VerifyArgs),
    /// Print a script that completes commands and options in a shell.
    Completions(shell::CompletionsArgs),
    /// Write a man page for the program and for each command into a folder.
    Man(shell::ManArgs),
}

/// An error with the exit code that the program ends with.
#[derive(Debug)]
struct Failure {
    code: u8,
    error: Box<dyn Error>,
}

impl<E: Error + 'static> From<E> for Failure
where
    for<'a> Blame: From<&'a E>,
{
    fn from(error: E) -> Self {
        let code = match Blame::from(&error) {
            Blame::Input => 2,
            Blame::Device => 3,
            Blame::Files => 4,
            Blame::Numbers => 5,
        };
        Self {
            code,
            error: Box::new(error),
        }
    }
}

/// Adapter and shaders of a command.
#[derive(Args, Debug)]
struct GpuArgs {
    /// Number of the adapter, or a part of its name that is not digits alone (see `swell inspect
    /// --adapters`). SWELL_ADAPTER in the environment where left out.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Read all shaders from this folder, an edited copy of the folder shaders/ of swell's source.
    /// What is made with them is recorded as not by the shipped ones. An endless loop in them can
    /// hang the device.
    #[arg(long, value_name = "DIR")]
    shaders: Option<PathBuf>,
    #[command(flatten)]
    require: RequireArgs,
}

impl GpuArgs {
    fn read(&self) -> Result<Gpu, Failure> {
        let shaders = self.shaders.as_deref().map(Shaders::read).transpose()?;
        Ok(Gpu {
            adapter: named_adapter(self.adapter.as_ref()),
            shaders: shaders.unwrap_or_default(),
            is_hardware_required: self.require.is_gpu(),
            imprecision: None,
        })
    }
}

/// What an adapter has to be.
#[derive(Args, Debug)]
struct RequireArgs {
    /// With gpu, refuse an adapter that is software (exit code 3). SWELL_REQUIRE_GPU in the
    /// environment does the same with any value but 0.
    #[arg(long, value_enum, value_name = "KIND")]
    require: Option<Required>,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum Required {
    Gpu,
}

impl RequireArgs {
    /// Whether software adapters are refused. The environment is ignored on the CPU and by commands
    /// without an adapter.
    fn is_gpu(&self) -> bool {
        let variable = set_variable("SWELL_REQUIRE_GPU");
        matches!(self.require, Some(Required::Gpu)) || variable.is_some_and(|value| value != "0")
    }
}

/// The adapter of `--adapter`, or the one named in the environment. The environment is ignored on
/// the CPU and by commands without an adapter.
fn named_adapter(flag: Option<&String>) -> Option<String> {
    flag.cloned().or_else(|| {
        Some(
            set_variable("SWELL_ADAPTER")?
                .to_string_lossy()
                .into_owned(),
        )
    })
}

/// An environment variable, if it is set and not empty.
fn set_variable(name: &str) -> Option<OsString> {
    std::env::var_os(name).filter(|value| !value.is_empty())
}

/// Device of a command that needs no adapter.
#[derive(Args, Debug)]
struct DeviceArgs {
    /// Device to compute on: an adapter, or the CPU with the f64 reference, which needs no driver
    /// and is slower.
    #[arg(long, value_enum, default_value_t, value_name = "DEVICE")]
    device: DeviceKind,
    #[command(flatten)]
    gpu: GpuArgs,
}

#[derive(ValueEnum, Clone, Copy, Debug, Default)]
enum DeviceKind {
    #[default]
    Gpu,
    Cpu,
}

impl DeviceArgs {
    fn read(&self) -> Result<Device, Failure> {
        let GpuArgs {
            adapter,
            shaders,
            require,
        } = &self.gpu;
        let fault = match (self.device, adapter, shaders, require.require) {
            (DeviceKind::Gpu, ..) => return Ok(Device::Gpu(self.gpu.read()?)),
            (DeviceKind::Cpu, None, None, None) => return Ok(Device::Cpu),
            (DeviceKind::Cpu, Some(name), ..) => format!("--adapter {name} names a GPU"),
            (DeviceKind::Cpu, None, Some(_), _) => "--shaders run on a GPU".to_owned(),
            (DeviceKind::Cpu, None, None, Some(_)) => "--require asks for a GPU".to_owned(),
        };
        Err(Failure {
            code: 2,
            error: format!("{fault}, and --device is cpu").into(),
        })
    }
}

/// Parses the command line, runs the command, and prints errors with all their causes. `build` is
/// what `--version` prints after the program's name: the version, commit, target and features.
pub fn main(build: &'static str) -> ExitCode {
    let matches = Cli::command().long_version(build).try_get_matches();
    let code = match matches.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => start(cli),
        Err(told) => tell(&told),
    };
    output::exit_code(code)
}

/// Prints clap's output: help, the version, or errors in the arguments.
fn tell(told: &clap::Error) -> u8 {
    let code = told.exit_code() as u8;
    if !told.use_stderr() {
        let shown = told.print().and_then(|()| io::stdout().flush());
        output::note("standard output", shown);
        return code;
    }
    let text = told.to_string();
    let lines = text.lines().map(str::trim).take_while(|it| !it.is_empty());
    let message = lines.collect::<Vec<_>>().join(" ");
    let shown = match told.kind() {
        // The line says everything about the value: the syntax of the command was right.
        ErrorKind::InvalidValue | ErrorKind::ValueValidation | ErrorKind::ArgumentConflict => {
            writeln!(io::stderr(), "{message}")
        }
        _ => told.print(),
    };
    output::note("standard error", shown);
    let message = message.strip_prefix("error: ").unwrap_or(&message);
    progress::unread(&arguments(), message, code);
    code
}

/// The command line without the program.
fn arguments() -> Vec<String> {
    let words = std::env::args_os().skip(1);
    words.map(|it| it.to_string_lossy().into_owned()).collect()
}

/// Opens the log, runs the command, and reports its end.
fn start(cli: Cli) -> u8 {
    let progress = Progress::new(cli.command.progress());
    let opened = match &cli.log {
        Some(file) => open_log(file),
        None => Ok(()),
    };
    let code = opened.and_then(|()| run(cli.command, &progress));
    let code = code.unwrap_or_else(|failure| {
        progress.fail(&chain(failure.error.as_ref()), failure.code);
        failure.code
    });
    let code = output::code(code);
    output::log(&format!("exit code {code}"));
    progress.end(code);
    code
}

fn open_log(file: &Path) -> Result<(), Failure> {
    log::open(file).map_err(|error| Failure {
        code: 4,
        error: format!("--log {}: {error}", file.display()).into(),
    })?;
    let words = arguments();
    let words: Vec<_> = words.iter().map(|it| posix::word(it)).collect();
    output::log(&format!("swell {}", words.join(" ")));
    let before = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        before(panic);
        output::log(&panic.to_string());
    }));
    Ok(())
}

impl Command {
    /// Progress mode of the command.
    fn progress(&self) -> Mode {
        match self {
            Self::Bake(args) => args.progress,
            Self::Render(args) => args.progress,
            Self::Export(args) => args.progress,
            Self::Study(args) => args.progress,
            Self::Tune(args) => args.progress,
            Self::Whitewater(args) => args.progress,
            Self::Wet(args) => args.progress,
            Self::Check(args) => args.progress,
            Self::View(args) => args.progress,
            Self::Inspect(_)
            | Self::Diff(_)
            | Self::Keys(_)
            | Self::Verify(_)
            | Self::Completions(_)
            | Self::Man(_) => Mode::None,
        }
    }
}

fn run(command: Command, progress: &Progress) -> Result<u8, Failure> {
    match command {
        Command::Bake(args) => bake::run(&args, progress),
        Command::Render(args) => render::run(&args, progress),
        Command::Export(args) => export::run(&args, progress),
        Command::Study(args) => study::run(&args, progress),
        Command::Tune(args) => tune::run(&args, progress),
        Command::Check(args) => check::run(&args, progress),
        Command::Inspect(args) => inspect::run(&args),
        Command::Diff(args) => diff::run(&args),
        Command::Keys(args) => {
            keys::run(&args);
            Ok(0)
        }
        Command::View(args) => view::run(&args, progress),
        Command::Whitewater(args) => whitewater::run(&args, progress),
        Command::Wet(args) => wet::run(&args, progress),
        Command::Verify(args) => verify::run(&args).map(|()| 0).map_err(Failure::from),
        Command::Completions(args) => Ok(shell::completions(&args)),
        Command::Man(args) => shell::man(&args),
    }
}

/// Whether a path that may be a cache or a scene is a cache: a folder, or missing and not named
/// like a scene.
fn is_cache(path: &Path) -> bool {
    path.is_dir() || (!path.exists() && path.extension().is_none_or(|end| end != "toml"))
}

/// An error, its causes, and the options that do what it advises, on one line.
fn chain(error: &(dyn Error + 'static)) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let next = error.to_string();
        // Some errors include their cause in their own message.
        if !text.contains(&next) {
            text += &format!(": {next}");
        }
        cause = error.source();
    }
    match hint::of(error) {
        Some(options) => format!("{text} ({options})"),
        None => text,
    }
}

/// A count with its noun: `1 frame`, `2 frames`.
fn count(many: u64, what: &str) -> String {
    match many {
        1 => format!("1 {what}"),
        many => format!("{many} {what}s"),
    }
}

/// Bytes in decimal units with one digit after the point.
fn size(bytes: u64) -> String {
    let mut value = bytes as f64;
    for unit in ["B", "kB", "MB", "GB"] {
        // 999.95 would print as 1000.0.
        if value < 999.95 {
            let digits = usize::from(unit != "B");
            return format!("{value:.digits$} {unit}");
        }
        value /= 1000.0;
    }
    format!("{value:.1} TB")
}
