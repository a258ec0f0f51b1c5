//! Weight and moments of a point's neighbours, summed in SIMD lanes.

use glam::{DMat3, DVec3};
use pulp::{Simd, WithSimd};

use super::grid::{BinnedPoints, HALVES};
use crate::lanes::{positive, widely};

/// Points that are processed together.
pub(super) const AT_ONCE: usize = 64;
/// Neighbours summed at once: ten sums with this many partial sums fit into a
/// processor's registers.
const LANES: usize = 4;

/// Weight and moments of neighbours, relative to a point.
pub(super) struct Moments {
    pub(super) weight: f64,
    first: DVec3,
    second: DMat3,
}

impl Moments {
    /// Sums over the points within `reach`, `place` itself included, with the paper's weight
    /// 1 − (r / R)³; `sorted` holds the points in the grid's order.
    pub(super) fn about(
        place: DVec3,
        (grid, sorted): (&BinnedPoints, &[DVec3]),
        reach: f64,
    ) -> Self {
        let mut near = Near::new(reach);
        grid.for_each_run(place, HALVES, |run| {
            for places in sorted[run].chunks(AT_ONCE) {
                near.take(places, place);
            }
        });
        near.moments()
    }

    /// Covariance about the weighted mean.
    pub(super) fn covariance(&self) -> DMat3 {
        self.second * (1.0 / self.weight) - outer(self.first / self.weight)
    }
}

/// Offsets of neighbours, collected before they are summed several at a time.
pub(super) struct Near {
    reach: f64,
    /// One axis after the other, metres.
    ways: [[f64; 2 * AT_ONCE]; 3],
    count: usize,
    sums: Sums,
}

impl Near {
    pub(super) fn new(reach: f64) -> Self {
        Self {
            reach,
            ways: [[0.0; 2 * AT_ONCE]; 3],
            count: 0,
            sums: Sums::default(),
        }
    }

    /// Collects those of at most [`AT_ONCE`] points that are within reach of `from`.
    pub(super) fn take(&mut self, places: &[DVec3], from: DVec3) {
        if self.count > AT_ONCE {
            self.sum();
        }
        // Branch-free, to avoid mispredictions.
        for place in places {
            let way = *place - from;
            for (axis, of) in self.ways.iter_mut().enumerate() {
                of[self.count] = way[axis];
            }
            self.count += usize::from(way.length_squared() < self.reach * self.reach);
        }
    }

    /// Sums the collected offsets, padded to whole lanes with entries of zero weight.
    fn sum(&mut self) {
        let whole = self.count.next_multiple_of(LANES);
        for at in self.count..whole {
            for (of, way) in self.ways.iter_mut().zip([2.0 * self.reach, 0.0, 0.0]) {
                of[at] = way;
            }
        }
        let [x, y, z] = (self.ways).each_ref().map(|of| &of[..whole]);
        let inverse = 1.0 / (self.reach * self.reach);
        let sums = &mut self.sums;
        widely(Add {
            ways: [x, y, z],
            inverse,
            sums,
        });
        self.count = 0;
    }

    pub(super) fn moments(mut self) -> Moments {
        self.sum();
        let Sums {
            weight,
            first,
            second,
        } = self.sums;
        let sum = |[a, b, c, d]: [f64; LANES]| (a + c) + (b + d);
        let [x, y, z] = first.map(sum);
        let [xx, yy, zz, yz, xz, xy] = second.map(sum);
        Moments {
            weight: sum(weight),
            first: DVec3::new(x, y, z),
            second: DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]),
        }
    }
}

/// Sums of weights, weighted offsets and weighted products of offsets.
#[derive(Default)]
struct Sums {
    weight: [f64; LANES],
    first: [[f64; LANES]; 3],
    /// xx, yy, zz, yz, xz, xy.
    second: [[f64; LANES]; 6],
}

/// Adds whole lanes of offsets.
struct Add<'a> {
    ways: [&'a [f64]; 3],
    /// 1 / R².
    inverse: f64,
    sums: &'a mut Sums,
}

impl WithSimd for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Sums {
            mut weight,
            first: [mut fx, mut fy, mut fz],
            second: [mut xx, mut yy, mut zz, mut yz, mut xz, mut xy],
        } = *self.sums;
        let [xs, ys, zs] = self.ways.map(|of| of.as_chunks::<LANES>().0);
        for ((x, y), z) in xs.iter().zip(ys).zip(zs) {
            for k in 0..LANES {
                let squared = (x[k] * x[k] + y[k] * y[k] + z[k] * z[k]) * self.inverse;
                let w = positive(1.0 - squared * squared.sqrt());
                let [wx, wy, wz] = [w * x[k], w * y[k], w * z[k]];
                weight[k] += w;
                fx[k] += wx;
                fy[k] += wy;
                fz[k] += wz;
                xx[k] += wx * x[k];
                yy[k] += wy * y[k];
                zz[k] += wz * z[k];
                yz[k] += wy * z[k];
                xz[k] += wx * z[k];
                xy[k] += wx * y[k];
            }
        }
        *self.sums = Sums {
            weight,
            first: [fx, fy, fz],
            second: [xx, yy, zz, yz, xz, xy],
        };
    }
}

fn outer(d: DVec3) -> DMat3 {
    DMat3::from_cols(d.x * d, d.y * d, d.z * d)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::uniform;

    /// Compares with a sum over each neighbour by itself, for more points than fit a batch and for
    /// counts that do not fill whole lanes.
    #[test]
    fn sums_are_those_of_each_neighbour() {
        let place = |k: u64| DVec3::from([0, 1, 2].map(|axis| uniform(3 * k + axis)));
        let places: Vec<DVec3> = (0..700).map(place).collect();
        let grid = BinnedPoints::new(&places, 0.2);
        let sorted = grid.sorted(&places);
        let mut most = 0;
        for &place in &places[..100] {
            let found = Moments::about(place, (&grid, &sorted), 0.4);
            // Deviation from the sums within `reach`, in roundings.
            let off = |reach: f64| {
                let (mut weight, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
                let near = places.iter().map(|it| *it - place);
                let near: Vec<DVec3> = near.filter(|d| d.length() < reach).collect();
                for &d in &near {
                    let w = 1.0 - (d.length() / reach).powi(3);
                    weight += w;
                    first += w * d;
                    second += outer(d) * w;
                }
                let off = (found.weight - weight).abs()
                    + (found.first - first).abs().max_element()
                    + (found.second - second)
                        .to_cols_array()
                        .map(f64::abs)
                        .iter()
                        .sum::<f64>();
                (near.len(), off / (near.len() as f64 * f64::EPSILON))
            };
            // 11 sums of terms of at most 1, each rounded up to four times.
            let (count, off_by) = off(0.4);
            assert!(off_by < 44.0, "{off_by}");
            most = most.max(count);
            // Negative control: a radius that is 1 % smaller.
            assert!(off(0.396).1 > 1e6);
        }
        assert!(most > AT_ONCE, "{most}");
    }

    /// The processor's widest vectors give the same bits as scalar code.
    #[test]
    fn lanes_are_summed_alike() {
        let ways =
            [0.7, 0.4, 0.1].map(|f: f64| [f, 0.3 * f, -0.8 * f, 0.9 * f, f * f, 0.0, -f, 0.5]);
        let sums = |run: &dyn Fn(Add<'_>)| {
            let mut sums = Sums::default();
            run(Add {
                ways: ways.each_ref().map(|of| &of[..]),
                inverse: 0.37,
                sums: &mut sums,
            });
            (sums.weight, sums.first, sums.second)
        };
        let wide = sums(&|add| widely(add));
        assert_eq!(wide, sums(&|add| add.with_simd(pulp::Scalar)));
        assert_ne!(wide.0, [0.0; LANES]);
    }
}
