//! Eigenvalues of symmetric 3 × 3 matrices.

use glam::{DMat3, DVec3};

/// Jacobi sweeps: they converge quadratically, and five reduce the error of any 3 × 3 matrix below
/// f64 rounding.
const SWEEPS: usize = 6;
/// Fraction of the diagonal below which an off-diagonal element changes no eigenvalue by more than
/// a rounding. Eigenvectors of eigenvalues this close together are arbitrary in their plane.
const NEGLIGIBLE: f64 = 0.1 * f64::EPSILON;

/// Returns the eigenvalues of a symmetric matrix, in no particular order, and the eigenvectors as
/// columns, by the cyclic Jacobi method (Golub and Van Loan, Matrix Computations, section 8.5).
pub fn symmetric(matrix: DMat3) -> (DVec3, DMat3) {
    let mut a = matrix.to_cols_array_2d();
    let mut vectors = DMat3::IDENTITY.to_cols_array_2d();
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            // The element is below the rounding of the eigenvalues.
            if a[p][q].abs() <= NEGLIGIBLE * (a[p][p].abs() + a[q][q].abs()) {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for row in &mut a {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            turn(&mut a, [p, q], [c, s]);
            turn(&mut vectors, [p, q], [c, s]);
        }
    }
    let values = DVec3::new(a[0][0], a[1][1], a[2][2]);
    (values, DMat3::from_cols_array_2d(&vectors))
}

/// Applies a Givens rotation to two rows.
fn turn(rows: &mut [[f64; 3]; 3], [p, q]: [usize; 2], [c, s]: [f64; 2]) {
    let (x, y) = (rows[p], rows[q]);
    rows[p] = std::array::from_fn(|k| c * x[k] - s * y[k]);
    rows[q] = std::array::from_fn(|k| s * x[k] + c * y[k]);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rotated diagonal matrices, with eigenvalues near and far apart, are rebuilt as A = Σ λ v vᵀ
    /// with orthogonal v.
    #[test]
    fn a_matrix_is_put_together_again_from_its_eigenvalues() {
        for (values, turn) in [
            (DVec3::new(1.0, 2.0, 3.0), 0.3),
            (DVec3::new(1.0, 1.0, 1e-9), 1.2),
            (DVec3::new(-5.0, 0.0, 1e6), 2.9),
        ] {
            let r = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), turn);
            let matrix = r * DMat3::from_diagonal(values) * r.transpose();
            let (found, vectors) = symmetric(matrix);
            let again = vectors * DMat3::from_diagonal(found) * vectors.transpose();
            // A few roundings of the greatest eigenvalue.
            let allowed = 64.0 * f64::EPSILON * values.abs().max_element();
            let off = |a: DMat3, b: DMat3| (a - b).to_cols_array().map(f64::abs);
            assert!(off(again, matrix).iter().all(|&x| x <= allowed), "{values}");
            let unit = vectors.transpose() * vectors;
            assert!(off(unit, DMat3::IDENTITY).iter().all(|&x| x < 1e-14));
            let mut sorted = [found.to_array(), values.to_array()];
            for list in &mut sorted {
                list.sort_by(f64::total_cmp);
            }
            let [found, wanted] = sorted.map(DVec3::from_array);
            assert!((found - wanted).abs().max_element() <= allowed, "{found}");
        }
    }
}
