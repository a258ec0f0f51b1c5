//! Zones before walls in which waves die out instead of being turned back: a sponge layer (Israeli and Orszag 1981).

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{
    super::{
        Wall,
        document::Document,
        error::SceneError,
        key::{Key, words},
        words::shown,
    },
    Effect, Surroundings,
};

/// The key that names the walls.
const KEY: &str = "effects.absorbing_zone.walls";

/// The rate at the wall over the angular frequency of the waves. In shallow water a zone of one and a half wave lengths
/// then turns back 0.3 % of a wave's height, and one of three quarters 3.6 %: from the equation η″ + k²(1 + i r/ω) η = 0
/// with a wall behind it, solved numerically. (1.5 turns back 1.6 and 13 %, 5 turns back 1.2 and 11 %.)
const RATE: f64 = 2.5;

/// `absorbing_zone = { walls = ["+x"], length = 9.4, period = 2.3 }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Walls before which a zone lies, each once.
    pub walls: Vec<Wall>,
    /// Of each zone from its wall, metres.
    pub length: f64,
    /// Of the longest waves that it has to take, s.
    pub period: f64,
}

impl Settings {
    /// Rate at which velocities fall at the wall, 1/s.
    pub fn rate(&self) -> f64 {
        RATE * std::f64::consts::TAU / self.period
    }

    /// How far into the zone a place lies, metres from the domain's least corner: 0 where it begins and before, 1 at the
    /// wall. The domain has `size`, metres.
    pub fn way(&self, size: DVec3, place: DVec3) -> f64 {
        let off = |wall: &Wall| match wall.is_max {
            false => place[wall.axis],
            true => size[wall.axis] - place[wall.axis],
        };
        let ways = self.walls.iter().map(|wall| 1.0 - off(wall) / self.length);
        ways.fold(0.0, f64::max).min(1.0)
    }

    /// Part of its velocity that water at that place loses in a step of so many seconds: r Δt / (1 + r Δt), with r the rate
    /// times the square of the way into the zone.
    pub fn absorbed(&self, size: DVec3, place: DVec3, step: f64) -> f64 {
        let way = self.way(size, place);
        let lost = self.rate() * step * way * way;
        lost / (1.0 + lost)
    }
}

impl Effect for Settings {
    const ABOUT: &'static str =
        "Zones before walls in which waves die out (a sponge layer, Israeli and Orszag 1981)";

    const KEYS: &'static [Key] = &[
        Key::choices("walls", &words(&Wall::NAMED))
            .also(", each once, none of them periodic or a wave maker's")
            .about("the walls, whose wave is not turned back"),
        Key::number("length", 1e-7..=1e6)
            .unit("metres")
            .also(", no longer than the domain is")
            .about("of each zone from its wall; one and a half wave lengths turn back less than 5 % of a wave's height"),
        Key::number("period", 1e-6..=1e6)
            .unit("s")
            .about("of the longest waves that have to die out: velocities fall by 5π/period at the wall, and by the square of the way into the zone before it"),
    ];

    fn check(&self, doc: &Document<'_>, around: &Surroundings<'_>) -> Result<(), SceneError> {
        let refuse = |problem: String| Err(doc.fault_of_plain(KEY, problem));
        if self.walls.is_empty() {
            return refuse("names no wall".to_owned());
        }
        for (index, wall) in self.walls.iter().enumerate() {
            let name = wall.name();
            if self.walls[..index].contains(wall) {
                return refuse(format!("{name:?} stands there twice"));
            }
            if around.periodic[wall.axis] {
                let problem = "domain.periodic joins both ends";
                return refuse(format!("there is no wall {name}: {problem}"));
            }
            if around.wave_makers.iter().any(|maker| maker.wall == *wall) {
                return refuse(format!("the wall {name} is a wave maker's"));
            }
            let room = around.domain.size()[wall.axis];
            if self.length > room {
                let problem = format!(
                    "before the wall {name} lie {} m, and the zone is {} m long",
                    shown(room),
                    shown(self.length)
                );
                return Err(doc.fault_of("effects.absorbing_zone.length", problem));
            }
        }
        Ok(())
    }
}
