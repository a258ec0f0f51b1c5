//! Interpolation of pressure from the cells of the projection.

use glam::DVec3;

use super::{
    bricks::{Bricks, CELLS, EDGE},
    poisson::{AIR, FLUID},
};

/// Fields of a substep from which a pressure is read.
pub struct Gauge<'a> {
    /// Layout of the elements.
    pub bricks: &'a Bricks,
    /// Cells of the domain along each axis.
    pub cells: [u32; 3],
    /// Edge length of a cell, metres.
    pub cell_size: f64,
    /// [`AIR`], [`FLUID`] or [`SOLID`](super::poisson::SOLID) for each element.
    pub kind: &'a [u32],
    /// Whether an element's centre lies within a wall or a solid.
    pub is_buried: &'a [bool],
    /// Pressure of each element, Pa.
    pub pressure: &'a [f64],
    /// Velocity that the substep removed at each element's three lower faces, divided by the
    /// substep's length, m/s². Together with gravity it is the effect of the pressure, or of the
    /// wall at a closed face.
    pub taken: &'a [[f32; 3]],
    /// Density of water, kg/m³.
    pub density: f64,
    /// Pressure gradient of water at rest, ρ g, Pa/m.
    pub rise: DVec3,
}

/// A cell.
#[derive(Clone, Copy)]
enum CellState {
    /// Its pressure, Pa.
    Water(f64),
    /// Water whose centre lies within a wall or a solid, and the projection's pressure there, Pa.
    Buried(f64),
    Air,
    Solid,
}

/// Purpose of a reading, which decides how the field is extrapolated.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Reading {
    /// The water's own pressure, extended up to walls and solids as in water at rest. The
    /// projection's pressure in a cell whose centre lies within them turns the water within a thin
    /// part of a cell (a wave that hit a face had 19 kPa in a sliver and 10 kPa half a cell off),
    /// so the neighbouring cells are used instead.
    Field,
    /// The pressure that stops the water at a surface, so that all of the water's momentum enters
    /// the force on it: from one cell to the next, pressure rises by what the face between them
    /// removes from the water.
    Load,
}

impl CellState {
    /// Pressure of water that is not buried.
    fn water(self) -> Option<f64> {
        match self {
            Self::Water(pressure) => Some(pressure),
            _ => None,
        }
    }
}

/// Result of a reading at a point.
enum Found {
    /// Its pressure, Pa.
    Water(f64),
    Air,
    Solid,
}

/// Tolerance for points beyond the domain due to rounding, in cells.
const ON_FACE: f64 = 1e-6;

/// Offsets from a surface at which pressure is read, in cells: first just on its water side, then
/// farther out of a solid that is coarser than the cells.
const OFF_FACE: [f64; 4] = [1e-3, 0.5, 1.0, 1.5];

impl Gauge<'_> {
    /// Returns the pressure at a point, Pa, trilinear between cell centres; `None` if the point's
    /// cell holds no water. `local` is relative to the domain's least corner, metres. Air counts as
    /// 0 Pa.
    ///
    /// Beyond a wall or in a solid the field is extrapolated from the water cells beside it as in
    /// water at rest, ∂p/∂n = ρ g·n, the condition that a still wall imposes. A pressure that is
    /// linear along a wall and rises by ρ g is thus exact up to the wall; at a wall parallel to
    /// gravity, the pressure equals that half a cell off.
    pub fn at(&self, local: DVec3) -> Option<f64> {
        match self.look(local, Reading::Field) {
            Found::Water(pressure) => Some(pressure),
            Found::Air | Found::Solid => None,
        }
    }

    /// Returns the pressure on a surface, Pa, whose unit `normal` points into the water; 0 where
    /// there is none. Beyond the surface the field is extrapolated by what the face between removes
    /// from the water, ∂p/∂n = ρ (g·n + removed acceleration). At a closed face this is the
    /// boundary condition of the projection; without it, a wall bears only 0.7 of the force of a
    /// jet four cells wide.
    pub fn on_face(&self, local: DVec3, normal: DVec3) -> f64 {
        for off in OFF_FACE {
            let way = off * self.cell_size * normal;
            match self.look(local + way, Reading::Load) {
                Found::Water(pressure) => return pressure - self.rise.dot(way),
                Found::Air => return 0.0,
                Found::Solid => {}
            }
        }
        0.0
    }

    fn look(&self, local: DVec3, reading: Reading) -> Found {
        let scaled = local / self.cell_size;
        let room = DVec3::from_array(self.cells.map(f64::from));
        if scaled.cmplt(DVec3::splat(-ON_FACE)).any() || scaled.cmpgt(room + ON_FACE).any() {
            return Found::Solid;
        }
        let own: [i64; 3] = std::array::from_fn(|axis| {
            let last = i64::from(self.cells[axis]) - 1;
            (scaled[axis].floor() as i64).clamp(0, last)
        });
        let own = match self.cell(own, reading) {
            CellState::Water(pressure) | CellState::Buried(pressure) => pressure,
            CellState::Air => return Found::Air,
            CellState::Solid => return Found::Solid,
        };
        let first = (scaled - 0.5).floor();
        let part = scaled - 0.5 - first;
        let place = |corner: usize| -> [i64; 3] {
            std::array::from_fn(|axis| first[axis] as i64 + (corner >> axis & 1) as i64)
        };
        let around: [CellState; 8] =
            std::array::from_fn(|corner| self.cell(place(corner), reading));
        let weight = |corner: usize| -> f64 {
            (0..3)
                .map(|axis| [1.0 - part[axis], part[axis]][corner >> axis & 1])
                .product()
        };
        let last = (reading == Reading::Load).then(|| place(7));
        let beyond = |corner: usize| self.beyond(&around, corner, last);
        let value = |corner: usize| match around[corner] {
            CellState::Water(pressure) => pressure,
            CellState::Air => 0.0,
            // Without a water cell whose centre is in the open, the buried cells' own pressures
            // have to do.
            CellState::Buried(pressure) => beyond(corner).unwrap_or(pressure),
            CellState::Solid => beyond(corner).unwrap_or(own),
        };
        Found::Water((0..8).map(|corner| weight(corner) * value(corner)).sum())
    }

    /// Extrapolates into a solid or buried cell among eight: the mean over the water cells that are
    /// the fewest axis steps away; `None` if there are none. If `last` gives the cell with the
    /// greatest coordinates of the eight, what the faces remove counts as well.
    fn beyond(
        &self,
        around: &[CellState; 8],
        corner: usize,
        last: Option<[i64; 3]>,
    ) -> Option<f64> {
        let steps = |other: usize| (corner ^ other).count_ones();
        let water = || (0..8).filter_map(|other| Some((other, around[other].water()?)));
        let nearest = water().map(|(other, _)| steps(other)).min()?;
        let (mut sum, mut count) = (0.0, 0.0);
        for (other, pressure) in water().filter(|&(other, _)| steps(other) == nearest) {
            let bit = |of: usize, axis: usize| (of >> axis & 1) as f64;
            let way = DVec3::from_array([0, 1, 2].map(|axis| bit(corner, axis) - bit(other, axis)));
            let mut slope = self.rise;
            if let (1, Some(last)) = (nearest, last) {
                // The face between two cells is the lower face of the greater one.
                let axis = (corner ^ other).trailing_zeros() as usize;
                let upper = corner | other;
                let cell = |axis: usize| last[axis] - 1 + (upper >> axis & 1) as i64;
                slope[axis] += self.density * self.taken_at(std::array::from_fn(cell), axis);
            }
            sum += pressure + self.cell_size * slope.dot(way);
            count += 1.0;
        }
        Some(sum / count)
    }

    /// Acceleration that the lower face of a cell removes, m/s².
    fn taken_at(&self, cell: [i64; 3], axis: usize) -> f64 {
        let element = self.element(self.bricks.wrapped(cell));
        element.map_or(0.0, |element| f64::from(self.taken[element][axis]))
    }

    /// Element of a cell; `None` beyond the bricks.
    fn element(&self, cell: [i64; 3]) -> Option<usize> {
        let dims = self.bricks.table_dims;
        let edge = i64::from(EDGE);
        let is_there = |axis: usize| (0..i64::from(dims[axis]) * edge).contains(&cell[axis]);
        if !(0..3).all(is_there) {
            return None;
        }
        let cell = cell.map(|c| c as u32);
        let [x, y, z] = cell.map(|c| c / EDGE);
        let slot = self.bricks.table[((z * dims[1] + y) * dims[0] + x) as usize];
        let [x, y, z] = cell.map(|c| c % EDGE);
        Some((CELLS * slot + x + EDGE * (y + EDGE * z)) as usize)
    }

    /// Cells outside of the domain are solid.
    fn cell(&self, cell: [i64; 3], reading: Reading) -> CellState {
        let cell = self.bricks.wrapped(cell);
        let is_inside = (0..3).all(|axis| (0..i64::from(self.cells[axis])).contains(&cell[axis]));
        let element = self.element(cell).filter(|_| is_inside);
        let Some(element) = element else {
            return CellState::Solid;
        };
        let is_buried = self.is_buried[element];
        match self.kind[element] {
            FLUID if is_buried => CellState::Buried(self.pressure[element]),
            FLUID => CellState::Water(self.pressure[element]),
            // Behind a surface there is no air.
            AIR if reading == Reading::Field || !is_buried => CellState::Air,
            _ => CellState::Solid,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::poisson::SOLID;

    /// Passes `look` the gauge of a box of 8 × 8 × 8 cells with water below cell 6 and air above.
    fn with_gauge<T>(
        rise: DVec3,
        field: impl Fn(DVec3) -> f64,
        look: impl FnOnce(&Gauge<'_>) -> T,
    ) -> T {
        with_gauge_of(|_| false, still, rise, field, look)
    }

    fn still(_: DVec3) -> DVec3 {
        DVec3::ZERO
    }

    /// Same, with cells buried where `buried` says so of their centres, and lower faces that remove
    /// `stopped`, m/s².
    fn with_gauge_of<T>(
        buried: impl Fn(DVec3) -> bool,
        stopped: impl Fn(DVec3) -> DVec3,
        rise: DVec3,
        field: impl Fn(DVec3) -> f64,
        look: impl FnOnce(&Gauge<'_>) -> T,
    ) -> T {
        let bricks = Bricks::new([8; 3], &[true], 0, 1);
        let cell_size = 0.25;
        let elements = bricks.slots() * CELLS as usize;
        let (mut kind, mut pressure) = (vec![SOLID; elements], vec![0.0; elements]);
        let mut all_taken = vec![[0.0; 3]; elements];
        let mut is_buried = vec![false; elements];
        for element in CELLS..2 * CELLS {
            let center = cell_size * (DVec3::from_array(bricks.cell(element).map(f64::from)) + 0.5);
            let is_water = center.y < 6.0 * cell_size;
            kind[element as usize] = if is_water { FLUID } else { AIR };
            pressure[element as usize] = if is_water { field(center) } else { 0.0 };
            is_buried[element as usize] = buried(center);
            all_taken[element as usize] = stopped(center).as_vec3().to_array();
        }
        let gauge = Gauge {
            bricks: &bricks,
            cells: [8; 3],
            cell_size,
            kind: &kind,
            is_buried: &is_buried,
            pressure: &pressure,
            taken: &all_taken,
            density: 1000.0,
            rise,
        };
        look(&gauge)
    }

    /// Readings of a pressure that rises by `slope` as in water at rest.
    fn at(slope: DVec3, places: &[DVec3]) -> Vec<Option<f64>> {
        let field = |center| 40.0 + slope.dot(center);
        with_gauge(slope, field, |gauge| {
            places.iter().map(|&place| gauge.at(place)).collect()
        })
    }

    /// A linear pressure is reproduced to rounding between centres and up to walls and corners.
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

    /// cos(π x / 2 m), flat at the wall at x = 0, under gravity along y. The pressure half a cell
    /// off the wall equals that at the wall. Between centres the error is that of the curvature,
    /// (Δx)² p″ / 8, and at the wall as much. Surface readings agree with point readings after the
    /// step back along the normal.
    #[test]
    fn at_a_wall_stands_what_stands_half_a_cell_off() {
        let (k, rise) = (0.5 * std::f64::consts::PI, DVec3::new(0.0, -20.0, 0.0));
        let field = |x: DVec3| 100.0 * (k * x.x).cos() + rise.dot(x);
        let bent = 100.0 * (0.25 * k).powi(2) / 8.0;
        with_gauge(rise, field, |gauge| {
            let wall = DVec3::new(0.0, 0.7, 1.0);
            let off = DVec3::new(0.125, 0.7, 1.0);
            let found = gauge.at(wall).unwrap();
            assert!((found - gauge.at(off).unwrap()).abs() < 1e-12);
            assert!((found - field(wall)).abs() < 1.01 * bent, "{found}");
            // Offset by a thousandth of a cell.
            assert!((gauge.on_face(wall, DVec3::X) - found).abs() < 1e-2);
            // The pressure on the floor is the weight above it.
            let floor = DVec3::new(0.6, 0.0, 1.0);
            let found = gauge.on_face(floor, DVec3::Y);
            assert!((found - field(floor)).abs() < 1.01 * bent, "{found}");
            // Negative control: without gravity it is less.
            let less = gauge.at(DVec3::new(0.6, 0.125, 1.0)).unwrap();
            assert!((less - field(floor)).abs() > 2.0, "{less}");
            // Air exerts no pressure, and there is none beyond the box.
            assert_eq!(gauge.on_face(DVec3::new(0.0, 1.7, 1.0), DVec3::X), 0.0);
            assert_eq!(gauge.on_face(floor, -DVec3::Y), 0.0);
        });
    }

    /// A jet that a wall at x = 0 stops: p = ½ ρ v² − ½ ρ (a x)² beside the wall, where water moves
    /// at a x towards it and the wall's face stops it at a rate s. Half a cell off the wall the
    /// pressure is that of the cell; at the wall it is ρ s Δx / 2 higher.
    #[test]
    fn what_a_wall_stops_presses_on_it() {
        let stops = DVec3::new(-3.0, 0.0, 0.0);
        let on_wall = |x: DVec3| if x.x < 0.25 { stops } else { DVec3::ZERO };
        let wall = DVec3::new(0.0, 0.7, 1.0);
        let look = |gauge: &Gauge<'_>| {
            let inside = gauge.at(DVec3::new(0.125, 0.7, 1.0)).unwrap();
            [
                inside,
                gauge.at(wall).unwrap(),
                gauge.on_face(wall, DVec3::X),
            ]
        };
        let [inside, at, on] = with_gauge_of(|_| false, on_wall, DVec3::ZERO, |_| 40.0, look);
        assert!((inside - 40.0).abs() < 1e-9, "{inside}");
        // The field reading continues as in water at rest.
        assert!((at - 40.0).abs() < 1e-9, "{at}");
        let expected = 40.0 + 1000.0 * 3.0 * 0.125;
        // Offset by a thousandth of a cell.
        assert!((on - expected).abs() < 1000.0 * 3.0 * 0.25 * 1.1e-3, "{on}");
        // Negative controls: open faces stop nothing, and a wall that stops nothing bears the
        // cell's pressure.
        let open = |x: DVec3| if x.x > 0.25 { stops } else { DVec3::ZERO };
        for found in with_gauge_of(|_| false, open, DVec3::ZERO, |_| 40.0, look) {
            assert!((found - 40.0).abs() < 1e-9, "{found}");
        }
    }

    /// A wall at 0.2 m, beyond the centres of the first cells. The projection's pressure there is
    /// ignored, both on the wall and in the open part of these cells; the pressure of the next
    /// cells extends to the wall as in water at rest.
    #[test]
    fn what_is_buried_does_not_count() {
        let slope = DVec3::new(3.0, -20.0, 5.0);
        let wall = |x: DVec3| x.x < 0.2;
        let field = |x: DVec3| 40.0 + slope.dot(x) + if wall(x) { 1e3 } else { 0.0 };
        let places = [DVec3::new(0.2, 0.9, 1.0), DVec3::new(0.3, 0.7, 1.1)];
        with_gauge_of(wall, still, slope, field, |gauge| {
            for place in places {
                let expected = 40.0 + slope.dot(place);
                let found = gauge.at(place).unwrap();
                assert!((found - expected).abs() < 1e-12, "{place}: {found}");
            }
        });
        // A load reading does use what the cell's face removes, 4 Pa per cell: the surface lies at
        // 0.8 of the first cell, 0.7 of a cell before the next centre.
        let takes = |x: DVec3| DVec3::X * if x.x < 0.5 { -0.016 } else { 0.0 };
        with_gauge_of(wall, takes, slope, field, |gauge| {
            let expected = 40.0 + slope.dot(places[0]) + 0.7 * 4.0;
            let found = gauge.on_face(places[0], DVec3::X);
            assert!((found - expected).abs() < 0.01, "{found} {expected}");
        });
        // Negative control: an unburied cell's pressure would show.
        with_gauge(slope, field, |gauge| {
            assert!(gauge.at(places[0]).unwrap() > 500.0);
        });
        // If every cell is buried, their pressures are used.
        with_gauge_of(
            |_| true,
            still,
            slope,
            field,
            |gauge| {
                let found = gauge.at(places[1]).unwrap();
                assert!(found > 40.0 && found < 1100.0, "{found}");
            },
        );
    }

    /// By hand: from 12 Pa at the last water centre, 1.375 m up, to zero at the air centre one
    /// cell above.
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
