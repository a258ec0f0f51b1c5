//! `swell verify CACHE`

use std::path::PathBuf;

use clap::Args;

use super::{output, size};
use swell_domain::frame_range::ranges;
use swell_stage::verify::{CacheError, VerifyReport, verify};

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
/// The first problem as [`CacheError::Damaged`]; other [`CacheError`]s if there is no cache to
/// check.
pub fn run(args: &VerifyArgs) -> Result<(), CacheError> {
    let report = verify(&args.cache)?;
    output::print(&show(&report));
    report.into_result().map(|_| ())
}

fn show(report: &VerifyReport) -> String {
    if report.problems.is_empty() {
        let plural = if report.frames == 1 { "" } else { "s" };
        let failed = if report.failed {
            ", and the frame that failed"
        } else {
            ""
        };
        let kept = match &report.kept[..] {
            [] => String::new(),
            kept => format!("; particles of frames {}", ranges(kept)),
        };
        return format!(
            "ok: {} frame{plural}, {}{failed}{kept}\n",
            report.frames,
            size(report.bytes)
        );
    }
    let problems = report.problems.iter();
    problems
        .map(|problem| format!("{}: {}\n", problem.file.display(), problem.what))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::size;
    use super::*;
    use swell_stage::verify::Problem;

    #[test]
    fn one_line_a_problem_or_one_line() {
        let mut report = VerifyReport {
            frames: 72,
            bytes: 1_234_000_000,
            kept: Vec::new(),
            failed: false,
            problems: vec![],
        };
        assert_eq!(show(&report), "ok: 72 frames, 1.2 GB\n");
        report.failed = true;
        let said = "ok: 72 frames, 1.2 GB, and the frame that failed\n";
        assert_eq!(show(&report), said);
        report.kept = vec![0, 10, 11];
        let said =
            "ok: 72 frames, 1.2 GB, and the frame that failed; particles of frames 0, 10-11\n";
        assert_eq!(show(&report), said);
        for name in ["a", "b"] {
            report.problems.push(Problem {
                file: name.into(),
                what: "it is missing".to_owned(),
            });
        }
        assert_eq!(show(&report), "a: it is missing\nb: it is missing\n");
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
