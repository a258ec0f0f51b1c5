//! Linear least squares with a few unknowns.

/// Unknowns that fit equations best, each its coefficients and then its right-hand side, by the
/// normal equations; `None` if they are singular. To each square of an unknown's coefficients
/// `ridge` of the mean of all is added.
pub(crate) fn least_squares<const N: usize, const WIDTH: usize>(
    equations: impl Iterator<Item = [f64; WIDTH]>,
    ridge: f64,
) -> Option<[f64; N]> {
    const { assert!(WIDTH == N + 1, "coefficients and a right-hand side") };
    let mut normal = [[0.0; WIDTH]; N];
    for equation in equations {
        for (line, a) in normal.iter_mut().zip(equation) {
            for (sum, b) in line.iter_mut().zip(equation) {
                *sum += a * b;
            }
        }
    }
    let trace: f64 = (0..N).map(|k| normal[k][k]).sum();
    for (k, line) in normal.iter_mut().enumerate() {
        line[k] += ridge * trace / N as f64;
    }
    solved(normal)
}

/// Solves linear equations, right-hand sides last, by Gaussian elimination with pivoting; `None` if
/// they are singular.
fn solved<const N: usize, const WIDTH: usize>(mut rows: [[f64; WIDTH]; N]) -> Option<[f64; N]> {
    let scale = rows.iter().flatten().fold(0.0f64, |a, v| a.max(v.abs()));
    for k in 0..N {
        let pivot = (k..N).max_by(|&a, &b| rows[a][k].abs().total_cmp(&rows[b][k].abs()))?;
        rows.swap(k, pivot);
        let row = rows[k];
        // Also false for NaN.
        if row[k].abs().partial_cmp(&(1e-9 * scale)) != Some(std::cmp::Ordering::Greater) {
            return None;
        }
        for other in (0..N).filter(|&other| other != k) {
            let factor = rows[other][k] / row[k];
            for (value, of_row) in rows[other].iter_mut().zip(row) {
                *value -= factor * of_row;
            }
        }
    }
    Some(std::array::from_fn(|k| rows[k][N] / rows[k][k]))
}
