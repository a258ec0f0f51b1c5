//! Progress within something long: a frame, or the work before the first one.

use std::time::{Duration, Instant};

/// Interval between two lines about one thing.
const LINES: Duration = Duration::from_secs(10);
/// Interval between two events about one thing.
const EVENTS: Duration = Duration::from_secs(1);

/// The work in progress.
pub(super) struct Within {
    name: String,
    begun: Instant,
    line: Instant,
    event: Instant,
}

/// What is due after a part, and the time estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Notice {
    /// Whether a line is due.
    pub(super) line: bool,
    /// Whether an event is due.
    pub(super) event: bool,
    /// Time since the work began.
    pub(super) elapsed: Duration,
    /// Estimated time for the remaining parts, each as long as those before; `None` before the
    /// first.
    pub(super) left: Option<Duration>,
}

impl Within {
    /// Records that `done` of `count` parts of `name` are done. Another name, or `done` = 0, starts
    /// a new measurement.
    pub(super) fn step(
        under_way: &mut Option<Self>,
        name: &str,
        (done, count): (u64, u64),
        now: Instant,
    ) -> Notice {
        let same = under_way.as_mut().filter(|it| it.name == name && done > 0);
        let Some(within) = same else {
            *under_way = Some(Self {
                name: name.to_owned(),
                begun: now,
                line: now,
                event: now,
            });
            return Notice {
                line: false,
                event: true,
                elapsed: Duration::ZERO,
                left: None,
            };
        };
        let due = |last: &mut Instant, interval: Duration| {
            let is_due = now - *last >= interval;
            if is_due {
                *last = now;
            }
            is_due
        };
        let elapsed = now - within.begun;
        let parts = count.saturating_sub(done) as f64 / done as f64;
        Notice {
            line: due(&mut within.line, LINES),
            event: due(&mut within.event, EVENTS),
            elapsed,
            left: Some(elapsed.mul_f64(parts)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_told_now_and_then_with_the_time_left() {
        let begin = Instant::now();
        let mut under_way = None;
        let mut step = |name: &str, done: u64, millis: u64| {
            let now = begin + Duration::from_millis(millis);
            Within::step(&mut under_way, name, (done, 64), now)
        };
        let told = step("frame 1", 0, 0);
        assert_eq!((told.line, told.event, told.left), (false, true, None));
        let told = step("frame 1", 1, 500);
        assert_eq!((told.line, told.event), (false, false));
        // 63 parts of half a second are left.
        assert_eq!(told.left, Some(Duration::from_millis(31_500)));
        let told = step("frame 1", 16, 8_000);
        assert_eq!((told.line, told.event), (false, true));
        assert_eq!(told.left, Some(Duration::from_secs(24)));
        let told = step("frame 1", 20, 10_000);
        assert_eq!((told.line, told.event), (true, true));
        let told = step("frame 1", 21, 10_900);
        assert_eq!((told.line, told.event), (false, false));
        // The next frame is measured from its own beginning.
        let told = step("frame 2", 0, 40_000);
        assert_eq!((told.event, told.left), (true, None));
        let told = step("frame 2", 32, 42_000);
        assert_eq!(told.left, Some(Duration::from_secs(2)));
        assert_eq!((told.line, told.event), (false, true));
    }
}
