//! Keys and checks of waves at the start.

use std::f64::consts::TAU;

use glam::DVec2;

use swell_domain::{
    bounds::Bounds,
    motion::{Spectrum, wave_number},
};
use swell_scene::{
    SceneError,
    start_waves::{HIGHEST_SOLITARY, KEY, StartWave},
    words::shown,
};

use crate::{
    document::Document,
    effects::generation_zone::check_waves,
    key::{Interval, Key, words},
};

const LENGTH: Interval = 1e-9..=1e6;

const PERIOD: Interval = 1e-4..=1e6;

const SPECTRA: [&str; 3] = words(&Spectrum::NAMED);

type Result<T> = std::result::Result<T, SceneError>;

/// How far a length of a periodic axis may be from a whole number of wave lengths, in wave lengths.
const FITS: f64 = 0.01;

pub(super) const KEYS: &[Key] = &[
    Key::choice("kind", &["solitary", "stokes", "sea"]).about(
        "`solitary`: one wave to third order (Grimshaw 1971); `stokes`: regular waves to second \
         order (Stokes 1847); `sea`: 64 waves of a spectrum by linear theory, the same as a \
         generation zone with these keys brings in at the start of its shot",
    ),
    Key::number("height", LENGTH)
        .unit("metres")
        .only("kind", &["solitary", "stokes"])
        .also(
            ", of a solitary wave at most half the depth; regular waves up to 0.78 depths and no \
             steeper than waves can be",
        )
        .about(
            "of a solitary wave's crest above still water; of regular waves, from trough to crest",
        ),
    Key::number("period", PERIOD)
        .unit("seconds")
        .only("kind", &["stokes"])
        .also(", of waves that are at least 10 particle spacings long")
        .about("of the waves"),
    Key::number("significant_height", LENGTH)
        .unit("metres")
        .only("kind", &["sea"])
        .also(", at most the depth and no steeper at the peak than waves can be")
        .about("four times the root of the elevation's variance"),
    Key::number("peak_period", PERIOD)
        .unit("seconds")
        .only("kind", &["sea"])
        .about("of the waves with the most energy"),
    Key::choice("spectrum", &SPECTRA)
        .default("\"jonswap\"")
        .only("kind", &["sea"])
        .about("as a wave maker's"),
    Key::number("peak_enhancement", 1.0..=20.0)
        .computed(|| "3.3".to_owned())
        .only("kind", &["sea"])
        .also(", not with spectrum = \"pierson_moskowitz\"")
        .about("γ, how much higher the peak is than Pierson and Moskowitz's"),
    Key::number("shortest_period", PERIOD)
        .unit("seconds")
        .computed(|| "a third of the peak's".to_owned())
        .only("kind", &["sea"])
        .also(
            ", a tenth to nine tenths of the peak's, of waves that are at least 10 \
               particle spacings long",
        )
        .about("of the shortest waves; what is left out is given to the others"),
    Key::number("spreading", 0.5..=1000.0)
        .absent()
        .only("kind", &["sea"])
        .about(
            "s of the spread over directions, (cos ½θ)^2s (Longuet-Higgins, Cartwright and \
                Smith 1963): wind seas about 10, swell 75; left out, all waves go one way",
        ),
    Key::whole("seed", 0..=u32::MAX)
        .default("0")
        .only("kind", &["sea"])
        .about("another number makes another sea of the same spectrum"),
    Key::number("at", -1e6..=1e6)
        .unit("metres")
        .only("kind", &["solitary"])
        .about("of the crest from the domain's least corner, along the way that the wave goes"),
    Key::number("depth", LENGTH)
        .unit("metres")
        .also(", no more than the domain is high, and the same for all waves")
        .about("of the water at rest, from the domain's floor"),
    Key::number("direction_degrees", -360.0..=360.0)
        .unit("degrees")
        .default("0.0")
        .about("where most of the waves go, from +x towards +z"),
];

/// What the waves have to fit.
pub(super) struct Surroundings<'a> {
    pub(super) domain: &'a Bounds,
    pub(super) periodic: [bool; 3],
    pub(super) gravity: [f64; 3],
    pub(super) spacing: f64,
    /// Whether the scene has blocks or meshes of water.
    pub(super) has_other_water: bool,
}

/// Checks the waves of a scene.
pub(super) fn check(
    doc: &Document<'_>,
    waves: &[StartWave],
    around: &Surroundings<'_>,
) -> Result<()> {
    let Some(first) = waves.first() else {
        return Ok(());
    };
    if around.has_other_water {
        let problem = "water below waves fills the domain, and water.block and water.mesh cannot \
                       stand beside it";
        return Err(doc.fault_of_plain(&format!("{KEY}[0]"), problem.to_owned()));
    }
    for (index, wave) in waves.iter().enumerate() {
        let path = format!("{KEY}[{index}]");
        if wave.depth() != first.depth() {
            let problem = format!(
                "{} m, and {KEY}[0] has {} m: all waves are on the same water",
                shown(wave.depth()),
                shown(first.depth())
            );
            return Err(doc.fault_of(&format!("{path}.depth"), problem));
        }
        check_one(doc, &path, wave, around)?;
    }
    Ok(())
}

fn check_one(
    doc: &Document<'_>,
    path: &str,
    wave: &StartWave,
    around: &Surroundings<'_>,
) -> Result<()> {
    let refuse = |key: &str, problem: String| Err(doc.fault_of(&format!("{path}.{key}"), problem));
    let [x, y, z] = around.gravity;
    if x != 0.0 || z != 0.0 || y >= 0.0 {
        return refuse("kind", "waves need gravity along -y".to_owned());
    }
    let high = around.domain.size().y;
    if wave.depth() > high {
        let (depth, high) = (shown(wave.depth()), shown(high));
        let problem = format!("{depth} m of water in a domain that is {high} m high");
        return refuse("depth", problem);
    }
    if let Some(open) = wave.open() {
        check_waves(&open, doc, path, -y, around.spacing)?;
    }
    if let StartWave::Solitary(solitary) = wave
        && solitary.height > HIGHEST_SOLITARY * solitary.depth
    {
        let problem = format!(
            "{} m on {} m of water: third-order theory is used up to {HIGHEST_SOLITARY} depths",
            shown(solitary.height),
            shown(solitary.depth)
        );
        return refuse("height", problem);
    }
    check_periods(doc, path, wave, around)
}

/// Rejects waves that do not repeat along a periodic axis.
fn check_periods(
    doc: &Document<'_>,
    path: &str,
    wave: &StartWave,
    around: &Surroundings<'_>,
) -> Result<()> {
    let degrees = wave.direction_degrees();
    let direction = DVec2::from_angle(degrees.to_radians());
    for (axis, name) in [(0, "x"), (2, "z")] {
        let along = if axis == 0 { direction.x } else { direction.y };
        if !around.periodic[axis] {
            continue;
        }
        let refuse = |key: &str, problem| Err(doc.fault_of(&format!("{path}.{key}"), problem));
        let size = around.domain.size()[axis];
        match wave {
            StartWave::Sea(sea) if sea.spreading.is_some() => {
                let problem = format!("spread waves do not fit the period along {name}");
                return refuse("spreading", problem);
            }
            StartWave::Stokes(waves) if along.abs() > 1e-6 => {
                let k = wave_number(TAU / waves.period, waves.depth, -around.gravity[1]);
                let count = size * along.abs() * k / TAU;
                if count < 0.5 || (count - count.round()).abs() > FITS {
                    let problem = format!(
                        "waves of {} s that go towards {} degrees: {count:.3} of their lengths are \
                         in the period of {} m along {name}, and a whole number fits",
                        shown(waves.period),
                        shown(degrees),
                        shown(size)
                    );
                    return refuse("period", problem);
                }
            }
            _ if along.abs() > 1e-6 => {
                let problem = format!(
                    "waves that go towards {} degrees do not fit the period along {name}",
                    shown(degrees)
                );
                return refuse("direction_degrees", problem);
            }
            _ => {}
        }
    }
    Ok(())
}
