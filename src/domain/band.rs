//! Narrow-band FLIP (Ferstl et al. 2016): particles only near the free surface, and in the depth
//! the velocity on the grid. At the end of each frame the band is laid anew: particles that are too
//! deep leave, and cells that come into it get theirs back.

mod cells;

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
};

use glam::{DVec3, Vec3};

use super::{
    bricks::{Bricks, CELLS, table_dims},
    deep::{Deep, DeepGrid, FILLED},
    flip::stored_cells,
    parallel,
    particles::Particles,
    sampling::finalized,
};
use cells::{Cells, depths, is_water};

/// Cells of hysteresis: particles leave where they are deeper than the band by more than this.
pub const HYSTERESIS: f32 = 1.0;

/// Faces between cells at least as deep as the band less this take the velocity of the depth.
pub const OVERLAP: f32 = 1.0;

/// Cells at least as deep as the band less this count as full: their particles have come across the
/// band's end, or go across it, and no particles beyond it make up for those. As a density such
/// errors would be sources of volume in step with the waves above, which takes a tenth of the
/// height of waves that enter still water.
pub const SEAM: f32 = 2.0;

/// Cells at least as deep as the band less this are listed: what moves with the water within a
/// frame is interpolated between them.
pub const LISTED: f32 = 3.0;

/// Depths are measured up to the band and these cells: beyond the hysteresis, so that what moves
/// with the water stays linear up to there.
const BEYOND: u32 = 2;

/// Least depth, cells, that a cell without particles may come to within a frame. Less, and air
/// beside it would see a surface that no particle makes.
const LEAST_DEPTH: f32 = 1.0;

/// The band of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// The grid.
    pub grid: DeepGrid,
    /// Periodic axes.
    pub periodic: [bool; 3],
}

/// Particles that changed when a band was laid. They are not water that entered or left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Relaid {
    /// Particles that cells got as they came into the band.
    pub seeded: u64,
    /// Particles that left with their cells into the depth.
    pub removed: u64,
}

/// Why a band could not be laid.
#[derive(Clone, Debug, PartialEq)]
pub enum BandError {
    /// The water moved too far within a frame: cells without particles came to the surface.
    TooThin {
        /// Centre of the first such cell, metres.
        at: [f64; 3],
        /// Number of such cells.
        count: usize,
        /// The band, cells.
        band: u32,
    },
    /// Particles have had all ids below [`FILLED`].
    NoIds,
}

impl fmt::Display for BandError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self::TooThin { at, count, band } = self else {
            return write!(f, "the band has used up the {FILLED} ids of particles");
        };
        let [x, y, z] = at;
        write!(
            f,
            "the band of {band} cells was used up within the frame: {count} cells without \
             particles came within {LEAST_DEPTH} cell of the surface, the first at [{x:.4}, \
             {y:.4}, {z:.4}]; use a thicker solver.flip.band, or more frames per second"
        )
    }
}

impl std::error::Error for BandError {}

impl Band {
    /// Takes the particles of a start, which are everywhere, out of the depth.
    pub fn enter(&self, particles: &mut Particles) -> Relaid {
        particles.deep = Deep::default();
        let bricks = self.bricks(particles);
        let field = self.face_velocities(particles, &bricks);
        let depth = self.depth(&bricks, &self.counts(particles, &bricks), &field.depth);
        self.settle(particles, &bricks, &field, &depth)
    }

    /// Lays the band anew at the end of frame `frame`. The deep cells of `particles` are all those
    /// that the solver knows, with depths that have moved with the water. `amount` is the
    /// [`Particles::amount`] with which the frame began, and `next_id` is advanced by the seeded
    /// particles.
    ///
    /// # Errors
    /// [`BandError`].
    pub fn relay(
        &self,
        particles: &mut Particles,
        (frame, amount): (u32, usize),
        next_id: &mut u32,
    ) -> Result<Relaid, BandError> {
        let bricks = self.bricks(particles);
        let field = Cells::of(&bricks, &particles.deep);
        let counts = self.counts(particles, &bricks);
        let depth = self.depth(&bricks, &counts, &field.depth);
        self.check(&bricks, &field.depth, &depth)?;
        let comes = self.coming(&counts, &field.depth, &depth);
        let refilled = self.refill(particles, &bricks, &field, comes, (frame, next_id));
        let settled = self.settle(particles, &bricks, &field, &depth);
        let counts = self.counts(particles, &bricks);
        let seams = (&bricks, &field, &depth[..], &counts[..]);
        let balanced = self.balance(particles, seams, amount, (frame, next_id));
        if *next_id > FILLED {
            return Err(BandError::NoIds);
        }
        let all = [refilled, settled, balanced];
        Ok(Relaid {
            seeded: all.iter().map(|it| it.seeded).sum(),
            removed: all.iter().map(|it| it.removed).sum(),
        })
    }

    /// Cells stored along each axis.
    pub fn stored_cells(&self) -> [u32; 3] {
        stored_cells(self.grid.cells, self.periodic)
    }

    /// Bricks around particles and deep cells.
    fn bricks(&self, particles: &Particles) -> Bricks {
        let is_wet = self.wet_bricks(particles);
        Bricks::periodic(self.stored_cells(), self.periodic, &is_wet, 1, 1)
    }

    /// Returns which bricks hold particles or deep cells.
    pub fn wet_bricks(&self, particles: &Particles) -> Vec<bool> {
        let dims = table_dims(self.stored_cells());
        let mut is_wet = vec![false; dims.iter().map(|&n| n as usize).product()];
        let [nx, ny, _] = dims.map(|n| n as usize);
        let mut mark = |cell: [u32; 3]| {
            let [x, y, z] = cell.map(|k| (k / super::bricks::EDGE) as usize);
            is_wet[(z * ny + y) * nx + x] = true;
        };
        particles.position.iter().for_each(|x| mark(self.cell(*x)));
        particles.deep.cell.iter().for_each(|cell| mark(*cell));
        is_wet
    }

    /// The cell of a position; positions on or beyond the domain's faces belong to the outermost.
    fn cell(&self, position: [f32; 3]) -> [u32; 3] {
        let at = Vec3::from_array(position).as_dvec3() - self.grid.origin;
        let at = (at / self.grid.cell_size).to_array();
        std::array::from_fn(|axis| (at[axis].max(0.0) as u32).min(self.grid.cells[axis] - 1))
    }

    fn element(&self, bricks: &Bricks, position: [f32; 3]) -> usize {
        bricks.element(self.cell(position).map(i64::from)) as usize
    }

    /// Particles in each cell.
    fn counts(&self, particles: &Particles, bricks: &Bricks) -> Vec<u16> {
        let elements = parallel::map_slice(&particles.position, |x| self.element(bricks, *x));
        let mut counts = vec![0u16; (bricks.active as usize + 1) * CELLS as usize];
        elements
            .into_iter()
            .for_each(|element| counts[element] = counts[element].saturating_add(1));
        counts
    }

    /// Depth of each cell below the free surface, cells, of particles and of cells that were deep.
    fn depth(&self, bricks: &Bricks, counts: &[u16], before: &[f32]) -> Vec<f32> {
        let full = self.grid.per_cell() as u16;
        let band = self.grid.band as f32;
        let water: Vec<u16> = (counts.iter().zip(before))
            .map(|(count, depth)| if *depth > band { full } else { *count })
            .collect();
        let is_water = is_water(bricks, self.grid.cells, &water, full);
        depths(bricks, self.grid.cells, &is_water, self.grid.band + BEYOND)
    }

    fn check(&self, bricks: &Bricks, before: &[f32], depth: &[f32]) -> Result<(), BandError> {
        let band = self.grid.band as f32;
        let is_bare = |element: &usize| before[*element] >= band && depth[*element] < LEAST_DEPTH;
        let inside = |element: &usize| {
            let cell = bricks.cell(*element as u32);
            (0..3).all(|axis| cell[axis] < self.grid.cells[axis])
        };
        let all = CELLS as usize..before.len();
        let mut bare = all.filter(is_bare).filter(inside);
        let Some(first) = bare.next() else {
            return Ok(());
        };
        let middle = DVec3::from_array(bricks.cell(first as u32).map(|k| f64::from(k) + 0.5));
        Err(BandError::TooThin {
            at: (self.grid.origin + self.grid.cell_size * middle).to_array(),
            count: 1 + bare.count(),
            band: self.grid.band,
        })
    }

    /// Cells that were deep and are to have the particles of a full cell: those that no longer are,
    /// and those in the hysteresis that lack half of theirs.
    ///
    /// The depth that moves with the water errs by parts of a cell. Without particles in the
    /// hysteresis a cell that it takes out of the depth too early would have none, and its water
    /// would be lost.
    fn coming(&self, counts: &[u16], before: &[f32], depth: &[f32]) -> Vec<usize> {
        let (band, n) = (self.grid.band as f32, self.grid.per_cell());
        let comes = |element: &usize| {
            let (depth, count) = (depth[*element], u32::from(counts[*element]));
            let is_thin = depth <= band + HYSTERESIS && 2 * count < n;
            before[*element] > band && (depth <= band || is_thin)
        };
        (CELLS as usize..depth.len()).filter(comes).collect()
    }

    /// Gives cells exactly the particles of a full cell.
    fn refill(
        &self,
        particles: &mut Particles,
        bricks: &Bricks,
        field: &Cells,
        comes: Vec<usize>,
        (frame, next_id): (u32, &mut u32),
    ) -> Relaid {
        let n = self.grid.per_cell();
        // Parts of each such cell that hold a particle, in the order of a lattice.
        let taken = comes.into_iter().map(|element| (element, Vec::new()));
        let mut taken: BTreeMap<usize, Vec<u32>> = taken.collect();
        if taken.is_empty() {
            return Relaid::default();
        }
        let mut keep = vec![true; particles.len()];
        for (keep, x) in keep.iter_mut().zip(&particles.position) {
            if let Some(taken) = taken.get_mut(&self.element(bricks, *x)) {
                *keep = taken.len() < n as usize;
                if *keep {
                    taken.push(self.part(*x));
                }
            }
        }
        let before = particles.len();
        particles.retain(&keep);
        let mut relaid = Relaid {
            removed: (before - particles.len()) as u64,
            seeded: 0,
        };
        for (element, taken) in taken {
            let cell = bricks.cell(element as u32);
            let missing = n as usize - taken.len();
            // Parts without a particle first.
            let mut parts: Vec<u32> = (0..n).collect();
            let turn = hash(cell, frame, n) as usize % n as usize;
            parts.rotate_left(turn);
            parts.sort_by_key(|part| taken.iter().filter(|it| *it == part).count());
            for part in parts.into_iter().take(missing) {
                self.seed(particles, bricks, field, (element, part), (frame, *next_id));
                *next_id += 1;
                relaid.seeded += 1;
            }
        }
        relaid
    }

    /// Adds or removes a particle in cells at the band's end until the water has its `amount`,
    /// first in those that lack most, or have most beyond a full cell: there the particles were
    /// lost or won, and elsewhere the surface would rise or fall. Cells that become deep have a few
    /// particles more or less than a full cell, which would add up.
    fn balance(
        &self,
        particles: &mut Particles,
        (bricks, field, depth, counts): (&Bricks, &Cells, &[f32], &[u16]),
        amount: usize,
        (frame, next_id): (u32, &mut u32),
    ) -> Relaid {
        let (now, band) = (particles.amount(), self.grid.band as f32);
        let mut relaid = Relaid::default();
        if now == amount || particles.deep.is_empty() {
            return relaid;
        }
        let is_end = |element: &usize| {
            depth[*element] > band - 1.0 && depth[*element] <= band && field.depth[*element] > 0.0
        };
        let mut cells: Vec<usize> = (CELLS as usize..depth.len()).filter(is_end).collect();
        let is_over = now > amount;
        cells.sort_by_key(|element| {
            let count = i32::from(counts[*element]);
            let first = if is_over { -count } else { count };
            (first, hash(bricks.cell(*element as u32), frame, u32::MAX))
        });
        cells.truncate(now.abs_diff(amount));
        if is_over {
            let mut chosen: BTreeSet<usize> = cells.into_iter().collect();
            let places = parallel::map_slice(&particles.position, |x| self.element(bricks, *x));
            let keep: Vec<bool> = places.iter().map(|place| !chosen.remove(place)).collect();
            relaid.removed = keep.iter().filter(|keep| !**keep).count() as u64;
            particles.retain(&keep);
            return relaid;
        }
        for element in cells {
            let part = hash(bricks.cell(element as u32), frame, 0) % self.grid.per_cell();
            self.seed(particles, bricks, field, (element, part), (frame, *next_id));
            *next_id += 1;
            relaid.seeded += 1;
        }
        relaid
    }

    /// Adds a particle in a part of a cell.
    fn seed(
        &self,
        particles: &mut Particles,
        bricks: &Bricks,
        field: &Cells,
        (element, part): (usize, u32),
        (frame, id): (u32, u32),
    ) {
        let (cell, n) = (bricks.cell(element as u32), self.grid.per_edge);
        let at = [part % n, part / n % n, part / n.pow(2)];
        let jitter = |axis: u32| {
            let bits = hash(cell, frame, 3 * part + axis);
            0.5 * (f64::from(bits) / f64::from(u32::MAX) - 0.5)
        };
        let within = DVec3::from_array(std::array::from_fn(|axis| {
            (f64::from(at[axis]) + 0.5 + jitter(axis as u32)) / f64::from(n)
        }));
        let place = DVec3::from_array(cell.map(f64::from)) + within;
        let x = self.grid.origin + self.grid.cell_size * place;
        particles.position.push(x.as_vec3().to_array());
        let v = field.velocity_at(bricks, element as u32, within);
        particles.velocity.push(v);
        particles.id.push(id);
        for column in particles.attributes.values_mut() {
            column.push(0.0);
        }
    }

    /// Part of its cell, of `per_edge`³, that a position lies in.
    fn part(&self, position: [f32; 3]) -> u32 {
        let (n, cell) = (self.grid.per_edge, self.cell(position));
        let at = Vec3::from_array(position).as_dvec3() - self.grid.origin;
        let within = at / self.grid.cell_size - DVec3::from_array(cell.map(f64::from));
        let [x, y, z] = (within * f64::from(n))
            .to_array()
            .map(|k| (k.max(0.0) as u32).min(n - 1));
        x + n * (y + n * z)
    }

    /// Removes the particles below the band and its hysteresis, and keeps the deep cells.
    fn settle(
        &self,
        particles: &mut Particles,
        bricks: &Bricks,
        field: &Cells,
        depth: &[f32],
    ) -> Relaid {
        let band = self.grid.band as f32;
        let keep = parallel::map_slice(&particles.position, |x| {
            depth[self.element(bricks, *x)] <= band + HYSTERESIS
        });
        let before = particles.len();
        particles.retain(&keep);
        let mut deep = Deep {
            grid: self.grid,
            ..Deep::default()
        };
        let last = (bricks.wet as usize + 1) * CELLS as usize;
        for (element, &depth) in depth.iter().enumerate().take(last).skip(CELLS as usize) {
            let cell = bricks.cell(element as u32);
            let is_inside = (0..3).all(|axis| cell[axis] < self.grid.cells[axis]);
            if depth >= band - LISTED && is_inside {
                deep.cell.push(cell);
                deep.depth.push(depth);
                deep.velocity.push(field.velocity[element]);
            }
        }
        particles.deep = if deep.is_empty() {
            Deep::default()
        } else {
            deep
        };
        Relaid {
            removed: (before - particles.len()) as u64,
            seeded: 0,
        }
    }

    /// Face velocities of the particles, with trilinear weights; no depths.
    fn face_velocities(&self, particles: &Particles, bricks: &Bricks) -> Cells {
        let mut field = Cells::of(bricks, &Deep::default());
        let mut weights = vec![[0.0f64; 3]; field.velocity.len()];
        let mut sums = weights.clone();
        for (x, v) in particles.position.iter().zip(&particles.velocity) {
            let at = Vec3::from_array(*x).as_dvec3() - self.grid.origin;
            let at = at / self.grid.cell_size;
            for axis in 0..3 {
                cells::for_corners(at, axis, |cell, weight| {
                    let element = bricks.element(cell) as usize;
                    weights[element][axis] += weight;
                    sums[element][axis] += weight * f64::from(v[axis]);
                });
            }
        }
        for (velocity, (sum, weight)) in field.velocity.iter_mut().zip(sums.iter().zip(&weights)) {
            *velocity = std::array::from_fn(|axis| match weight[axis] > 0.0 {
                true => (sum[axis] / weight[axis]) as f32,
                false => 0.0,
            });
        }
        field
    }
}

/// Random bits of a cell, a frame and a number.
fn hash(cell: [u32; 3], frame: u32, number: u32) -> u32 {
    let words = cell.into_iter().chain([frame, number]);
    let state = words.fold(0u64, |state, word| {
        finalized((state ^ u64::from(word)).wrapping_add(0x9E37_79B9_7F4A_7C15))
    });
    (state >> 32) as u32
}

#[cfg(test)]
mod tests;
