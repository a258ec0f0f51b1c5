//! The ACES 1.0 output for sRGB displays, implemented exactly rather than fitted: the reference
//! rendering transform (`RRT.ctl`) and the output transform
//! `ODT.Academy.RGBmonitor_100nits_dim.ctl` of the Academy's aces-dev 1.0.3.

use std::sync::LazyLock;

use glam::{DMat3, DVec3};

use super::super::colour::{ACES_2065, ACES_CG, REC_709};

/// Luminance of black and of white on a cinema screen, nits.
const CINEMA: [f64; 2] = [0.02, 48.0];
/// Exponent of luminance that compensates for a dim surround, compared with a cinema's dark one.
const DIM_SURROUND: f64 = 0.9811;
/// Saturation factors of the rendering and of the output transform.
const SATURATION: [f64; 2] = [0.96, 0.93];

/// Values derived from the constants above.
struct AcesConstants {
    /// Matrices from Rec. 709 to ACES2065-1, from that to ACEScg, and from that to Rec. 709.
    matrices: [DMat3; 3],
    /// Luminance coefficients of AP1.
    luminance: DVec3,
    output_tone: Tone<9>,
}

static PARTS: LazyLock<AcesConstants> = LazyLock::new(|| AcesConstants {
    matrices: [
        REC_709.to(ACES_2065),
        ACES_2065.to(ACES_CG),
        ACES_CG.to(REC_709),
    ],
    luminance: ACES_CG.luminance(),
    output_tone: output_tone(),
});

/// Converts scene-linear Rec. 709 to display-linear Rec. 709, 0 to 1.
pub(super) fn aces(scene: DVec3) -> DVec3 {
    let parts = &*PARTS;
    let [to_2065, to_cg, to_709] = parts.matrices;
    let light = reddened(glowing(to_2065 * scene)).max(DVec3::ZERO);
    let linear = parts.saturated((to_cg * light).max(DVec3::ZERO), SATURATION[0]);
    let [black, white] = CINEMA;
    let shown = map(linear, |x| {
        (parts.output_tone.of(RENDER_TONE.of(x)) - black) / (white - black)
    });
    // Dim surround: bends luminance and keeps chromaticity.
    let luminance = parts.luminance.dot(shown);
    let bent = match luminance > 0.0 {
        true => shown * luminance.powf(DIM_SURROUND - 1.0),
        false => shown,
    };
    let display = to_709 * parts.saturated(bent, SATURATION[1]);
    display.clamp(DVec3::ZERO, DVec3::ONE)
}

impl AcesConstants {
    /// Scales the saturation about grey.
    fn saturated(&self, v: DVec3, saturation: f64) -> DVec3 {
        let grey = DVec3::splat(self.luminance.dot(v));
        grey + saturation * (v - grey)
    }
}

fn map(v: DVec3, by: impl Fn(f64) -> f64) -> DVec3 {
    DVec3::from_array(v.to_array().map(by))
}

fn saturation_of(v: DVec3) -> f64 {
    let (most, least) = (v.max_element(), v.min_element());
    (most.max(1e-10) - least.max(1e-10)) / most.max(1e-2)
}

/// Glow module: brightens dark saturated colours.
fn glowing(v: DVec3) -> DVec3 {
    const GAIN: f64 = 0.05;
    const MIDDLE: f64 = 0.08;
    let [r, g, b] = v.to_array();
    let chroma = (b * (b - g) + g * (g - r) + r * (r - b)).max(0.0).sqrt();
    let bright = (r + g + b + 1.75 * chroma) / 3.0;
    let x = (saturation_of(v) - 0.4) / 0.2;
    let t = (1.0 - (0.5 * x).abs()).max(0.0);
    let gain = GAIN * 0.5 * (1.0 + x.signum() * (1.0 - t * t));
    let added = if bright <= 2.0 / 3.0 * MIDDLE {
        gain
    } else if bright >= 2.0 * MIDDLE {
        0.0
    } else {
        gain * (MIDDLE / bright - 0.5)
    };
    v * (1.0 + added)
}

/// Red modifier: compresses strong reds.
fn reddened(v: DVec3) -> DVec3 {
    const SCALE: f64 = 0.82;
    const PIVOT: f64 = 0.03;
    /// Width in degrees of hue.
    const WIDTH: f64 = 135.0;
    let [r, g, b] = v.to_array();
    // atan2 gives red a hue of about 0, in −180° to 180°; grey has hue 0 and no saturation.
    let hue = (3f64.sqrt() * (g - b)).atan2(2.0 * r - g - b).to_degrees();
    let weight = 1.5 * cubic_basis(4.0 * hue / WIDTH);
    let red = r + weight * saturation_of(v) * (PIVOT - r) * (1.0 - SCALE);
    DVec3::new(red, g, b)
}

/// Cubic B-spline about 0 with a half-width of 2.
fn cubic_basis(x: f64) -> f64 {
    let x = x.abs();
    if x >= 2.0 {
        0.0
    } else if x >= 1.0 {
        (2.0 - x).powi(3) / 6.0
    } else {
        (4.0 - 6.0 * x * x + 3.0 * x * x * x) / 6.0
    }
}

/// Tone curve in log10 over log10: two quadratic B-splines that meet in the middle, extended by
/// straight lines.
struct Tone<const N: usize> {
    low: [f64; N],
    high: [f64; N],
    /// Least, middle and greatest points: input and output.
    points: [[f64; 2]; 3],
    /// Slope above the greatest point; the curve is constant below the least one.
    slope: f64,
}

impl<const N: usize> Tone<N> {
    fn of(&self, x: f64) -> f64 {
        let [least, middle, most] = self.points.map(|point| point.map(f64::log10));
        let log = x.max(1e-10).log10();
        let bent = if log <= least[0] {
            least[1]
        } else if log < middle[0] {
            spline(&self.low, (log - least[0]) / (middle[0] - least[0]))
        } else if log < most[0] {
            spline(&self.high, (log - middle[0]) / (most[0] - middle[0]))
        } else {
            most[1] + self.slope * (log - most[0])
        };
        10f64.powf(bent)
    }
}

/// Evaluates a uniform quadratic B-spline at the parameter `part`, 0 to 1.
fn spline(coefficients: &[f64], part: f64) -> f64 {
    let spans = coefficients.len() - 2;
    let at = part * spans as f64;
    let span = (at as usize).min(spans - 1);
    let t = at - span as f64;
    let [a, b, c] = [0, 1, 2].map(|k| coefficients[span + k]);
    (0.5 * a - b + 0.5 * c) * t * t + (b - a) * t + 0.5 * (a + b)
}

/// `segmented_spline_c5_fwd`; omits the sixth coefficient, which repeats the fifth and is only read
/// at the very end.
const RENDER_TONE: Tone<5> = Tone {
    low: [
        -4.0,
        -4.0,
        -3.157_376_577_3,
        -0.485_249_995_8,
        1.847_732_470_6,
    ],
    high: [-0.718_548_242_5, 2.081_030_717_2, 3.668_124_123_7, 4.0, 4.0],
    points: [
        [0.18 / 32_768.0, 1e-4],
        [0.18, 4.8],
        [0.18 * 262_144.0, 1e4],
    ],
    slope: 0.0,
};

/// `segmented_spline_c9_fwd` for 48 nits, whose end points are the rendering of 6.5 stops around
/// grey.
fn output_tone() -> Tone<9> {
    let stops = 6.5f64.exp2();
    let [black, white] = CINEMA;
    Tone {
        low: [
            -1.698_970_004_3,
            -1.698_970_004_3,
            -1.4779,
            -1.2291,
            -0.8648,
            -0.448,
            0.005_18,
            0.451_108_033_4,
            0.911_374_441_4,
        ],
        high: [
            0.515_438_696_5,
            0.847_043_778_3,
            1.1358,
            1.3802,
            1.5197,
            1.5985,
            1.6467,
            1.674_609_135_7,
            1.687_873_339_0,
        ],
        points: [
            [RENDER_TONE.of(0.18 / stops), black],
            [RENDER_TONE.of(0.18), 4.8],
            [RENDER_TONE.of(0.18 * stops), white],
        ],
        slope: 0.04,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::srgb_encode;

    /// Linear Rec. 709 and its display value by OpenColorIO 2, encoded: built-in configuration
    /// cg-config-v1.0.0_aces-v1.3, display "sRGB - Display", view "ACES 1.0 - SDR Video", clamped
    /// to 0 to 1.
    const SHOWN: [([f64; 3], [f64; 3]); 15] = [
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ([0.01, 0.01, 0.01], [0.012_837, 0.012_837, 0.012_837]),
        ([0.05, 0.05, 0.05], [0.124_520, 0.124_520, 0.124_520]),
        ([0.18, 0.18, 0.18], [0.355_953, 0.355_953, 0.355_953]),
        ([1.0, 1.0, 1.0], [0.811_975, 0.811_975, 0.811_975]),
        ([4.0, 4.0, 4.0], [0.955_285, 0.955_285, 0.955_285]),
        ([64.0, 64.0, 64.0], [1.0, 1.0, 1.0]),
        ([1.0, 0.0, 0.0], [0.803_757, 0.0, 0.024_503]),
        ([0.0, 1.0, 0.0], [0.329_835, 0.818_212, 0.169_023]),
        ([0.0, 0.0, 1.0], [0.0, 0.0, 0.823_410]),
        ([0.5, 0.1, 0.02], [0.603_661, 0.239_850, 0.075_292]),
        ([0.02, 0.1, 0.5], [0.0, 0.227_428, 0.632_419]),
        ([0.1, 0.5, 0.05], [0.273_271, 0.642_584, 0.176_690]),
        ([8.0, 1.0, 0.2], [1.0, 0.867_571, 0.632_952]),
        ([0.2, 2.0, 9.0], [0.806_364, 0.907_315, 0.991_616]),
    ];

    /// Largest difference of an encoded channel from OpenColorIO's, with light multiplied by
    /// `factor`.
    fn off(factor: f64) -> f64 {
        let one = |&(scene, shown): &([f64; 3], [f64; 3])| {
            let found = aces(factor * DVec3::from(scene)).to_array();
            let pairs = found.into_iter().zip(shown);
            pairs.fold(0.0f64, |worst, (found, shown)| {
                worst.max((srgb_encode(found) - shown).abs())
            })
        };
        SHOWN.iter().map(one).fold(0.0, f64::max)
    }

    #[test]
    fn colours_are_those_of_opencolorio() {
        // Both compute the same formulas, but OpenColorIO's curves are f32 tables. A tenth of an
        // 8-bit step.
        const TABLES: f64 = 0.1 / 255.0;
        assert!(off(1.0) < TABLES, "{}", off(1.0));
        // Control: a hundredth of a stop.
        assert!(
            off(0.01f64.exp2()) > 2.0 * TABLES,
            "{}",
            off(0.01f64.exp2())
        );
    }

    #[test]
    fn grey_has_ten_nits_of_a_hundred_and_white_rolls_off() {
        let grey = |x: f64| aces(DVec3::splat(x)).y;
        // 4.8 nits of a cinema's 48, less its black, in a dim surround: ((4.8 − 0.02) /
        // 47.98)^0.9811.
        let expected = (4.78f64 / 47.98).powf(DIM_SURROUND);
        // The curve passes its middle point within the ten places of its coefficients.
        assert!((grey(0.18) - expected).abs() < 1e-6, "{}", grey(0.18));
        assert!((expected - 0.10).abs() < 0.005);
        // The greatest point is six and a half stops above grey.
        assert!(grey(0.18 * 6.0f64.exp2()) < 1.0 && grey(0.18 * 6.51f64.exp2()) > 0.9999);
        let mut last = -1.0;
        for step in -160..120 {
            let now = grey((f64::from(step) / 8.0).exp2());
            assert!(now >= last, "{step}");
            last = now;
        }
    }
}
