//! How much of a cell is inside a solid, from signed distances at its corners.

use glam::{DMat3, DQuat, DVec3};

use super::{parallel, signed_distance::SignedDistance};

/// Places at which the volume of a cut solid is averaged: it varies among them by under a percent
/// of what an edge or corner loses.
const POSES: usize = 8;

/// Largest offset, in cells. Solids that need more are smaller than a cell.
const MOST: f64 = 0.25;

/// Steps of the secant method; with convex solids the volume is almost linear in the offset.
const STEPS: usize = 4;

/// A solid in some pose on a grid of cells.
struct Cut {
    /// Cells that are inside, whatever the offset.
    full: f64,
    /// Distances at the corners of the cells that the surface may cut, metres.
    cells: Vec<[f64; 8]>,
}

/// Returns the fraction of a cube below the plane through values at its corners (x fastest), where
/// the values are negative; exact for a plane (Scardovelli and Zaleski 2000).
pub fn inside(corners: &[f64; 8]) -> f64 {
    let slope = |axis: usize| {
        let sign = |k: usize| if k >> axis & 1 == 0 { -0.25 } else { 0.25 };
        (0..8).map(|k| sign(k) * corners[k]).sum::<f64>().abs()
    };
    let mut slopes = [slope(0), slope(1), slope(2)];
    slopes.sort_by(f64::total_cmp);
    let rise = slopes.iter().sum::<f64>().max(1e-20);
    let [m1, m2, m3] = slopes.map(|slope| (slope / rise).max(1e-20));
    let height = (0.5 - corners.iter().sum::<f64>() / 8.0 / rise).clamp(0.0, 1.0);
    let a = height.min(1.0 - height);
    // A tetrahedron, of its height over those of the whole corner.
    let tip = |a: f64| (a / m1) * (a / m2) * (a / m3) / 6.0;
    let smaller = if a <= m1 {
        tip(a)
    } else if a <= m1 + m2 {
        let both = (a / m2 * (a - m1) + m1 / m2 * m1 / 3.0) / (2.0 * m3);
        both - tip((a - m2).max(0.0)) - tip((a - m3).max(0.0))
    } else {
        (a - 0.5 * (m1 + m2)) / m3
    };
    if height > 0.5 { 1.0 - smaller } else { smaller }
}

/// Returns the distance by which a solid's surface has to move outward so that cells cut by planes
/// hold `volume`, m³, on average over its poses; metres.
///
/// A plane in each cell cuts off what an edge or a corner has beyond it: of a box eight cells wide
/// and four high a twentieth.
pub fn volume_offset(grid: &SignedDistance, volume: f64, cell_size: f64) -> f64 {
    let poses: Vec<Cut> = (0..POSES)
        .map(|k| Cut::new(grid, &turn(k), shift(k), cell_size))
        .collect();
    let cell = cell_size.powi(3);
    let error = |offset: f64| {
        let all: f64 = poses.iter().map(|pose| pose.volume(offset)).sum();
        all / POSES as f64 * cell - volume
    };
    let most = MOST * cell_size;
    let (mut last, mut offset) = (0.0, 0.1 * cell_size);
    let mut last_error = error(last);
    for _ in 0..STEPS {
        let here = error(offset);
        let slope = (here - last_error) / (offset - last);
        if slope <= 0.0 {
            // No cell is cut: a body far below their size.
            return last;
        }
        (last, last_error) = (offset, here);
        offset = (offset - here / slope).clamp(-most, most);
        if offset == last {
            break;
        }
    }
    offset
}

impl Cut {
    fn new(grid: &SignedDistance, turn: &DMat3, shift: DVec3, cell_size: f64) -> Self {
        let last = DVec3::from_array(grid.dims.map(|n| (n - 1) as f64));
        let half = 0.5 * grid.spacing * last;
        let centre = grid.origin + half;
        let rows = [0, 1, 2].map(|k| turn.row(k).abs().dot(half));
        let reach = rows.map(|row| (row / cell_size).ceil() as i64 + 1);
        let least = MOST * cell_size;
        let layers = parallel::map(0..2 * reach[2] as usize, |layer| {
            let z = layer as i64 - reach[2];
            let mut found = Self {
                full: 0.0,
                cells: Vec::new(),
            };
            for y in -reach[1]..reach[1] {
                for x in -reach[0]..reach[0] {
                    let corners = std::array::from_fn(|k| {
                        let step = [x, y, z].map(|c| c as f64);
                        let corner = [k & 1, k >> 1 & 1, k >> 2].map(|c| c as f64);
                        let at = DVec3::from_array(step) + DVec3::from_array(corner) + shift;
                        grid.sample(turn.transpose() * (cell_size * at) + centre)
                    });
                    found.add(corners, least);
                }
            }
            found
        });
        Self {
            full: layers.iter().map(|layer| layer.full).sum(),
            cells: layers.into_iter().flat_map(|layer| layer.cells).collect(),
        }
    }

    /// Adds a cell, which an offset below `least` changes or not.
    fn add(&mut self, corners: [f64; 8], least: f64) {
        let low = corners.into_iter().fold(f64::INFINITY, f64::min);
        let high = corners.into_iter().fold(f64::NEG_INFINITY, f64::max);
        if high < -least {
            self.full += 1.0;
        } else if low < least {
            self.cells.push(corners);
        }
    }

    /// Volume with the surface moved outward, in cells.
    fn volume(&self, offset: f64) -> f64 {
        let parts = self.cells.iter();
        let parts = parts.map(|corners| inside(&corners.map(|value| value - offset)));
        self.full + parts.sum::<f64>()
    }
}

/// Term `k` of a sequence that fills the unit cube of six dimensions evenly, of one of them: an
/// additive recurrence by powers of the root of x⁷ = x + 1.
fn even(k: usize, dimension: i32) -> f64 {
    const ROOT: f64 = 1.112_775_684_278_705_5;
    ((k + 1) as f64 * ROOT.powi(-1 - dimension)).fract()
}

/// Rotation of a pose: uniform among all (Shoemake 1992).
fn turn(k: usize) -> DMat3 {
    use std::f64::consts::TAU;
    let [u, v, w] = [0, 1, 2].map(|dimension| even(k, dimension));
    let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
    let (v, w) = (TAU * v, TAU * w);
    let (x, y, z, w) = (a * v.sin(), a * v.cos(), b * w.sin(), b * w.cos());
    DMat3::from_quat(DQuat::from_xyzw(x, y, z, w))
}

/// Displacement of a pose, in cells.
fn shift(k: usize) -> DVec3 {
    DVec3::new(even(k, 3), even(k, 4), even(k, 5))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{bounds::Bounds, mesh::tests::box_mesh};

    /// Fraction below a plane by counting: `n`³ points.
    fn counted(corners: &[f64; 8], n: usize) -> f64 {
        let middle = corners.iter().sum::<f64>() / 8.0;
        let slope = |axis: usize| {
            let sign = |k: usize| if k >> axis & 1 == 0 { -0.25 } else { 0.25 };
            (0..8).map(|k| sign(k) * corners[k]).sum::<f64>()
        };
        let slopes = DVec3::new(slope(0), slope(1), slope(2));
        let at = |k: usize| (k as f64 + 0.5) / n as f64 - 0.5;
        let below = (0..n * n * n).filter(|k| {
            let x = DVec3::new(at(k % n), at(k / n % n), at(k / (n * n)));
            middle + slopes.dot(x) < 0.0
        });
        below.count() as f64 / (n * n * n) as f64
    }

    /// The exact fraction is that of points counted, to the points that a plane may cut at most
    /// (√3 n² of n³); the height that replaces it for faces is not.
    #[test]
    fn the_fraction_below_a_plane_is_exact() {
        let n = 48;
        let within = 3f64.sqrt() / n as f64;
        let mut farthest_of_height = 0.0f64;
        for k in 0..200 {
            let slopes = DVec3::new(even(k, 0), even(k, 1), even(k, 2) * even(k, 3)) - 0.5;
            let middle = 0.8 * (even(k, 4) - 0.5);
            let corners: [f64; 8] = std::array::from_fn(|c| {
                let corner = [c & 1, c >> 1 & 1, c >> 2].map(|x| x as f64);
                middle + slopes.dot(DVec3::from_array(corner) - 0.5)
            });
            let truth = counted(&corners, n);
            let found = inside(&corners);
            assert!(
                (found - truth).abs() <= within,
                "{corners:?}: {found} {truth}"
            );
            let height = 0.5 - middle / slopes.abs().element_sum();
            farthest_of_height = farthest_of_height.max((height.clamp(0.0, 1.0) - truth).abs());
        }
        assert!(farthest_of_height > 2.0 * within, "{farthest_of_height}");
    }

    /// Planes that are parallel to faces or edges, and cells wholly on one side.
    #[test]
    fn the_fraction_is_exact_at_its_limits() {
        let of = |m: f64, x: f64, y: f64, z: f64| {
            inside(&std::array::from_fn(|c| {
                let corner = [c & 1, c >> 1 & 1, c >> 2].map(|x| x as f64 - 0.5);
                m + x * corner[0] + y * corner[1] + z * corner[2]
            }))
        };
        let close = |found: f64, exact: f64| assert!((found - exact).abs() < 1e-12, "{found}");
        close(of(0.25, 0.0, 1.0, 0.0), 0.25);
        close(of(0.5, 1.0, 1.0, 0.0), 0.125);
        close(of(1.0, 1.0, 1.0, 1.0), 0.125 / 6.0);
        close(of(-1.0, 1.0, 1.0, 1.0), 1.0 - 0.125 / 6.0);
        close(of(0.0, 1.0, 1.0, 1.0), 0.5);
        close(of(3.0, 1.0, 1.0, 1.0), 0.0);
        close(of(-1.0, 0.0, 0.0, 0.0), 1.0);
        close(of(1.0, 0.0, 0.0, 0.0), 0.0);
    }

    /// A box eight cells wide and four high: cut by planes it lacks a twentieth of its volume; with
    /// the offset its mean over other poses is right to half a percent.
    #[test]
    fn an_offset_gives_a_box_its_volume() {
        let half = DVec3::new(0.2, 0.1, 0.2);
        let mesh = box_mesh(Bounds {
            min: -half,
            max: half,
        });
        let cell = 0.05;
        let around = mesh.bounds().expect("vertices").grown(0.1);
        let grid = SignedDistance::from_mesh(&mesh, &around, 0.5 * cell).expect("closed");
        let volume = 8.0 * half.element_product();
        let offset = volume_offset(&grid, volume, cell);
        let with = |offset: f64| {
            let other = (20..28).map(|k| {
                let cut = Cut::new(&grid, &turn(k), shift(k), cell);
                cut.volume(offset) * cell.powi(3) / volume - 1.0
            });
            other.sum::<f64>() / 8.0
        };
        assert!(with(0.0) < -0.04, "{}", with(0.0));
        assert!(with(offset).abs() < 0.005, "{offset}: {}", with(offset));
    }
}
