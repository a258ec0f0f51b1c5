//! Keys of waves that several tables have.

use swell_domain::motion::Spectrum;

use super::key::{Interval, Key, words};

/// Heights and depths, metres.
pub(super) const LENGTH: Interval = 1e-9..=1e6;

/// Seconds.
pub(super) const PERIOD: Interval = 1e-4..=1e6;

const SPECTRA: [&str; 3] = words(&Spectrum::NAMED);

/// Kinds of waves that have a key.
type Kinds = &'static [&'static str];

/// Period of regular waves, which are of the kind `stokes`.
pub(super) const fn period() -> Key {
    Key::number("period", PERIOD)
        .unit("seconds")
        .only("kind", &["stokes"])
        .also(", of waves that are at least 10 particle spacings long")
        .about("of the waves")
}

/// Significant height of a sea.
pub(super) const fn significant_height(kinds: Kinds) -> Key {
    Key::number("significant_height", LENGTH)
        .unit("metres")
        .only("kind", kinds)
        .also(", at most the depth and no steeper at the peak than waves can be")
        .about("four times the root of the elevation's variance")
}

/// Peak period of a spectrum.
pub(super) const fn peak_period(kinds: Kinds) -> Key {
    Key::number("peak_period", PERIOD)
        .unit("seconds")
        .only("kind", kinds)
        .about("of the waves with the most energy")
}

/// Form of a spectrum.
pub(super) const fn spectrum(kinds: Kinds) -> Key {
    Key::choice("spectrum", &SPECTRA)
        .default("\"jonswap\"")
        .only("kind", kinds)
        .about("as a wave maker's")
}

/// γ of a spectrum.
pub(super) const fn peak_enhancement(kinds: Kinds) -> Key {
    Key::number("peak_enhancement", 1.0..=20.0)
        .computed(|| "3.3".to_owned())
        .only("kind", kinds)
        .also(", not with spectrum = \"pierson_moskowitz\"")
        .about("γ, how much higher the peak is than Pierson and Moskowitz's")
}

/// Period of the shortest waves of a spectrum.
pub(super) const fn shortest_period(kinds: Kinds) -> Key {
    Key::number("shortest_period", PERIOD)
        .unit("seconds")
        .computed(|| "a third of the peak's".to_owned())
        .only("kind", kinds)
        .also(
            ", a tenth to nine tenths of the peak's, of waves that are at least 10 \
             particle spacings long",
        )
        .about("of the shortest waves; what is left out is given to the others")
}

/// Spread over directions.
pub(super) const fn spreading(kinds: Kinds) -> Key {
    Key::number("spreading", 0.5..=1000.0)
        .absent()
        .only("kind", kinds)
        .about(
            "s of the spread over directions, (cos ½θ)^2s (Longuet-Higgins, Cartwright and \
             Smith 1963): wind seas about 10, swell 75; left out, all waves go one way",
        )
}

/// Seed of the phases of a sea.
pub(super) const fn seed(kinds: Kinds) -> Key {
    Key::whole("seed", 0..=u32::MAX)
        .default("0")
        .only("kind", kinds)
        .about("another number makes another sea of the same spectrum")
}

/// Direction of waves.
pub(super) const fn direction_degrees() -> Key {
    Key::number("direction_degrees", -360.0..=360.0)
        .unit("degrees")
        .default("0.0")
        .about("where most of the waves go, from +x towards +z")
}
