//! Constants and formulas of the PBF model that the GPU solver and its reference share.

/// Smallest distance of particles from walls and solids, in particle spacings; in the resting
/// lattice it is 0.5.
pub const CONTACT: f64 = 0.25;

/// Largest correction of one iteration, in particle spacings d. Physical masses with the paper's
/// formulas verbatim blow up without it.
pub const MAX_CORRECTION: f64 = 0.5;

/// Displacement cap of a substep relative to the CFL displacement. Particles that accelerate beyond
/// it within a frame are slowed and counted.
pub const CAP: f64 = 2.0;

/// ε of λ's denominator, relative to the bulk's Σ|∇C|². An ε as large as that sum doubles the
/// iterations (measured).
pub const REGULARIZATION: f64 = 1e-3;

/// Density that the other particles contribute at a particle of a plane surface, relative to that
/// deep in the water. It is 0.77 for the topmost layer of a lattice and 0.53 for a single layer.
pub const PLANE_SHARE: f64 = 2.0 / 3.0;

/// Returns the factors of the Chebyshev semi-iteration (Golub and Varga 1961; Wang 2015, eq. 9),
/// one per iteration: 1, 2 / (2 − ρ²), and then 4 / (4 − ρ² ω).
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

    /// The polynomial of degree 20 reduces an error at the edge of the spectrum by 1 / T_20(1/ρ).
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
