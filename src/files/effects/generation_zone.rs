//! Keys and checks of generation zones.

use glam::{DVec2, DVec3};

use swell_scene::{
    SceneError, Wall,
    effects::generation_zone::{Settings, WAVES},
    open_waves::{Packet, Waves},
    words::shown,
};

use super::{Declared, Surroundings, zone};
use crate::{declare::keys, document::Document, key::words, open_waves};

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
        open_waves::check(&self.waves, doc, WAVES, gravity.length(), spacing)?;
        let (depth, [.., degrees]) = (self.waves.level(), self.waves.common());
        let height = around.domain.size().y;
        if depth > height {
            let (depth, height) = (shown(depth), shown(height));
            let problem = format!("{depth} m of water in a domain that is {height} m high");
            let key = match self.waves.simulated_depth() {
                Some(_) => "waves.simulated_depth",
                None => "waves.depth",
            };
            return refuse(key, problem);
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
