//! Predicts from the growth of whitewater when it will exceed the limit of its settings.

use std::collections::VecDeque;

/// Number of frames over which growth (births minus deaths) is measured, from the first frame with
/// whitewater.
pub(super) const OVER: usize = 4;

/// A predicted excess of whitewater, if growth continues as measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LimitForecast {
    /// First frame that would have more than `max_particles`.
    pub frame: u32,
    /// Predicted number of particles at the last requested frame.
    pub at_end: u64,
    /// The last requested frame.
    pub end: u32,
    /// Number of frames over which growth was measured.
    pub over: usize,
    /// `max_particles` of the settings.
    pub allowed: u32,
}

/// Particle counts of a growing stream.
pub(super) struct Forecast {
    allowed: u32,
    end: u32,
    /// Counts of consecutive frames, the newest last; before the first whitewater a single frame
    /// without any.
    counts: VecDeque<usize>,
    is_told: bool,
}

impl Forecast {
    /// Starts from a stream with `count` particles, to be extended to frame `end`.
    pub(super) fn new(allowed: u32, end: u32, count: usize) -> Self {
        Self {
            allowed,
            end,
            counts: [count].into(),
            is_told: false,
        }
    }

    /// Takes the number of particles of the next frame. Returns a prediction, once, when the line
    /// through it and the count [`OVER`] frames before exceeds the limit by the last frame.
    pub(super) fn see(&mut self, frame: u32, count: usize) -> Option<LimitForecast> {
        if count == 0 || self.counts.len() > OVER {
            self.counts.pop_front();
        }
        self.counts.push_back(count);
        let first = self.counts.front().copied()?;
        if self.is_told || self.counts.len() <= OVER || count <= first {
            return None;
        }
        let growth = (count - first) as f64 / OVER as f64;
        let room = f64::from(self.allowed) - count as f64;
        let until = (room / growth).floor() + 1.0;
        let left = f64::from(self.end.saturating_sub(frame));
        self.is_told = until <= left;
        self.is_told.then(|| LimitForecast {
            frame: frame + until as u32,
            at_end: (count as f64 + growth * left) as u64,
            end: self.end,
            over: OVER,
            allowed: self.allowed,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The prediction, and the frame after which it is made, for counts from frame 1 on.
    fn said(allowed: u32, end: u32, counts: &[usize]) -> Option<(u32, LimitForecast)> {
        let mut forecast = Forecast::new(allowed, end, 0);
        let mut all = (1u32..).zip(counts).filter_map(|(frame, &count)| {
            let found = forecast.see(frame, count);
            found.map(|found| (frame, found))
        });
        let first = all.next();
        assert_eq!(all.next(), None, "told twice");
        first
    }

    #[test]
    fn steady_growth_is_foretold_to_the_frame() {
        // From frame 11 on 30 per frame: frame k has 30 (k − 10), which exceeds 1000 at frame 44.
        let steady: Vec<usize> = (1usize..=43).map(|k| 30 * k.saturating_sub(10)).collect();
        let (when, found) = said(1000, 60, &steady).unwrap_or_else(|| panic!("nothing said"));
        assert_eq!(when, 14);
        assert_eq!(
            found,
            LimitForecast {
                frame: 44,
                at_end: 1500,
                end: 60,
                over: OVER,
                allowed: 1000
            }
        );
        // Controls: a sufficient limit, a bake that ends before, growth that stopped, no whitewater
        // at all.
        assert_eq!(said(1500, 60, &steady), None);
        assert_eq!(said(1000, 43, &steady), None);
        let level: Vec<usize> = (1..=40).map(|k| 100 * k.min(3)).collect();
        assert_eq!(said(1000, 40, &level[..3]), None);
        assert_eq!(said(3100, 40, &level), None);
        assert_eq!(said(10, 60, &[0; 40]), None);
    }

    /// Growth that begins late is detected when it begins.
    #[test]
    fn a_later_burst_is_foretold_too() {
        let burst: Vec<usize> = (1..=40usize)
            .map(|k| k + 100 * k.saturating_sub(30))
            .collect();
        let (when, found) = said(1500, 60, &burst).unwrap_or_else(|| panic!("nothing said"));
        assert!((31..=34).contains(&when), "{when}");
        assert!(found.frame > 40 && found.frame <= 60, "{found:?}");
    }
}
