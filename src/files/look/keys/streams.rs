//! Keys of the streams beside the water that a look draws.

use super::{Key, PART, PER_METRE};

pub(super) const WHITEWATER: &[Key] = &[
    Key::file_stem("stream")
        .default("\"default\"")
        .about("its name, which is that of its folder in CACHE/whitewater"),
    Key::number("density_per_metre", PER_METRE)
        .unit("1/m")
        .default("40.0")
        .about(
            "optical density within a whitewater particle, which stands for many drops or bubbles",
        ),
    Key::number("size", 1e-3..=1e3)
        .default("1.0")
        .about("factor on its radius"),
    Key::number("foam_albedo", PART)
        .default("0.9")
        .about("fraction of the light on it that foam reflects"),
    Key::number("foam_amount", 1e-3..=1e3)
        .default("3.0")
        .about("factor on the area of foam's discs, and so on the depth that covers the water"),
];

pub(super) const WET: &[Key] = &[
    Key::file_stem("stream")
        .default("\"default\"")
        .about("its name, which is that of its folder in CACHE/wet"),
    Key::number("roughness", PART).default("0.3").about(
        "root mean square slope of the film of water, which spreads the sun's reflection and dims \
             what is mirrored at grazing incidence",
    ),
];
