//! Pressure at a point from the projection's cells.

use glam::DVec3;

use super::{
    bricks::{Bricks, CELLS, EDGE},
    poisson::{AIR, FLUID, SOLID},
};

/// Fields of a substep.
pub struct Gauge<'a> {
    /// Where the elements lie.
    pub bricks: &'a Bricks,
    /// Of the domain, along each axis.
    pub cells: [u32; 3],
    /// Metres.
    pub cell_size: f64,
    /// [`AIR`], [`FLUID`] or [`SOLID`], by element.
    pub kind: &'a [u32],
    /// By element, Pa.
    pub pressure: &'a [f64],
}

impl Gauge<'_> {
    /// Trilinear between cell centres; `local` is relative to the domain's least corner, metres. `None` where the
    /// point's cell holds no water. Air counts as 0 Pa; beyond a wall or in a solid the field goes on straight from the
    /// point's cell and the one opposite, so that a linear pressure is met up to the wall.
    pub fn at(&self, local: DVec3) -> Option<f64> {
        let scaled = local / self.cell_size;
        let own: [i64; 3] = std::array::from_fn(|axis| {
            let last = i64::from(self.cells[axis]) - 1;
            (scaled[axis].floor() as i64).clamp(0, last)
        });
        let (FLUID, here) = self.cell(own) else {
            return None;
        };
        let first = (scaled - 0.5).floor();
        let part = scaled - 0.5 - first;
        let mut sum = 0.0;
        for corner in 0..8usize {
            let bit: [usize; 3] = std::array::from_fn(|axis| corner >> axis & 1);
            let cell: [i64; 3] = std::array::from_fn(|axis| first[axis] as i64 + bit[axis] as i64);
            let weights = (0..3).map(|axis| [1.0 - part[axis], part[axis]][bit[axis]]);
            let value = match self.cell(cell) {
                (FLUID, p) => p,
                (AIR, _) => 0.0,
                _ => match self.cell(std::array::from_fn(|axis| 2 * own[axis] - cell[axis])) {
                    (FLUID, opposite) => 2.0 * here - opposite,
                    _ => here,
                },
            };
            sum += weights.product::<f64>() * value;
        }
        Some(sum)
    }

    /// Kind and pressure of a cell; what is outside of the domain is solid.
    fn cell(&self, cell: [i64; 3]) -> (u32, f64) {
        let is_inside = (0..3).all(|axis| (0..i64::from(self.cells[axis])).contains(&cell[axis]));
        if !is_inside {
            return (SOLID, 0.0);
        }
        let cell = cell.map(|c| c as u32);
        let dims = self.bricks.table_dims;
        let [x, y, z] = cell.map(|c| c / EDGE);
        let slot = self.bricks.table[((z * dims[1] + y) * dims[0] + x) as usize];
        let [x, y, z] = cell.map(|c| c % EDGE);
        let element = (CELLS * slot + x + EDGE * (y + EDGE * z)) as usize;
        (self.kind[element], self.pressure[element])
    }
}
