//! Foam at points on the surface of the water: how much of the surface it covers, and its age.

use std::f64::consts::PI;

use glam::DVec3;

use super::grid::{BinnedPoints, HALVES};
use crate::{
    bounds::Bounds,
    parallel,
    particles::Particles,
    period::Period,
    whitewater::{AGE, KIND, LIFE, RADIUS, SUPPORT, WhitewaterKind},
};

/// Attribute of a vertex: fraction of the surface that foam covers, 0 to 1.
pub const FOAM: &str = "foam";
/// Attribute of a vertex: mean age of that foam, seconds; 0 where there is none.
pub const FOAM_AGE: &str = "foam_age";

/// The box that a mesh is in; positions are relative to its least corner, metres.
#[derive(Clone, Copy, Debug)]
pub struct FoamBox {
    /// Position of the least corner, relative to the scene's origin.
    pub corner: DVec3,
    /// Walls at the frame, which a wave maker moves.
    pub walls: Bounds,
    /// Lengths along periodic axes.
    pub period: Period,
    /// Distance between neighbouring water particles at rest.
    pub spacing: f64,
}

/// A foam particle: a disc on the surface.
#[derive(Clone, Copy, Debug)]
pub struct Disc {
    /// Centre, relative to the box's least corner, metres.
    pub place: DVec3,
    /// Area, m².
    pub area: f64,
    /// Time since birth, seconds.
    pub age: f64,
    /// Remaining life, seconds.
    pub life: f64,
    /// Id of the particle.
    pub id: u32,
    /// 1 along the axes along which a wall mirrors it, else 0.
    pub mirrored: DVec3,
}

impl FoamBox {
    /// Returns the radius R of the kernel along the surface, metres.
    pub fn radius(&self) -> f64 {
        SUPPORT * self.spacing
    }
}

/// Returns the foam among the particles of a whitewater stream. Its images behind walls complete
/// the kernel at points near a wall, those beyond a joint of a periodic box are neighbours.
pub fn discs(white: &Particles, room: &FoamBox) -> Vec<Disc> {
    let column = |name| white.attributes.get(name).map_or(&[][..], Vec::as_slice);
    let [kinds, ages, lives, radii] = [KIND, AGE, LIFE, RADIUS].map(column);
    let count = [ages, lives, radii].map(<[f32]>::len).into_iter().min();
    let count = count.unwrap_or(0).min(kinds.len());
    let mut discs = parallel::flat_map(0..count, |k| {
        (kinds[k] == WhitewaterKind::Foam.number()).then(|| Disc {
            place: DVec3::from(white.position[k].map(f64::from)) - room.corner,
            area: PI * f64::from(radii[k]).powi(2),
            age: ages[k].into(),
            life: lives[k].into(),
            id: white.id[k],
            mirrored: DVec3::ZERO,
        })
    });
    for axis in 0..3 {
        let images = parallel::flat_map(0..discs.len(), |k| {
            discs[k].images(axis, room, room.radius())
        });
        discs.extend(images);
    }
    discs
}

/// The foam of a frame, to be asked for at points.
pub struct Foam {
    /// In the order of the grid.
    discs: Vec<Disc>,
    grid: BinnedPoints,
    /// Radius R of the kernel along the surface, and largest distance from the surface, metres.
    radius: f64,
}

impl Foam {
    /// Takes the foam among the particles of a whitewater stream.
    pub fn new(white: &Particles, room: &FoamBox) -> Self {
        let discs = discs(white, room);
        let radius = room.radius();
        let places: Vec<DVec3> = discs.iter().map(|disc| disc.place).collect();
        // A disc that counts is at most R along the surface and R off it.
        let grid = BinnedPoints::new(&places, 2f64.sqrt() * radius / HALVES as f64);
        Self {
            discs: parallel::map_slice(&grid.order, |&k| discs[k as usize]),
            grid,
            radius,
        }
    }

    /// Returns the coverage and the mean age at points of the surface with these unit normals.
    ///
    /// Coverage is 1 − exp(−Σ πr² W), with W = 3 / (πR²) (1 − t²/R²)² of the distance t along the
    /// surface: the fraction that discs in random positions cover where Σ πr² W is their area per
    /// area of the surface (the Boolean model; Stoyan, Kendall and Mecke 1995). The distance from
    /// the surface does not matter up to R/2, and beyond R a disc does not count.
    pub fn at(&self, places: &[DVec3], normals: &[[f32; 3]]) -> [Vec<f32>; 2] {
        let found = parallel::map(0..places.len(), |k| {
            self.one(places[k], DVec3::from(normals[k].map(f64::from)))
        });
        [0, 1].map(|value| found.iter().map(|pair| pair[value]).collect())
    }

    fn one(&self, place: DVec3, normal: DVec3) -> [f32; 2] {
        let (mut area, mut aged) = (0.0, 0.0);
        self.grid.for_each_run(place, HALVES, |run| {
            for disc in &self.discs[run] {
                let d = (disc.place - place) / self.radius;
                let off = d.dot(normal);
                let s = 1.0 - (d.length_squared() - off * off);
                if s > 0.0 {
                    // A wall continues a surface that stands across it, and not one along it.
                    let across = DVec3::ONE - disc.mirrored * normal * normal;
                    let near = nearness(off.abs()) * across.element_product();
                    let w = disc.area * s * s * near;
                    area += w;
                    aged += w * disc.age;
                }
            }
        });
        if area == 0.0 {
            return [0.0; 2];
        }
        let share = area * 3.0 / (PI * self.radius.powi(2));
        [-(-share).exp_m1() as f32, (aged / area) as f32]
    }
}

/// 1 up to half the radius, 0 from the radius on, smooth between.
fn nearness(off: f64) -> f64 {
    let t = (2.0 * off - 1.0).clamp(0.0, 1.0);
    1.0 - t * t * (3.0 - 2.0 * t)
}

impl Disc {
    /// Images of a disc within `reach` metres of an end: behind a wall, or beyond a joint.
    fn images(
        &self,
        axis: usize,
        room: &FoamBox,
        reach: f64,
    ) -> impl Iterator<Item = Self> + use<> {
        let (own, x) = (*self, self.place[axis]);
        let period = room.period.0[axis];
        let [low, high] = match period > 0.0 {
            true => [0.0, period],
            false => [room.walls.min[axis], room.walls.max[axis]],
        };
        let ends = [
            (x < low + reach, low, period),
            (x > high - reach, high, -period),
        ];
        ends.into_iter().filter_map(move |(is_near, side, whole)| {
            let mut image = own;
            match period > 0.0 {
                true => image.place[axis] += whole,
                false => {
                    image.place[axis] = 2.0 * side - x;
                    image.mirrored[axis] = 1.0;
                }
            }
            is_near.then_some(image)
        })
    }
}

#[cfg(test)]
#[path = "foam/tests.rs"]
mod tests;
