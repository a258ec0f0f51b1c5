//! Keys of the motions of wave makers and solids.

use super::super::{
    declare::keys,
    key::{Interval, Key, words},
};
use swell_domain::{motion::Spectrum, named::read_by_name};

/// Kind of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum MotionKind {
    #[default]
    Still,
    ConstantVelocity,
    Sine,
    Solitary,
    Stokes,
    Cnoidal,
    Sea,
    Focused,
    Table,
}

impl MotionKind {
    /// All kinds with the names used in scenes.
    const NAMED: [(&'static str, Self); 9] = [
        ("still", Self::Still),
        ("constant_velocity", Self::ConstantVelocity),
        ("sine", Self::Sine),
        ("solitary", Self::Solitary),
        ("stokes", Self::Stokes),
        ("cnoidal", Self::Cnoidal),
        ("sea", Self::Sea),
        ("focused", Self::Focused),
        ("table", Self::Table),
    ];

    fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
}

read_by_name!(MotionKind);

/// Kinds of which solids move.
const OF_SOLIDS: &[&str] = &["constant_velocity", "sine", "table"];

/// Metres: a stroke, a wave height or the depth of the water. The upper bound is
/// that of the domain.
const LENGTH: Interval = 1e-9..=1e6;

/// Seconds: from a tenth of a millisecond (ultrasonic ripples) to eleven days (a spring tide).
const PERIOD: Interval = 1e-4..=1e6;

// The speed of sound in water is 1500 m/s.
const fn velocity(name: &'static str) -> Key {
    Key::number(name, 1e-9..=1e5)
        .unit("m/s")
        .only("kind", &["constant_velocity"])
        .about("steady speed, inward or along direction")
}

const fn until(name: &'static str) -> Key {
    Key::number(name, 1e-6..=1e9)
        .unit("seconds")
        .absent()
        .only("kind", &["constant_velocity"])
        .about("when it stops")
}

const fn stroke(name: &'static str) -> Key {
    Key::number(name, LENGTH)
        .unit("metres")
        .only("kind", &["sine"])
        .about(
            "the whole distance from one end of the way to the other, twice the amplitude: \
             x(t) = stroke/2 (1 − cos(2π t / period)), times the ramp; the S of H/S in wave \
             maker theory (Dean and Dalrymple 1991)",
        )
}

const fn cycle(name: &'static str) -> Key {
    Key::number(name, PERIOD)
        .unit("seconds")
        .only("kind", &["sine"])
        .about("of one cycle, there and back")
}

const fn ramp(name: &'static str) -> Key {
    Key::number_or_zero(name, PERIOD)
        .unit("seconds")
        .computed(|| "one period".to_owned())
        .only("kind", &["sine"])
        .about("how long the motion takes to reach its full stroke; 0: it begins with it")
}

const fn file(name: &'static str) -> Key {
    Key::text(
        name,
        "a table of time and displacement (seconds, metres), two numbers a line, \
         relative to the scene file",
    )
    .absent()
    .only("kind", &["table"])
    .about(
        "displacements from a file, a comma, a semicolon, a tab or spaces between the two; the \
         written-out scene has them as points",
    )
}

const fn points(name: &'static str) -> Key {
    Key::points(
        name,
        2,
        "at least two [seconds, metres], times rising from 0 on, displacements from 0 on, inward \
         or along direction, the first 0, all up to 1e9, no faster than 100000 m/s",
    )
    .only("kind", &["table"])
    .without(&["file"])
    .about("displacements in place")
}

keys! { struct SolidMotionSpec {
    kind: MotionKind = choice(OF_SOLIDS)
        .also("; solitary and regular waves, seas and packets are made by a wall")
        .about("kind of motion"),
    velocity: Option<f64> = velocity,
    until: Option<f64> = until,
    stroke: Option<f64> = stroke,
    period: Option<f64> = cycle,
    ramp: Option<f64> = ramp,
    file: Option<String> = file,
    points: Option<Vec<[f64; 2]>> = points,
} }

keys! { struct TurnSpec {
    kind: MotionKind = choice(OF_SOLIDS).about("kind of motion"),
    degrees_per_second: Option<f64> = number(1e-9..=1e9)
        .unit("degrees/s")
        .only("kind", &["constant_velocity"])
        .about("steady speed"),
    until: Option<f64> = until,
    swing_degrees: Option<f64> = number(1e-9..=1e9)
        .unit("degrees")
        .only("kind", &["sine"])
        .about(
            "the whole angle from one end of the way to the other: swing/2 (1 − cos(2π t / \
             period)), times the ramp; the solid stands at one end at the start",
        ),
    period: Option<f64> = cycle,
    ramp: Option<f64> = ramp,
    file: Option<String> = text(
        "a table of time and angle (seconds, degrees), two numbers a line, \
         relative to the scene file",
    )
    .absent()
    .only("kind", &["table"])
    .about(
        "angles from a file, a comma, a semicolon, a tab or spaces between the two; the \
         written-out scene has them as points",
    ),
    points: Option<Vec<[f64; 2]>> = points(
        2,
        "at least two [seconds, degrees], times rising from 0 on, the first angle 0, all up to 1e9",
    )
    .only("kind", &["table"])
    .without(&["file"])
    .about("angles in place, joined by a monotone cubic"),
} }

/// Motions with a spectrum.
const SEAS: &[&str] = &["sea", "focused"];

keys! { #[derive(Default)] struct WallMotionSpec {
    kind: MotionKind = choice(&words(&MotionKind::NAMED)).about(
        "kind of motion; `still`, with absorption alone, makes no waves; `solitary` is Goring \
         1978; `stokes` (second order, Schäffer 1996 and Madsen 1971) and `cnoidal` (shallow \
         water, Goring 1978) make regular waves without free ones; `sea` and `focused` follow a \
         spectrum, by linear theory or to second order",
    ),
    velocity: Option<f64> = velocity,
    until: Option<f64> = until,
    stroke: Option<f64> = stroke,
    period: Option<f64> = number(PERIOD)
        .unit("seconds")
        .only("kind", &["sine", "stokes", "cnoidal"])
        .also("; regular waves are at least 10 particle spacings long, cnoidal ones 8 depths")
        .about("of one cycle, there and back; of regular waves"),
    ramp: Option<f64> = number_or_zero(PERIOD)
        .unit("seconds")
        .computed(|| "one period of a sine, two (of the peak) of other waves,".to_owned())
        .only("kind", &["sine", "stokes", "cnoidal", "sea", "focused"])
        .about(
            "how long the motion takes to reach its full size; 0, of a sine and of regular waves \
             alone: it begins with it",
        ),
    height: Option<f64> = number(LENGTH)
        .unit("metres")
        .only("kind", &["solitary", "stokes", "cnoidal", "focused"])
        .also(", at most the depth; regular waves are up to 0.78 depths high and do not break")
        .about(
            "of a solitary wave, whose crest leaves the wall (6 d/K + H/K)/c after the start, K \
             = √(3H/4d), c = √(g (d + H)); of regular waves, trough to crest; of a packet's \
             crest by linear theory",
        ),
    depth: Option<f64> = number(LENGTH)
        .unit("metres")
        .only("kind", &["solitary", "stokes", "cnoidal", "sea", "focused"])
        .about("of the water at rest"),
    spectrum: Option<Spectrum> = choice(&words(&Spectrum::NAMED))
        .default("\"jonswap\"")
        .only("kind", SEAS)
        .about(
            "how the energy is spread: JONSWAP (Hasselmann et al. 1973), Pierson and Moskowitz \
             1964, TMA (Bouws et al. 1985)",
        ),
    peak_enhancement: Option<f64> = number(1.0..=20.0)
        .computed(|| "3.3".to_owned())
        .only("kind", SEAS)
        .also(", not with spectrum = \"pierson_moskowitz\"")
        .about("γ, how much higher the peak is than Pierson and Moskowitz's"),
    peak_period: Option<f64> = number(PERIOD)
        .unit("seconds")
        .only("kind", SEAS)
        .about("of the waves with the most energy; the sea comes again after 200 of them"),
    shortest_period: Option<f64> = number(PERIOD)
        .unit("seconds")
        .computed(|| "a third of the peak's".to_owned())
        .only("kind", SEAS)
        .also(
            ", a tenth to nine tenths of the peak's, of waves that are at least 10 \
             particle spacings long",
        )
        .about("of the shortest waves that are made; what is left out is given to the others"),
    significant_height: Option<f64> = number(LENGTH)
        .unit("metres")
        .only("kind", &["sea"])
        .also(", at most the depth and no steeper at the peak than waves can be")
        .about("four times the root of the elevation's variance"),
    seed: Option<u32> = whole(0..=u32::MAX)
        .default("0")
        .only("kind", &["sea"])
        .about("another number makes another sea of the same spectrum"),
    at: Option<f64> = number(LENGTH)
        .unit("metres")
        .only("kind", &["focused"])
        .also(", inside of the domain")
        .about("where the packet's crests meet, from where the wall is at the start"),
    time: Option<f64> = number(PERIOD)
        .unit("seconds")
        .only("kind", &["focused"])
        .also(", late enough for its slowest waves to be there")
        .about("when they meet"),
    second_order: Option<bool> = flag()
        .default("false")
        .only("kind", SEAS)
        .also(
            ", for waves that the second order holds for, the shortest at least a \
             quarter of the depth long",
        )
        .about(
            "whether the wall moves at sums and differences of frequencies too, so that it makes \
             no free waves of them (Schäffer 1996)",
        ),
    file: Option<String> = file,
    points: Option<Vec<[f64; 2]>> = points,
} }

keys! { struct TrackSpec {
    file: Option<String> = text(
        "a glTF file (.gltf or .glb) or USD as text (.usda), relative to the scene file",
    )
    .absent()
    .about("its node's animation carries the solid; the written-out scene has it as poses"),
    node: Option<String> = text(
        "the name of a node in the file; of USD its path will do too",
    )
    .absent()
    .with("file")
    .about(
        "whose motion it is, with that of the nodes above it; left out: the file's only node, or \
         USD's only prim with a transform",
    ),
    start: Option<f64> = number(-1e6..=1e6)
        .absent()
        .with("file")
        .about(
            "the file's frame that is frame 1 of the shot, such as 1001: of USD a time code, of \
             glTF a frame of the shot's rate",
        ),
    poses: Option<Vec<[f64; 8]>> = points(
        8,
        "rows of [seconds, x, y, z, qx, qy, qz, qw], times rising from 0 on, places in metres, \
         unit quaternions, the first [0, 0, 0, 1]",
    )
    .absent()
    .without(&["file"])
    .about(
        "the motion in place: where a point of the solid is, and how the solid is turned about it",
    ),
} }
