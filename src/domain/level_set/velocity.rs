//! Velocity of the water at points on its surface.

use glam::{DMat3, DVec3};

use super::grid::BinnedPoints;
use crate::parallel;

/// Radius within which particles contribute, particle spacings: a surface lies within 2.5 of one.
const NEAR: f64 = 3.0;
/// Fraction of the neighbours' spread that is added in all directions: in a direction without
/// spread (a sheet, a pair) the velocity is then the neighbours' mean.
const SPREAD: f64 = 1e-2;

/// Velocities of particles, interpolated at points near them.
pub struct Velocities<'a> {
    places: &'a [DVec3],
    velocities: &'a [[f32; 3]],
    grid: BinnedPoints,
}

impl<'a> Velocities<'a> {
    /// Indexes particles at `places`, metres; `spacing` is the distance between neighbours at
    /// rest, metres.
    pub fn new(places: &'a [DVec3], velocities: &'a [[f32; 3]], spacing: f64) -> Self {
        Self {
            places,
            velocities,
            grid: BinnedPoints::new(places, NEAR * spacing),
        }
    }

    /// Returns the velocity at each of `places`, m/s: the linear function of position that fits the
    /// neighbours' velocities best under the weight (1 − (r/R)²)³, limited to their range extended
    /// by half on each side. Zero where no particle is near.
    pub fn at(&self, places: &[DVec3]) -> Vec<[f32; 3]> {
        parallel::map_slice(places, |&place| self.one(place))
    }

    fn one(&self, place: DVec3) -> [f32; 3] {
        let mut weight = 0.0;
        let [mut mean_place, mut mean] = [DVec3::ZERO; 2];
        let [mut places, mut both] = [DMat3::ZERO; 2];
        let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        self.grid.for_each_near(place, |k| {
            let d = (self.places[k] - place) / self.grid.edge();
            let s = 1.0 - d.length_squared();
            if s > 0.0 {
                let (w, v) = (s * s * s, DVec3::from(self.velocities[k].map(f64::from)));
                weight += w;
                mean_place += w * d;
                mean += w * v;
                places += outer(d, d) * w;
                both += outer(v, d) * w;
                (least, most) = (least.min(v), most.max(v));
            }
        });
        if weight == 0.0 {
            return [0.0; 3];
        }
        mean_place /= weight;
        mean /= weight;
        let spread = places * (1.0 / weight) - outer(mean_place, mean_place);
        let along = both * (1.0 / weight) - outer(mean, mean_place);
        let trace = spread.x_axis.x + spread.y_axis.y + spread.z_axis.z;
        let spread = spread + DMat3::IDENTITY * (SPREAD * trace);
        let slope = match spread.determinant() > 0.0 {
            true => along * spread.inverse() * mean_place,
            false => DVec3::ZERO,
        };
        let beyond = 0.5 * (most - least);
        let found = (mean - slope).clamp(least - beyond, most + beyond);
        found.as_vec3().to_array()
    }
}

/// Outer product a bᵀ.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    const D: f64 = 0.1;

    fn block(layers: usize) -> Vec<DVec3> {
        let at = |k: usize| D * (k as f64 + 0.5);
        let mut all = Vec::new();
        for y in 0..layers {
            for (x, z) in (0..12).flat_map(|x| (0..12).map(move |z| (x, z))) {
                all.push(DVec3::new(at(x), at(y), at(z)));
            }
        }
        all
    }

    fn worst(layers: usize, field: impl Fn(DVec3) -> DVec3) -> f64 {
        let places = block(layers);
        let velocities: Vec<_> = places
            .iter()
            .map(|&p| field(p).as_vec3().to_array())
            .collect();
        let top = D * layers as f64;
        let wanted: Vec<_> = (4..8)
            .map(|k| DVec3::new(0.13 * f64::from(k), top, 0.6))
            .collect();
        let found = Velocities::new(&places, &velocities, D).at(&wanted);
        let errors = wanted.iter().zip(found);
        errors
            .map(|(&p, v)| (field(p) - DVec3::from(v.map(f64::from))).length())
            .fold(0.0, f64::max)
    }

    #[test]
    fn a_turning_block_has_its_velocities_at_its_surface() {
        let turning = |p: DVec3| DVec3::new(2.0, 1.0, -1.0) + DVec3::new(0.3, 0.5, 1.0).cross(p);
        // The neighbours' mean lies about a spacing below the surface; the spread added to theirs
        // reduces the slope along that distance by 3 SPREAD.
        let slope = DVec3::new(0.3, 0.5, 1.0).length();
        assert!(
            worst(8, turning) < 4.0 * SPREAD * slope * 1.5 * D,
            "{}",
            worst(8, turning)
        );
        // Negative control: the mean alone is off by a good part of the change over a spacing.
        let places = block(8);
        let below = turning(DVec3::ZERO) - turning(DVec3::Y * D);
        assert!(below.length() > 4.0 * SPREAD * slope * 1.5 * D);
        assert_eq!(places.len(), 8 * 144);
    }

    #[test]
    fn a_sheet_goes_as_its_particles_do() {
        let even = |_: DVec3| DVec3::new(3.0, -2.0, 1.0);
        assert!(worst(1, even) < 1e-6);
        let none = Velocities::new(&[], &[], D).at(&[DVec3::ONE]);
        assert_eq!(none, [[0.0; 3]]);
    }
}
