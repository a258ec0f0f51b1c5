//! Keys and checks of generation zones.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use swell_domain::{
    motion::wave_number,
    open_waves::Meeting,
};
use swell_scene::{
    SceneError, Wall,
    effects::generation_zone::{Packet, Settings, WAVES, Waves},
    words::shown,
};

use super::{Declared, Surroundings, zone};
use crate::{
    declare::{Keyed, keys},
    document::Document,
    key::{Key, words},
    motion::check_speed,
    regular_waves, seas,
    wave_keys::{self, LENGTH, PERIOD},
};

/// Keys of the effect and of its waves.
const KEY: &str = "effects.generation_zone";

keys! { fields of Settings {
    walls: Vec<Wall> = choices(&words(&Wall::NAMED))
        .also(
            ", upright ones, each once, none of them periodic or a wave maker's, one at \
             least from which the waves come",
        )
        .about("the walls before which the zones lie; the water's gravity goes along -y"),
    length: f64 = number(1e-7..=1e6)
        .unit("metres")
        .also(", at least two particle spacings and no longer than the domain is")
        .about(
            "of each zone from its wall; with one and a half wave lengths waves are within \
             5 % of those asked for",
        ),
    waves: Waves = inline().about(
        "what comes in; height, phase and velocity are \
         given at each place of the zones",
    ),
} }

impl Declared for Settings {
    const ABOUT: &'static str = "Zones before walls in which water is led towards given waves, \
                                 which run in from there, and in which what runs out dies \
                                 (relaxation zones, Jacobsen, Fuhrman and Fredsøe 2012)";

    fn check(&self, doc: &Document<'_>, around: &Surroundings<'_>) -> Result<(), SceneError> {
        zone::check(&self.zone(), doc, KEY, around)?;
        let refuse = |key: &str, problem| Err(doc.fault_of(&format!("{KEY}.{key}"), problem));
        if let Some(wall) = self.walls.iter().find(|wall| wall.axis == 1) {
            let problem = format!("the wall {} is not upright", wall.name());
            return refuse("walls", problem);
        }
        let gravity = around.gravity;
        if gravity.x != 0.0 || gravity.z != 0.0 || gravity.y > 0.0 {
            let problem = "waves need gravity along -y".to_owned();
            return refuse("waves.kind", problem);
        }
        let spacing = 0.5 * around.least_length;
        check_waves(&self.waves, doc, WAVES, gravity.length(), spacing)?;
        let [_, depth, degrees] = self.waves.common();
        let height = around.domain.size().y;
        if depth > height {
            let (depth, height) = (shown(depth), shown(height));
            let problem = format!("{depth} m of water in a domain that is {height} m high");
            return refuse("waves.depth", problem);
        }
        let direction = DVec2::from_angle(degrees.to_radians());
        let comes_from = |wall: &Wall| {
            let along = if wall.axis == 0 {
                direction.x
            } else {
                direction.y
            };
            let inward = if wall.is_max { -along } else { along };
            inward > 0.01
        };
        for axis in [0, 2].into_iter().filter(|&axis| around.periodic[axis]) {
            let across = if axis == 0 { direction.x } else { direction.y };
            let name = ["x", "y", "z"][axis];
            if self.waves.spreading().is_some() {
                let problem = format!("spread waves do not fit the period along {name}");
                return refuse("waves.spreading", problem);
            }
            if across.abs() > 1e-6 {
                let problem = format!(
                    "waves that go towards {} degrees do not fit the period along {name}",
                    shown(degrees)
                );
                return refuse("waves.direction_degrees", problem);
            }
        }
        if let Waves::Focused(packet) = &self.waves {
            let walls = self.walls.iter().filter(|wall| comes_from(wall));
            check_packet(self, packet, doc, walls, around)?;
        }
        if !self.walls.iter().any(comes_from) {
            let problem = format!(
                "waves that go towards {} degrees come from none of the walls",
                shown(degrees)
            );
            return refuse("waves.direction_degrees", problem);
        }
        Ok(())
    }
}

/// Rejects waves of the table at `path` that are outside of theory or that particles `spacing` metres
/// apart cannot resolve.
pub(crate) fn check_waves(
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
        let periods = [asked.peak_period, asked.shortest_period, asked.ramp];
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
    check_speed(waves.by(gravity).most_speed())
        .map_err(|problem| doc.fault_of_plain(path, problem))
}

/// Rejects a packet whose crests meet outside of the domain, or before its slowest waves can
/// arrive from the nearest zone.
fn check_packet<'a>(
    settings: &Settings,
    packet: &Packet,
    doc: &Document<'_>,
    from: impl Iterator<Item = &'a Wall>,
    around: &Surroundings<'_>,
) -> Result<(), SceneError> {
    let refuse = |key: &str, problem| Err(doc.fault_of(&format!("{WAVES}.{key}"), problem));
    let size = around.domain.size();
    let at = DVec3::new(packet.at[0], 0.0, packet.at[1]);
    if let Some(axis) = [0, 2]
        .into_iter()
        .find(|&axis| !(0.0..=size[axis]).contains(&at[axis]))
    {
        let problem = format!(
            "{} m along {} from the domain's least corner, and the domain is {} m long",
            shown(at[axis]),
            ["x", "y", "z"][axis],
            shown(size[axis])
        );
        return refuse("at", problem);
    }
    let direction = DVec2::from_angle(packet.direction_degrees.to_radians());
    let way = |wall: &Wall| {
        let off = match wall.is_max {
            false => at[wall.axis],
            true => size[wall.axis] - at[wall.axis],
        };
        let along = [direction.x, 0.0, direction.y][wall.axis].abs();
        (off - settings.length).max(0.0) / along
    };
    let way = from.map(way).fold(f64::INFINITY, f64::min);
    let waves = settings.incoming(around.gravity);
    let (ramp, speed) = (waves.ramp(), waves.least_group_speed());
    let least = ramp + way / speed;
    if way.is_finite() && packet.time < least {
        let problem = format!(
            "its slowest waves, of {speed:.3} m/s, arrive after {least:.3} s if they leave the \
             zone when the ramp ends"
        );
        return refuse("time", problem);
    }
    Ok(())
}

const SEA: &[&str] = &["sea"];

const PACKET: &[&str] = &["focused"];

const SPECTRAL: &[&str] = &["sea", "focused"];

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
    wave_keys::period(),
    wave_keys::significant_height(SEA),
    wave_keys::peak_period(SPECTRAL),
    wave_keys::spectrum(SPECTRAL),
    wave_keys::peak_enhancement(SPECTRAL),
    wave_keys::shortest_period(SPECTRAL),
    wave_keys::spreading(SPECTRAL),
    wave_keys::seed(SEA),
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
        .also(", no more than the domain is high")
        .about("of the water at rest, from the domain's floor"),
    Key::number_or_zero("ramp", PERIOD)
        .unit("seconds")
        .computed(|| "two periods (of the peak)".to_owned())
        .also("; 0 of regular waves alone")
        .about("how long the waves take to grow to their full height"),
    wave_keys::direction_degrees(),
];
