//! SPH kernels, calibrated on the bulk lattice.
//!
//! Density is the poly6 sum, its gradient the spiky slope (Müller 2003; Macklin and Müller 2013). Particle
//! mass follows from the lattice, so that water at rest has exactly its rest density.

use std::f64::consts::PI;

/// Kernel factors for particles of spacing d on a cubic lattice with support radius h.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// h, metres.
    pub support_radius: f64,
    /// Relative density per unit of (1 − q²)³, q = r/h.
    pub density_scale: f64,
    /// |∇C| per unit of (1 − q)², 1/m.
    pub gradient_scale: f64,
    /// Lattice density beyond a face over the continuum's, about 0.9.
    pub wall_density_scale: f64,
    /// Fluid particles' worth of one boundary sample that stands for d² of a solid's surface.
    pub sample_weight: f64,
    /// Part of a linear field's gradient that Σ_j (a_i + a_j) ∇W gives on the bulk lattice; 0.95 at h = 2d.
    pub linear_gradient: f64,
    /// Σ_k |∇_k C|² of a bulk particle, 1/m².
    pub bulk_gradient_squares: f64,
}

/// Fraction of the bulk density that a half-space of continuous fluid gives at distance q h outside it:
/// 315/256 ∫_q^1 (1 − t²)⁴ dt.
pub fn half_space_fraction(q: f64) -> f64 {
    let q = q.clamp(0.0, 1.0);
    let q2 = q * q;
    let integral = q * (1.0 + q2 * (-4.0 / 3.0 + q2 * (6.0 / 5.0 + q2 * (-4.0 / 7.0 + q2 / 9.0))));
    0.5 - 315.0 / 256.0 * integral
}

impl Calibration {
    /// Sums over the infinite cubic lattice; `spacing` in metres, `support_ratio` = h / d.
    pub fn new(spacing: f64, support_ratio: f64) -> Self {
        let h = spacing * support_ratio;
        let reach = support_ratio.ceil() as i32;
        let (mut kernel, mut below, mut squares, mut linear) = (0.0, 0.0, 0.0, 0.0);
        for z in -reach..=reach {
            for y in -reach..=reach {
                for x in -reach..=reach {
                    let q = f64::from(x * x + y * y + z * z).sqrt() / support_ratio;
                    if q >= 1.0 {
                        continue;
                    }
                    let w = (1.0 - q * q).powi(3);
                    kernel += w;
                    if z < 0 {
                        below += w;
                    }
                    if q > 0.0 {
                        squares += (1.0 - q).powi(4);
                        linear += f64::from(x * x) * (1.0 - q).powi(2) / (q * support_ratio);
                    }
                }
            }
        }
        let volume = 64.0 * PI * h.powi(3) / (315.0 * kernel);
        let gradient_scale = volume * 45.0 / (PI * h.powi(4));
        let face = 0.5 / support_ratio;
        let deficit = below / kernel;
        let plane = 315.0 / 256.0 * (1.0 - face * face).powi(4) / h;
        Self {
            support_radius: h,
            density_scale: 1.0 / kernel,
            gradient_scale,
            wall_density_scale: deficit / half_space_fraction(face),
            sample_weight: deficit * spacing * spacing / (volume * plane),
            linear_gradient: gradient_scale * spacing * linear,
            bulk_gradient_squares: gradient_scale * gradient_scale * squares,
        }
    }

    /// p / Σ λ of a substep of Δt seconds whose corrections were relaxed by ω: −ρ0 κ ω / Δt². Σ_j (λ_i + λ_j) ∇C moves
    /// a particle as the pressure force −Σ_j m (p_i/ρ0² + p_j/ρ0²) ∇W does in Δt², but that on the lattice the sum gives
    /// κ of a pressure's gradient ([`Self::linear_gradient`]). What a correction's bound cuts off counts as if it were
    /// not cut. λ in m², ρ0 in kg/m³; the result in Pa/m².
    pub fn pressure_scale(&self, rest_density: f64, relaxation: f64, time_step: f64) -> f64 {
        -rest_density * relaxation * self.linear_gradient / (time_step * time_step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Summed over the lattice, h = 2d: face 0.81, edge 0.65, corner 0.52 of bulk; the product of faces meets them.
    #[test]
    fn walls_meet_lattice_deficits() {
        let calibration = Calibration::new(0.1, 2.0);
        let face = 1.0 - calibration.wall_density_scale * half_space_fraction(0.25);
        assert!((face - 0.81).abs() < 0.005, "{face}");
        assert!((face * face - 0.65).abs() < 0.01, "{}", face * face);
        assert!((face.powi(3) - 0.52).abs() < 0.015, "{}", face.powi(3));
    }

    /// The closed form against the midpoint rule, error O(1/n²) < 1e-8.
    #[test]
    fn half_space_closed_form() {
        let n = 20_000;
        for q in [0.0, 0.1, 0.25, 0.5, 0.9] {
            let step = (1.0 - q) / f64::from(n);
            let sum: f64 = (0..n)
                .map(|k| (1.0 - (q + (f64::from(k) + 0.5) * step).powi(2)).powi(4) * step)
                .sum();
            assert!((half_space_fraction(q) - 315.0 / 256.0 * sum).abs() < 1e-8);
        }
    }

    /// Everything with a length scales with the spacing, everything without does not.
    #[test]
    fn scale_free() {
        let (a, b) = (Calibration::new(0.1, 2.0), Calibration::new(1.0, 2.0));
        assert!((a.gradient_scale / b.gradient_scale - 10.0).abs() < 1e-12);
        assert!((a.density_scale - b.density_scale).abs() < 1e-15);
        assert!((a.sample_weight - b.sample_weight).abs() < 1e-14);
    }
}
