//! How wet surfaces are: finely sampled surfaces, their contact with water, and drying.

mod contact;
mod refined;

pub use contact::Contact;
pub use refined::{MOST_VERTICES, RefinedSurface, TooFine};

/// Attribute of a point of a wet surface: 1 in contact with water, 0 where it is dry.
pub const WETNESS: &str = "wetness";

/// Contact distance, particle spacings.
///
/// Particles at rest lie half a spacing from a wall. A point of the wall is at most √2/2 of a
/// spacing beside the nearest of them, where the layer is a square lattice, hence at most 0.87
/// spacings away; the second layer is 1.5 spacings away. One spacing finds the layer that touches
/// the wall, whatever its phase, and no other.
pub const CONTACT: f64 = 1.0;

/// Longest edge of the triangles that sample a surface, particle spacings: no finer than the water.
pub const EDGE: f64 = 1.0;

/// Drying time, seconds.
pub const DRYING: f64 = 120.0;

/// Returns the wetness after `seconds` of a surface that was `before` wet, with the drying time τ
/// in seconds: 1 in contact with water, else w exp(−t/τ).
pub fn next(before: f32, is_in_contact: bool, seconds: f64, drying: f64) -> f32 {
    match is_in_contact {
        true => 1.0,
        false => (f64::from(before) * (-seconds / drying).exp()) as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_left_the_water_dries_exponentially() {
        let (drying, seconds) = (0.4, 1.0 / 24.0);
        let mut wetness = next(0.0, true, seconds, drying);
        assert_eq!(wetness, 1.0);
        for step in 1..=48 {
            wetness = next(wetness, false, seconds, drying);
            let exact = (-f64::from(step) * seconds / drying).exp();
            // A rounding to f32 a step, and the sum of the steps' times.
            let allowed = f64::from(step) * f64::from(f32::EPSILON);
            assert!(
                (f64::from(wetness) / exact - 1.0).abs() <= allowed,
                "{step}"
            );
            // Control: linear drying.
            assert!((1.0 - f64::from(step) * seconds / drying - exact).abs() > allowed);
        }
        assert_eq!(next(wetness, true, seconds, drying), 1.0);
        assert_eq!(next(0.0, false, seconds, drying), 0.0);
    }
}
