//! Aerodynamic drag on drops of water.

use glam::DVec3;

/// Density of air relative to that of water, at 15 °C.
pub const DENSITY: f64 = 1.225 / 999.1;
/// Kinematic viscosity of air at 15 °C, m²/s.
pub const VISCOSITY: f64 = 1.48e-5;

/// Returns the rate at which drag reduces a drop's speed relative to the air, 1/s: 3/8 (ρ_air/ρ)
/// C_D |w| / r. C_D is the drag coefficient of a sphere by Schiller and Naumann 1933 (Clift, Grace
/// and Weber 1978, table 5.1): 24/Re (1 + 0.15 Re^0.687), at least 0.44. `radius` in metres,
/// `speed` relative to the air in m/s.
pub fn resistance(radius: f64, speed: f64) -> f64 {
    let reynolds = 2.0 * radius * speed / VISCOSITY;
    // C_D relative to Stokes drag, 24/Re.
    let over_stokes = (1.0 + 0.15 * reynolds.powf(0.687)).max(0.44 / 24.0 * reynolds);
    4.5 * VISCOSITY * DENSITY / (radius * radius) * over_stokes
}

/// Returns a drop's velocity, m/s, after one step of gravity and of drag in air that moves with
/// `wind`. `fall` is what gravity adds in the step, m/s. The update is implicit in the velocity: no
/// step overshoots the wind, and a drop reaches its terminal speed however long the steps are.
pub fn blown([velocity, fall]: [DVec3; 2], wind: DVec3, radius: f64, seconds: f64) -> DVec3 {
    let against = velocity - wind;
    wind + (against + fall) / (1.0 + seconds * resistance(radius, against.length()))
}

/// Returns the fraction of a lone drop's drag that acts on a particle whose neighbourhood holds
/// this `share` of water: 1 for a drop in open air, falling to 0 at `of_plane`, the share below a
/// plane surface, and 0 deeper in the water.
pub fn exposure(share: f64, of_plane: f64) -> f64 {
    (1.0 - share / of_plane).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Terminal speed of a drop, m/s, by fixed-point iteration of gravity and drag.
    fn terminal_speed(radius: f64) -> f64 {
        let mut speed = 1.0;
        for _ in 0..200 {
            // Solves g = resistance(speed) speed; damped by half, because resistance grows with
            // the speed.
            speed = 0.5 * (speed + 9.81 / resistance(radius, speed));
        }
        speed
    }

    /// Gunn and Kinzer 1949, table 2 (drops in stagnant air, 20 °C): diameters of 0.2, 0.5, 1 and 2
    /// mm fall at 0.72, 2.06, 4.03 and 6.49 m/s. The sphere's drag agrees within 5 %, and within 7
    /// % for the largest, which flattens and falls slower than a sphere.
    #[test]
    fn drops_fall_as_gunn_and_kinzer_measured() {
        let cases = [
            (0.2e-3, 0.72, 0.05),
            (0.5e-3, 2.06, 0.05),
            (1e-3, 4.03, 0.05),
            (2e-3, 6.49, 0.07),
        ];
        for (diameter, measured, allowed) in cases {
            let speed = terminal_speed(0.5 * diameter);
            let off = speed / measured - 1.0;
            assert!(
                off.abs() < allowed,
                "{diameter}: {speed} against {measured}"
            );
            // Negative control: half the radius falls at a different speed.
            assert!((terminal_speed(0.25 * diameter) / measured - 1.0).abs() > 0.2);
        }
    }

    /// Stokes 1851: 6πηrw on a mass of 4/3 πr³ρ.
    #[test]
    fn slow_drops_have_stokes_drag_and_those_at_rest_as_well() {
        let [radius, density] = [1e-5, 999.1];
        let mass = 4.0 / 3.0 * std::f64::consts::PI * f64::powi(radius, 3) * density;
        let stokes = 6.0 * std::f64::consts::PI * VISCOSITY * 1.225 * radius / mass;
        assert!((resistance(radius, 0.0) / stokes - 1.0).abs() < 1e-12);
        assert!((resistance(radius, 1e-4) / stokes - 1.0).abs() < 1e-2);
        // At 1 m/s Re is 1.35, and the drag 18 % higher.
        assert!((resistance(radius, 1.0) / stokes - 1.184).abs() < 2e-3);
    }

    #[test]
    fn no_step_takes_a_drop_beyond_the_wind() {
        let wind = DVec3::new(30.0, 0.0, 0.0);
        let velocity = DVec3::new(-5.0, 8.0, 0.0);
        let mut before = (velocity - wind).length();
        for seconds in [1e-3, 1.0, 1e3, 1e6] {
            let after = blown([velocity, DVec3::ZERO], wind, 1e-3, seconds) - wind;
            assert!(after.length() < before && after.dot(velocity - wind) > 0.0);
            before = after.length();
        }
    }

    #[test]
    fn a_drop_falls_as_fast_in_steps_of_any_length() {
        let [radius, gravity] = [5e-4, 9.81];
        for seconds in [1e-3, 0.02, 0.2] {
            let fall = DVec3::new(0.0, -gravity * seconds, 0.0);
            let wind = DVec3::new(3.0, 0.0, 0.0);
            let after = |v: DVec3| blown([v, fall], wind, radius, seconds);
            let steady = (0..4000).fold(DVec3::ZERO, |v, _| after(v));
            let off = steady - DVec3::new(3.0, -terminal_speed(radius), 0.0);
            assert!(off.length() < 1e-3, "{seconds}: {steady}");
        }
    }

    #[test]
    fn what_lies_in_water_is_not_exposed() {
        assert_eq!(exposure(0.0, 0.4), 1.0);
        assert_eq!(exposure(0.2, 0.4), 0.5);
        assert_eq!(exposure(0.4, 0.4), 0.0);
        assert_eq!(exposure(1.0, 0.4), 0.0);
    }
}
