//! Water bricks without particles: walls and solids leave too little of their cells for a particle,
//! or water is about to close a gap before a wall.
//!
//! If such cells were air, the water beside them would lose its pressure there.

use std::collections::BTreeSet;

use glam::{DMat3, DVec3};

use super::{
    boundary::Boundary, bounds::Bounds, bricks::EDGE, pose::Pose, signed_distance::SignedDistance,
};

/// Largest gap that is closed, in cells (flip/close_gaps).
const MOST_GAP: f64 = 4.0;

/// A wall nearer than this to a cell's face, in cells, counts as on it.
const ON_FACE: f64 = 1e-3;

/// Positions where the solids of a scene cut cells. Lengths are in cells, from the domain's
/// least corner.
#[derive(Clone, Debug, Default)]
pub struct Shores {
    at_rest: Option<Surface>,
    moving: Vec<Surface>,
    /// Axes along which the last brick is next to the first.
    periodic: [bool; 3],
}

/// Boxes of a brick's edge length around each part of a solid's surface.
#[derive(Clone, Debug)]
pub struct Surface {
    origin: DVec3,
    boxes: Vec<DVec3>,
}

impl Surface {
    /// Finds the surface in a grid; `least` is the domain's least corner, metres.
    pub fn of(grid: &SignedDistance, least: DVec3, cell_size: f64) -> Self {
        let edge = f64::from(EDGE);
        let mut boxes = BTreeSet::new();
        // A cell that the surface crosses has a node within a cell's diagonal plus one node spacing
        // of it.
        let reach = 3f64.sqrt() * (cell_size + grid.spacing);
        let [nx, ny, _] = grid.dims;
        for (k, &distance) in grid.values.iter().enumerate() {
            if f64::from(distance).abs() <= reach {
                let node = [k % nx, k / nx % ny, k / (nx * ny)].map(|n| n as f64);
                let place = DVec3::from_array(node) * (grid.spacing / cell_size);
                boxes.insert((place / edge).floor().to_array().map(|b| b as i64));
            }
        }
        let corner = |b: [i64; 3]| edge * DVec3::from_array(b.map(|b| b as f64));
        Self {
            origin: (grid.origin - least) / cell_size,
            boxes: boxes.into_iter().map(corner).collect(),
        }
    }

    /// Bricks that the surface touches in `pose`, which is in cells from the domain's least corner.
    fn bricks(&self, pose: Pose, dims: [u32; 3]) -> impl Iterator<Item = usize> {
        let edge = f64::from(EDGE);
        let last = DVec3::from_array(dims.map(|n| f64::from(n) - 1.0));
        let turn = DMat3::from_quat(pose.turn);
        let half = 0.5 * (turn.x_axis.abs() + turn.y_axis.abs() + turn.z_axis.abs());
        self.boxes.iter().flat_map(move |corner| {
            let middle = pose.place(self.origin + corner + 0.5 * edge) / edge;
            let (low, high) = (middle - half, middle + half);
            let from = low.floor().clamp(DVec3::ZERO, last).as_uvec3();
            let to = high.floor().clamp(DVec3::ZERO, last).as_uvec3();
            let is_within = high.cmpge(DVec3::ZERO).all() && low.cmple(last + 1.0).all();
            let rows = move |z: u32| (from.y..=to.y).map(move |y| (z, y));
            let rows = (from.z..=to.z).filter(move |_| is_within).flat_map(rows);
            rows.flat_map(move |(z, y)| {
                (from.x..=to.x).map(move |x| ((z * dims[1] + y) * dims[0] + x) as usize)
            })
        })
    }
}

impl Shores {
    /// Collects the surfaces of a scene's solids; `least` is the domain's least corner, metres.
    pub fn new(boundary: &Boundary, least: DVec3, cell_size: f64) -> Self {
        let surface = |grid: &SignedDistance| Surface::of(grid, least, cell_size);
        Self {
            at_rest: boundary.distance.as_ref().map(surface),
            moving: boundary.moving.iter().map(surface).collect(),
            periodic: [false; 3],
        }
    }

    /// Returns the same for a domain that is periodic along these axes.
    pub fn joined(self, periodic: [bool; 3]) -> Self {
        Self { periodic, ..self }
    }

    /// Marks bricks beside those that hold particles: bricks that solids cut, with moving solids at
    /// `poses` (in cells from the domain's least corner), each with its surface where the shape
    /// changes, and bricks of which the walls at `cut` leave no more than four cells, the largest
    /// gap that is closed (flip/close_gaps). `is_wet` has one flag per brick, `dims` bricks along
    /// each axis, x fastest; lengths are in cells.
    pub fn mark(
        &self,
        is_wet: &mut [bool],
        dims: [u32; 3],
        cut: &Bounds,
        poses: impl Iterator<Item = (Pose, Option<Surface>)>,
    ) {
        let at_rest = self.at_rest.iter().map(|surface| (surface, Pose::START));
        let with_water = is_wet.to_vec();
        let mut add = |surface: &Surface, pose: Pose| {
            for brick in surface.bricks(pose, dims) {
                is_wet[brick] |= has_water_about(&with_water, dims, self.periodic, brick);
            }
        };
        at_rest.for_each(|(surface, pose)| add(surface, pose));
        for (surface, (pose, now)) in self.moving.iter().zip(poses) {
            add(now.as_ref().unwrap_or(surface), pose);
        }
        for axis in 0..3 {
            let edge = f64::from(EDGE);
            let (low, high) = (cut.min[axis], cut.max[axis]);
            let first = ((low + ON_FACE) / edge).floor();
            let last = ((high - ON_FACE) / edge).ceil() - 1.0;
            if first >= 0.0 && edge * (first + 1.0) - low <= MOST_GAP {
                spread(is_wet, dims, axis, first as u32, 1);
            }
            if last >= 1.0 && high - edge * last <= MOST_GAP {
                spread(is_wet, dims, axis, last as u32, -1);
            }
        }
    }
}

/// Returns whether one of the 27 bricks around a brick is set.
fn has_water_about(is_wet: &[bool], dims: [u32; 3], periodic: [bool; 3], brick: usize) -> bool {
    let n = dims.map(|n| n as usize);
    let at = [brick % n[0], brick / n[0] % n[1], brick / (n[0] * n[1])];
    let near = |axis: usize| {
        let (at, n) = (at[axis], n[axis]);
        [at + n - 1, at + n, at + n + 1]
            .into_iter()
            .filter(move |k| periodic[axis] || (n..2 * n).contains(k))
            .map(move |k| k % n)
    };
    near(2).any(|z| near(1).any(|y| near(0).any(|x| is_wet[(z * n[1] + y) * n[0] + x])))
}

/// Sets the bricks of layer `layer` along an axis whose neighbour `inward` is set.
fn spread(is_wet: &mut [bool], dims: [u32; 3], axis: usize, layer: u32, inward: i64) {
    let from = i64::from(layer) + inward;
    if layer >= dims[axis] || !(0..i64::from(dims[axis])).contains(&from) {
        return;
    }
    let stride: usize = dims[..axis].iter().map(|&n| n as usize).product();
    for brick in 0..is_wet.len() {
        if brick / stride % dims[axis] as usize == layer as usize {
            let beside = (brick as i64 + inward * stride as i64) as usize;
            is_wet[brick] |= is_wet[beside];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DIMS: [u32; 3] = [4, 3, 2];

    fn index([x, y, z]: [usize; 3]) -> usize {
        (z * 3 + y) * 4 + x
    }

    fn marked(shores: &Shores, wet: &[[usize; 3]], cut: Bounds, way: DVec3) -> Vec<usize> {
        let mut is_wet = vec![false; 24];
        for &brick in wet {
            is_wet[index(brick)] = true;
        }
        let pose = Pose {
            centre: way,
            ..Pose::START
        };
        shores.mark(&mut is_wet, DIMS, &cut, [(pose, None)].into_iter());
        (0..24).filter(|&k| is_wet[k]).collect()
    }

    fn cut(min: [f64; 3], max: [f64; 3]) -> Bounds {
        Bounds {
            min: DVec3::from_array(min),
            max: DVec3::from_array(max),
        }
    }

    fn sorted(bricks: &[[usize; 3]]) -> Vec<usize> {
        let mut all: Vec<usize> = bricks.iter().map(|&brick| index(brick)).collect();
        all.sort_unstable();
        all
    }

    #[test]
    fn bricks_of_which_walls_leave_few_layers_are_water() {
        let none = Shores::default();
        let last = [32.0, 24.0, 16.0];
        // A wall within the first brick, which has no particles.
        for (x, expected) in [
            (7.6, vec![[0, 0, 0], [1, 0, 0]]),
            (4.1, vec![[0, 0, 0], [1, 0, 0]]),
            (3.9, vec![[1, 0, 0]]),
            (8.0, vec![[1, 0, 0]]),
        ] {
            let found = marked(&none, &[[1, 0, 0]], cut([x, 0.0, 0.0], last), DVec3::ZERO);
            assert_eq!(found, sorted(&expected), "{x}");
        }
        // Two walls meet: the brick in the corner is marked too.
        let walls = cut([0.0; 3], [19.9, 8.3, 16.0]);
        let found = marked(&none, &[[1, 0, 0], [3, 2, 1]], walls, DVec3::ZERO);
        let corner = [[1, 0, 0], [2, 0, 0], [1, 1, 0], [2, 1, 0], [3, 2, 1]];
        assert_eq!(found, sorted(&corner));
    }

    /// The floor of a moving solid at height 8.5 cells: bricks below the water's and beside it are
    /// marked, none farther away.
    #[test]
    fn bricks_that_a_solid_cuts_are_water_beside_water() {
        let grid = SignedDistance {
            origin: DVec3::new(-0.4, 0.45, -0.4),
            spacing: 0.05,
            dims: [81, 9, 41],
            values: (0..81 * 9 * 41)
                .map(|k| 0.05 * ((k / 81 % 9) as f32 - 8.0))
                .collect(),
        };
        let boundary = Boundary {
            moving: vec![grid],
            ..Boundary::default()
        };
        let shores = Shores::new(&boundary, DVec3::ZERO, 0.1);
        let all = cut([0.0; 3], [32.0, 24.0, 16.0]);
        let wet = [[1, 1, 0]];
        let found = marked(&shores, &wet, all, DVec3::ZERO);
        assert!(found.contains(&index([1, 0, 0])), "{found:?}");
        assert!(!found.contains(&index([3, 0, 0])), "{found:?}");
        assert!(!found.contains(&index([1, 2, 0])), "{found:?}");
        // If the ends are joined, the brick beside the last one is the first.
        let across = shores.clone().joined([true, false, false]);
        let found = marked(&across, &[[0, 1, 0]], all, DVec3::ZERO);
        assert!(found.contains(&index([3, 0, 0])), "{found:?}");
        let found = marked(&shores, &[[0, 1, 0]], all, DVec3::ZERO);
        assert!(!found.contains(&index([3, 0, 0])), "{found:?}");
        // Negative control: with the solid gone nothing is marked.
        let gone = marked(&shores, &wet, all, DVec3::new(0.0, -40.0, 0.0));
        assert_eq!(gone, sorted(&wet));
    }
}
