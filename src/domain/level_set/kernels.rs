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

use std::{f64::consts::PI, ops::Range};

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::eigen;

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
        Self::of_fitted(&fitted, size, spacing)
    }

    /// These kernels, which [`Self::of_first`] fitted, and those that stand in the mirrors of the box's sides.
    pub fn of_fitted(fitted: &[Ellipsoid], size: DVec3, spacing: f64) -> Self {
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
        let all = mirrored(positions, size, NEAR * spacing, &|&p, axis, plane| {
            reflected(p, axis, plane)
        });
        fit(&all, count, &calibration)
    }

    /// The field itself, for values at any place.
    pub fn field(&self) -> Field<'_> {
        let reach = |it: &Ellipsoid| it.reach.max_element();
        let edge = self.ellipsoids.iter().map(reach).fold(0.0, f64::max);
        let places: Vec<DVec3> = self.ellipsoids.iter().map(|it| it.centre).collect();
        Field {
            kernels: self,
            grid: Grid::new(&places, edge.max(f64::MIN_POSITIVE)),
        }
    }
}

/// The field of kernels: what a level set samples.
pub struct Field<'a> {
    kernels: &'a Kernels,
    grid: Grid,
}

impl Field<'_> {
    /// At `x`: positive in water, 0 at its surface, −1 where no particle reaches.
    pub fn value(&self, x: DVec3) -> f64 {
        let mut sum = 0.0;
        let ellipsoids = &self.kernels.ellipsoids;
        self.grid
            .for_each_near(x, |k| sum += ellipsoids[k].value(x));
        sum / self.kernels.level - 1.0
    }

    /// [`Self::value`] and [`Self::gradient`] at once.
    pub fn value_and_gradient(&self, x: DVec3) -> (f64, DVec3) {
        let (mut sum, mut slope) = (0.0, DVec3::ZERO);
        let ellipsoids = &self.kernels.ellipsoids;
        self.grid.for_each_near(x, |k| {
            let (value, gradient) = ellipsoids[k].value_and_gradient(x);
            sum += value;
            slope += gradient;
        });
        let level = self.kernels.level;
        (sum / level - 1.0, slope / level)
    }

    /// ∇ at `x`, 1/m.
    pub fn gradient(&self, x: DVec3) -> DVec3 {
        let mut sum = DVec3::ZERO;
        let ellipsoids = &self.kernels.ellipsoids;
        self.grid
            .for_each_near(x, |k| sum += ellipsoids[k].value_and_gradient(x).1);
        sum / self.kernels.level
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
    all: &[T],
    size: DVec3,
    near: f64,
    mirror: &dyn Fn(&T, usize, f64) -> T,
) -> Vec<T> {
    let mut all = all.to_vec();
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
    let sorted: Vec<DVec3> = grid.order.iter().map(|&k| places[k as usize]).collect();
    (0..count)
        .into_par_iter()
        .map(|k| {
            let near = Moments::about(places[k], (&grid, &sorted), reach);
            calibration.kernel(places[k], &near)
        })
        .collect()
}

/// Cells in the reach of a kernel's neighbours.
const HALVES: usize = 2;
/// Places that are looked at together.
const AT_ONCE: usize = 64;

/// Weight and moments of neighbours, relative to a place.
struct Moments {
    weight: f64,
    first: DVec3,
    second: DMat3,
}

impl Moments {
    /// Of the places within `reach`, itself included, under the paper's weight 1 − (r / R)³; `sorted` are in the grid's order.
    fn about(place: DVec3, (grid, sorted): (&Grid, &[DVec3]), reach: f64) -> Self {
        let mut moments = Self::zero();
        let mut near = [DVec3::ZERO; AT_ONCE];
        grid.for_each_run(place, HALVES, |run| {
            for places in sorted[run].chunks(AT_ONCE) {
                // Those that are near first, without a branch that a processor would have to guess.
                let mut count = 0;
                for other in places {
                    near[count] = *other - place;
                    count += usize::from(near[count].length_squared() < reach * reach);
                }
                near[..count].iter().for_each(|&d| moments.add(d, reach));
            }
        });
        moments
    }

    fn zero() -> Self {
        Self {
            weight: 0.0,
            first: DVec3::ZERO,
            second: DMat3::ZERO,
        }
    }

    fn add(&mut self, d: DVec3, reach: f64) {
        let squared = d.length_squared() / (reach * reach);
        if squared < 1.0 {
            let w = 1.0 - squared * squared.sqrt();
            self.weight += w;
            self.first += w * d;
            self.second += outer(d) * w;
        }
    }

    /// About their mean.
    fn covariance(&self) -> DMat3 {
        self.second * (1.0 / self.weight) - outer(self.first / self.weight)
    }
}

/// 0 up to the first of these, 1 from the second on, and steadily between.
fn rise([from, to]: [f64; 2], x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn outer(d: DVec3) -> DMat3 {
    DMat3::from_cols(d.x * d, d.y * d, d.z * d)
}

impl Calibration {
    fn new(spacing: f64) -> Self {
        let reach = NEAR.ceil() as i32;
        let mut bulk = Moments::zero();
        for z in -reach..=reach {
            for y in -reach..=reach {
                for x in -reach..=reach {
                    bulk.add(DVec3::new(x.into(), y.into(), z.into()), NEAR);
                }
            }
        }
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
                let mut sums = Moments::zero();
                for z in -side..=side {
                    for y in -side..=side.min(layer) {
                        for x in -side..=side {
                            sums.add(DVec3::new(x.into(), y.into(), z.into()), NEAR);
                        }
                    }
                }
                self.kernel(place, &sums)
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

/// Places by cell, for neighbours within a cell's edge.
pub(super) struct Grid {
    edge: f64,
    min: DVec3,
    cells: [usize; 3],
    starts: Vec<u32>,
    order: Vec<u32>,
}

impl Grid {
    pub(super) fn new(places: &[DVec3], edge: f64) -> Self {
        let least = |a: DVec3, b: &DVec3| a.min(*b);
        let min = places.iter().fold(DVec3::INFINITY, least);
        let max = places.iter().fold(DVec3::NEG_INFINITY, |a, b| a.max(*b));
        let span = ((max - min) / edge).floor().max(DVec3::ZERO);
        let cells = match places.is_empty() {
            true => [1; 3],
            false => span.to_array().map(|n| n as usize + 1),
        };
        let mut grid = Self {
            edge,
            min,
            cells,
            starts: vec![0; cells.iter().product::<usize>() + 1],
            order: vec![0; places.len()],
        };
        for &p in places {
            let cell = grid.index(grid.cell(p));
            grid.starts[cell + 1] += 1;
        }
        for cell in 1..grid.starts.len() {
            grid.starts[cell] += grid.starts[cell - 1];
        }
        let mut next = grid.starts.clone();
        for (k, &p) in places.iter().enumerate() {
            let at = &mut next[grid.index(grid.cell(p))];
            grid.order[*at as usize] = k as u32;
            *at += 1;
        }
        grid
    }

    /// Of a cell, metres: how far neighbours are found.
    pub(super) fn edge(&self) -> f64 {
        self.edge
    }

    fn cell(&self, p: DVec3) -> [usize; 3] {
        let at = ((p - self.min) / self.edge).to_array();
        [0, 1, 2].map(|axis| (at[axis].max(0.0) as usize).min(self.cells[axis] - 1))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.cells[1] + y) * self.cells[0] + x
    }

    /// Visits those of the 3³ cells about a place, which may lie outside of all, in an order that depends on the places alone.
    pub(super) fn for_each_near(&self, p: DVec3, mut visit: impl FnMut(usize)) {
        self.for_each_run(p, 1, |run| {
            self.order[run].iter().for_each(|&k| visit(k as usize));
        });
    }

    /// Visits the rows of those of the cells about a place that are up to `reach` from its own, as ranges of the grid's order.
    fn for_each_run(&self, p: DVec3, reach: usize, mut visit: impl FnMut(Range<usize>)) {
        let [x, y, z] = self.cell(p);
        let range = |c: usize, n: usize| c.saturating_sub(reach)..=(c + reach).min(n - 1);
        for cz in range(z, self.cells[2]) {
            for cy in range(y, self.cells[1]) {
                let xs = range(x, self.cells[0]);
                let row = self.index([0, cy, cz]);
                let first = self.starts[row + xs.start()] as usize;
                let last = self.starts[row + xs.end() + 1] as usize;
                visit(first..last);
            }
        }
    }
}
