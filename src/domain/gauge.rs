//! Pressure at a point from the projection's cells.

use glam::DVec3;

use super::{
    bricks::{Bricks, CELLS, EDGE},
    poisson::{AIR, FLUID, SOLID},
};

/// The fields of a substep that a pressure is read from.
pub struct Gauge<'a> {
    /// Layout of the elements.
    pub bricks: &'a Bricks,
    /// Cells of the domain along each axis.
    pub cells: [u32; 3],
    /// Metres.
    pub cell_size: f64,
    /// [`AIR`], [`FLUID`] or [`SOLID`], by element.
    pub kind: &'a [u32],
    /// Pressure of each element, Pa.
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
        let cell = self.bricks.wrapped(cell);
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A box of 8 × 8 × 8 cells with water below cell 6 and air above; the pressure is linear.
    fn at(slope: DVec3, places: &[DVec3]) -> Vec<Option<f64>> {
        let bricks = Bricks::new([8; 3], &[true], 0, 1);
        let cell_size = 0.25;
        let elements = bricks.slots() * CELLS as usize;
        let (mut kind, mut pressure) = (vec![SOLID; elements], vec![0.0; elements]);
        for element in CELLS..2 * CELLS {
            let center = cell_size * (DVec3::from_array(bricks.cell(element).map(f64::from)) + 0.5);
            let is_water = center.y < 6.0 * cell_size;
            kind[element as usize] = if is_water { FLUID } else { AIR };
            pressure[element as usize] = if is_water {
                40.0 + slope.dot(center)
            } else {
                0.0
            };
        }
        let gauge = Gauge {
            bricks: &bricks,
            cells: [8; 3],
            cell_size,
            kind: &kind,
            pressure: &pressure,
        };
        places.iter().map(|&place| gauge.at(place)).collect()
    }

    /// A linear pressure comes back to rounding between centres and up to walls and corners.
    #[test]
    fn a_linear_pressure_is_met_up_to_the_walls() {
        let slope = DVec3::new(3.0, -20.0, 5.0);
        let places = [
            DVec3::splat(0.9),
            DVec3::new(0.0, 0.7, 1.93),
            DVec3::new(2.0, 0.0, 0.0),
            DVec3::new(0.31, 1.2, 1.999),
        ];
        for (found, place) in at(slope, &places).into_iter().zip(places) {
            let expected = 40.0 + slope.dot(place);
            assert!(
                (found.unwrap() - expected).abs() < 1e-12,
                "{place}: {found:?}"
            );
        }
    }

    /// By hand: from 12 Pa at the last centre of water, 1.375 m up, to none at the centre of air a cell above.
    #[test]
    fn air_is_no_pressure_and_no_water_none() {
        let slope = DVec3::new(0.0, -28.0 / 1.375, 0.0);
        let places = [1.375, 1.45, 1.49, 1.51].map(|y| DVec3::new(1.0, y, 1.0));
        let found = at(slope, &places);
        for (found, expected) in found.iter().zip([12.0, 12.0 * 0.7, 12.0 * 0.54]) {
            assert!(
                (found.unwrap() - expected).abs() < 1e-12,
                "{found:?} {expected}"
            );
        }
        assert_eq!(found[3], None);
    }
}
