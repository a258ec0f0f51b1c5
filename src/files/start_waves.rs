//! Keys and checks of waves at the start.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use swell_domain::{bounds::Bounds, motion::wave_number};
use swell_scene::{
    SceneError,
    start_waves::{HIGHEST_SOLITARY, KEY, StartWave},
    words::shown,
};

use crate::{
    declare::Keyed,
    document::Document,
    key::Key,
    open_waves::{self, LENGTH},
};

const SEA: &[&str] = &["sea"];

const OPEN: &[&str] = &["stokes", "sea"];

type Result<T> = std::result::Result<T, SceneError>;

/// How far a length of a periodic axis may be from a whole number of wave lengths, in wave lengths.
const FITS: f64 = 0.01;

/// A test compares them with the fields of each kind.
impl Keyed for StartWave {
    const KEYS: &'static [Key] = &[
        Key::choice("kind", &["solitary", "stokes", "sea"]).about(
            "`solitary`: one wave to third order (Grimshaw 1971); `stokes`: regular waves to \
             second order (Stokes 1847); `sea`: 64 waves of a spectrum by linear theory",
        ),
        Key::number("height", LENGTH)
            .unit("metres")
            .only("kind", &["solitary", "stokes"])
            .also(
                ", of a solitary wave at most half the depth; regular waves up to 0.78 depths \
                 and no steeper than waves can be",
            )
            .about(
                "of a solitary wave's crest above still water; of regular waves, from trough to \
                 crest",
            ),
        open_waves::period(),
        open_waves::significant_height(SEA),
        open_waves::peak_period(SEA),
        open_waves::spectrum(SEA),
        open_waves::peak_enhancement(SEA),
        open_waves::shortest_period(SEA),
        open_waves::spreading(SEA),
        open_waves::seed(SEA),
        Key::number("at", -1e6..=1e6)
            .unit("metres")
            .only("kind", &["solitary"])
            .about("of the crest from the domain's least corner, along the way that the wave goes"),
        Key::number("depth", LENGTH)
            .unit("metres")
            .also(
                ", no more than the domain is high if all of it is simulated, and the same for all \
                 waves",
            )
            .about("of the water at rest"),
        open_waves::simulated_depth(OPEN),
        open_waves::direction_degrees(),
    ];
}

/// What the waves have to fit.
pub(super) struct Surroundings<'a> {
    pub(super) domain: &'a Bounds,
    pub(super) periodic: [bool; 3],
    pub(super) gravity: DVec3,
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
        if wave.level() != first.level() {
            let problem = format!(
                "{} m are simulated, and {} m of {KEY}[0]",
                shown(wave.level()),
                shown(first.level())
            );
            let key = match wave {
                StartWave::Solitary(_) => "kind",
                StartWave::Stokes(_) | StartWave::Sea(_) => "simulated_depth",
            };
            return Err(doc.fault_of_plain(&format!("{path}.{key}"), problem));
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
    let DVec3 { x, y, z } = around.gravity;
    if x != 0.0 || z != 0.0 || y >= 0.0 {
        let problem = format!("{path} needs gravity along -y");
        return Err(doc.fault_of("water.gravity", problem));
    }
    let high = around.domain.size().y;
    if wave.level() > high {
        let (depth, high) = (shown(wave.level()), shown(high));
        let problem = format!("{depth} m of water in a domain that is {high} m high");
        let key = match wave.level() < wave.depth() {
            true => "simulated_depth",
            false => "depth",
        };
        return refuse(key, problem);
    }
    if let Some(open) = wave.open() {
        open_waves::check(&open, doc, path, -y, around.spacing)?;
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
                let k = wave_number(TAU / waves.period, waves.depth, -around.gravity.y);
                let count = size * along.abs() * k / TAU;
                if count < 0.5 || (count - count.round()).abs() > FITS {
                    let k = TAU * count.round().max(1.0) / (size * along.abs());
                    let gravity = -around.gravity.y;
                    let fitting = TAU / (gravity * k * (k * waves.depth).tanh()).sqrt();
                    let problem = format!(
                        "waves of {} s that go towards {} degrees: {count:.3} of their lengths are \
                         in the period of {} m along {name}, and a whole number fits, as with \
                         {fitting:.6} s",
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

/// Most water below waves, m³: as deep as up to a crest that is one depth high.
pub(super) fn most_volume(waves: &[StartWave], domain: &Bounds) -> f64 {
    let size = domain.size();
    let deepest = |wave: &StartWave| (2.0 * wave.level()).min(size.y);
    waves
        .first()
        .map_or(0.0, |wave| size.x * size.z * deepest(wave))
}
