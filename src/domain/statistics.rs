//! Median and percentiles.

/// Returns the median, the upper one of two middle values; `None` for an empty list.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Returns the least value that a fraction `p` (0 to 1) of all values does not exceed; `None` for
/// an empty list.
pub fn percentile(mut values: Vec<f64>, p: f64) -> Option<f64> {
    let index = (values.len() as f64 * p).ceil() as usize;
    let index = index.saturating_sub(1);
    (index < values.len()).then(|| *values.select_nth_unstable_by(index, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn middles_and_tails() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(Vec::new()), None);
        let thousand: Vec<f64> = (1..=1000).map(f64::from).collect();
        assert_eq!(percentile(thousand.clone(), 0.999), Some(999.0));
        assert_eq!(percentile(thousand, 1.0), Some(1000.0));
        assert_eq!(percentile(Vec::new(), 0.5), None);
        // By hand: 4 of these 7 are a fraction of 0.571, and 5 one of 0.714.
        let seven = vec![9.0, 2.0, 4.0, 7.0, 3.0, 8.0, 5.0];
        let at = |p| percentile(seven.clone(), p);
        assert_eq!(
            [at(0.57), at(0.572), at(0.71), at(0.72)].map(Option::unwrap),
            [5.0, 7.0, 7.0, 8.0]
        );
        assert_eq!((at(0.01), at(0.99)), (Some(2.0), Some(9.0)));
        assert_eq!(median(seven[..6].to_vec()), Some(7.0));
    }
}
