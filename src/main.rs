//! The `swell` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    swell::cli::main()
}
