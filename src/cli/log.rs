//! `--log FILE`: what goes to standard error, and progress, also into a file, a line with its time each.

use std::{
    fs::File,
    io::{self, Write as _},
    path::Path,
    sync::{Mutex, PoisonError},
    time::{Duration, SystemTime, UNIX_EPOCH},
};

/// The file, where one was asked for.
static LOG: Mutex<Option<File>> = Mutex::new(None);

/// Has everything from here on written behind what the file holds. Several processes may write into one.
///
/// # Errors
/// The system's.
pub(super) fn open(file: &Path) -> io::Result<()> {
    let file = File::options().append(true).create(true).open(file)?;
    *LOG.lock().unwrap_or_else(PoisonError::into_inner) = Some(file);
    Ok(())
}

/// Writes text, each of its lines with the time; nothing without a file.
///
/// # Errors
/// The system's.
pub(super) fn write(text: &str) -> io::Result<()> {
    let mut log = LOG.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(file) = &mut *log else {
        return Ok(());
    };
    let time = utc(SystemTime::now());
    let lines = text.lines().map(|line| format!("{time} {line}\n"));
    // In one piece, so that lines of several processes do not mix.
    file.write_all(lines.collect::<String>().as_bytes())
}

/// A time as RFC 3339 writes it, to the second: `2026-11-24T15:12:18Z`.
fn utc(time: SystemTime) -> String {
    let since = time.duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
    let seconds = since.as_secs();
    let (year, month, day) = date(seconds / 86_400);
    let [hour, minute, second] = [seconds / 3600 % 24, seconds / 60 % 60, seconds % 60];
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

/// Year, month and day of a day after 1970-01-01, in the Gregorian calendar: Hinnant, "chrono-Compatible Low-Level Date
/// Algorithms", `civil_from_days`. Years begin in March, so that the leap day is a year's last.
fn date(days: u64) -> (u64, u64, u64) {
    let day = days + 719_468;
    let (era, day_of_era) = (day / 146_097, day % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month + 2) / 5 + 1;
    let (month, later) = match month {
        0..10 => (month + 3, 0),
        _ => (month - 9, 1),
    };
    (400 * era + year_of_era + later, month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_those_of_the_calendar() {
        // As GNU date gives them: date -u -d @SECONDS +%FT%TZ.
        for (seconds, wanted) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_399, "2000-02-28T23:59:59Z"),
            (951_868_800, "2000-03-01T00:00:00Z"),
            (1_709_208_000, "2024-02-29T12:00:00Z"),
            (1_767_225_599, "2025-12-31T23:59:59Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            let time = UNIX_EPOCH + Duration::from_secs(seconds);
            assert_eq!(utc(time), wanted, "{seconds}");
        }
    }
}
