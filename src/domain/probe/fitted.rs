//! Interpolation of a particle field at a point.

use glam::{DMat3, DVec3};

/// Returns a field of the particles at `at`, from the plane that fits the particles within
/// `support` best under the kernel (1 − q²)³ (moving least squares): exact for a linear field, also
/// beside walls and surfaces. `None` if no particle is nearer than half of `support`; the kernel's
/// mean if there are too few for a plane.
pub fn fitted(points: impl Iterator<Item = (DVec3, f64)>, at: DVec3, support: f64) -> Option<f64> {
    let (mut near, mut nearest) = (Vec::new(), f64::MAX);
    for (x, value) in points {
        let q2 = (x - at).length_squared() / (support * support);
        if q2 < 1.0 {
            near.push((x - at, value, (1.0 - q2).powi(3)));
            nearest = nearest.min(q2);
        }
    }
    if nearest > 0.25 {
        return None;
    }
    let weights: f64 = near.iter().map(|(.., w)| w).sum();
    let center = near.iter().map(|(d, _, w)| *w * *d).sum::<DVec3>() / weights;
    let mean = near.iter().map(|(_, value, w)| w * value).sum::<f64>() / weights;
    let (mut spread, mut slope) = (DMat3::ZERO, DVec3::ZERO);
    for (d, value, w) in &near {
        let d = *d - center;
        spread += DMat3::from_cols(*w * d.x * d, *w * d.y * d, *w * d.z * d);
        slope += *w * (value - mean) * d;
    }
    // The spread of a half space of neighbours is about a twentieth of support² along each axis; a
    // sheet has next to none.
    let least = weights * 1e-3 * support * support;
    if spread.determinant() < least.powi(3) {
        return Some(mean);
    }
    Some(mean - (spread.inverse() * slope).dot(center))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::tests::block;
    use super::*;

    /// By hand, too few points for a plane: values 2 and 5 at a quarter and a half of the support,
    /// with weights (15/16)³ and (3/4)³.
    #[test]
    fn two_points_have_their_kernels_mean() {
        let pair = |near: f64| {
            let points = [(near * DVec3::X, 2.0), (0.5 * DVec3::Y, 5.0)];
            fitted(points.into_iter(), DVec3::ZERO, 1.0)
        };
        let weights = [(15.0f64 / 16.0).powi(3), 0.75f64.powi(3)];
        let mean = (2.0 * weights[0] + 5.0 * weights[1]) / (weights[0] + weights[1]);
        assert!((pair(0.25).unwrap() - mean).abs() < 1e-12);
        // There is water if a particle is within half of the support.
        let alone = |q: f64| fitted([(q * DVec3::X, 2.0)].into_iter(), DVec3::ZERO, 1.0);
        assert_eq!((alone(0.499), alone(0.501)), (Some(2.0), None));
    }

    /// A linear field is reproduced to rounding at the block's face and corner as in its middle;
    /// the mean does not do that.
    #[test]
    fn a_plane_is_fitted_exactly() {
        let particles = block([8, 8, 8], DVec3::ZERO);
        let field = |x: DVec3| 3.0 + x.dot(DVec3::new(1.0, -20.0, 5.0));
        let points = || {
            let all = particles.position.iter();
            all.map(|p| Vec3::from_array(*p).as_dvec3())
        };
        for at in [
            DVec3::splat(0.41),
            DVec3::new(0.4, 0.0, 0.33),
            DVec3::splat(0.8),
        ] {
            let found = fitted(points().map(|x| (x, field(x))), at, 0.2).unwrap();
            assert!((found - field(at)).abs() < 1e-9, "{found} {}", field(at));
        }
        let at = DVec3::splat(2.0);
        assert_eq!(fitted(points().map(|x| (x, 1.0)), at, 0.2), None);
        // A single layer does not determine a plane: its mean counts.
        let sheet = || points().filter(|x| x.y < 0.1);
        let found = fitted(sheet().map(|x| (x, 7.0)), DVec3::new(0.4, 0.05, 0.4), 0.2);
        assert!((found.unwrap() - 7.0).abs() < 1e-12);
    }
}
