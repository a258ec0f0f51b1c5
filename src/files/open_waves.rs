//! Keys and checks of waves on open water.

use std::f64::consts::TAU;

use swell_domain::{
    motion::{Spectrum, wave_number},
    open_waves::Meeting,
};
use swell_scene::{SceneError, open_waves::Waves, words::shown};

use super::{
    declare::Keyed,
    document::Document,
    key::{Interval, Key, words},
    regular_waves, seas,
    speed::check_speed,
};

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

/// Depth of the water that is simulated.
pub(super) const fn simulated_depth(kinds: Kinds) -> Key {
    Key::number("simulated_depth", LENGTH)
        .unit("metres")
        .absent()
        .only("kind", kinds)
        .also(", less than `depth`, and no more than the domain is high")
        .about(
            "from still water down to the domain's floor, above which a floor moves as the water \
             there would; left out, all of `depth` is simulated",
        )
}

/// Direction of waves.
pub(super) const fn direction_degrees() -> Key {
    Key::number("direction_degrees", -360.0..=360.0)
        .unit("degrees")
        .default("0.0")
        .about("where most of the waves go, from +x towards +z")
}

const SEA: &[&str] = &["sea"];

const PACKET: &[&str] = &["focused"];

const SPECTRAL: &[&str] = &["sea", "focused"];

const ALL: &[&str] = &["stokes", "sea", "focused"];

/// A test compares them with the fields of each kind.
impl Keyed for Waves {
    const KEYS: &'static [Key] = WAVES_KEYS;
}

const WAVES_KEYS: &[Key] = &[
    Key::choice("kind", &["stokes", "sea", "focused"]).about(
        "`stokes`: regular waves to second order (Stokes 1847); `sea`: 64 waves of a \
         spectrum by linear theory; `focused`: such waves, whose crests meet",
    ),
    Key::number("height", LENGTH)
        .unit("metres")
        .only("kind", &["stokes", "focused"])
        .also(
            ", at most the depth; regular waves up to 0.78 depths and no \
             steeper than waves can be",
        )
        .about(
            "of regular waves, from trough to crest; of a packet's crest above still \
             water by linear theory",
        ),
    period(),
    significant_height(SEA),
    peak_period(SPECTRAL),
    spectrum(SPECTRAL),
    peak_enhancement(SPECTRAL),
    shortest_period(SPECTRAL),
    spreading(SPECTRAL),
    seed(SEA),
    Key::vector("at", 2, 0.0..=1e6)
        .unit("metres")
        .only("kind", PACKET)
        .also(", in the domain")
        .about("where crests meet: x and z from the domain's least corner"),
    Key::number("time", PERIOD)
        .unit("seconds")
        .only("kind", PACKET)
        .also(", late enough for its slowest waves to be there")
        .about("when they meet there"),
    Key::number("depth", LENGTH)
        .unit("metres")
        .also(", no more than the domain is high if all of it is simulated")
        .about("of the water at rest"),
    simulated_depth(ALL),
    Key::number_or_zero("ramp", PERIOD)
        .unit("seconds")
        .computed(|| "two periods (of the peak)".to_owned())
        .about(
            "how long the waves take to grow to their full height; 0: they have it at the start, \
             as those of `water.wave` do",
        ),
    direction_degrees(),
];

/// Rejects waves of the table at `path` that are outside of theory, or that particles `spacing`
/// metres apart cannot resolve.
pub(super) fn check(
    waves: &Waves,
    doc: &Document<'_>,
    path: &str,
    gravity: f64,
    spacing: f64,
) -> Result<(), SceneError> {
    if let Waves::Stokes(regular) = waves {
        let asked = regular.asked(gravity);
        regular_waves::check_stokes(doc, path, &asked)?;
        let length = TAU / asked.wave_number();
        let period = format!("{path}.period");
        seas::check_spacings(doc, &period, [asked.period, length, spacing])?;
    }
    if let Some((asked, enhancement)) = waves.spectral(gravity) {
        seas::shape(doc, path, asked.spectrum, enhancement)?;
        let periods = [asked.peak_period, asked.shortest_period];
        seas::check_periods(doc, path, periods, gravity)?;
        let (key, stands) = match asked.meeting {
            Meeting::Random {
                significant_height, ..
            } => {
                let water = [asked.depth, gravity];
                let stands = seas::check_height(significant_height, asked.peak_period, water);
                ("significant_height", stands)
            }
            Meeting::Focused { height, .. } => ("height", seas::check_depth(height, asked.depth)),
        };
        stands.map_err(|problem| doc.fault_of(&format!("{path}.{key}"), problem))?;
        let k = wave_number(TAU / asked.shortest_period, asked.depth, gravity);
        let shortest = [asked.shortest_period, TAU / k, spacing];
        let key = format!("{path}.shortest_period");
        seas::check_spacings(doc, &key, shortest)?;
    }
    check_simulated(doc, path, waves)?;
    check_speed(waves.by(gravity).most_speed()).map_err(|problem| doc.fault_of_plain(path, problem))
}

/// Rejects a simulated depth that is not less than all.
fn check_simulated(doc: &Document<'_>, path: &str, waves: &Waves) -> Result<(), SceneError> {
    let [_, depth, _] = waves.common();
    match waves.simulated_depth() {
        Some(simulated) if simulated >= depth => {
            let problem = format!(
                "{} m of water that is {} m deep; left out, all of it is simulated",
                shown(simulated),
                shown(depth)
            );
            Err(doc.fault_of(&format!("{path}.simulated_depth"), problem))
        }
        _ => Ok(()),
    }
}
