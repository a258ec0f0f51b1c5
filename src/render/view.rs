//! View transforms from scene-linear light to display values.

mod aces;

use std::sync::LazyLock;

use glam::{DMat3, DVec3};

use swell_scene::look::{TransformSpec, ViewSpec};

/// Encodes a linear channel as sRGB; clamps to the range 0 to 1.
pub fn srgb_encode(linear: f64) -> f64 {
    let x = linear.clamp(0.0, 1.0);
    if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    }
}

/// Converts scene-linear Rec. 709 to encoded sRGB, each channel 0 to 1.
///
/// Applies exposure, the look's tone curve, contrast about middle grey, saturation, and the sRGB
/// encoding.
pub fn apply(view: &ViewSpec, colour: [f32; 3]) -> [f64; 3] {
    Display::of(view).linear(colour).to_array().map(srgb_encode)
}

/// Steps of linear light from 0 to 1. The encoding's slope is at most 12.92, so that it rises by at
/// most 0.8 of a 255th over a step, which rounds to at most two bytes.
const STEPS: usize = 4096;

/// Lookup table of the sRGB encoding in 255ths, in place of a power.
struct Bytes {
    /// Least linear values that round to 1, 2 and so on up to 255, then NaN, which no value
    /// reaches.
    least: [f64; 256],
    /// Byte to which the beginning of each step rounds.
    first: [u8; STEPS + 1],
}

static BYTES: LazyLock<Bytes> = LazyLock::new(|| {
    let rounded = |x: f64| (srgb_encode(x) * 255.0).round();
    let least = |byte: f64| {
        // Positive floats have the order of their bits.
        let (mut below, mut from) = (0.0f64.to_bits(), 1.0f64.to_bits());
        while below + 1 < from {
            let middle = below + (from - below) / 2;
            match rounded(f64::from_bits(middle)) >= byte {
                true => from = middle,
                false => below = middle,
            }
        }
        f64::from_bits(from)
    };
    Bytes {
        least: std::array::from_fn(|index| match index {
            255 => f64::NAN,
            _ => least(index as f64 + 1.0),
        }),
        first: std::array::from_fn(|step| rounded(step as f64 / STEPS as f64) as u8),
    }
});

impl Bytes {
    fn of(&self, linear: f64) -> u8 {
        let step = (linear.clamp(0.0, 1.0) * STEPS as f64) as usize;
        let first = self.first[step];
        first + u8::from(linear >= self.least[usize::from(first)])
    }
}

/// Middle grey, the fixed point of contrast.
const GREY: f64 = 0.18;

/// A view with the values derived from it for all pixels.
pub(super) struct Display {
    transform: TransformSpec,
    /// 2^exposure.
    gain: f64,
    /// Contrast `GREY (x / GREY)^contrast` in the form `scale x^power`, where the power also
    /// linearises AgX's values.
    power: f64,
    scale: f64,
    saturation: f64,
}

impl Display {
    pub(super) fn of(view: &ViewSpec) -> Self {
        let power = match view.transform {
            TransformSpec::Agx => AGX_POWER,
            TransformSpec::Aces | TransformSpec::Srgb => 1.0,
        };
        Self {
            transform: view.transform,
            gain: view.exposure_stops.exp2(),
            power: power * view.contrast,
            scale: GREY.powf(1.0 - view.contrast),
            saturation: view.saturation,
        }
    }

    /// Like [`apply`], in 255ths.
    pub(super) fn bytes(&self, colour: [f32; 3]) -> [u8; 3] {
        let bytes = &*BYTES;
        self.linear(colour).to_array().map(|x| bytes.of(x))
    }

    /// Display-linear Rec. 709; the encoding clips values beyond 0 and 1.
    fn linear(&self, colour: [f32; 3]) -> DVec3 {
        let scene = DVec3::from(colour.map(f64::from)).max(DVec3::ZERO) * self.gain;
        let shown = match self.transform {
            TransformSpec::Agx => agx(scene),
            TransformSpec::Aces => aces::aces(scene),
            TransformSpec::Srgb => scene.min(DVec3::ONE),
        };
        let raised = match self.power {
            1.0 => shown,
            power => shown.as_vec3().powf(power as f32).as_dvec3(),
        };
        let display = raised * self.scale;
        let grey = DVec3::splat(display.dot(DVec3::new(0.2126, 0.7152, 0.0722)));
        grey + (display - grey) * self.saturation
    }
}

/// Exponent that linearises AgX's values.
const AGX_POWER: f64 = 2.2;

/// Sobotka's AgX base view of Rec. 709, 0 to 1 and not yet raised to [`AGX_POWER`], with Wrensch's
/// polynomial for its curve (2023): the inset matrix compresses the primaries, light is mapped to
/// log2 over 16.5 stops about middle grey and through the curve, and the outset matrix expands the
/// primaries.
fn agx(scene: DVec3) -> DVec3 {
    let inset = DMat3::from_cols_array(&[
        0.842_479_062_253_094,
        0.042_328_242_100_123_8,
        0.042_375_654_905_705_1,
        0.078_433_599_999_999_2,
        0.878_468_636_469_772,
        0.078_433_6,
        0.079_223_745_147_764_3,
        0.079_166_127_460_542_8,
        0.879_142_973_793_104,
    ]);
    let outset = DMat3::from_cols_array(&[
        1.196_879_005_120_17,
        -0.052_896_851_757_456_2,
        -0.052_971_635_514_443_8,
        -0.098_020_881_140_136_8,
        1.151_903_129_904_17,
        -0.098_043_450_117_124_1,
        -0.099_029_744_079_720_5,
        -0.098_961_176_844_843_3,
        1.151_073_672_641_16,
    ]);
    const LEAST: f64 = -12.473_93;
    const MOST: f64 = 4.026_069;
    let bent = (inset * scene).to_array().map(|x| {
        // The 24 bits of f32 suffice for 8-bit output.
        let stops = f64::from((x.max(1e-10) as f32).log2());
        let log = (stops.clamp(LEAST, MOST) - LEAST) / (MOST - LEAST);
        curve(log)
    });
    (outset * DVec3::from_array(bent)).clamp(DVec3::ZERO, DVec3::ONE)
}

fn curve(x: f64) -> f64 {
    let x2 = x * x;
    let x4 = x2 * x2;
    15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x
        - 0.00232
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(view: &ViewSpec, x: f32) -> f64 {
        let [r, g, b] = apply(view, [x; 3]);
        // The rows of AgX's matrices sum to 1 within 2e-4.
        assert!((r - g).abs() < 2e-3 && (b - g).abs() < 2e-3);
        g
    }

    #[test]
    fn known_values_go_through_the_transform() {
        let agx = ViewSpec::default();
        // The curve's pivot: middle grey maps to 0.489 on a display with gamma 2.2, which is 0.493
        // in sRGB. The polynomial is within 0.01 of it.
        assert!(
            (grey(&agx, 0.18) - 0.493).abs() < 0.01,
            "{}",
            grey(&agx, 0.18)
        );
        assert!(grey(&agx, 0.0) < 1e-6);
        // Ten times white is not clipped yet; a plain sRGB encoding clips from 1 on.
        assert!(grey(&agx, 1.0) < 0.85 && grey(&agx, 10.0) < 1.0);
        let plain = ViewSpec {
            transform: TransformSpec::Srgb,
            ..ViewSpec::default()
        };
        // IEC 61966-2-1: linear 0.214041 encodes to 0.5; a power of 1/2.2 would give 0.4962.
        assert!((grey(&plain, 0.214_041) - 0.5).abs() < 1e-5);
    }

    /// Sobotka's own curve over log2 light from 10 stops below middle grey to 6.5 above: a sigmoid
    /// through (10/16.5, 1/2) with slope 2 there, toe power 3 and shoulder power 3.25.
    fn sigmoid(x: f64) -> f64 {
        const PIVOT: f64 = 10.0 / 16.5;
        let half = |run: f64, power: f64| {
            let limit =
                ((2.0 * run).powf(-power) * ((4.0 * run).powf(power) - 1.0)).powf(-1.0 / power);
            move |distance: f64| {
                let term = 2.0 * distance / limit;
                limit * term / (1.0 + term.powf(power)).powf(1.0 / power)
            }
        };
        if x < PIVOT {
            0.5 - half(PIVOT, 3.0)(PIVOT - x)
        } else {
            0.5 + half(1.0 - PIVOT, 3.25)(x - PIVOT)
        }
    }

    #[test]
    fn grey_follows_agx_over_sixteen_stops() {
        let off = |factor: f64| {
            (0..=330)
                .map(|step| {
                    let x = f64::from(step) / 330.0;
                    let light = 0.18 * (16.5 * x - 10.0).exp2();
                    let expected = srgb_encode(sigmoid(x).max(0.0).powf(2.2));
                    (grey(&ViewSpec::default(), (factor * light) as f32) - expected).abs()
                })
                .fold(0.0, f64::max)
        };
        // The polynomial is within 0.0056 of the curve; the rows of the matrices add 2e-4.
        assert!(off(1.0) < 0.006, "{}", off(1.0));
        // Control: an eighth of a stop.
        assert!(off(0.125f64.exp2()) > 0.012, "{}", off(0.125f64.exp2()));
    }

    #[test]
    fn contrast_and_saturation_turn_about_grey() {
        let view = |contrast, saturation| ViewSpec {
            transform: TransformSpec::Srgb,
            contrast,
            saturation,
            ..ViewSpec::default()
        };
        let colour = [0.09f32, 0.36, 0.18];
        let found = apply(&view(2.0, 1.0), colour);
        // (x / 0.18)² × 0.18.
        for (found, linear) in found.into_iter().zip([0.045, 0.72, 0.18]) {
            assert!(
                (found - srgb_encode(linear)).abs() < 1e-6,
                "{found} {linear}"
            );
        }
        // Rec. 709 luminance: 0.2126 × 0.09 + 0.7152 × 0.36 + 0.0722 × 0.18 = 0.289 602.
        for found in apply(&view(1.0, 0.0), colour) {
            assert!((found - srgb_encode(0.289_602)).abs() < 1e-6, "{found}");
        }
        let [r, ..] = apply(&view(1.0, 2.0), [0.25, 0.3, 0.3]);
        // 0.289 37 − 2 × 0.039 37.
        assert!((r - srgb_encode(0.210_63)).abs() < 1e-6, "{r}");
    }

    #[test]
    fn brighter_is_never_darker_and_a_stop_is_a_factor_of_two() {
        let view = ViewSpec::default();
        let mut last = -1.0;
        for step in -100..60 {
            let now = grey(&view, (f64::from(step) / 8.0).exp2() as f32);
            assert!(now >= last, "{step}");
            last = now;
        }
        let up = ViewSpec {
            exposure_stops: 1.0,
            ..ViewSpec::default()
        };
        assert_eq!(grey(&up, 0.1), grey(&view, 0.2));
    }

    #[test]
    fn bytes_are_encoded_values_rounded() {
        let view = |transform| ViewSpec {
            transform,
            contrast: 1.2,
            saturation: 1.25,
            ..ViewSpec::default()
        };
        let mut seen = [false; 256];
        for transform in [TransformSpec::Agx, TransformSpec::Srgb] {
            let view = view(transform);
            let display = Display::of(&view);
            for step in 0..20_000u32 {
                let x = (f64::from(step) / 1000.0 - 15.0).exp2() as f32;
                let colour = [x, 0.7 * x, 2.0 * x];
                let found = display.bytes(colour);
                let expected = apply(&view, colour).map(|x| (x * 255.0).round() as u8);
                assert_eq!(found, expected, "{colour:?}");
                seen[usize::from(found[0])] = true;
            }
        }
        assert!(seen.iter().all(|seen| *seen));
        // The thresholds between bytes are exact to the last bit, and NaN is black.
        for (byte, least) in (1u8..=255).zip(BYTES.least) {
            let of = |x: f64| (srgb_encode(x) * 255.0).round() as u8;
            for of in [&of as &dyn Fn(f64) -> u8, &|x| BYTES.of(x)] {
                assert_eq!([of(least), of(least.next_down())], [byte, byte - 1]);
            }
        }
        assert_eq!([BYTES.of(f64::INFINITY), BYTES.of(-1.0)], [255, 0]);
        let plain = Display::of(&view(TransformSpec::Srgb));
        assert_eq!(plain.bytes([f32::NAN; 3]), [0; 3]);
    }

    #[test]
    fn strong_colours_run_to_white() {
        let [r, g, b] = apply(&ViewSpec::default(), [0.5, 4.0, 40.0]);
        assert!(b > 0.9 && g > 0.5 && r > 0.3, "{r} {g} {b}");
    }
}
