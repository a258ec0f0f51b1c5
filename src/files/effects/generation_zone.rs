//! Keys and checks of generation zones.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use swell_domain::{
    motion::{Spectrum, wave_number},
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
    key::{Interval, Key, words},
    motion::check_speed,
    regular_waves, seas,
};

/// Keys of the effect and of its waves.
const KEY: &str = "effects.generation_zone";

const LENGTH: Interval = 1e-9..=1e6;

const PERIOD: Interval = 1e-4..=1e6;

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
        check_waves(
            &self.waves,
            doc,
            gravity.length(),
            0.5 * around.least_length,
        )?;
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

/// Rejects waves that are outside of theory or that particles `spacing` metres
/// apart cannot resolve.
fn check_waves(
    waves: &Waves,
    doc: &Document<'_>,
    gravity: f64,
    spacing: f64,
) -> Result<(), SceneError> {
    if let Waves::Stokes(regular) = waves {
        let asked = regular.asked(gravity);
        regular_waves::check_stokes(doc, WAVES, &asked)?;
        let length = TAU / asked.wave_number();
        let period = format!("{WAVES}.period");
        seas::check_spacings(doc, &period, [asked.period, length, spacing])?;
    }
    if let Some((asked, enhancement)) = waves.spectral(gravity) {
        seas::shape(doc, WAVES, asked.spectrum, enhancement)?;
        let periods = [asked.peak_period, asked.shortest_period, asked.ramp];
        seas::check_periods(doc, WAVES, periods, gravity)?;
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
        stands.map_err(|problem| doc.fault_of(&format!("{WAVES}.{key}"), problem))?;
        let k = wave_number(TAU / asked.shortest_period, asked.depth, gravity);
        let shortest = [asked.shortest_period, TAU / k, spacing];
        let key = format!("{WAVES}.shortest_period");
        seas::check_spacings(doc, &key, shortest)?;
    }
    check_speed(waves.by(gravity).most_speed())
        .map_err(|problem| doc.fault_of_plain(WAVES, problem))
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

const SPECTRA: [&str; 3] = words(&Spectrum::NAMED);

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
    Key::number("period", PERIOD)
        .unit("seconds")
        .only("kind", &["stokes"])
        .also(", of waves that are at least 10 particle spacings long")
        .about("of the waves"),
    Key::number("significant_height", LENGTH)
        .unit("metres")
        .only("kind", SEA)
        .also(", at most the depth and no steeper at the peak than waves can be")
        .about("four times the root of the elevation's variance"),
    Key::number("peak_period", PERIOD)
        .unit("seconds")
        .only("kind", SPECTRAL)
        .about("of the waves with the most energy"),
    Key::choice("spectrum", &SPECTRA)
        .default("\"jonswap\"")
        .only("kind", SPECTRAL)
        .about("as a wave maker's"),
    Key::number("peak_enhancement", 1.0..=20.0)
        .computed(|| "3.3".to_owned())
        .only("kind", SPECTRAL)
        .also(", not with spectrum = \"pierson_moskowitz\"")
        .about("γ, how much higher the peak is than Pierson and Moskowitz's"),
    Key::number("shortest_period", PERIOD)
        .unit("seconds")
        .computed(|| "a third of the peak's".to_owned())
        .only("kind", SPECTRAL)
        .also(
            ", a tenth to nine tenths of the peak's, of waves that are at least 10 \
             particle spacings long",
        )
        .about("of the shortest waves; what is left out is given to the others"),
    Key::number("spreading", 0.5..=1000.0)
        .absent()
        .only("kind", SPECTRAL)
        .about(
            "s of the spread over directions, (cos ½θ)^2s (Longuet-Higgins, Cartwright and \
             Smith 1963): wind seas about 10, swell 75; left out, all waves go one way",
        ),
    Key::whole("seed", 0..=u32::MAX)
        .default("0")
        .only("kind", SEA)
        .about("another number makes another sea of the same spectrum"),
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
    Key::number("direction_degrees", -360.0..=360.0)
        .unit("degrees")
        .default("0.0")
        .about("where most of the waves go, from +x towards +z"),
];
