//! Linear system of the pressure on sparse bricks, in double precision: the reference for the
//! GPU's rows.
//!
//! For each cell of water, Σ f (q − q') over its six faces = b, with f the face's open fraction
//! (Batty et al. 2007). In air, q' is 0 at the air cell's centre, or where the surface crosses the
//! line to it (ghost fluid, Enright et al. 2003). Rows are not scaled: an open face has
//! coefficient 1.

pub mod cases;

use rayon::prelude::*;

use super::{
    body::{Six, dot, product},
    bricks::{Bricks, CELLS, EDGE},
};

/// Kind of a cell without water.
pub const AIR: u32 = 0;
/// Kind of a cell of water.
pub const FLUID: u32 = 1;
/// Kind of a cell without open volume; its faces have fraction 0.
pub const SOLID: u32 = 2;

/// Smallest fraction of the distance to air at which the surface may lie: smaller ones make the row
/// ever stiffer for a pressure ever closer to 0.
pub const LEAST_THETA: f64 = 0.01;

/// Largest such fraction, where the surface lies beyond the air cell, above a floor that is higher
/// than that cell's centre: the pressure there is nearly that of the water.
pub const MOST_THETA: f64 = 100.0;

/// Marks the absence of a row.
pub const NONE: u32 = u32::MAX;

/// Rows per parallel task.
const GRAIN: usize = 4096;

/// Input of a system, in f32 as on the GPU or in f64. Arrays are indexed by element,
/// `512 slot + local`, slot 0 included.
#[derive(Clone, Copy, Debug)]
pub struct Cells<'a, T = f32> {
    /// Layout of the elements.
    pub bricks: &'a Bricks,
    /// [`AIR`], [`FLUID`] or [`SOLID`]; only wet bricks hold water.
    pub kind: &'a [u32],
    /// Open fractions of the lower faces, 0..1: three planes of the length of `kind`.
    pub open: &'a [T],
    /// Distance to the surface at cell centres, negative inside, in any unit; `None` for a surface
    /// at the air cells' centres.
    pub distance: Option<&'a [T]>,
}

impl<T: Copy + Into<f64>> Cells<'_, T> {
    /// Returns the element of the neighbour in direction `k` (−x, +x, −y, +y, −z, +z); it lies in
    /// slot 0 if there is none.
    pub fn neighbor(&self, element: u32, k: usize) -> u32 {
        let (slot, local) = (element / CELLS, element % CELLS);
        let (axis, is_up) = (k / 2, k % 2 == 1);
        let step = EDGE.pow(axis as u32);
        let at = local / step % EDGE;
        let is_inside = if is_up { at + 1 < EDGE } else { at > 0 };
        if is_inside {
            return if is_up {
                element + step
            } else {
                element - step
            };
        }
        let side = 3usize.pow(axis as u32);
        let brick = if is_up { 13 + side } else { 13 - side };
        let other = self.bricks.records[slot as usize].neighbors[brick];
        let across = if is_up {
            local - at * step
        } else {
            local + (EDGE - 1) * step
        };
        CELLS * other + across
    }

    /// Returns the index into `open` of the face in direction `k`.
    pub fn face(&self, element: u32, k: usize) -> usize {
        let owner = if k % 2 == 1 {
            self.neighbor(element, k)
        } else {
            element
        };
        k / 2 * self.kind.len() + owner as usize
    }

    /// Returns θ: the fraction of the distance from the cell `water` to the cell `air` at which the
    /// surface lies.
    pub fn theta(&self, water: u32, air: u32) -> f64 {
        let Some(distance) = self.distance else {
            return 1.0;
        };
        let inside = (-distance[water as usize].into()).max(0.0);
        let outside = distance[air as usize].into();
        if inside + outside > 0.0 {
            (inside / (inside + outside)).clamp(LEAST_THETA, MOST_THETA)
        } else {
            MOST_THETA
        }
    }
}

/// The linear system, with one row per cell of water that has an open face.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct System {
    /// Element of each row.
    pub cell: Vec<u32>,
    /// Part of the diagonal due to air, Σ f/θ.
    pub dirichlet: Vec<f64>,
    /// Diagonal of the matrix.
    pub diagonal: Vec<f64>,
    /// Rows of the neighbours, −x, +x, −y, +y, −z, +z; [`NONE`] without a common open face
    /// to water.
    pub neighbor: Vec<[u32; 6]>,
    /// Open fractions of the faces to these neighbours, 0..1; the matrix holds their negatives.
    pub coefficient: Vec<[f64; 6]>,
    /// Elements of water without an open face.
    pub dropped: Vec<u32>,
    /// Bodies that the pressure moves: the matrix holds J^T R J of each.
    pub bodies: Vec<Coupling>,
}

/// A body that the pressure moves (Batty, Bertails and Bridson 2007).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coupling {
    /// Rows of cells that its surface cuts.
    pub row: Vec<u32>,
    /// J: how the pressure of each of these cells pushes it, and how its velocities push water out
    /// of the cell; area over Δx², then moment about its centre of mass over Δx², metres.
    pub push: Vec<Six>,
    /// R: the change of its velocities for each sum of q, rows of six.
    pub response: [Six; 6],
}

impl Coupling {
    /// Removes the means of J over the body's cells in a pocket, whose rows ascend: there q is
    /// determined up to a constant, which then moves nothing.
    fn remove_means(&mut self, pocket: &[u32]) {
        let is_inside = |row: &u32| pocket.binary_search(row).is_ok();
        let (mut sum, mut count) = ([0.0; 6], 0.0);
        for (_, push) in self
            .row
            .iter()
            .zip(&self.push)
            .filter(|(row, _)| is_inside(row))
        {
            sum = std::array::from_fn(|k| sum[k] + push[k]);
            count += 1.0;
        }
        for (_, push) in self
            .row
            .iter()
            .zip(&mut self.push)
            .filter(|(row, _)| is_inside(row))
        {
            *push = std::array::from_fn(|k| push[k] - sum[k] / count);
        }
    }

    /// Returns the change of the body's velocities by q of each row, m/s and rad/s.
    pub fn change(&self, q: &[f64]) -> Six {
        let mut sum = [0.0; 6];
        for (&row, push) in self.row.iter().zip(&self.push) {
            for (sum, push) in sum.iter_mut().zip(push) {
                *sum += push * q[row as usize];
            }
        }
        product(&self.response, &sum)
    }

    /// Adds the flux by a change of the body's velocities to each of its rows.
    pub fn add_flux(&self, change: &Six, flux: &mut [f64]) {
        for (&row, push) in self.row.iter().zip(&self.push) {
            flux[row as usize] += dot(push, change);
        }
    }
}

impl System {
    /// Builds the rows, in the order of the elements.
    pub fn new<T: Copy + Into<f64>>(cells: Cells<'_, T>) -> Self {
        let mut system = Self::default();
        let wet = CELLS..CELLS * (cells.bricks.wet + 1);
        let mut row = vec![NONE; cells.kind.len()];
        for element in wet.filter(|&e| cells.kind[e as usize] == FLUID) {
            let (mut coefficient, mut dirichlet) = ([0.0; 6], 0.0);
            for (k, shared) in coefficient.iter_mut().enumerate() {
                let open = cells.open[cells.face(element, k)].into();
                let other = cells.neighbor(element, k);
                match cells.kind[other as usize] {
                    FLUID => *shared = open,
                    AIR => dirichlet += open / cells.theta(element, other),
                    _ => {}
                }
            }
            let diagonal = dirichlet + coefficient.iter().sum::<f64>();
            if diagonal > 0.0 {
                row[element as usize] = system.cell.len() as u32;
                system.cell.push(element);
                system.dirichlet.push(dirichlet);
                system.diagonal.push(diagonal);
                system.coefficient.push(coefficient);
            } else {
                system.dropped.push(element);
            }
        }
        system.neighbor = system
            .cell
            .iter()
            .zip(&system.coefficient)
            .map(|(&element, coefficient)| {
                std::array::from_fn(|k| {
                    if coefficient[k] > 0.0 {
                        row[cells.neighbor(element, k) as usize]
                    } else {
                        NONE
                    }
                })
            })
            .collect();
        system
    }

    /// Returns b = −(Σ ± f u + `solid_flux`) of each row; velocities are in planes
    /// like `Cells::open`.
    pub fn rhs<T: Copy + Into<f64> + Sync>(
        &self,
        cells: Cells<'_, T>,
        velocity: &[T],
        solid_flux: &[T],
    ) -> Vec<f64> {
        let outflow = |&element: &u32| {
            let through = (0..6).map(|k| {
                let face = cells.face(element, k);
                let sign = if k % 2 == 1 { 1.0 } else { -1.0 };
                sign * cells.open[face].into() * velocity[face].into()
            });
            through.sum::<f64>() + solid_flux[element as usize].into()
        };
        self.cell
            .par_iter()
            .with_min_len(GRAIN)
            .map(|element| -outflow(element))
            .collect()
    }

    /// Returns the faces that a projection changes, as indices into the planes of `Cells::open`,
    /// with the amount q − q' that the solution `q` subtracts from the velocity there. Each face
    /// appears once, in the order of the rows.
    pub fn gradient<T: Copy + Into<f64>>(
        &self,
        cells: Cells<'_, T>,
        q: &[f64],
    ) -> Vec<(usize, f64)> {
        let mut faces = Vec::new();
        for (i, &element) in self.cell.iter().enumerate() {
            for k in 0..6 {
                let face = cells.face(element, k);
                let other = cells.neighbor(element, k);
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                let j = self.neighbor[i][k];
                if j != NONE && k % 2 == 0 {
                    faces.push((face, q[i] - q[j as usize]));
                } else if cells.kind[other as usize] == AIR && cells.open[face].into() > 0.0 {
                    faces.push((face, sign * q[i] / cells.theta(element, other)));
                }
            }
        }
        faces
    }

    /// Multiplies the matrix by `x`, written in differences so that a smooth `x` loses no digits:
    /// the f64 reference of `shaders/pressure/multiply.wgsl`.
    pub fn apply(&self, x: &[f64]) -> Vec<f64> {
        let mut product = self.apply_water(x);
        for body in &self.bodies {
            body.add_flux(&body.change(x), &mut product);
        }
        product
    }

    /// Multiplies the matrix without its bodies by `x`.
    pub fn apply_water(&self, x: &[f64]) -> Vec<f64> {
        (0..x.len())
            .into_par_iter()
            .with_min_len(GRAIN)
            .map(|i| {
                let mut sum = self.dirichlet[i] * x[i];
                for (&j, &shared) in self.neighbor[i].iter().zip(&self.coefficient[i]) {
                    if j != NONE {
                        sum += shared * (x[i] - x[j as usize]);
                    }
                }
                sum
            })
            .collect()
    }

    /// Adds bodies, which no pocket's constant pressure moves.
    pub fn add_bodies(&mut self, bodies: Vec<Coupling>) {
        self.bodies = bodies;
        if !self.bodies.is_empty() {
            let pockets = self.pockets();
            for body in &mut self.bodies {
                pockets.iter().for_each(|pocket| body.remove_means(pocket));
            }
        }
    }

    /// Returns the rows of each body of water without contact to air, in the order of their first
    /// rows. There the matrix is singular: b must sum to zero, and the pressure is determined up to
    /// a constant.
    pub fn pockets(&self) -> Vec<Vec<u32>> {
        let mut is_seen = vec![false; self.cell.len()];
        let mut pockets = Vec::new();
        for first in 0..self.cell.len() {
            if is_seen[first] {
                continue;
            }
            is_seen[first] = true;
            let mut body = vec![first as u32];
            let mut next = 0;
            while let Some(&row) = body.get(next) {
                next += 1;
                for &j in self.neighbor[row as usize].iter().filter(|&&j| j != NONE) {
                    if !std::mem::replace(&mut is_seen[j as usize], true) {
                        body.push(j);
                    }
                }
            }
            if body.iter().all(|&row| self.dirichlet[row as usize] == 0.0) {
                body.sort_unstable();
                pockets.push(body);
            }
        }
        pockets
    }
}

/// Subtracts the mean of `values` over each pocket. Values that are equal up to rounding become
/// exactly 0: the rounding of their mean would be a right-hand side without a solution.
pub fn remove_means(values: &mut [f64], pockets: &[Vec<u32>]) {
    for pocket in pockets {
        let sum: f64 = pocket.iter().map(|&row| values[row as usize]).sum();
        let mean = sum / pocket.len() as f64;
        let slack = pocket.len() as f64 * f64::EPSILON * mean.abs();
        let is_alike = |&row: &u32| (values[row as usize] - mean).abs() <= slack;
        let are_alike = pocket.iter().all(is_alike);
        for &row in pocket {
            let value = &mut values[row as usize];
            *value = if are_alike { 0.0 } else { *value - mean };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        cases::{Case, Surface, tank},
        *,
    };

    #[test]
    fn rows_are_symmetric_and_sum_to_what_air_adds() {
        let case = tank(16, Surface::GhostFluid, true);
        let system = case.system();
        assert!(system.cell.len() > 1500);
        for i in 0..system.cell.len() {
            let sum: f64 = system.coefficient[i].iter().sum();
            assert!((system.diagonal[i] - sum - system.dirichlet[i]).abs() < 1e-12);
            for k in 0..6 {
                let j = system.neighbor[i][k];
                if j != NONE {
                    assert_eq!(system.neighbor[j as usize][k ^ 1], i as u32);
                    assert_eq!(
                        system.coefficient[j as usize][k ^ 1],
                        system.coefficient[i][k]
                    );
                }
            }
        }
        assert!(system.pockets().is_empty());
    }

    /// The gradient subtracts what the right-hand side asks for: b of the corrected velocities is
    /// b − A q.
    #[test]
    fn the_gradient_of_a_solution_is_its_image() {
        for surface in [Surface::GhostFluid, Surface::Voxel] {
            let case = Case {
                surface,
                ..tank(12, surface, true)
            };
            let system = case.system();
            let q = cases::white_noise(system.cell.len());
            let planes = case.open.len();
            let mut velocity = vec![0.0f32; planes];
            for (face, difference) in system.gradient(case.cells(), &q) {
                velocity[face] -= difference as f32;
            }
            let flux = vec![0.0f32; case.kind.len()];
            let left = system.rhs(case.cells(), &velocity, &flux);
            // Velocities of at most 2 / θ = 200 are rounded at 6e-8.
            for (left, image) in left.iter().zip(system.apply(&q)) {
                assert!((left + image).abs() < 1e-4, "{left} {image}");
            }
        }
    }

    #[test]
    fn a_lone_cell_and_a_closed_pair() {
        // Water at (1,1,1) in air, at (5,5,5) and (6,5,5) in rock, and isolated in rock at (5,1,5).
        let water = [[1, 1, 1], [5, 5, 5], [6, 5, 5], [5, 1, 5]];
        let kind = |c: [u32; 3]| match (water.contains(&c), c[0] < 4) {
            (true, _) => FLUID,
            (_, true) => AIR,
            _ => SOLID,
        };
        let case = Case::new([8; 3], 1.0, kind, |_, _| 1.0, |_| 0.0);
        let system = System::new(Cells {
            distance: None,
            ..case.cells()
        });
        let element = |c: [u32; 3]| 512 + c[0] + 8 * c[1] + 64 * c[2];
        assert_eq!(system.dropped, [element([5, 1, 5])]);
        assert_eq!(system.cell, [[1, 1, 1], [5, 5, 5], [6, 5, 5]].map(element));
        assert_eq!(system.diagonal, [6.0, 1.0, 1.0]);
        assert_eq!(system.pockets(), [vec![1, 2]]);
    }
}
