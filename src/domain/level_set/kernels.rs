//! Anisotropic kernels of particles (Yu and Turk, Reconstructing surfaces of particle-based fluids
//! using anisotropic kernels, 2013).
//!
//! A particle's kernel is stretched along the distribution of its neighbours: a ball within the
//! water, a flat disc along a surface or a sheet. Calm water is therefore flat, and a sheet one
//! particle thick stays connected. This implementation differs from the paper:
//!
//! - Lengths follow from the lattice, so that the surface of half a lattice lies half a spacing
//!   beyond its outermost particles, and a lone particle is a ball of its own volume.
//! - The transition from isolated to connected particles is gradual, where the paper switches, so
//!   that no particle flickers.
//! - In water torn to half of its density, particles are balls again: the field of stretched
//!   kernels would nowhere reach the surface's value.
//! - Half axes are proportional to the neighbours' standard deviations, where the paper
//!   uses variances.
//! - Centres stay at the particles. The paper moves them towards their neighbours' mean by λ; this
//!   left a noisy surface equally rough, 0.06 spacings for any λ up to 0.5, and with the paper's
//!   0.9 kernels no longer reach a calm surface.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::{
    eigen,
    grid::{BinnedPoints, HALVES},
    moments::{AT_ONCE, Moments, Near},
};
use crate::parallel;

/// Radius of a kernel that is not flattened, particle spacings.
const SUPPORT: f64 = 2.5;
/// Half axis of a lone particle's kernel, particle spacings; the paper's k_n is one half.
pub const ALONE: f64 = 0.5 * SUPPORT;
/// Radius within which neighbours shape a kernel, particle spacings.
const NEAR: f64 = 3.0;
/// Largest ratio of the longest to the shortest half axis; the paper's k_r.
const FLATTEST: f64 = 4.0;
/// Distance within which particles affect the field at a point, particle spacings: kernels that
/// reach it, and the neighbours that shape them.
pub(super) const REACH: f64 = SUPPORT + NEAR;
/// Total neighbour weights between which a kernel changes from that of a lone particle to a
/// stretched one.
const JOINED: [f64; 2] = [1.0, 6.0];
/// Relative densities between which a kernel changes likewise. At 0.55 the field of stretched
/// kernels has a calm surface's value.
const TORN: [f64; 2] = [0.4, 0.8];

/// The kernel of a particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Centre, metres.
    pub centre: DVec3,
    /// G, 1/m: the boundary of the kernel is |G (x − centre)| = 1.
    pub inverse: DMat3,
    /// Half extents of the bounding box, metres.
    pub reach: DVec3,
    /// Longest half axis, metres.
    pub(super) longest: f64,
    /// Value at the centre.
    pub peak: f64,
}

impl Ellipsoid {
    /// Evaluates V det(G) P(|G (x − centre)|) with P(q) = 315/(64π) (1 − q²)³.
    pub fn value(&self, x: DVec3) -> f64 {
        let q = self.inverse * (x - self.centre);
        self.peak * (1.0 - q.length_squared()).max(0.0).powi(3)
    }

    /// [`Self::value`] and its gradient, 1/m.
    fn value_and_gradient(&self, x: DVec3) -> (f64, DVec3) {
        let q = self.inverse * (x - self.centre);
        let s = (1.0 - q.length_squared()).max(0.0);
        if s == 0.0 {
            return (0.0, DVec3::ZERO);
        }
        // G is symmetric.
        let gradient = self.inverse * q * (-6.0 * self.peak * s * s);
        (self.peak * s.powi(3), gradient)
    }

    /// Builds the kernel of a particle of `volume` m³ with half axes `axes`, metres, along the
    /// columns of `turn`.
    fn new(centre: DVec3, turn: DMat3, axes: DVec3, volume: f64) -> Self {
        let inverse = turn * DMat3::from_diagonal(axes.recip()) * turn.transpose();
        let stretch = turn * DMat3::from_diagonal(axes) * turn.transpose();
        // The matrix is symmetric, so its columns are its rows.
        let reach = DVec3::new(
            stretch.x_axis.length(),
            stretch.y_axis.length(),
            stretch.z_axis.length(),
        );
        Self {
            centre,
            inverse,
            reach,
            longest: axes.max_element(),
            peak: 315.0 / (64.0 * PI) * volume / axes.element_product(),
        }
    }

    /// Mirror image of the kernel at `plane` along `axis`.
    fn mirrored(&self, axis: usize, plane: f64) -> Self {
        let mut flip = DVec3::ONE;
        flip[axis] = -1.0;
        let flip = DMat3::from_diagonal(flip);
        Self {
            centre: reflected(self.centre, axis, plane),
            inverse: flip * self.inverse * flip,
            ..*self
        }
    }
}

/// The kernels of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Kernels {
    /// One kernel per particle, in the order of the particles, followed by the images in the
    /// box's sides.
    pub ellipsoids: Vec<Ellipsoid>,
    /// Value of the summed kernels at a calm surface.
    pub level: f64,
}

/// Lengths and weights that follow from the lattice alone.
struct Calibration {
    spacing: f64,
    /// Variance of the neighbours' positions along an axis, m².
    variance: f64,
    /// Total weight of a point with water all around.
    bulk: f64,
    /// Factor of a lone particle's kernel.
    alone: f64,
    level: f64,
}

impl Kernels {
    /// Fits kernels to particles at `positions`, metres from the least corner of a box of `size`
    /// whose sides are mirrors; `spacing` is the distance between neighbours at rest, metres.
    pub fn fit(positions: &[DVec3], size: DVec3, spacing: f64) -> Self {
        let fitted = Self::of_first(positions.len(), positions, size, spacing);
        Self::of_fitted(fitted, size, spacing)
    }

    /// Adds to the kernels from [`Self::of_first`] their images in the box's sides.
    pub fn of_fitted(fitted: Vec<Ellipsoid>, size: DVec3, spacing: f64) -> Self {
        Self {
            ellipsoids: mirrored(fitted, size, SUPPORT * spacing, &Ellipsoid::mirrored),
            level: Calibration::new(spacing).level,
        }
    }

    /// Fits only the kernels of the first `count` positions, without images; the other positions
    /// only shape them.
    pub fn of_first(
        count: usize,
        positions: &[DVec3],
        size: DVec3,
        spacing: f64,
    ) -> Vec<Ellipsoid> {
        let calibration = Calibration::new(spacing);
        let all = mirrored(
            positions.to_vec(),
            size,
            NEAR * spacing,
            &|&p, axis, plane| reflected(p, axis, plane),
        );
        fit(&all, count, &calibration)
    }

    /// Returns the field, which evaluates at any point.
    pub fn field(&self) -> KernelField<'_> {
        let longest = self.ellipsoids.par_iter().map(|it| it.longest);
        let farthest = longest.reduce(|| f64::MIN_POSITIVE, f64::max);
        let places: Vec<DVec3> = parallel::map_slice(&self.ellipsoids, |it| it.centre);
        let grid = BinnedPoints::new(&places, farthest / HALVES as f64);
        KernelField {
            kernels: self,
            centres: grid.sorted(&places),
            farthest: farthest * farthest,
            grid,
        }
    }
}

/// The field of a set of kernels, which a level set samples.
pub struct KernelField<'a> {
    kernels: &'a Kernels,
    grid: BinnedPoints,
    /// Centres in the grid's order.
    centres: Vec<DVec3>,
    /// Squared distance beyond which no kernel reaches a point, m².
    farthest: f64,
}

impl KernelField<'_> {
    /// Visits the kernels that may reach a point, in the grid's order.
    fn for_each(&self, x: DVec3, mut visit: impl FnMut(&Ellipsoid)) {
        let mut near = [0; AT_ONCE];
        self.grid.for_each_run(x, HALVES, |run| {
            let centres = self.centres[run.clone()].chunks(AT_ONCE);
            for (centres, places) in centres.zip(self.grid.order[run].chunks(AT_ONCE)) {
                // Branch-free, to avoid mispredictions.
                let mut count = 0;
                for (centre, place) in centres.iter().zip(places) {
                    near[count] = *place as usize;
                    count += usize::from(centre.distance_squared(x) < self.farthest);
                }
                let near = near[..count].iter();
                near.for_each(|&k| visit(&self.kernels.ellipsoids[k]));
            }
        });
    }

    /// Returns the field at `x`: positive in water, 0 at its surface, −1 where no kernel reaches.
    pub fn value(&self, x: DVec3) -> f64 {
        let mut sum = 0.0;
        self.for_each(x, |kernel| sum += kernel.value(x));
        sum / self.kernels.level - 1.0
    }

    /// Returns [`Self::value`] and [`Self::gradient`] at once.
    pub fn value_and_gradient(&self, x: DVec3) -> (f64, DVec3) {
        let (mut sum, mut slope) = (0.0, DVec3::ZERO);
        self.for_each(x, |kernel| {
            let (value, gradient) = kernel.value_and_gradient(x);
            sum += value;
            slope += gradient;
        });
        let level = self.kernels.level;
        (sum / level - 1.0, slope / level)
    }

    /// Returns the gradient at `x`, 1/m.
    pub fn gradient(&self, x: DVec3) -> DVec3 {
        self.value_and_gradient(x).1
    }
}

fn reflected(mut p: DVec3, axis: usize, plane: f64) -> DVec3 {
    p[axis] = 2.0 * plane - p[axis];
    p
}

/// Anything with a position.
trait Placed: Copy {
    fn place(&self) -> DVec3;
}

impl Placed for DVec3 {
    fn place(&self) -> DVec3 {
        *self
    }
}

impl Placed for Ellipsoid {
    fn place(&self) -> DVec3 {
        self.centre
    }
}

/// Appends the images of all items within `near` of a side of the box.
fn mirrored<T: Placed>(
    mut all: Vec<T>,
    size: DVec3,
    near: f64,
    mirror: &dyn Fn(&T, usize, f64) -> T,
) -> Vec<T> {
    for axis in 0..3 {
        for k in 0..all.len() {
            let p = all[k].place()[axis];
            for plane in [0.0, size[axis]] {
                if (p - plane).abs() < near {
                    let image = mirror(&all[k], axis, plane);
                    all.push(image);
                }
            }
        }
    }
    all
}

/// Kernels of the first `count` points.
fn fit(places: &[DVec3], count: usize, calibration: &Calibration) -> Vec<Ellipsoid> {
    let reach = NEAR * calibration.spacing;
    // 27 % of the points in the visited cells are within reach; with cells of the full radius it
    // would be 16 %.
    let grid = BinnedPoints::new(places, reach / HALVES as f64);
    let sorted = grid.sorted(places);
    parallel::map(0..count, |k| {
        let near = Moments::about(places[k], (&grid, &sorted), reach);
        calibration.kernel(places[k], &near)
    })
}

/// Smoothstep: 0 up to `from`, 1 from `to` on.
fn rise([from, to]: [f64; 2], x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

impl Calibration {
    fn new(spacing: f64) -> Self {
        let reach = NEAR.ceil() as i32;
        let mut bulk = Near::new(NEAR);
        for z in -reach..=reach {
            for y in -reach..=reach {
                for x in -reach..=reach {
                    bulk.take(&[DVec3::new(x.into(), y.into(), z.into())], DVec3::ZERO);
                }
            }
        }
        let bulk = bulk.moments();
        let mut found = Self {
            spacing: 1.0,
            variance: bulk.covariance().x_axis.x,
            bulk: bulk.weight,
            alone: 1.0,
            level: 1.0,
        };
        found.level = found.calm_level();
        found.alone = lone_factor(found.level);
        Self {
            spacing,
            variance: found.variance * spacing * spacing,
            ..found
        }
    }

    fn kernel(&self, place: DVec3, near: &Moments) -> Ellipsoid {
        // A particle is its own neighbour, with weight 1.
        let (values, turn) = eigen::symmetric(near.covariance() * (1.0 / self.variance));
        let longest = values.max_element().max(0.0).sqrt();
        let stretch = DVec3::from_array(values.to_array().map(|x| x.max(0.0).sqrt()))
            .max(DVec3::splat(longest / FLATTEST))
            .clamp(DVec3::splat(1.0 / FLATTEST), DVec3::ONE);
        // Density relative to that of water: the neighbours fill the kernel's stretched volume.
        let density = near.weight / (self.bulk * stretch.element_product());
        let joined = rise(JOINED, near.weight - 1.0) * rise(TORN, density);
        let full = SUPPORT * self.spacing;
        let alone = DVec3::splat(ALONE * self.spacing);
        let axes = alone.lerp(full * stretch, joined);
        let factor = self.alone + joined * (1.0 - self.alone);
        Ellipsoid::new(place, turn, axes, factor * self.spacing.powi(3))
    }

    /// Mean of the field over a plane half a spacing above the outermost particles of half a
    /// lattice of spacing 1.
    fn calm_level(&self) -> f64 {
        const SAMPLES: i32 = 4;
        // One particle per layer is fitted; the others in the layer have the same kernel, shifted.
        let layers = (NEAR + SUPPORT).ceil() as i32 + 1;
        let side = NEAR.ceil() as i32;
        let kernels: Vec<Ellipsoid> = (0..layers)
            .map(|layer| {
                let place = DVec3::new(0.0, -0.5 - f64::from(layer), 0.0);
                let mut near = Near::new(NEAR);
                for z in -side..=side {
                    for y in -side..=side.min(layer) {
                        for x in -side..=side {
                            let other = DVec3::new(x.into(), y.into(), z.into());
                            near.take(&[other], DVec3::ZERO);
                        }
                    }
                }
                self.kernel(place, &near.moments())
            })
            .collect();
        let middle = |k: i32| (f64::from(k) + 0.5) / f64::from(SAMPLES);
        let mut sum = 0.0;
        for k in 0..SAMPLES.pow(2) {
            for (x, z) in (-side..=side).flat_map(|x| (-side..=side).map(move |z| (x, z))) {
                let from = DVec3::new(x.into(), 0.0, z.into());
                let at = DVec3::new(middle(k % SAMPLES), 0.0, middle(k / SAMPLES)) - from;
                sum += kernels.iter().map(|kernel| kernel.value(at)).sum::<f64>();
            }
        }
        sum / f64::from(SAMPLES.pow(2))
    }
}

/// Factor of a lone particle's kernel for which the field equals `level` at the radius of a ball of
/// its volume; the spacing is 1.
fn lone_factor(level: f64) -> f64 {
    let radius = (3.0 / (4.0 * PI)).cbrt();
    let plain = Ellipsoid::new(DVec3::ZERO, DMat3::IDENTITY, DVec3::splat(ALONE), 1.0);
    level / plain.value(DVec3::X * radius)
}
