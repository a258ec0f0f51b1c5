//! `swell keys`.

use clap::{Args, builder::PossibleValuesParser};

use super::output;
use swell_files::keys::{File, page};

#[derive(Args, Debug)]
pub(super) struct KeysArgs {
    /// Only the keys of this file: scene, look, study, tolerance or whitewater.
    #[arg(value_parser = PossibleValuesParser::new(File::NAMED.map(|(name, _)| name)))]
    file: Option<String>,
}

/// Prints the reference page.
pub(super) fn run(args: &KeysArgs) {
    let wanted = |name: &str| args.file.as_deref().is_none_or(|file| file == name);
    let files = File::NAMED.iter().filter(|(name, _)| wanted(name));
    let files: Vec<_> = files.map(|(_, file)| *file).collect();
    output::print(&page(&files));
}
