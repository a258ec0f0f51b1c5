//! Numbers of the PBF model that the GPU solver and its reference share.

/// Particles keep this part of their spacing from walls and solids; at rest the lattice stands at 0.5.
pub const CONTACT: f64 = 0.25;

/// Largest correction of one iteration, in units of d; physical masses with the paper's formulas verbatim
/// blow up without.
pub const MAX_CORRECTION: f64 = 0.5;

/// Displacement cap of a substep over the CFL displacement: what speeds up within a frame beyond this is
/// slowed and counted.
pub const CAP: f64 = 2.0;

/// ε of λ's denominator over the bulk's Σ|∇C|². As large as that sum it doubles the iterations (measured).
pub const REGULARIZATION: f64 = 1e-3;

/// Density that the others make at a particle of a plane surface, over what they make deep in the water. The topmost layer of a
/// lattice has 0.77, a lone layer 0.53.
pub const PLANE_SHARE: f64 = 2.0 / 3.0;

/// Factors of the Chebyshev semi-iteration (Golub and Varga 1961; Wang 2015, eq. 9), one an iteration: 1,
/// 2 / (2 − ρ²), and then 4 / (4 − ρ² ω).
pub fn chebyshev_factors(spectral_radius: f64) -> impl Iterator<Item = f64> {
    let square = spectral_radius * spectral_radius;
    std::iter::successors(Some((0u32, 1.0)), move |&(k, omega)| {
        let next = if k == 0 {
            2.0 / (2.0 - square)
        } else {
            4.0 / (4.0 - square * omega)
        };
        Some((k + 1, next))
    })
    .map(|(_, omega)| omega)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The polynomial of degree 20 shrinks an error at the edge of the spectrum as 1 / T_20(1/ρ).
    #[test]
    fn factors_give_chebyshev_polynomials() {
        let rho: f64 = 0.98;
        let (mut before, mut now) = (1.0, 1.0);
        for (k, omega) in chebyshev_factors(rho).take(20).enumerate() {
            let next = if k == 0 {
                rho * now
            } else {
                omega * (rho * now - before) + before
            };
            (before, now) = (now, next);
        }
        let expected = 1.0 / (20.0 * (1.0 / rho).acosh()).cosh();
        assert!((now - expected).abs() < 1e-12, "{now} {expected}");
    }
}
