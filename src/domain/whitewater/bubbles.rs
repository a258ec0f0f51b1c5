//! Sizes of bubbles, and the speed at which each size rises.

use std::sync::LazyLock;

use super::random;

/// Smallest and largest radius of the bubbles that a particle stands for, metres. Smaller ones
/// dissolve or stay, and larger ones break up (Deane and Stokes 2002).
const RADII: [f64; 2] = [1e-4, 5e-3];
/// Radius below which turbulence does not break a bubble, metres (Hinze scale; Deane and Stokes
/// 2002, "Scale dependence of bubble creation mechanisms in breaking waves").
const HINZE: f64 = 1e-3;
/// Powers of the radius that the number of bubbles follows below and above the Hinze scale.
const POWERS: [f64; 2] = [-1.5, -10.0 / 3.0];
/// Random channel of a particle's size of bubble; channel 0 is [`super::random_of`].
const CHANNEL: u32 = 1;
/// Number of intervals in the table of speeds.
const STEPS: usize = 256;

/// Acceleration of gravity at which the speeds hold, m/s².
const GRAVITY: f64 = 9.81;
/// Kinematic viscosity of water at 20 °C, m²/s.
const VISCOSITY: f64 = 1.004e-6;
/// Density of water at 20 °C, kg/m³.
const DENSITY: f64 = 998.2;
/// Surface tension of water at 20 °C, N/m.
const TENSION: f64 = 0.0728;

/// Returns the radius, metres, below which bubbles have this `share`, 0 to 1, of the cross-section
/// of all: the inverse of ∫ r² n(r) dr, with n ∝ r^-3/2 below the Hinze scale and r^-10/3 above it.
/// Whitewater is drawn by what it covers, so a particle stands for a fixed cross-section.
fn radius_of(share: f64) -> f64 {
    let [least, greatest] = RADII.map(|radius| radius / HINZE);
    // ∫ x^(p+2) dx from `a` to `b`, in Hinze radii.
    let [below, above] = POWERS.map(|power| power + 3.0);
    let part = |exponent: f64, a: f64, b: f64| (b.powf(exponent) - a.powf(exponent)) / exponent;
    let small = part(below, least, 1.0);
    let wanted = share * (small + part(above, 1.0, greatest));
    HINZE
        * match wanted < small {
            true => (least.powf(below) + below * wanted).powf(1.0 / below),
            false => (1.0 + above * (wanted - small)).powf(1.0 / above),
        }
}

/// Returns the terminal speed, m/s, of a bubble of this radius, metres, in water that is not
/// perfectly clean: that of a rigid sphere (Schiller and Naumann 1933) or, where it is less, that
/// of an ellipsoid by the correlation of Clift, Grace and Weber 1978, chapter 7.
fn terminal_speed(radius: f64) -> f64 {
    let diameter = 2.0 * radius;
    let stokes = GRAVITY * diameter * diameter / (18.0 * VISCOSITY);
    let mut sphere = 0.1;
    for _ in 0..60 {
        let reynolds = sphere * diameter / VISCOSITY;
        // Damped by half, because drag grows with the speed.
        sphere = 0.5 * (sphere + stokes / (1.0 + 0.15 * reynolds.powf(0.687)));
    }
    let dynamic = DENSITY * VISCOSITY;
    let morton = GRAVITY * dynamic.powi(4) / (DENSITY * TENSION.powi(3));
    let eotvos = GRAVITY * DENSITY * diameter * diameter / TENSION;
    // The viscosity of water in the correlation is 0.9 mPa s.
    let h = 4.0 / 3.0 * eotvos * morton.powf(-0.149) * (dynamic / 9e-4).powf(-0.14);
    if h <= 2.0 {
        return sphere;
    }
    let j = match h <= 59.3 {
        true => 0.94 * h.powf(0.757),
        false => 3.42 * h.powf(0.441),
    };
    sphere.min(VISCOSITY / diameter * morton.powf(-0.149) * (j - 0.857))
}

/// Speeds of bubbles by their share of [`radius_of`].
static SPEEDS: LazyLock<Vec<f64>> = LazyLock::new(|| {
    let shares = (0..=STEPS).map(|k| k as f64 / STEPS as f64);
    shares
        .map(|share| terminal_speed(radius_of(share)))
        .collect()
});

/// Returns the speed of rise, m/s, of the bubbles that the whitewater particle with this id stands
/// for.
pub(super) fn rise_of(id: u32) -> f64 {
    let share = STEPS as f64 * random(0, id, 0, CHANNEL);
    let k = (share as usize).min(STEPS - 1);
    let [a, b] = [SPEEDS[k], SPEEDS[k + 1]];
    a + (share - k as f64) * (b - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Number of bubbles in 10 % around a radius, in proportion, from the slope of the share.
    fn number(radius: f64) -> f64 {
        let share = |wanted: f64| {
            let (mut least, mut most) = (0.0, 1.0);
            for _ in 0..60 {
                let middle = 0.5 * (least + most);
                match radius_of(middle) < wanted {
                    true => least = middle,
                    false => most = middle,
                }
            }
            least
        };
        (share(1.001 * radius) - share(0.999 * radius)) / (0.002 * radius * radius * radius)
    }

    /// Deane and Stokes 2002, figure 3: r^-3/2 below the Hinze scale and r^-10/3 above it, without
    /// a step there. A slope over half a per cent of the radius errs by less than 1e-3.
    #[test]
    fn sizes_follow_deane_and_stokes() {
        let slope = |a: f64, b: f64| (number(b) / number(a)).ln() / (b / a).ln();
        assert!((slope(2e-4, 8e-4) + 1.5).abs() < 1e-3);
        assert!((slope(1.2e-3, 4e-3) + 10.0 / 3.0).abs() < 1e-3);
        assert!((number(0.99e-3) / number(1.01e-3) - 1.0).abs() < 0.07);
        assert!((radius_of(0.0) / RADII[0] - 1.0).abs() < 1e-12);
        assert!((radius_of(1.0) / RADII[1] - 1.0).abs() < 1e-12);
    }

    /// Rigid spheres by the Best number N, Clift, Grace and Weber 1978, table 5.3: log Re is
    /// -1.7095 + 1.33438 l - 0.11591 l² for 73 < N < 580, and -1.81391 + 1.34671 l - 0.12427 l² +
    /// 0.006344 l³ above, with l = log N. Both laws fit measurements within 5 %.
    #[test]
    fn small_bubbles_rise_as_rigid_spheres() {
        for diameter in [0.2e-3, 0.3e-3, 0.5e-3, 1e-3f64] {
            let best = 4.0 * GRAVITY * diameter.powi(3) / (3.0 * VISCOSITY * VISCOSITY);
            let l = best.log10();
            let reynolds = match best < 580.0 {
                true => -1.7095 + l * (1.33438 - 0.11591 * l),
                false => -1.81391 + l * (1.34671 + l * (-0.12427 + l * 0.006344)),
            };
            let expected = 10f64.powf(reynolds) * VISCOSITY / diameter;
            let speed = terminal_speed(0.5 * diameter);
            assert!(
                (speed / expected - 1.0).abs() < 0.05,
                "{diameter}: {speed} {expected}"
            );
        }
    }

    /// Karamanev 1996 ("Equations for calculation of the terminal velocity and drag coefficient of
    /// solid spheres and gas bubbles"): in contaminated water C_D is 0.95 over the bubble's
    /// horizontal section, which widens by (1 + 0.163 Eo^0.757)^(1/3). The two correlations are of
    /// different measurements and differ by up to a third at 3 mm; a bubble whose drag did not rise
    /// with its width would be at twice the speed at 10 mm.
    #[test]
    fn large_bubbles_flatten() {
        for diameter in [2e-3, 3e-3, 5e-3, 8e-3, 10e-3f64] {
            let eotvos = GRAVITY * DENSITY * diameter * diameter / TENSION;
            let wide = (1.0 + 0.163 * eotvos.powf(0.757)).cbrt();
            let expected = (4.0 / 3.0 * GRAVITY * diameter / (0.95 * wide * wide)).sqrt();
            let speed = terminal_speed(0.5 * diameter);
            assert!(
                (speed / expected - 1.0).abs() < 0.33,
                "{diameter}: {speed} {expected}"
            );
        }
    }

    /// Ids draw from all sizes. Below the Hinze scale, a third of the cross-section, the speed
    /// rises with the size, and all above it are faster.
    #[test]
    fn ids_draw_all_sizes() {
        let mut speeds: Vec<f64> = (0..4000).map(rise_of).collect();
        speeds.sort_unstable_by(f64::total_cmp);
        // Quantiles of 4000 numbers err by 0.007 of the share; four times that is allowed.
        for share in [0.1, 0.2, 0.3] {
            let found = speeds[(share * 4000.0) as usize];
            let [least, most] =
                [share - 0.03, share + 0.03].map(|share| terminal_speed(radius_of(share)));
            assert!((least..=most).contains(&found), "{share}: {found}");
        }
        assert!(radius_of(0.33) < HINZE && radius_of(0.35) > HINZE);
    }
}
