//! A naive Jacobi iteration of PBF.

use glam::DVec3;
use swell::{
    domain::{
        particles::Particles,
        sph::{Calibration, half_space_fraction},
    },
    scene::Scene,
};

use crate::support::D;

/// One Jacobi iteration from rest without gravity, by an O(n²) search in f64. Written from the
/// paper's formulas and not from the shaders.
pub(super) struct Naive {
    pub(super) positions: Vec<DVec3>,
    pub(super) size: DVec3,
    pub(super) calibration: Calibration,
}

impl Naive {
    pub(super) fn new(scene: &Scene, particles: &Particles) -> Self {
        let pbf = scene.solver.pbf().unwrap();
        Self {
            positions: particles
                .position
                .iter()
                .map(|p| glam::Vec3::from_array(*p).as_dvec3())
                .collect(),
            size: scene.domain.size(),
            calibration: Calibration::new(pbf.particle_spacing, pbf.support_ratio),
        }
    }

    /// Relative density that the walls add at `x`, and its gradient, 1/m.
    pub(super) fn walls(&self, x: DVec3) -> (f64, DVec3) {
        let (h, scale) = (
            self.calibration.support_radius,
            self.calibration.wall_density_scale,
        );
        let free = |z: f64| 1.0 - scale * half_space_fraction(z / h);
        let product = |p: DVec3| -> f64 {
            (0..3)
                .map(|k| free(p[k]) * free(self.size[k] - p[k]))
                .product()
        };
        let slope = |z: f64| {
            let q = (z / h).min(1.0);
            scale * 1.5 * (1.0 - q).powi(4) * (1.0 + 4.0 * q) / h
        };
        let gradient = DVec3::from_array(std::array::from_fn(|k| {
            let others: f64 = (0..3)
                .filter(|&o| o != k)
                .map(|o| free(x[o]) * free(self.size[o] - x[o]))
                .product();
            (slope(self.size[k] - x[k]) - slope(x[k])) * others
        }));
        (1.0 - product(x), gradient)
    }

    pub(super) fn density(&self, i: usize) -> f64 {
        let (h, x) = (self.calibration.support_radius, self.positions[i]);
        let kernel: f64 = self
            .positions
            .iter()
            .map(|y| (1.0 - x.distance_squared(*y) / (h * h)).max(0.0).powi(3))
            .sum();
        self.calibration.density_scale * kernel + self.walls(x).0
    }

    pub(super) fn gradient(&self, i: usize, j: usize) -> DVec3 {
        let (h, d) = (
            self.calibration.support_radius,
            self.positions[i] - self.positions[j],
        );
        let r = d.length();
        if i == j || r >= h {
            return DVec3::ZERO;
        }
        -self.calibration.gradient_scale * (1.0 - r / h).powi(2) * d / r
    }

    pub(super) fn lambda(&self, i: usize) -> f64 {
        let mut own = self.walls(self.positions[i]).1;
        let mut squares = 0.0;
        for j in 0..self.positions.len() {
            let gradient = self.gradient(i, j);
            own += gradient;
            squares += gradient.length_squared();
        }
        let epsilon = 1e-3 * self.calibration.bulk_gradient_squares;
        -(self.density(i) - 1.0).max(0.0) / (squares + own.length_squared() + epsilon)
    }

    pub(super) fn corrected(&self) -> Vec<DVec3> {
        let n = self.positions.len();
        let lambda: Vec<f64> = (0..n).map(|i| self.lambda(i)).collect();
        (0..n)
            .map(|i| {
                let walls = lambda[i] * self.walls(self.positions[i]).1;
                let sum: DVec3 = (0..n)
                    .map(|j| (lambda[i] + lambda[j]) * self.gradient(i, j))
                    .sum();
                let contact = DVec3::splat(0.25 * D);
                (self.positions[i] + walls + sum).clamp(contact, self.size - contact)
            })
            .collect()
    }
}
