//! SPH kernels, calibrated on the bulk lattice.
//!
//! Density is the poly6 sum; its gradient uses the spiky kernel (Müller 2003; Macklin and
//! Müller 2013). The particle mass follows from the lattice, so that water at rest has exactly
//! its rest density.

use std::f64::consts::PI;

/// Kernel factors for particles of spacing d on a cubic lattice with support radius h.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Support radius h, metres.
    pub support_radius: f64,
    /// Relative density per unit of (1 − q²)³, q = r/h.
    pub density_scale: f64,
    /// |∇C| per unit of (1 − q)², 1/m.
    pub gradient_scale: f64,
    /// Ratio of lattice density to continuum density beyond a face, about 0.9.
    pub wall_density_scale: f64,
    /// Weight, in fluid particles, of a boundary sample that represents d² of a solid's surface.
    pub sample_weight: f64,
    /// Fraction of a linear field's gradient that Σ_j (a_i + a_j) ∇W gives on the bulk lattice;
    /// 0.95 at h = 2d.
    pub linear_gradient: f64,
    /// Σ_k |∇_k C|² of a bulk particle, 1/m².
    pub bulk_gradient_squares: f64,
}

/// Returns the fraction of the bulk density that a half-space of continuous fluid contributes at
/// distance q h outside of it: 315/256 ∫_q^1 (1 − t²)⁴ dt.
#[inline]
pub fn half_space_fraction(q: f64) -> f64 {
    let q = q.clamp(0.0, 1.0);
    let q2 = q * q;
    let integral = q * (1.0 + q2 * (-4.0 / 3.0 + q2 * (6.0 / 5.0 + q2 * (-4.0 / 7.0 + q2 / 9.0))));
    0.5 - 315.0 / 256.0 * integral
}

impl Calibration {
    /// Evaluates the sums over the infinite cubic lattice; `spacing` in metres,
    /// `support_ratio` = h / d.
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

    /// Returns p / Σ λ of a substep of Δt seconds whose corrections were relaxed by ω, in Pa/m²:
    /// −ρ0 κ ω / Δt². `rest_density` is ρ0 in kg/m³, λ in m².
    ///
    /// Σ_j (λ_i + λ_j) ∇C displaces a particle as the pressure force −Σ_j m (p_i/ρ0² + p_j/ρ0²) ∇W
    /// does in Δt², except that on the lattice the sum gives only κ times a pressure's gradient
    /// ([`Self::linear_gradient`]). The limit on corrections is ignored.
    #[inline]
    pub fn pressure_scale(&self, rest_density: f64, relaxation: f64, time_step: f64) -> f64 {
        -rest_density * relaxation * self.linear_gradient / (time_step * time_step)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// Lattice sums for h = 2d: 0.81 of the bulk density at a face, 0.65 at an edge, 0.52 at a
    /// corner; products of the face value reproduce them.
    #[test]
    fn walls_meet_lattice_deficits() {
        let calibration = Calibration::new(0.1, 2.0);
        let face = 1.0 - calibration.wall_density_scale * half_space_fraction(0.25);
        assert!((face - 0.81).abs() < 0.005, "{face}");
        assert!((face * face - 0.65).abs() < 0.01, "{}", face * face);
        assert!((face.powi(3) - 0.52).abs() < 0.015, "{}", face.powi(3));
    }

    /// Compares the closed form with the midpoint rule, whose error is O(1/n²) < 1e-8.
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

    /// Spacings and h/d: at and between whole numbers, and 3, where the lattice has points on
    /// the rim.
    const CASES: [(f64, f64); 4] = [(0.1, 2.0), (0.07, 1.7), (0.25, 2.4), (1.3, 3.0)];

    /// Müller 2003, eq. 20, 1/m³.
    fn poly6(r: f64, h: f64) -> f64 {
        315.0 / (64.0 * PI * h.powi(9)) * (h * h - r * r).max(0.0).powi(3)
    }

    /// Müller 2003, eq. 21, 1/m³.
    fn spiky(r: f64, h: f64) -> f64 {
        15.0 / (PI * h.powi(6)) * (h - r).max(0.0).powi(3)
    }

    /// Gradient of spiky at the particle, 1/m⁴; `d` = x_i − x_j.
    fn spiky_gradient(d: DVec3, h: f64) -> DVec3 {
        let r = d.length();
        -45.0 / (PI * h.powi(6)) * (h - r).max(0.0).powi(2) * d / r
    }

    /// A cubic lattice around one of its points, which comes first; it reaches beyond every h
    /// of [`CASES`].
    fn lattice(spacing: f64) -> Vec<DVec3> {
        let line = || (-4..=4).map(f64::from);
        let all = line().flat_map(|x| line().flat_map(move |y| line().map(move |z| (x, y, z))));
        let mut points: Vec<DVec3> = all.map(|(x, y, z)| spacing * DVec3::new(x, y, z)).collect();
        points.sort_by(|a, b| a.length().total_cmp(&b.length()));
        points
    }

    /// Volume m/ρ0 of a particle, m³, such that the lattice has density ρ0: 1 = V Σ W.
    fn volume(spacing: f64, h: f64) -> f64 {
        let sum: f64 = lattice(spacing).iter().map(|x| poly6(x.length(), h)).sum();
        1.0 / sum
    }

    fn is_close(a: f64, b: f64, part: f64) -> bool {
        (a - b).abs() <= part * b.abs()
    }

    /// Properties of the kernels that the other tests rely on: both integrate to 1 over space, and
    /// the gradient is that of spiky. The midpoint rule with n steps errs by O(1/n²) < 1e-6, a
    /// central difference over e h by O(e²).
    #[test]
    fn kernels_of_the_statements_are_the_textbook_s() {
        let (h, n) = (0.3, 4000);
        let step = h / f64::from(n);
        for kernel in [poly6, spiky] {
            let shell = |k: u32| {
                let r = (f64::from(k) + 0.5) * step;
                4.0 * PI * r * r * kernel(r, h) * step
            };
            let integral: f64 = (0..n).map(shell).sum();
            assert!(is_close(integral, 1.0, 1e-6), "{integral}");
        }
        for r in [0.05, 0.15, 0.25] {
            let e = 1e-5 * h;
            let slope = (spiky(r + e, h) - spiky(r - e, h)) / (2.0 * e);
            let gradient = spiky_gradient(DVec3::new(0.0, r, 0.0), h);
            assert!(is_close(gradient.y, slope, 1e-7), "{gradient} {slope}");
        }
    }

    /// Sums of 100 positive f64 terms have a relative error of 1e-14; with some quotients, 1e-12.
    const ROUNDED: f64 = 1e-12;

    #[test]
    fn a_lattice_has_its_rest_density_by_poly6_with_the_particles_mass() {
        for (d, ratio) in CASES {
            let (found, h) = (Calibration::new(d, ratio), d * ratio);
            assert!(is_close(found.support_radius, h, ROUNDED));
            let each = |x: &DVec3| {
                let q = (x.length() / h).min(1.0);
                found.density_scale * (1.0 - q * q).powi(3)
            };
            let density: f64 = lattice(d).iter().map(each).sum();
            assert!(is_close(density, 1.0, ROUNDED), "{density}");
            let alone = volume(d, h) * poly6(0.0, h);
            assert!(is_close(found.density_scale, alone, ROUNDED), "{ratio}");
        }
    }

    /// ∇_j C_i = −V ∇_i W (Macklin and Müller 2013, eq. 8), and Σ_k |∇_k C_i|² over the particle
    /// and its neighbours.
    #[test]
    fn gradients_are_spiky_s_with_the_mass_of_poly6() {
        for (d, ratio) in CASES {
            let (found, h) = (Calibration::new(d, ratio), d * ratio);
            let v = volume(d, h);
            for q in [0.2, 0.5, 0.9] {
                let slope = v * spiky_gradient(DVec3::new(0.0, 0.0, q * h), h).length();
                let scaled = found.gradient_scale * (1.0 - q) * (1.0 - q);
                assert!(is_close(scaled, slope, ROUNDED), "{ratio} {q}");
            }
            let of = |x: &DVec3| -v * spiky_gradient(-*x, h);
            let others: Vec<DVec3> = lattice(d)[1..].iter().map(of).collect();
            let own: DVec3 = -others.iter().sum::<DVec3>();
            let squares =
                own.length_squared() + others.iter().map(|g| g.length_squared()).sum::<f64>();
            assert!(
                is_close(found.bulk_gradient_squares, squares, ROUNDED),
                "{ratio}: {} {squares}",
                found.bulk_gradient_squares
            );
        }
    }

    /// Σ_j (λ_i + λ_j) V ∇W on the lattice for λ = 3 + g · x is κ g for any direction of g; κ is
    /// 0.947 at h = 2d.
    #[test]
    fn a_linear_field_s_gradient_is_seen_in_part() {
        let g = DVec3::new(1.0, -2.0, 0.5);
        for (d, ratio) in CASES {
            let (found, h) = (Calibration::new(d, ratio), d * ratio);
            let lambda = |x: DVec3| 3.0 + g.dot(x);
            let pair = |x: &DVec3| (lambda(DVec3::ZERO) + lambda(*x)) * spiky_gradient(-*x, h);
            let sum: DVec3 = volume(d, h) * lattice(d)[1..].iter().map(pair).sum::<DVec3>();
            // The constant part cancels to rounding: 6 / h over g.
            let rounding = ROUNDED * (1.0 + 6.0 / h);
            let off = sum - found.linear_gradient * g;
            assert!(off.length() < rounding, "{ratio}: {off}");
            if ratio == 2.0 {
                assert!((found.linear_gradient - 0.947).abs() < 0.0005);
            }
        }
    }

    /// Water at rest: the λ whose relaxed corrections compensate the displacement by gravity in Δt²
    /// is a pressure that increases by ρ0 g with depth.
    #[test]
    fn pressure_of_still_water_rises_by_its_weight() {
        let (density, relaxation, step, gravity) = (1025.0, 0.7, 0.004, 9.81);
        for (d, ratio) in CASES {
            let (found, h) = (Calibration::new(d, ratio), d * ratio);
            let rise = |slope: f64| -> f64 {
                let pair = |x: &DVec3| slope * x.y * spiky_gradient(-*x, h).y;
                let sum: f64 = lattice(d)[1..].iter().map(pair).sum();
                relaxation * volume(d, h) * sum
            };
            // The slope that lifts by g Δt².
            let slope = gravity * step * step / rise(1.0);
            let pressure = found.pressure_scale(density, relaxation, step) * slope;
            assert!(
                is_close(pressure, -density * gravity, ROUNDED),
                "{pressure}"
            );
        }
    }

    /// A particle half a spacing from a wall, with the lattice only on its own side, has its rest
    /// density together with the wall's term: the kernel's integral over the half-space beyond, by
    /// the midpoint rule with 300² steps, which errs by a relative 2/300² = 2e-5 at most (measured
    /// 8e-6), times the wall's scale.
    #[test]
    fn walls_make_up_for_half_the_lattice() {
        for (d, ratio) in CASES {
            let (found, h) = (Calibration::new(d, ratio), d * ratio);
            let near = lattice(d).into_iter().filter(|x| x.z > -0.5 * d);
            let fluid: f64 = near.map(|x| volume(d, h) * poly6(x.length(), h)).sum();
            let n = 300;
            let height = (h - 0.5 * d) / f64::from(n);
            let disc = |z: f64| {
                let step = (h * h - z * z).sqrt() / f64::from(n);
                let ring = |j: u32| {
                    let r = (f64::from(j) + 0.5) * step;
                    2.0 * PI * r * poly6(r.hypot(z), h) * step
                };
                (0..n).map(ring).sum::<f64>()
            };
            let beyond = (0..n).map(|k| disc(0.5 * d + (f64::from(k) + 0.5) * height) * height);
            let wall = found.wall_density_scale * beyond.sum::<f64>();
            assert!(is_close(wall, 1.0 - fluid, 2e-5), "{ratio}: {wall} {fluid}");
        }
    }

    /// Same beside a solid whose surface is covered with samples (Akinci 2012): a sheet with 16² of
    /// them per squared spacing, each weighted by its area. The sum over the sheet approximates the
    /// integral to 2e-7 (poly6 is smooth there; measured).
    #[test]
    fn samples_make_up_for_half_the_lattice() {
        for (d, ratio) in CASES {
            let (found, h) = (Calibration::new(d, ratio), d * ratio);
            let v = volume(d, h);
            let near = lattice(d).into_iter().filter(|x| x.z > -0.5 * d);
            let fluid: f64 = near.map(|x| v * poly6(x.length(), h)).sum();
            let part = d / 16.0;
            let line = || (-64..64).map(|k| (f64::from(k) + 0.5) * part);
            let sheet = line().flat_map(|x| line().map(move |y| DVec3::new(x, y, 0.5 * d)));
            let weight = found.sample_weight * part * part / (d * d);
            let solid: f64 = sheet.map(|x| v * weight * poly6(x.length(), h)).sum();
            assert!(
                is_close(solid, 1.0 - fluid, 1e-6),
                "{ratio}: {solid} {fluid}"
            );
        }
    }

    /// Factors with a length unit scale with the spacing, dimensionless ones do not.
    #[test]
    fn scale_free() {
        let (a, b) = (Calibration::new(0.1, 2.0), Calibration::new(1.0, 2.0));
        assert!((a.gradient_scale / b.gradient_scale - 10.0).abs() < 1e-12);
        assert!((a.density_scale - b.density_scale).abs() < 1e-15);
        assert!((a.sample_weight - b.sample_weight).abs() < 1e-14);
    }
}
