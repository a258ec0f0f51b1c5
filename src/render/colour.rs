//! Colour spaces of linear light and the conversions between them.

use glam::{DMat3, DVec2, DVec3};

use swell_scene::look::ColourSpaceSpec;

/// Primaries and white point of a linear RGB space, as CIE 1931 xy chromaticities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Space {
    /// Chromaticities of red, green and blue.
    pub primaries: [[f64; 2]; 3],
    /// Chromaticity of equal RGB values.
    pub white: [f64; 2],
}

/// ITU-R BT.709-6 with its D65 white point.
pub const REC_709: Space = Space {
    primaries: [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]],
    white: [0.3127, 0.3290],
};

/// White point of ACES (SMPTE ST 2065-1), near D60.
const ACES_WHITE: [f64; 2] = [0.32168, 0.33767];

/// ACEScg: AP1 primaries (Academy S-2014-004).
pub const ACES_CG: Space = Space {
    primaries: [[0.713, 0.293], [0.165, 0.830], [0.128, 0.044]],
    white: ACES_WHITE,
};

/// ACES2065-1: AP0 primaries (SMPTE ST 2065-1).
pub(super) const ACES_2065: Space = Space {
    primaries: [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.0770]],
    white: ACES_WHITE,
};

/// Bradford matrix from XYZ to cone responses (Lam 1985), row by row. ACES adapts white points with
/// it; CAT02, the usual alternative, differs by 0.003 from Rec. 709 to ACEScg.
const BRADFORD: [[f64; 3]; 3] = [
    [0.8951, 0.2664, -0.1614],
    [-0.7502, 1.7135, 0.0367],
    [0.0389, -0.0685, 1.0296],
];

impl Space {
    /// Returns the colour space in which a look is written.
    pub fn of(spec: ColourSpaceSpec) -> Self {
        match spec {
            ColourSpaceSpec::Rec709 => REC_709,
            ColourSpaceSpec::AcesCg => ACES_CG,
        }
    }

    /// Matrix to CIE XYZ, with Y = 1 for white (SMPTE RP 177).
    fn to_xyz(self) -> DMat3 {
        let columns = self.primaries.map(|xy| xyz(xy.into()));
        let primaries = DMat3::from_cols(columns[0], columns[1], columns[2]);
        let parts = primaries.inverse() * xyz(self.white.into());
        primaries * DMat3::from_diagonal(parts)
    }

    /// Contribution of each primary to luminance, with 1 for white.
    pub(super) fn luminance(self) -> DVec3 {
        self.to_xyz().transpose().col(1)
    }

    /// Matrix to another space, with Bradford adaptation of the white point: white stays white.
    pub fn to(self, other: Self) -> DMat3 {
        let bradford = DMat3::from_cols_array_2d(&BRADFORD).transpose();
        let [from, to] = [self, other].map(|space| bradford * xyz(space.white.into()));
        let adapted = bradford.inverse() * DMat3::from_diagonal(to / from) * bradford;
        other.to_xyz().inverse() * adapted * self.to_xyz()
    }
}

/// XYZ of a chromaticity, with Y = 1.
fn xyz(xy: DVec2) -> DVec3 {
    DVec3::new(xy.x, xy.y, 1.0 - xy.x - xy.y) / xy.y
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Matrix from Rec. 709, row by row, as the `colour` library (0.4.7, `matrix_RGB_to_RGB`,
    /// Bradford) prints it; the built-in ACES configurations of OpenColorIO agree to six decimal
    /// places.
    const TO_ACES_CG: [[f64; 3]; 3] = [
        [0.613_097_402_401, 0.339_523_146_184, 0.047_379_451_415],
        [0.070_193_722_470, 0.916_353_879_057, 0.013_452_398_473],
        [0.020_615_592_882, 0.109_569_772_938, 0.869_814_634_180],
    ];
    const TO_ACES_2065: [[f64; 3]; 3] = [
        [0.439_632_981_921, 0.382_988_698_157, 0.177_378_319_965],
        [0.089_776_442_947, 0.813_439_428_734, 0.096_784_128_325],
        [0.017_541_170_383, 0.111_546_553_302, 0.870_912_276_314],
    ];
    /// Matrix from Rec. 709 to ACEScg with CAT02.
    const BY_CAT02: [[f64; 3]; 3] = [
        [0.613_082_892_220, 0.341_167_054_244, 0.045_750_053_536],
        [0.070_003_549_807, 0.918_062_830_408, 0.011_933_619_785],
        [0.020_490_777_838, 0.106_763_987_591, 0.872_745_234_571],
    ];

    /// Largest absolute difference between entries.
    fn off(found: DMat3, rows: &[[f64; 3]; 3]) -> f64 {
        let entries = rows.iter().flatten().zip(found.transpose().to_cols_array());
        entries.fold(0.0, |worst, (row, entry)| worst.max((row - entry).abs()))
    }

    #[test]
    fn matrices_from_rec_709_are_the_published_ones() {
        // Twelve decimal places are printed; f64 loses four of its sixteen digits in three
        // inversions.
        const PLACES: f64 = 1e-11;
        assert!(off(REC_709.to(ACES_CG), &TO_ACES_CG) < PLACES);
        // The library uses AP0's matrix as the Academy rounds it, to ten places.
        const ROUNDED: f64 = 1e-9;
        assert!(off(REC_709.to(ACES_2065), &TO_ACES_2065) < ROUNDED);
        // Control: another adaptation is distinguished.
        assert!(off(REC_709.to(ACES_CG), &BY_CAT02) > 1e-3);
    }

    #[test]
    fn white_stays_white_and_luminance_is_y() {
        let white = REC_709.to(ACES_CG) * DVec3::ONE;
        assert!((white - DVec3::ONE).abs().max_element() < 1e-12, "{white}");
        // BT.709-6, item 3.2.
        let luminance = REC_709.luminance();
        let expected = DVec3::new(0.2126, 0.7152, 0.0722);
        assert!(
            (luminance - expected).abs().max_element() < 5e-5,
            "{luminance}"
        );
    }
}
