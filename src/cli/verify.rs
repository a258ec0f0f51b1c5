//! `swell verify CACHE`

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;

use super::size;
use crate::stage::verify::{CacheError, VerifyReport, verify};

/// Look at every checksum of a cache.
#[derive(Args, Clone, Debug)]
pub struct VerifyArgs {
    /// The cache's folder, the one that holds manifest.json.
    #[arg(value_name = "CACHE")]
    pub cache: PathBuf,
}

/// Prints one line for each file with a problem, or `ok: 72 frames, 1.2 GB`.
///
/// # Errors
/// The first problem as [`CacheError::Damaged`]; [`CacheError`] where there is no cache to look at.
pub fn run(args: &VerifyArgs) -> Result<(), CacheError> {
    let report = verify(&args.cache)?;
    // A closed pipe (`swell verify | head -1`) must not hide the result, which is the exit code.
    let _ = show(&mut io::stdout().lock(), &report);
    report.into_result().map(|_| ())
}

fn show(out: &mut impl Write, report: &VerifyReport) -> io::Result<()> {
    for problem in &report.problems {
        writeln!(out, "{}: {}", problem.file.display(), problem.what)?;
    }
    if report.problems.is_empty() {
        let plural = if report.frames == 1 { "" } else { "s" };
        writeln!(
            out,
            "ok: {} frame{plural}, {}",
            report.frames,
            size(report.bytes)
        )?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::size;
    use super::*;
    use crate::stage::verify::Problem;

    fn shown(report: &VerifyReport) -> String {
        let mut out = Vec::new();
        show(&mut out, report).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn one_line_a_problem_or_one_line() {
        let mut report = VerifyReport {
            frames: 72,
            bytes: 1_234_000_000,
            problems: vec![],
        };
        assert_eq!(shown(&report), "ok: 72 frames, 1.2 GB\n");
        for name in ["a", "b"] {
            report.problems.push(Problem {
                file: name.into(),
                what: "it is missing".to_owned(),
            });
        }
        assert_eq!(shown(&report), "a: it is missing\nb: it is missing\n");
        assert!(report.into_result().is_err());
    }

    #[test]
    fn sizes() {
        assert_eq!(size(0), "0 B");
        assert_eq!(size(999), "999 B");
        assert_eq!(size(1000), "1.0 kB");
        assert_eq!(size(999_949), "999.9 kB");
        assert_eq!(size(999_960), "1.0 MB");
        assert_eq!(size(5_000_000_000_000), "5.0 TB");
    }
}
