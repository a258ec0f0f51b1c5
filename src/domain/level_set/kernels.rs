//! Anisotropic kernels of particles (Yu and Turk, Reconstructing surfaces of particle-based fluids using anisotropic kernels, 2013).
//!
//! A particle's kernel is stretched as its neighbours lie: a ball within the water, a flat disc along a surface or a sheet. So calm
//! water is flat, and a sheet one particle thick holds together. What is not the paper's: lengths follow from the lattice, so that
//! half a lattice has its surface half a spacing beyond its outermost particles, and a lone particle is a ball of its own volume;
//! from lone to joined a kernel changes steadily, where the paper switches, so that no particle flickers; in water that is torn to half of
//! its density particles are balls again, since stretched kernels would nowhere reach the surface's value; half axes go with the
//! neighbours' standard deviations, where the paper takes variances; and centres stay where particles are: moved towards their
//! neighbours' mean (the paper's λ), they left a noisy surface as rough, 0.06 spacings for any λ up to 0.5, and with the paper's 0.9
//! kernels no longer reach a calm surface.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::{
    eigen,
    grid::{Grid, HALVES},
    moments::{AT_ONCE, Moments, Near},
};

/// Reach of a kernel that is not flattened, in particle spacings.
const SUPPORT: f64 = 2.5;
/// Half axis of a lone particle's kernel, in particle spacings; the paper's k_n is a half.
pub const ALONE: f64 = 0.5 * SUPPORT;
/// Neighbours that shape a kernel lie within so many particle spacings.
const NEAR: f64 = 3.0;
/// The longest half axis over the shortest one, at most; the paper's k_r.
const FLATTEST: f64 = 4.0;
/// How far from a place particles may stand that its field depends on, in particle spacings: kernels that reach it, and what shapes them.
pub(super) const REACH: f64 = SUPPORT + NEAR;
/// Weights of neighbours between which a kernel goes from a lone particle's to a stretched one.
const JOINED: [f64; 2] = [1.0, 6.0];
/// Densities over that of water between which it does too. At 0.55 the field of stretched kernels has a calm surface's value.
const TORN: [f64; 2] = [0.4, 0.8];

/// The kernel of a particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Metres.
    pub centre: DVec3,
    /// G, 1/m: the kernel's edge is |G (x − centre)| = 1.
    pub inverse: DMat3,
    /// Half of the box that holds it, metres.
    pub reach: DVec3,
    /// Longest half axis, metres.
    pub(super) longest: f64,
    /// Its value at the centre.
    pub peak: f64,
}

impl Ellipsoid {
    /// V det(G) P(|G (x − centre)|), P(q) = 315/(64π) (1 − q²)³.
    pub fn value(&self, x: DVec3) -> f64 {
        let q = self.inverse * (x - self.centre);
        self.peak * (1.0 - q.length_squared()).max(0.0).powi(3)
    }

    /// [`Self::value`], and its ∇, 1/m.
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

    /// Half axes in metres along the columns of `turn`, of a particle of `volume` m³.
    fn new(centre: DVec3, turn: DMat3, axes: DVec3, volume: f64) -> Self {
        let inverse = turn * DMat3::from_diagonal(axes.recip()) * turn.transpose();
        let stretch = turn * DMat3::from_diagonal(axes) * turn.transpose();
        // A symmetric matrix has its rows for columns.
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

    /// As a mirror at `plane` along `axis` shows it.
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
    /// One a particle, in the order of the particles, and then those that stand in the mirrors of the box's sides.
    pub ellipsoids: Vec<Ellipsoid>,
    /// Value of the field at a calm surface.
    pub level: f64,
}

/// Lengths and weights that follow from the lattice alone.
struct Calibration {
    spacing: f64,
    /// Variance of their places along an axis, m².
    variance: f64,
    /// Weight of a place with water all around.
    bulk: f64,
    /// Factor on a lone particle's kernel.
    alone: f64,
    level: f64,
}

impl Kernels {
    /// Fits kernels to particles at `positions`, metres from the least corner of a box of `size` whose sides are mirrors;
    /// `spacing` lies between neighbours at rest, metres.
    pub fn fit(positions: &[DVec3], size: DVec3, spacing: f64) -> Self {
        let fitted = Self::of_first(positions.len(), positions, size, spacing);
        Self::of_fitted(fitted, size, spacing)
    }

    /// These kernels, which [`Self::of_first`] fitted, and those that stand in the mirrors of the box's sides.
    pub fn of_fitted(fitted: Vec<Ellipsoid>, size: DVec3, spacing: f64) -> Self {
        Self {
            ellipsoids: mirrored(fitted, size, SUPPORT * spacing, &Ellipsoid::mirrored),
            level: Calibration::new(spacing).level,
        }
    }

    /// The kernels of the first `count` of these positions alone, without those that stand in mirrors; the others shape them.
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

    /// The field itself, for values at any place.
    pub fn field(&self) -> Field<'_> {
        let longest = self.ellipsoids.par_iter().map(|it| it.longest);
        let farthest = longest.reduce(|| f64::MIN_POSITIVE, f64::max);
        let places: Vec<DVec3> = self.ellipsoids.par_iter().map(|it| it.centre).collect();
        let grid = Grid::new(&places, farthest / HALVES as f64);
        Field {
            kernels: self,
            centres: grid.sorted(&places),
            farthest: farthest * farthest,
            grid,
        }
    }
}

/// The field of kernels: what a level set samples.
pub struct Field<'a> {
    kernels: &'a Kernels,
    grid: Grid,
    /// In the grid's order.
    centres: Vec<DVec3>,
    /// Square of the distance from which on no kernel reaches a place, m².
    farthest: f64,
}

impl Field<'_> {
    /// Visits the kernels that may reach a place, in the grid's order.
    fn for_each(&self, x: DVec3, mut visit: impl FnMut(&Ellipsoid)) {
        let mut near = [0; AT_ONCE];
        self.grid.for_each_run(x, HALVES, |run| {
            let centres = self.centres[run.clone()].chunks(AT_ONCE);
            for (centres, places) in centres.zip(self.grid.order[run].chunks(AT_ONCE)) {
                // Without a branch that a processor would have to guess.
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

    /// At `x`: positive in water, 0 at its surface, −1 where no particle reaches.
    pub fn value(&self, x: DVec3) -> f64 {
        let mut sum = 0.0;
        self.for_each(x, |kernel| sum += kernel.value(x));
        sum / self.kernels.level - 1.0
    }

    /// [`Self::value`] and [`Self::gradient`] at once.
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

    /// ∇ at `x`, 1/m.
    pub fn gradient(&self, x: DVec3) -> DVec3 {
        self.value_and_gradient(x).1
    }
}

fn reflected(mut p: DVec3, axis: usize, plane: f64) -> DVec3 {
    p[axis] = 2.0 * plane - p[axis];
    p
}

/// What has a place.
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

/// These, and behind them their images at the sides of a box that they are within `near` of.
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

/// Kernels of the first `count` of these places.
fn fit(places: &[DVec3], count: usize, calibration: &Calibration) -> Vec<Ellipsoid> {
    let reach = NEAR * calibration.spacing;
    // 27 % of the places in the cells that are looked at are within reach; were cells as long as that, it would be 16 %.
    let grid = Grid::new(places, reach / HALVES as f64);
    let sorted = grid.sorted(places);
    (0..count)
        .into_par_iter()
        .map(|k| {
            let near = Moments::about(places[k], (&grid, &sorted), reach);
            calibration.kernel(places[k], &near)
        })
        .collect()
}

/// 0 up to the first of these, 1 from the second on, and steadily between.
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
        // A particle is a neighbour of its own, with a weight of 1.
        let (values, turn) = eigen::symmetric(near.covariance() * (1.0 / self.variance));
        let longest = values.max_element().max(0.0).sqrt();
        let stretch = DVec3::from_array(values.to_array().map(|x| x.max(0.0).sqrt()))
            .max(DVec3::splat(longest / FLATTEST))
            .clamp(DVec3::splat(1.0 / FLATTEST), DVec3::ONE);
        // Over that of water: neighbours are where the kernel is.
        let density = near.weight / (self.bulk * stretch.element_product());
        let joined = rise(JOINED, near.weight - 1.0) * rise(TORN, density);
        let full = SUPPORT * self.spacing;
        let alone = DVec3::splat(ALONE * self.spacing);
        let axes = alone.lerp(full * stretch, joined);
        let factor = self.alone + joined * (1.0 - self.alone);
        Ellipsoid::new(place, turn, axes, factor * self.spacing.powi(3))
    }

    /// The field's mean over a plane half a spacing above the outermost particles of half a lattice of spacing 1.
    fn calm_level(&self) -> f64 {
        const SAMPLES: i32 = 4;
        // One particle of each layer; the others of a layer have the same kernel beside it.
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

/// Factor on a lone particle's kernel with which the field is `level` where a ball of its volume ends; the spacing is 1.
fn lone_factor(level: f64) -> f64 {
    let radius = (3.0 / (4.0 * PI)).cbrt();
    let plain = Ellipsoid::new(DVec3::ZERO, DMat3::IDENTITY, DVec3::splat(ALONE), 1.0);
    level / plain.value(DVec3::X * radius)
}
