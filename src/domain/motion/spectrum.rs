//! Spectra of wind seas: the distribution of wave energy over frequencies.

use super::wave_number;

/// Shape of a spectrum; its height and peak are given separately.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spectrum {
    /// A growing sea: the Pierson–Moskowitz spectrum with a peak enhanced by γ (Hasselmann et
    /// al. 1973).
    Jonswap,
    /// A fully developed sea (Pierson and Moskowitz 1964).
    PiersonMoskowitz,
    /// JONSWAP in water of finite depth (Bouws et al. 1985).
    Tma,
}

crate::read_by_name!(Spectrum);

impl Spectrum {
    /// All spectra with their names in scenes.
    pub const NAMED: [(&'static str, Self); 3] = [
        ("jonswap", Self::Jonswap),
        ("pierson_moskowitz", Self::PiersonMoskowitz),
        ("tma", Self::Tma),
    ];

    /// Returns the name used in scenes.
    pub fn name(self) -> &'static str {
        let mut named = Self::NAMED.iter();
        named
            .find(|named| named.1 == self)
            .map_or("", |named| named.0)
    }

    /// Returns the spectral density at a frequency, up to a factor common to all frequencies.
    /// `frequency` and `peak` in Hz, `enhancement` is γ, depth in metres, gravity in m/s².
    pub(crate) fn density(
        self,
        frequency: f64,
        peak: f64,
        enhancement: f64,
        (depth, gravity): (f64, f64),
    ) -> f64 {
        let ratio = frequency / peak;
        let grown = ratio.powi(-5) * (-1.25 * ratio.powi(-4)).exp();
        if self == Self::PiersonMoskowitz {
            return grown;
        }
        let width = if ratio <= 1.0 { 0.07 } else { 0.09 };
        let off = (ratio - 1.0) / width;
        let raised = grown * enhancement.powf((-0.5 * off * off).exp());
        if self == Self::Jonswap {
            return raised;
        }
        // Kitaigorodskii et al. 1975: tanh² kh / (1 + 2kh / sinh 2kh).
        let kh = depth * wave_number(std::f64::consts::TAU * frequency, depth, gravity);
        let shallow = 2.0 * kh / (2.0 * kh).min(300.0).sinh();
        raised * kh.tanh().powi(2) / (1.0 + shallow)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ of a density for a peak of 1 Hz, in 20 000 steps up to ten times the peak.
    fn area(spectrum: Spectrum, enhancement: f64, depth: f64) -> f64 {
        let at = |f: f64| spectrum.density(f, 1.0, enhancement, (depth, 9.81));
        (1..=20_000).map(|i| 5e-4 * at(5e-4 * f64::from(i))).sum()
    }

    /// ∫ x⁻⁵ exp(−1.25 x⁻⁴) dx = 1/5. For JONSWAP with γ = 3.3 it is 1.52 times as much (Goda 2000,
    /// 0.06533 for 1/5 · 5/16 by his formula 0.0624 / (0.23 + 0.0336 γ − 0.185 / (1.9 + γ)), within
    /// 0.5 %).
    #[test]
    fn densities_have_the_areas_that_are_known_in_closed_form() {
        let grown = area(Spectrum::PiersonMoskowitz, 3.3, 1.0);
        assert!((grown / 0.2 - 1.0).abs() < 2e-4, "{grown}");
        let raised = area(Spectrum::Jonswap, 3.3, 1.0);
        let goda = |y: f64| 0.0624 / (0.23 + 0.0336 * y - 0.185 / (1.9 + y));
        let expected = 0.3125 / goda(3.3);
        assert!(
            (raised / grown / expected - 1.0).abs() < 0.01,
            "{} {expected}",
            raised / grown
        );
        assert!((area(Spectrum::Jonswap, 1.0, 1.0) - grown).abs() < 1e-12);
    }

    /// With x² = ω² h/g, Thompson and Vincent 1983 approximate φ by x²/2 up to x = 1 and
    /// 1 − (2 − x)²/2 up to x = 2, within 4 %.
    #[test]
    fn shallow_water_takes_from_the_long_waves_what_is_published() {
        let (depth, gravity) = (1.0f64, 9.81);
        for x in [0.1f64, 0.3, 0.6, 1.0, 1.4, 1.8] {
            let frequency = x / (depth / gravity).sqrt() / std::f64::consts::TAU;
            let of = |s: Spectrum| s.density(frequency, frequency, 3.3, (depth, gravity));
            let found = of(Spectrum::Tma) / of(Spectrum::Jonswap);
            let known = if x <= 1.0 {
                0.5 * x * x
            } else {
                1.0 - 0.5 * (2.0 - x).powi(2)
            };
            assert!(
                (found - known).abs() < 0.04 * known.max(0.5),
                "{x}: {found} {known}"
            );
        }
    }
}
