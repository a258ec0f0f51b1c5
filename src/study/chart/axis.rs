//! A linear or logarithmic chart axis and its tick positions.

/// Approximate number of intervals on a linear axis.
const INTERVALS: f64 = 5.0;

/// The range of an axis and where it lies on the paper.
pub(super) struct Axis {
    is_log: bool,
    /// First and last value; their decimal exponents on a logarithmic axis.
    ends: [f64; 2],
    pub(super) paper: [f64; 2],
}

impl Axis {
    /// An axis that covers all values; a logarithmic one ignores those that are not positive.
    pub(super) fn new(
        is_log: bool,
        has_room: bool,
        values: impl Iterator<Item = f64>,
        paper: [f64; 2],
    ) -> Self {
        let ends = match is_log {
            true => log_ends(values),
            false => linear_ends(values, has_room),
        };
        Self {
            is_log,
            ends,
            paper,
        }
    }

    /// First and last value of a linear axis.
    pub(super) fn ends(&self) -> [f64; 2] {
        self.ends
    }

    /// Position of a value as a fraction of the axis; outside of 0 to 1 it is off the axis.
    pub(super) fn part(&self, value: f64) -> f64 {
        let place = if self.is_log { value.log10() } else { value };
        (place - self.ends[0]) / (self.ends[1] - self.ends[0])
    }

    pub(super) fn at(&self, value: f64) -> f64 {
        self.paper[0] + self.part(value) * (self.paper[1] - self.paper[0])
    }

    /// Values of the numbered ticks, and of the unnumbered grid lines.
    pub(super) fn ticks(&self) -> (Vec<f64>, Vec<f64>) {
        match self.is_log {
            true => log_ticks(self.ends),
            false => (linear_ticks(self.ends), Vec::new()),
        }
    }
}

/// Minimum and maximum of the finite values.
fn span(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values
        .filter(|v| v.is_finite())
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| {
            [a.min(v), b.max(v)]
        })
}

/// Covers all positive values with a small margin; at least half a decade.
fn log_ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let [low, high] = span(values.filter(|value| *value > 0.0).map(f64::log10));
    if low > high {
        return [0.0, 1.0];
    }
    let room = 0.07 * (high - low) + (0.25 - 0.5 * (high - low)).max(0.0);
    [low - room, high + room]
}

/// Ends that are never equal. `has_room` adds a margin, so that lines do not touch the frame, and
/// includes 0 if that costs little.
fn linear_ends(values: impl Iterator<Item = f64>, has_room: bool) -> [f64; 2] {
    let [mut low, mut high] = span(values);
    if low > high {
        return [0.0, 1.0];
    }
    if has_room {
        if low > 0.0 && low < 0.5 * high {
            low = 0.0;
        }
        let span = high - low;
        high += 0.06 * span;
        low -= if low == 0.0 { 0.0 } else { 0.06 * span };
    }
    if high - low <= 1e-12 * high.abs().max(1e-6) {
        let half = 0.5 * high.abs().max(1.0);
        return [low - half, high + half];
    }
    [low, high]
}

/// Round numbers (1, 2 or 5 times a power of ten) within the ends.
fn linear_ticks([low, high]: [f64; 2]) -> Vec<f64> {
    let rough = (high - low) / INTERVALS;
    let decade = 10f64.powf(rough.log10().floor());
    let steps = [1.0, 2.0, 5.0].map(|m| m * decade).into_iter();
    let step = steps
        .filter(|step| *step >= rough * (1.0 - 1e-9))
        .fold(10.0 * decade, f64::min);
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

fn log_ticks([low, high]: [f64; 2]) -> (Vec<f64>, Vec<f64>) {
    let digits: &[u32] = match high - low {
        span if span < 1.2 => &[1, 2, 3, 5, 7],
        span if span < 2.5 => &[1, 2, 5],
        _ => &[1],
    };
    let stride = (((high - low) / 8.0).ceil() as i32).max(1);
    let (mut numbered, mut plain) = (Vec::new(), Vec::new());
    for decade in low.floor() as i32..=high.ceil() as i32 {
        for digit in 1..10 {
            let value = f64::from(digit) * 10f64.powi(decade);
            if !(low..=high).contains(&value.log10()) {
                continue;
            }
            if digits.contains(&digit) && decade % stride == 0 {
                numbered.push(value);
            } else if stride == 1 || digit == 1 {
                plain.push(value);
            }
        }
    }
    (numbered, plain)
}

/// A tick label with as few digits as needed.
pub(super) fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if (1e-3..1e5).contains(&value.abs()) {
        let text = format!("{value:.4}");
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    format!("{value:.0e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within() {
        assert_eq!(linear_ticks([0.0, 10.0]), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(linear_ticks([-1.0, 1.3]), [-1.0, -0.5, 0.0, 0.5, 1.0]);
        let fine: Vec<String> = linear_ticks([0.0, 0.004]).into_iter().map(number).collect();
        assert_eq!(fine, ["0", "0.001", "0.002", "0.003", "0.004"]);
        assert_eq!(number(1234567.0), "1e6");
    }
}
