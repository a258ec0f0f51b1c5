//! `swell completions SHELL` and `swell man DIR`: shell completions and man pages.

use std::{fs, path::PathBuf};

use clap::{Args, CommandFactory as _};
use clap_complete::{Shell, generate};

use super::{Cli, Failure, output};

#[derive(Args, Debug)]
pub(super) struct CompletionsArgs {
    /// Shell to complete words for.
    shell: Shell,
}

#[derive(Args, Debug)]
pub(super) struct ManArgs {
    /// Folder for the pages, which is made where it is missing.
    #[arg(value_name = "DIR")]
    directory: PathBuf,
}

/// Prints a completion script for the shell.
pub(super) fn completions(args: &CompletionsArgs) -> u8 {
    let mut script = Vec::new();
    generate(args.shell, &mut Cli::command(), "swell", &mut script);
    output::print(&String::from_utf8_lossy(&script));
    0
}

/// Writes a page for the program and one for each command.
pub(super) fn man(args: &ManArgs) -> Result<u8, Failure> {
    let directory = &args.directory;
    let written = fs::create_dir_all(directory)
        .and_then(|()| clap_mangen::generate_to(Cli::command(), directory));
    written.map(|()| 0).map_err(|error| Failure {
        code: 4,
        error: format!("cannot write to {}: {error}", directory.display()).into(),
    })
}
