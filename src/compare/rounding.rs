//! First-order bounds of f32 rounding errors in sums over neighbours.
//!
//! Inputs are equal on both sides, so that a difference of positions is exact to half a unit in its
//! last place, however far from the origin. With u = 2⁻²⁴, a sum, difference or product has an
//! error of u relative to its value, a quotient 5 u, an inverse square root 4 u, a square root 9 u
//! (WGSL's accuracy: correctly rounded, 2.5 ulp, 2 ulp, and the square root through the inverse
//! root). With q = r/h:
//!
//! - r²: 5 u (each square 3 u, two sums); 1 − q²: 5 + 4 u of q² and u; p³ of it: 30 u p² + 2 u p³;
//! - r = r² / √r²: 9 u; s = 1 − q: 11 u; s²: 22 u s + u s²; d s²/r: 22 u s + 11 u s²;
//! - a sum of n terms: n u of the sum of their magnitudes (Higham 2002, eq. 4.4).

use super::tolerance::bounds;

/// Unit roundoff of f32.
pub const U: f64 = 1.0 / (1 << 24) as f64;

/// Unit roundoff of f64.
pub const U64: f64 = 1.0 / (1u64 << 53) as f64;

/// Magnitudes of the weighted terms in a particle's sums over neighbours, with p = 1 − q² and
/// s = 1 − q.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sums {
    /// Number of terms.
    pub count: f64,
    /// Σ w p².
    pub p2: f64,
    /// Σ w p³.
    pub p3: f64,
    /// Σ w s.
    pub s1: f64,
    /// Σ w s².
    pub s2: f64,
}

impl Sums {
    /// Adds a neighbour at distance q h whose term has the factor `weight`.
    pub fn add(&mut self, q: f64, weight: f64) {
        let p = (1.0 - q * q).max(0.0);
        let s = (1.0 - q).max(0.0);
        self.count += 1.0;
        self.p2 += weight * p * p;
        self.p3 += weight * p * p * p;
        self.s1 += weight * s;
        self.s2 += weight * s * s;
    }

    /// Returns [`KERNEL`] for these sums.
    pub fn kernel(&self) -> f64 {
        KERNEL.of([self.count, self.p2, self.p3])
    }

    /// Returns [`GRADIENT`] for these sums.
    pub fn gradient(&self) -> f64 {
        GRADIENT.of([self.count, self.s1, self.s2])
    }

    /// Returns [`SQUARES`] for these sums.
    pub fn squares(&self) -> f64 {
        SQUARES.of([self.count, self.s2])
    }
}

bounds! {
    /// Error of Σ w p³.
    pub KERNEL = [n: "neighbours", p2: "Σ w p²", p3: "Σ w p³"] U * (30.0 * p2 + (n + 6.0) * p3),
        "with a few roundings more of what is multiplied on";
    /// Error of |Σ w d s²/r|.
    pub GRADIENT = [n: "neighbours", s1: "Σ w s", s2: "Σ w s²"] U * (22.0 * s1 + (n + 16.0) * s2),
        "with a few roundings more of what is multiplied on";
    /// Error of Σ w s⁴ for weights 1.
    pub SQUARES = [n: "neighbours", s2: "Σ w s²"] U * (n + 50.0) * s2,
        "each term 44 u s³ + 2 u s⁴, and s³, s⁴ ≤ s²";
    /// Error of a position's distance from a wall, relative to h.
    pub WALL_PLACE = [place: "by how much f32 misplaces a wall, over h"] place + 8.0 * U,
        "a difference and a quotient";
    /// Error of the walls' contribution, as half-spaces, to the relative density.
    pub WALL_DENSITY = [faces: "walls within h", q: "" WALL_PLACE]
        faces * (315.0 / 256.0 * q + 16.0 * U),
        "the fraction's slope is at most 315/256, and its polynomial adds 16 u";
    /// Error of the walls' contribution to the density gradient times h.
    pub WALL_GRADIENT = [faces: "walls within h", q: "" WALL_PLACE, density: "" WALL_DENSITY]
        faces * (405.0 / 128.0 * q + 20.0 * U + 1.5 * density),
        "the slope of the fraction's slope is at most 405/128, and its polynomial adds 16 u";
    /// Error of the relative density.
    pub DENSITY = [scale: "the kernel's scale", sums: "" KERNEL, walls: "" WALL_DENSITY,
        density: "the relative density"]
        scale * (sums + 6.0 * U) + walls + 2.0 * U * density, "";
    /// Error of |∇C| with respect to the particle itself.
    pub OWN_GRADIENT = [scale: "the gradient's scale", sums: "" GRADIENT,
        walls: "over h " WALL_GRADIENT, own: "|∇C| by itself"]
        scale * sums + walls + 2.0 * U * own, "";
    /// Error of Σ|∇C|² with respect to the neighbours.
    pub OTHER_GRADIENTS = [scale: "the gradient's scale", squares: "" SQUARES]
        scale * scale * squares, "";
    /// Error of Σ|∇C|²: |own|² of a vector, plus the neighbours' part.
    pub GRADIENT_SQUARES = [own: "|∇C| by itself", error: "" OWN_GRADIENT,
        others: "" OTHER_GRADIENTS]
        2.0 * own * error + error * error + 6.0 * U * own * own + others, "";
    /// Error of λ = −max(C, 0) / (Σ|∇C|² + ε).
    pub LAMBDA = [lambda: "|λ|", denominator: "Σ|∇C|² + ε", density: "" DENSITY,
        squares: "" GRADIENT_SQUARES]
        (density + lambda * squares) / denominator + 8.0 * U * lambda, "";
}

#[cfg(test)]
mod tests {
    use super::*;
    use swell_domain::sph::half_space_fraction;

    #[test]
    fn units_are_half_the_distance_from_1_to_the_next_number() {
        assert_eq!(U, f64::from(1.0f32.next_up() - 1.0) / 2.0);
        assert_eq!(U64, (1.0f64.next_up() - 1.0) / 2.0);
    }

    /// Bounds for walls that are displaced by h.
    fn walls(faces: f64) -> [f64; 2] {
        let q = WALL_PLACE.of([1.0]);
        let density = WALL_DENSITY.of([faces, q]);
        [density, WALL_GRADIENT.of([faces, q, density])]
    }

    /// A wall's displacement far above U is multiplied by the steepest slope, found by differences
    /// over 1e-6 at 2000 positions, to a relative 1e-5.
    #[test]
    fn walls_err_by_their_steepest_slope() {
        let e = 1e-6;
        let steepest = |f: &dyn Fn(f64) -> f64| {
            let slopes = (0..2000).map(|k| {
                let q = f64::from(k) / 2000.0;
                (f(q + e) - f(q)).abs() / e
            });
            slopes.fold(0.0, f64::max)
        };
        let [density, gradient] = walls(1.0);
        let spiky = |q: f64| 1.5 * (1.0 - q).powi(4) * (1.0 + 4.0 * q);
        for (found, steepest) in [
            (density, steepest(&half_space_fraction)),
            (gradient - 1.5 * density, steepest(&spiky)),
        ] {
            // No less than the slope, except for the error of the differences.
            let part = found / steepest;
            assert!((1.0 - 1e-9..1.0 + 1e-5).contains(&part), "{part}");
        }
        assert!((walls(3.0)[0] / density - 3.0).abs() < 1e-12);
    }

    /// λ and Σ|∇C|² with inputs perturbed in the worst direction by far more than U. The bounds are
    /// first-order: second-order terms and U leave deviations of about 1e-4.
    #[test]
    fn bounds_are_met_by_the_worst_inputs() {
        let (excess, denominator) = (0.05f64, 700.0);
        let value = -excess / denominator;
        let [density_error, square_error] = [1e-5 * excess, 1e-5 * denominator];
        let worst = -(excess + density_error) / (denominator - square_error);
        let bound = LAMBDA.of([value.abs(), denominator, density_error, square_error]);
        let part = bound / (worst - value).abs();
        // 8 u |λ| relative to 2e-5 |λ| is 2.4e-2.
        let rounded = 8.0 * U / 2e-5;
        assert!((part - 1.0 - rounded).abs() < 1e-4, "{part}");
        let (own, error) = (3.0, 1e-3);
        let grown = (own + error) * (own + error) - own * own;
        let part = GRADIENT_SQUARES.of([own, error, 0.5 * grown]) / (1.5 * grown);
        assert!((part - 1.0).abs() < 1e-3, "{part}");
    }

    /// Sums over 200 neighbours in f32, as the passes compute them, compared with f64: they are
    /// within the bound, and the bound is within a factor of 1000 of the error (it is a worst case
    /// over the signs of 200 × 10 roundings).
    #[test]
    fn bounds_hold_and_are_no_wider_than_they_need() {
        let h = 0.2f32;
        let (mut sums, mut kernel, mut exact) = (Sums::default(), 0.0f32, 0.0f64);
        for k in 0..200u32 {
            let at = |m: u32| (k.wrapping_mul(m) % 1009) as f32 / 1009.0 * 0.11;
            let d = [at(7), at(131), at(977)];
            let r2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            let inverse = 1.0 / h;
            let p = (1.0 - r2 * inverse * inverse).max(0.0);
            kernel += p * p * p;
            let wide = d.map(f64::from);
            let r2 = wide[0] * wide[0] + wide[1] * wide[1] + wide[2] * wide[2];
            let q2 = r2 / (f64::from(h) * f64::from(h));
            exact += (1.0 - q2).max(0.0).powi(3);
            sums.add(q2.sqrt(), 1.0);
        }
        let error = (f64::from(kernel) - exact).abs();
        assert!(error <= sums.kernel(), "{error:e} {:e}", sums.kernel());
        assert!(
            sums.kernel() < 1e-3 * exact && error > 1e-3 * sums.kernel(),
            "{error:e}"
        );
    }
}
