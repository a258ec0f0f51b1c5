//! Test systems whose solutions or iteration counts are known.

use glam::DVec3;

use super::{AIR, Cells, FLUID, SOLID, System};
use crate::bricks::{Bricks, CELLS, EDGE, table_dims};

/// Where pressure is taken to be zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// At the centre of the first cell of air.
    Voxel,
    /// Where the surface crosses the line to that centre.
    GhostFluid,
}

/// Input of a system, laid out on bricks.
#[derive(Clone, Debug)]
pub struct Case {
    /// Layout of the elements.
    pub bricks: Bricks,
    /// Edge length of a cell, metres.
    pub cell_size: f64,
    /// Cell kinds, as in [`Cells`].
    pub kind: Vec<u32>,
    /// Open face fractions, as in [`Cells`].
    pub open: Vec<f32>,
    /// Distances to the surface, as in [`Cells`], metres.
    pub distance: Vec<f32>,
    /// Whether `distance` is used.
    pub surface: Surface,
}

impl Case {
    /// Lays out a box of `dims` cells. `kind` is evaluated per cell. `open` is evaluated per lower
    /// face (axis, cell), and replaced by 0 at the box's own walls and around solid cells.
    /// `distance` is evaluated at a cell's centre, metres.
    pub fn new(
        dims: [u32; 3],
        cell_size: f64,
        kind: impl Fn([u32; 3]) -> u32,
        open: impl Fn(usize, [u32; 3]) -> f32,
        distance: impl Fn(DVec3) -> f64,
    ) -> Self {
        let is_wet = wet_bricks(dims, &kind);
        let bricks = Bricks::new(dims, &is_wet, 1, 8);
        let count = bricks.slots() * CELLS as usize;
        let mut case = Self {
            kind: vec![AIR; count],
            open: vec![0.0; 3 * count],
            distance: vec![0.0; count],
            surface: Surface::GhostFluid,
            cell_size,
            bricks,
        };
        for slot in 1..=case.bricks.active {
            for local in 0..CELLS {
                let cell = case.cell(slot * CELLS + local);
                if (0..3).any(|axis| cell[axis] >= dims[axis]) {
                    continue;
                }
                let element = (slot * CELLS + local) as usize;
                let center = DVec3::from_array(cell.map(|c| f64::from(c) + 0.5)) * cell_size;
                case.kind[element] = kind(cell);
                case.distance[element] = distance(center) as f32;
                for axis in 0..3 {
                    let mut before = cell;
                    before[axis] = before[axis].wrapping_sub(1);
                    let is_closed = cell[axis] == 0 || kind(cell) == SOLID || kind(before) == SOLID;
                    if !is_closed {
                        case.open[axis * count + element] = open(axis, cell);
                    }
                }
            }
        }
        case
    }

    /// Returns the coordinates of an element's cell.
    pub fn cell(&self, element: u32) -> [u32; 3] {
        self.bricks.cell(element)
    }

    /// Returns the centre of an element's cell, metres.
    pub fn center(&self, element: u32) -> DVec3 {
        DVec3::from_array(self.cell(element).map(|c| f64::from(c) + 0.5)) * self.cell_size
    }

    /// Returns the input of the system builder.
    pub fn cells(&self) -> Cells<'_> {
        Cells {
            bricks: &self.bricks,
            kind: &self.kind,
            open: &self.open,
            distance: (self.surface == Surface::GhostFluid).then_some(&self.distance),
        }
    }

    /// Builds the system.
    pub fn system(&self) -> System {
        System::new(self.cells())
    }
}

fn wet_bricks(dims: [u32; 3], kind: &impl Fn([u32; 3]) -> u32) -> Vec<bool> {
    let [nx, ny, nz] = table_dims(dims);
    let mut is_wet = vec![false; (nx * ny * nz) as usize];
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            for x in 0..dims[0] {
                if kind([x, y, z]) == FLUID {
                    is_wet[((z / EDGE * ny + y / EDGE) * nx + x / EDGE) as usize] = true;
                }
            }
        }
    }
    is_wet
}

/// Builds the tank on which iteration counts are compared: n³ cells of a unit cube, 60 % full with
/// a sloshing surface, and a solid sphere in it. `has_cuts` represents the sphere by open fractions
/// instead of whole cells.
pub fn tank(n: u32, surface: Surface, has_cuts: bool) -> Case {
    let spacing = 1.0 / f64::from(n);
    let pi = std::f64::consts::PI;
    let water = |x: DVec3| x.y - 0.6 - 0.08 * (pi * x.x).cos() * (pi * x.z).cos();
    let sphere = |x: DVec3| x.distance(DVec3::new(0.5, 0.3, 0.5)) - 0.15;
    let corner = |c: [u32; 3]| DVec3::from_array(c.map(f64::from)) * spacing;
    let is_solid = |c: [u32; 3]| {
        if has_cuts {
            (0..8).all(|k| {
                sphere(corner([
                    c[0] + (k & 1),
                    c[1] + (k >> 1 & 1),
                    c[2] + (k >> 2),
                ])) <= 0.0
            })
        } else {
            sphere(corner(c) + 0.5 * spacing) < 0.0
        }
    };
    let kind = |c: [u32; 3]| match (is_solid(c), water(corner(c) + 0.5 * spacing) < 0.0) {
        (true, _) => SOLID,
        (false, true) => FLUID,
        (false, false) => AIR,
    };
    let open = |axis: usize, c: [u32; 3]| {
        if !has_cuts {
            return 1.0;
        }
        let mut sides = [DVec3::ZERO; 2];
        sides[0][(axis + 1) % 3] = spacing / 8.0;
        sides[1][(axis + 2) % 3] = spacing / 8.0;
        let is_open = |k: &u32| {
            let [s, t] = [k % 8, k / 8].map(|v| f64::from(v) + 0.5);
            sphere(corner(c) + s * sides[0] + t * sides[1]) > 0.0
        };
        (0..64).filter(is_open).count() as f32 / 64.0
    };
    Case {
        surface,
        ..Case::new([n; 3], spacing, kind, open, water)
    }
}

/// Builds a manufactured solution: p = cos πx cos πz sin(π(h − y)/2h) in a unit square basin of n²
/// columns with the surface at y = `HEIGHT`. Also returns, for each row, b and the exact q = p.
pub fn manufactured(n: u32) -> (Case, Vec<f64>, Vec<f64>) {
    let spacing = 1.0 / f64::from(n);
    let pi = std::f64::consts::PI;
    let center = |c: [u32; 3]| (f64::from(c[1]) + 0.5) * spacing;
    let kind = |c: [u32; 3]| if center(c) < HEIGHT { FLUID } else { AIR };
    let case = Case::new([n; 3], spacing, kind, |_, _| 1.0, |x| x.y - HEIGHT);
    let upright = 0.5 * pi / HEIGHT;
    let exact = |&element: &u32| {
        let x = case.center(element);
        (pi * x.x).cos() * (pi * x.z).cos() * (upright * (HEIGHT - x.y)).sin()
    };
    let q: Vec<f64> = case.system().cell.iter().map(exact).collect();
    // −Δx² ∇²p.
    let scale = spacing * spacing * (2.0 * pi * pi + upright * upright);
    let b = q.iter().map(|q| scale * q).collect();
    (case, b, q)
}

/// Height of the surface of [`manufactured`]; on no cell's face or centre for n a power of 2.
pub const HEIGHT: f64 = 0.63;

/// Returns the right-hand side of the tank: a product of sines, plus a tenth as much noise.
pub fn tank_rhs(case: &Case, system: &System) -> Vec<f64> {
    let tau = std::f64::consts::TAU;
    let noise = white_noise(system.cell.len());
    let wave = |&element: &u32| {
        let x = tau * case.center(element);
        x.x.sin() * x.y.sin() * x.z.sin()
    };
    let waves = system.cell.iter().map(wave);
    waves
        .zip(noise)
        .map(|(wave, noise)| wave + 0.1 * noise)
        .collect()
}

/// Returns values in −1..1, each a hash of its row.
pub fn white_noise(rows: usize) -> Vec<f64> {
    (1..=rows as u64)
        .map(|k| {
            let mut z = k.wrapping_mul(0x9e37_79b9_7f4a_7c15);
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        })
        .collect()
}
