//! Zones in front of walls in which the velocity is relaxed towards a target; shared by absorbing
//! and generating zones.

use glam::DVec3;

use crate::Wall;

/// Zones of equal length in front of some walls of the domain.
#[derive(Clone, Copy, Debug)]
pub struct Zone<'a> {
    /// Walls with a zone, each listed once.
    pub walls: &'a [Wall],
    /// Length of each zone from its wall, metres.
    pub length: f64,
    /// Relaxation rate at the wall, 1/s.
    pub rate: f64,
}

impl Zone<'_> {
    /// Returns the depth of a position within the zone: 0 at its beginning and outside, 1 at
    /// the wall. `place` is relative to the domain's least corner and `size` is the
    /// domain's, both in metres.
    pub fn way(&self, size: DVec3, place: DVec3) -> f64 {
        let off = |wall: &Wall| match wall.is_max {
            false => place[wall.axis],
            true => size[wall.axis] - place[wall.axis],
        };
        let ways = self.walls.iter().map(|wall| 1.0 - off(wall) / self.length);
        ways.fold(0.0, f64::max).min(1.0)
    }

    /// Returns the fraction by which the velocity at a position approaches the target in `step`
    /// seconds: r Δt / (1 + r Δt), where r is the rate times the squared depth in the zone.
    pub fn led(&self, size: DVec3, place: DVec3, step: f64) -> f64 {
        let way = self.way(size, place);
        let led = self.rate * step * way * way;
        led / (1.0 + led)
    }

    /// Returns the part of a disturbance that is left where a current of `speed`, m/s, leaves a
    /// zone: exp(−∫ r dx / U), where r is the rate times the squared depth in the zone.
    pub fn left(&self, speed: f64) -> f64 {
        (-self.rate * self.length / (3.0 * speed)).exp()
    }

    /// Returns the mask of the zone's walls, made of [`Wall::bit`].
    pub fn bits(&self) -> u32 {
        self.walls.iter().map(Wall::bit).sum()
    }
}
