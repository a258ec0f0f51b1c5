//! Mean, minimum and maximum of a probe over the time before each sample.
//!
//! They follow only from the samples, which are in the ledger, so that a resumed bake writes the
//! same.

use std::collections::VecDeque;

use super::probes::Look;

/// The samples that are still in the window.
#[derive(Clone, Debug, Default)]
pub(super) struct Window {
    /// Start and end of the interval that a sample covers, seconds, and its values by column.
    held: VecDeque<(f64, f64, Vec<Option<f64>>)>,
    /// Time of the last sample, seconds.
    last: Option<f64>,
}

impl Window {
    /// Adds a sample and returns mean, minimum and maximum by column over the last `length`
    /// seconds.
    ///
    /// A value covers the interval since the sample before; the mean weights it by the part of the
    /// interval inside the window. Minimum and maximum range over the samples in the window.
    /// Missing values are ignored; without any value there is no mean.
    pub(super) fn take(&mut self, length: f64, look: Look<'_>) -> Vec<[Option<f64>; 3]> {
        let since = self.last.replace(look.time).unwrap_or(look.time);
        self.held
            .push_back((since, look.time, look.values.to_vec()));
        let begin = look.time - length;
        // A sample on the window's edge is outside, and round-off must not let it in.
        let edge = begin + 1e-9 * length;
        while self.held.front().is_some_and(|(_, end, _)| *end <= edge) {
            self.held.pop_front();
        }
        (0..look.values.len())
            .map(|column| self.of_column(column, begin))
            .collect()
    }

    fn of_column(&self, column: usize, begin: f64) -> [Option<f64>; 3] {
        let seen = || {
            let held = self.held.iter();
            held.filter_map(|(from, to, values)| Some((to - from.max(begin), values[column]?)))
        };
        let total: f64 = seen().map(|(span, _)| span).sum();
        let mean = if total > 0.0 {
            Some(seen().map(|(span, value)| span * value).sum::<f64>() / total)
        } else {
            // No interval yet: the first sample.
            seen().map(|(_, value)| value).next_back()
        };
        let values = || seen().map(|(_, value)| value);
        [
            mean,
            values().min_by(f64::total_cmp),
            values().max_by(f64::total_cmp),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(length: f64, looks: &[(f64, Option<f64>)]) -> Vec<[Option<f64>; 3]> {
        let mut window = Window::default();
        let take = |&(time, value): &(f64, Option<f64>)| {
            window.take(
                length,
                Look {
                    time,
                    values: &[value],
                },
            )[0]
        };
        looks.iter().map(take).collect()
    }

    /// Computed by hand, over 2 s at uneven times: each value covers the interval since the sample
    /// before.
    #[test]
    fn a_value_holds_since_the_look_before() {
        let looks = [(0.0, 10.0), (1.0, 2.0), (1.5, 4.0), (3.0, 8.0), (5.0, 1.0)];
        let found = run(2.0, &looks.map(|(time, value)| (time, Some(value))));
        let expected = [
            [10.0, 10.0, 10.0],
            [2.0, 2.0, 10.0],
            [(2.0 + 0.5 * 4.0) / 1.5, 2.0, 10.0],
            // The window begins at 1 s, which excludes the sample of 1 s.
            [(0.5 * 4.0 + 1.5 * 8.0) / 2.0, 4.0, 8.0],
            [1.0, 1.0, 1.0],
        ];
        assert_eq!(found, expected.map(|all| all.map(Some)));
    }

    /// sin² at 100 Hz, sampled at 1 kHz over its period of 10 ms: mean 1/2, range 0 to 1. Over half
    /// a period the mean differs.
    #[test]
    fn a_whole_period_has_its_mean() {
        let looks: Vec<_> = (0..100)
            .map(|k| {
                let time = f64::from(k) * 1e-3;
                (
                    time,
                    Some((std::f64::consts::PI * 100.0 * time).sin().powi(2)),
                )
            })
            .collect();
        for [mean, least, greatest] in run(0.01, &looks).into_iter().skip(10) {
            assert!((mean.unwrap() - 0.5).abs() < 1e-12, "{mean:?}");
            assert!(least.unwrap() < 1e-12 && greatest.unwrap() > 1.0 - 1e-12);
        }
        let half = run(0.005, &looks)[52][0].unwrap();
        assert!((half - 0.5).abs() > 0.1, "{half}");
    }

    #[test]
    fn what_was_not_seen_counts_for_nothing() {
        let found = run(
            10.0,
            &[(0.0, None), (1.0, None), (2.0, Some(6.0)), (3.0, None)],
        );
        let none = [None; 3];
        let six = [Some(6.0); 3];
        assert_eq!(found, [none, none, six, six]);
    }
}
