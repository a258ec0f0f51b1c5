//! Zones before walls in which water is led towards a velocity: what those that absorb and those that generate share.

use glam::DVec3;

use super::{
    super::{Wall, document::Document, error::SceneError, words::shown},
    Surroundings,
};

/// Zones of one length before some of the domain's walls.
#[derive(Clone, Copy, Debug)]
pub struct Zone<'a> {
    /// Walls before which one lies, each once.
    pub walls: &'a [Wall],
    /// Of each from its wall, metres.
    pub length: f64,
    /// At which velocities are led at the wall, 1/s.
    pub rate: f64,
}

impl Zone<'_> {
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

    /// Part of the way from its velocity to the wanted one that water at that place is led in a step of so many seconds: r Δt / (1 + r Δt), with
    /// r the rate times the square of the way into the zone.
    pub fn led(&self, size: DVec3, place: DVec3, step: f64) -> f64 {
        let way = self.way(size, place);
        let led = self.rate * step * way * way;
        led / (1.0 + led)
    }

    /// A bit a wall: of the least faces along x, y and z, then of the greatest.
    pub fn bits(&self) -> u32 {
        self.walls.iter().map(Wall::bit).sum()
    }

    /// Refuses walls and a length that do not fit into the scene; `effect` is the zone's key.
    pub(super) fn check(
        &self,
        doc: &Document<'_>,
        effect: &str,
        around: &Surroundings<'_>,
    ) -> Result<(), SceneError> {
        let refuse = |problem: String| Err(doc.fault_of(&format!("{effect}.walls"), problem));
        let length = |problem: String| Err(doc.fault_of(&format!("{effect}.length"), problem));
        if self.walls.is_empty() {
            return refuse("names no wall".to_owned());
        }
        if self.length < around.least_length {
            let problem = format!(
                "a zone of {} m is shorter than two particle spacings, {} m",
                shown(self.length),
                shown(around.least_length)
            );
            return length(problem);
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
                return length(problem);
            }
        }
        Ok(())
    }
}
