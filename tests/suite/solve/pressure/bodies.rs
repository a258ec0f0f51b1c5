//! Bodies of water that touch no air, compared with a flood fill over the open faces: label_cells
//! finds them within blocks, merge_labels joins them across blocks, and count_pockets counts them.

use swell::{
    domain::poisson::{
        AIR, FLUID,
        cases::{Case, Surface},
    },
    gpu::adapter::{Context, InjectedFault},
    scene::flip::Preconditioner,
    solve::pressure::{blocked, buffers::LABEL},
};

use crate::support::context;
use crate::support::pressure::{Rig, settings};

/// Cells of a box, indexed with x fastest.
struct Grid {
    dims: [u32; 3],
    is_air: Vec<bool>,
    /// Whether water passes through the lower faces.
    is_open: Vec<[bool; 3]>,
}

impl Grid {
    fn new(dims: [u32; 3]) -> Self {
        let count = dims.iter().product::<u32>() as usize;
        Self {
            dims,
            is_air: vec![false; count],
            is_open: vec![[false; 3]; count],
        }
    }

    fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        ((z * self.dims[1] + y) * self.dims[0] + x) as usize
    }

    fn cell(&self, index: usize) -> [u32; 3] {
        let (index, [nx, ny, _]) = (index as u32, self.dims);
        [index % nx, index / nx % ny, index / (nx * ny)]
    }

    /// Opens the face between two neighbours.
    fn open(&mut self, a: [u32; 3], b: [u32; 3]) {
        let axis = (0..3).find(|&k| a[k] != b[k]).unwrap();
        let upper = if a[axis] < b[axis] { b } else { a };
        let index = self.index(upper);
        self.is_open[index][axis] = true;
    }

    /// Cells that an open face leads to.
    fn beyond(&self, index: usize) -> Vec<usize> {
        let cell = self.cell(index);
        let mut found = Vec::new();
        for axis in 0..3 {
            if self.is_open[index][axis] && cell[axis] > 0 {
                let mut other = cell;
                other[axis] -= 1;
                found.push(self.index(other));
            }
            if cell[axis] + 1 < self.dims[axis] {
                let mut other = cell;
                other[axis] += 1;
                let other = self.index(other);
                if self.is_open[other][axis] {
                    found.push(other);
                }
            }
        }
        found
    }

    /// Bodies of water without contact to air and with at least one open face, by flood fill.
    fn bodies(&self) -> Vec<Vec<usize>> {
        let mut is_seen = self.is_air.clone();
        let mut bodies = Vec::new();
        for first in 0..is_seen.len() {
            if is_seen[first] {
                continue;
            }
            is_seen[first] = true;
            let (mut body, mut next, mut has_air) = (vec![first], 0, false);
            while next < body.len() {
                for other in self.beyond(body[next]) {
                    has_air |= self.is_air[other];
                    if !is_seen[other] {
                        is_seen[other] = true;
                        body.push(other);
                    }
                }
                next += 1;
            }
            if !has_air && body.len() > 1 {
                bodies.push(body);
            }
        }
        bodies
    }

    fn case(&self) -> Case {
        let kind = |c: [u32; 3]| {
            if self.is_air[self.index(c)] {
                AIR
            } else {
                FLUID
            }
        };
        let open =
            |axis: usize, c: [u32; 3]| f32::from(u8::from(self.is_open[self.index(c)][axis]));
        Case {
            surface: Surface::Voxel,
            ..Case::new(self.dims, 0.1, kind, open, |_| 0.0)
        }
    }

    /// Returns the number of cells whose label differs from the flood fill's, the number of bodies
    /// that the device counted, and the true number. A label is the least index of its body in the
    /// device's order, and 0 where the body touches air or no face is open.
    fn compare(&self, context: &Context) -> (usize, u32, usize) {
        let mut rig = Rig::new(
            context,
            self.case(),
            &settings(Preconditioner::Multigrid, 1e-3),
        );
        let none = vec![0.0; rig.system.cell.len()];
        rig.set_rhs(&none);
        let counted = rig.project(None).pockets;
        let cells = rig.case.kind.len();
        let labels = rig.program.read(LABEL, cells).unwrap();
        let place = |index: usize| {
            let element = rig.case.bricks.element(self.cell(index).map(i64::from));
            blocked(element)
        };
        let bodies = self.bodies();
        let mut expected = vec![0; self.is_air.len()];
        for body in &bodies {
            let least = body.iter().map(|&index| place(index)).min().unwrap();
            for &index in body {
                expected[index] = least as u32;
            }
        }
        // Cells of air have no row and no label.
        let is_wrong = |&index: &usize| labels[place(index)] != expected[index];
        let wrong = (0..expected.len()).filter(is_wrong).count();
        (wrong, counted, bodies.len())
    }
}

/// Every combination of open faces among the twelve faces within a block of 2³ cells, one isolated
/// block each; and all of them again with air in the last cell.
fn every_block() -> Grid {
    let mut grid = Grid::new([64, 32, 32]);
    let inner: Vec<[[u32; 3]; 2]> = (0..3)
        .flat_map(|axis| {
            let lower = (0..8u32).filter(move |c| c >> axis & 1 == 0);
            lower.map(move |c| [c, c | 1 << axis].map(|c| [c & 1, c >> 1 & 1, c >> 2]))
        })
        .collect();
    assert_eq!(inner.len(), 12);
    for k in 0..8192u32 {
        let first = [k % 32, k / 32 % 16, k / 512].map(|b| 2 * b);
        let at = |c: [u32; 3]| [first[0] + c[0], first[1] + c[1], first[2] + c[2]];
        for (bit, &[a, b]) in inner.iter().enumerate() {
            if k >> bit & 1 == 1 {
                grid.open(at(a), at(b));
            }
        }
        if k >= 4096 {
            let last = grid.index(at([1, 1, 1]));
            grid.is_air[last] = true;
        }
    }
    grid
}

/// A path through all cells of a box, back and forth along x, y and z, cut into pieces of
/// `piece(n)` cells, with air in the very last cell.
fn snake(dims: [u32; 3], piece: impl Fn(usize) -> usize) -> Grid {
    let mut grid = Grid::new(dims);
    let mut way = Vec::new();
    for z in 0..dims[2] {
        for row in 0..dims[1] {
            let y = if z % 2 == 0 { row } else { dims[1] - 1 - row };
            for step in 0..dims[0] {
                let is_back = (z * dims[1] + row) % 2 == 1;
                let x = if is_back { dims[0] - 1 - step } else { step };
                way.push([x, y, z]);
            }
        }
    }
    let (mut left, mut cuts) = (piece(0), 0);
    for pair in way.windows(2) {
        left -= 1;
        if left == 0 {
            cuts += 1;
            left = piece(cuts);
        } else {
            grid.open(pair[0], pair[1]);
        }
    }
    let last = grid.index(*way.last().unwrap());
    grid.is_air[last] = true;
    grid
}

fn snakes() -> [Grid; 3] {
    [
        // One body up to the last piece of 4 cells, which ends in air; and a single piece that ends
        // in air.
        snake([24, 24, 24], |n| if n == 0 { 24 * 24 * 24 - 4 } else { 4 }),
        snake([24, 24, 24], |_| 24 * 24 * 24),
        // Pieces of 2 to 400 cells, in a box that is not a multiple of a brick.
        snake([21, 18, 26], |n| 2 + 37 * n * n % 399),
    ]
}

#[test]
fn bodies_within_blocks_are_those_of_a_flood_fill() {
    let (wrong, counted, bodies) = every_block().compare(&context());
    println!("{counted} bodies of {bodies}");
    assert!(bodies > 4096, "{bodies}");
    assert_eq!((wrong, counted), (0, bodies as u32));
    // Negative control: one round instead of seven leaves bodies in parts.
    let mut spoiled = context();
    spoiled.spoil = Some(InjectedFault {
        pass: "pressure/label_cells",
        from: "round < 7u",
        to: "round < 1u",
    });
    assert!(every_block().compare(&spoiled).0 > 1000);
}

#[test]
fn bodies_that_wind_through_blocks_are_those_of_a_flood_fill() {
    let context = context();
    for (grid, least) in snakes().iter().zip([1, 0, 20]) {
        let (wrong, counted, bodies) = grid.compare(&context);
        println!("{:?}: {counted} bodies of {bodies}", grid.dims);
        assert!(bodies >= least, "{bodies}");
        assert_eq!((wrong, counted), (0, bodies as u32));
    }
    // Negative control: without unions across a block's faces along z.
    let mut spoiled = context.clone();
    spoiled.spoil = Some(InjectedFault {
        pass: "pressure/merge_labels",
        from: "across(own + z, lower.z + 256u + z, l.out.zl);",
        to: "",
    });
    assert!(snakes()[0].compare(&spoiled).0 > 1000);
}
