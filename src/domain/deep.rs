//! Water without particles: cells in the depth of a body of water whose particles lie only in a
//! band below the free surface (narrow-band FLIP, Ferstl et al. 2016).

use glam::{DVec3, Vec3};

use super::{
    bricks::{CELLS, EDGE, table_dims},
    parallel,
};

/// Ids of particles that stand for deep cells begin here; those of others are below it.
pub const FILLED: u32 = 1 << 31;

/// Grid that the band is measured on. All of it is 0 in a state whose particles are everywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeepGrid {
    /// Least corner of cell (0, 0, 0), metres, in the coordinates of the particles.
    pub origin: DVec3,
    /// Edge of a cell, metres.
    pub cell_size: f64,
    /// Cells of the domain along each axis.
    pub cells: [u32; 3],
    /// Particles along the edge of a full cell.
    pub per_edge: u32,
    /// Depth of the band, cells: a cell that is deeper holds its water without particles.
    pub band: u32,
}

/// Cells near and in the depth, in the order of [`order`].
///
/// A cell deeper than the band is full of water. What particles are left in it do not count: it
/// stands for a lattice of `per_edge`³ of them. Cells up to three cells less deep are listed too,
/// for depths and velocities between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Deep {
    /// The grid.
    pub grid: DeepGrid,
    /// Indices of the cells.
    pub cell: Vec<[u32; 3]>,
    /// Depth of each cell's centre below the free surface, cells.
    pub depth: Vec<f32>,
    /// Velocity on the least faces of each cell, each component on its own, m/s.
    pub velocity: Vec<[f32; 3]>,
}

/// Sort key of a cell: bricks of 8³ cells with x fastest, and in them cells likewise.
pub fn order(cell: [u32; 3]) -> [u32; 6] {
    let [x, y, z] = cell;
    [z / EDGE, y / EDGE, x / EDGE, z % EDGE, y % EDGE, x % EDGE]
}

impl DeepGrid {
    /// Returns the particles of a full cell.
    pub fn per_cell(&self) -> u32 {
        self.per_edge.pow(3)
    }

    /// Returns how many ids particles need that stand for cells.
    pub fn ids(&self) -> u64 {
        let bricks = table_dims(self.cells).map(u64::from);
        let cells = u64::from(CELLS) * bricks.iter().product::<u64>();
        cells.saturating_mul(self.per_cell().into())
    }

    /// Returns the id of the first particle that stands for a cell; ids ascend in the order of
    /// [`order`].
    pub(crate) fn first_id(&self, cell: [u32; 3]) -> u32 {
        let [nx, ny, _] = table_dims(self.cells);
        let [bz, by, bx, z, y, x] = order(cell);
        let brick = (bz * ny + by) * nx + bx;
        let local = (z * EDGE + y) * EDGE + x;
        FILLED + (brick * CELLS + local) * self.per_cell()
    }

    /// Returns the cell that holds a position, if it is not below the grid.
    pub fn cell_of(&self, position: [f32; 3]) -> Option<[u32; 3]> {
        let at = (Vec3::from_array(position).as_dvec3() - self.origin) / self.cell_size;
        let is_inside = at.min_element() >= 0.0 && at.max_element() < f64::from(u32::MAX);
        is_inside.then(|| at.to_array().map(|x| x as u32))
    }
}

impl Deep {
    /// Returns whether there is no such cell.
    pub fn is_empty(&self) -> bool {
        self.cell.is_empty()
    }

    /// Returns how many cells hold their water without particles.
    pub fn count(&self) -> usize {
        let band = self.grid.band as f32;
        self.depth.iter().filter(|depth| **depth > band).count()
    }

    /// Returns the index of a cell.
    fn find(&self, cell: [u32; 3]) -> Option<usize> {
        let key = order(cell);
        self.cell.binary_search_by_key(&key, |it| order(*it)).ok()
    }

    /// Returns whether a position lies in a cell that holds its water without particles.
    pub fn holds(&self, position: [f32; 3]) -> bool {
        let found = (self.grid.cell_of(position)).and_then(|cell| self.find(cell));
        found.is_some_and(|k| self.depth[k] > self.grid.band as f32)
    }

    /// Returns the velocities on both faces of a cell along each axis, m/s; without a cell beyond
    /// the greater one, that of the least.
    pub(crate) fn faces(&self, index: usize) -> [[f32; 2]; 3] {
        let low = self.velocity[index];
        std::array::from_fn(|axis| {
            let mut beside = self.cell[index];
            beside[axis] += 1;
            let high = self.find(beside).map(|k| self.velocity[k][axis]);
            [low[axis], high.unwrap_or(low[axis])]
        })
    }

    /// Returns the velocity at the centre of a cell, m/s.
    fn velocity_at_centre(&self, index: usize) -> DVec3 {
        let mean = |[low, high]: [f32; 2]| 0.5 * (f64::from(low) + f64::from(high));
        DVec3::from_array(self.faces(index).map(mean))
    }

    /// Returns the centre of a cell, metres.
    fn centre(&self, index: usize) -> DVec3 {
        let middle = DVec3::from_array(self.cell[index].map(|k| f64::from(k) + 0.5));
        self.grid.origin + self.grid.cell_size * middle
    }

    /// Returns position and velocity at the centre of each cell that holds its water without
    /// particles; metres, m/s.
    pub fn centres(&self) -> Vec<[DVec3; 2]> {
        let band = self.grid.band as f32;
        parallel::flat_map(0..self.cell.len(), |k| {
            (self.depth[k] > band).then(|| [self.centre(k), self.velocity_at_centre(k)])
        })
    }

    /// Returns the first problem of a state read from a file, if there is one.
    pub fn fault(&self) -> Option<String> {
        let n = self.cell.len();
        if self.depth.len() != n || self.velocity.len() != n {
            let (depths, velocities) = (self.depth.len(), self.velocity.len());
            return Some(format!(
                "{n} deep cells, {depths} depths, {velocities} velocities"
            ));
        }
        let mut pairs = self.cell.windows(2);
        let wrong = pairs.position(|two| order(two[0]) >= order(two[1]));
        if let Some(k) = wrong {
            return Some(format!("deep cell {:?} is out of order", self.cell[k + 1]));
        }
        let is_bad = |k: &usize| {
            let v = self.velocity[*k];
            !(self.depth[*k].is_finite() && v.iter().all(|x| x.is_finite()))
        };
        let bad = (0..n).find(is_bad)?;
        Some(format!(
            "deep cell {:?} has a value that is not finite",
            self.cell[bad]
        ))
    }
}
