//! Height of the water along the vertical sides of its box.

use glam::{DVec2, DVec3};

use super::kernels::{Kernels, REACH};
use crate::parallel;

/// Samples per particle spacing in the upward search for water.
const LOOKS: f64 = 2.0;
/// Bisection steps between a sample in the water and the one above it.
const HALVINGS: u32 = 12;

/// Heights of the water at nodes along the vertical sides of a box.
#[derive(Clone, Debug, PartialEq)]
pub struct Edges {
    /// Nodes along x and z; the first and the last are at corners.
    pub nodes: [u32; 2],
    /// Heights above the floor, metres, along the sides −x, +x, −z, +z in this order; 0 where there
    /// is no water.
    pub heights: Vec<f32>,
}

/// Returns the number of nodes along x and z for a box of `size` metres: one per particle spacing
/// of `spacing` metres, and one at each corner.
pub fn nodes_along(size: DVec3, spacing: f64) -> [u32; 2] {
    [size.x, size.z].map(|length| (length / spacing).ceil().max(1.0) as u32 + 1)
}

impl Edges {
    /// Measures the water of particles at `positions`, metres from the box's least corner, with
    /// `spacing` metres between neighbours at rest. Water counts from the floor up to the first gap
    /// of one particle spacing of air; spray above it does not count.
    pub fn new(positions: &[DVec3], size: DVec3, spacing: f64) -> Self {
        let near = REACH * spacing;
        let is_near = |p: &&DVec3| {
            let from = p.min(size - **p);
            from.x.min(from.z) < near
        };
        let beside: Vec<DVec3> = positions.iter().filter(is_near).copied().collect();
        let top = beside.iter().fold(0.0, |top: f64, p| top.max(p.y)) + near;
        let nodes = nodes_along(size, spacing);
        let kernels = Kernels::fit(&beside, size, spacing);
        let field = kernels.field();
        let column = |at: DVec2| {
            let wet = |y: f64| field.value(DVec3::new(at.x, y, at.y)) > 0.0;
            let step = spacing / LOOKS;
            let (mut last, mut air, mut y) = (None, 0, 0.5 * step);
            while y < top && f64::from(air) <= LOOKS {
                match wet(y) {
                    true => (last, air) = (Some(y), 0),
                    false => air += 1,
                }
                y += step;
            }
            let Some(mut low) = last else {
                return 0.0;
            };
            let mut high = low + step;
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                match wet(middle) {
                    true => low = middle,
                    false => high = middle,
                }
            }
            0.5 * (low + high) as f32
        };
        let places: Vec<DVec2> = places(size, nodes).collect();
        Self {
            nodes,
            heights: parallel::map_slice(&places, |&place| column(place)),
        }
    }
}

/// Positions of the nodes in plan, in the order of the heights.
fn places(size: DVec3, [nx, nz]: [u32; 2]) -> impl Iterator<Item = DVec2> {
    let along = |k: u32, n: u32, length: f64| length * f64::from(k) / f64::from(n - 1);
    let across = [0.0, size.x]
        .into_iter()
        .flat_map(move |x| (0..nz).map(move |k| DVec2::new(x, along(k, nz, size.z))));
    let beside = [0.0, size.z]
        .into_iter()
        .flat_map(move |z| (0..nx).map(move |k| DVec2::new(along(k, nx, size.x), z)));
    across.chain(beside)
}

#[cfg(test)]
mod tests {
    use super::*;

    const D: f64 = 0.1;
    const SIZE: DVec3 = DVec3::new(3.0, 2.0, 2.0);

    /// A tank whose level rises along x, with a drop in flight over one side.
    fn tank(slope: f64) -> Vec<DVec3> {
        let place = |k: usize| (k as f64 + 0.5) * D;
        let mut all = Vec::new();
        for x in 0..30 {
            let level = 1.0 + slope * (place(x) - 0.5 * SIZE.x);
            // Layers are compressed or stretched so that the topmost lies half a layer below
            // the level.
            let layers = 10;
            for (y, z) in (0..layers).flat_map(|y| (0..20).map(move |z| (y, z))) {
                let height = (y as f64 + 0.5) * level / f64::from(layers);
                all.push(DVec3::new(place(x), height, place(z)));
            }
        }
        all.push(DVec3::new(0.05, 1.8, 1.0));
        all
    }

    #[test]
    fn a_level_is_found_at_every_side_below_what_flies() {
        let edges = Edges::new(&tank(0.0), SIZE, D);
        assert_eq!(edges.nodes, [31, 21]);
        assert_eq!(edges.heights.len(), 2 * (31 + 21));
        // The field is calibrated so that its mean over a lattice cell is zero at the level; within
        // a cell it varies.
        assert!(
            edges
                .heights
                .iter()
                .all(|h| (h - 1.0).abs() < 0.02 * D as f32),
            "{:?}",
            edges.heights
        );
    }

    #[test]
    fn a_slope_is_followed_along_the_sides() {
        let edges = Edges::new(&tank(0.1), SIZE, D);
        let of = |x: f64| 1.0 + 0.1 * (x - 0.5 * SIZE.x);
        let worst = |offset: f64| {
            let places = places(SIZE, edges.nodes).zip(&edges.heights);
            // The sides are mirrors, so that a slope is level there: within a kernel's reach it
            // differs from the tank's.
            let inner = places.filter(|(p, _)| (0.3..=SIZE.x - 0.3).contains(&p.x));
            inner
                .map(|(p, &h)| (f64::from(h) - of(p.x) - offset).abs())
                .fold(0.0, f64::max)
        };
        // Layers are up to 14 % closer together or farther apart than the lattice's, and the
        // surface is half a layer above the outermost: 0.07 spacings.
        assert!(worst(0.0) < 0.1 * D, "{}", worst(0.0));
        assert!(worst(0.2 * D) > 0.1 * D, "the control: 0.2 spacings off");
    }

    #[test]
    fn dry_sides_have_no_height() {
        let edges = Edges::new(&[], SIZE, D);
        assert!(edges.heights.iter().all(|&h| h == 0.0));
        let middle = [DVec3::new(1.5, 0.5, 1.0)];
        assert!(
            Edges::new(&middle, SIZE, D)
                .heights
                .iter()
                .all(|&h| h == 0.0)
        );
    }
}
