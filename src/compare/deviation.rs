//! Error of one set of values relative to a reference.

use serde::Serialize;

use swell_domain::statistics::percentile;

/// A value that can be compared: scalars and 3-vectors, f32 or f64.
pub trait ComparedValue: Copy {
    /// Returns the Euclidean norm.
    fn norm(self) -> f64;
    /// Returns the norm of the difference, in f64; infinite if either value is not finite, so that
    /// NaN is the worst error and never none.
    fn error(self, reference: Self) -> f64;
}

impl ComparedValue for f64 {
    fn norm(self) -> f64 {
        self.abs()
    }

    fn error(self, reference: Self) -> f64 {
        finite_or_worst((self - reference).abs())
    }
}

impl ComparedValue for f32 {
    fn norm(self) -> f64 {
        f64::from(self).abs()
    }

    fn error(self, reference: Self) -> f64 {
        f64::from(self).error(reference.into())
    }
}

impl ComparedValue for [f64; 3] {
    fn norm(self) -> f64 {
        glam::DVec3::from(self).length()
    }

    fn error(self, reference: Self) -> f64 {
        finite_or_worst(glam::DVec3::from(self).distance(reference.into()))
    }
}

impl ComparedValue for glam::DVec3 {
    fn norm(self) -> f64 {
        self.length()
    }

    fn error(self, reference: Self) -> f64 {
        finite_or_worst(self.distance(reference))
    }
}

impl ComparedValue for [f32; 3] {
    fn norm(self) -> f64 {
        self.map(f64::from).norm()
    }

    fn error(self, reference: Self) -> f64 {
        self.map(f64::from).error(reference.map(f64::from))
    }
}

fn finite_or_worst(error: f64) -> f64 {
    if error.is_finite() {
        error
    } else {
        f64::INFINITY
    }
}

/// Error |a − b| of values a relative to their reference b, in the unit of the values; the norm for
/// vectors. All zero if there are no values. Infinity is null in JSON.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Deviation {
    /// Number of pairs compared.
    pub count: usize,
    /// Largest error.
    pub max: f64,
    /// Index of the first pair with the largest error; `None` if all errors are zero.
    pub max_at: Option<usize>,
    /// Root mean square error.
    pub rms: f64,
    /// Error that half of the pairs do not exceed.
    pub p50: f64,
    /// Error that 99 % of the pairs do not exceed.
    pub p99: f64,
    /// Root mean square of the reference.
    pub reference_rms: f64,
    /// Largest norm in the reference.
    pub reference_max: f64,
}

impl Deviation {
    /// Measures pairs of a value and its reference.
    pub fn of<T: ComparedValue>(pairs: impl IntoIterator<Item = (T, T)>) -> Self {
        let mut reference_squares = 0.0;
        let mut this = Self::default();
        let errors: Vec<f64> = pairs
            .into_iter()
            .map(|(value, reference)| {
                let norm = reference.norm();
                reference_squares += norm * norm;
                this.reference_max = this.reference_max.max(norm);
                value.error(reference)
            })
            .collect();
        for (index, &error) in errors.iter().enumerate() {
            if error > this.max {
                (this.max, this.max_at) = (error, Some(index));
            }
        }
        this.count = errors.len();
        let mean = |squares: f64| (squares / errors.len().max(1) as f64).sqrt();
        this.rms = mean(errors.iter().map(|error| error * error).sum());
        this.reference_rms = mean(reference_squares);
        this.p50 = percentile(errors.clone(), 0.5).unwrap_or(0.0);
        this.p99 = percentile(errors, 0.99).unwrap_or(0.0);
        this
    }

    /// Measures an array against a reference.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn between<T: ComparedValue>(values: &[T], reference: &[T]) -> Self {
        assert_eq!(values.len(), reference.len(), "pairs of values");
        Self::of(values.iter().copied().zip(reference.iter().copied()))
    }

    /// Returns the RMS error relative to the reference's RMS, ‖a − b‖/‖b‖: 0 if there is no error,
    /// infinite for an error relative to a reference of zeros.
    pub fn relative_rms(&self) -> f64 {
        relative(self.rms, self.reference_rms)
    }

    /// Returns the largest error relative to the largest norm in the reference, with the same rule
    /// for zeros.
    pub fn relative_max(&self) -> f64 {
        relative(self.max, self.reference_max)
    }
}

/// Iterates over the measures that exceed their limits, with value and limit; a measure without a
/// limit is not judged.
pub fn out_of_limits<const N: usize>(
    measures: [(&'static str, f64, Option<f64>); N],
) -> impl Iterator<Item = (&'static str, f64, f64)> {
    let over = |(measure, value, limit): (&'static str, f64, Option<f64>)| {
        Some((measure, value, limit.filter(|&limit| value > limit)?))
    };
    measures.into_iter().filter_map(over)
}

/// Returns error over scale; 0 for no error, whatever the scale, and infinite if the ratio is
/// not finite.
pub fn relative(error: f64, scale: f64) -> f64 {
    if error == 0.0 {
        0.0
    } else {
        finite_or_worst(error / scale.abs())
    }
}

/// Returns the index of the first pair whose error exceeds `tolerance`.
pub fn first_over<T: ComparedValue>(
    pairs: impl IntoIterator<Item = (T, T)>,
    tolerance: f64,
) -> Option<usize> {
    pairs
        .into_iter()
        .position(|(value, reference)| value.error(reference) > tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_values_have_no_error_and_none_have_none() {
        let values = [1.0, -2.0, 3.0];
        let found = Deviation::between(&values, &values);
        assert_eq!((found.max, found.max_at, found.rms), (0.0, None, 0.0));
        assert_eq!((found.count, found.reference_max), (3, 3.0));
        assert_eq!(found.relative_rms(), 0.0);
        assert_eq!(Deviation::between::<f64>(&[], &[]), Deviation::default());
        // Zero error relative to a reference of zeros is zero.
        assert_eq!(Deviation::between(&[0.0], &[0.0]).relative_max(), 0.0);
    }

    #[test]
    fn figures_of_a_known_error() {
        // Errors 0, 1, ..., 99: the 50th of them is 49, the 99th is 98.
        let reference = [2.0; 100];
        let values: Vec<f64> = (0..100).map(|k| 2.0 - f64::from(k)).collect();
        let found = Deviation::between(&values, &reference);
        assert_eq!((found.max, found.max_at), (99.0, Some(99)));
        assert_eq!((found.p50, found.p99), (49.0, 98.0));
        // Σ k² for k < n is (n−1) n (2n−1) / 6.
        assert!((found.rms - (99.0 * 199.0 / 6.0_f64).sqrt()).abs() < 1e-12);
        assert_eq!(found.reference_rms, 2.0);
        assert_eq!(found.relative_max(), 49.5);
        assert_eq!(found.relative_rms(), found.rms / 2.0);
        let pairs = || values.iter().copied().zip(reference);
        assert_eq!(first_over(pairs(), 0.0), Some(1));
        assert_eq!(first_over(pairs(), 98.5), Some(99));
        assert_eq!(first_over(pairs(), 99.0), None);
    }

    #[test]
    fn vectors_are_compared_by_the_norm() {
        let found = Deviation::between(&[[3.0f32, 0.0, 4.0]], &[[0.0, 0.0, 0.0]]);
        assert_eq!((found.max, found.rms), (5.0, 5.0));
        assert_eq!(found.relative_rms(), f64::INFINITY);
        // Values are widened before the subtraction: 1 and its f32 neighbour.
        let next = f32::from_bits(1.0f32.to_bits() + 1);
        let found = Deviation::between(&[[next, 0.0, 0.0]], &[[1.0, 0.0, 0.0]]);
        assert_eq!(found.max, f64::from(f32::EPSILON));
    }

    #[test]
    fn what_is_not_finite_is_the_worst() {
        for (value, reference) in [
            (f64::NAN, 0.0),
            (0.0, f64::NAN),
            (f64::NAN, f64::NAN),
            (f64::INFINITY, f64::INFINITY),
        ] {
            let pairs = [(1.0, 1.0), (value, reference), (5.0, 1.0)];
            let found = Deviation::of(pairs);
            assert_eq!((found.max, found.max_at), (f64::INFINITY, Some(1)));
            assert_eq!((found.rms, found.p50), (f64::INFINITY, 4.0));
            assert_eq!(found.relative_rms(), f64::INFINITY);
            assert_eq!(found.relative_max(), f64::INFINITY);
            assert_eq!(first_over(pairs, 1e300), Some(1));
        }
    }
}
