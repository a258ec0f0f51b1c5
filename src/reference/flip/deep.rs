//! Water without particles (narrow-band FLIP, Ferstl et al. 2016): velocity and depth on the grid.

use glam::DVec3;

use super::{
    Faces, FlipSubstep, Model, OpenSpace,
    grid::{along, corner, per_cell},
    to_particles::velocity_at,
};
use swell_domain::{
    band::{OVERLAP, SEAM},
    bricks::{Bricks, CELLS},
    deep::Deep,
};

/// Velocity and depth that have moved with the water, on the bricks of a substep.
#[derive(Clone, Debug)]
pub struct DeepCells {
    /// Layout of the elements.
    pub bricks: Bricks,
    /// Depth of each cell's centre below the free surface, cells; 0 where it is not known.
    pub depth: Vec<f64>,
    /// Velocity on the lower faces of each cell, m/s.
    pub velocity: Vec<DVec3>,
}

impl DeepCells {
    /// Takes over the deep cells of a state; `bricks` contain them.
    pub fn of(bricks: &Bricks, deep: &Deep) -> Self {
        let all = CELLS as usize * bricks.slots();
        let mut found = Self {
            bricks: bricks.clone(),
            depth: vec![0.0; all],
            velocity: vec![DVec3::ZERO; all],
        };
        for ((cell, depth), velocity) in deep.cell.iter().zip(&deep.depth).zip(&deep.velocity) {
            let element = bricks.element(cell.map(i64::from)) as usize;
            found.depth[element] = f64::from(*depth);
            found.velocity[element] = DVec3::from(velocity.map(f64::from));
        }
        found
    }

    /// Returns all cells that have a depth, rounded.
    pub fn rounded(&self, model: &Model) -> Deep {
        let mut deep = Deep::default();
        let Some(band) = model.scene.band() else {
            return deep;
        };
        deep.grid = band.grid;
        // Bricks are in the order of their coordinates, and so are the cells.
        for element in CELLS..CELLS * (self.bricks.wet + 1) {
            let (cell, depth) = (self.bricks.cell(element), self.depth[element as usize]);
            if depth > 0.0 && (0..3).all(|axis| cell[axis] < model.cells[axis]) {
                deep.cell.push(cell);
                deep.depth.push(depth as f32);
                let velocity = self.velocity[element as usize];
                deep.velocity.push(velocity.as_vec3().to_array());
            }
        }
        deep
    }

    /// Index of the value of an element of other bricks; slot 0 where there is none.
    fn index(&self, bricks: &Bricks, element: u32) -> usize {
        match element < CELLS {
            true => 0,
            false => self.bricks.element(bricks.cell(element).map(i64::from)) as usize,
        }
    }
}

/// Gives faces in the depth the velocity of `before`, with forces as on that of particles: those
/// between two cells at least as deep as the band less [`OVERLAP`]. Returns the depths.
pub fn place_deep(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    before: &DeepCells,
    space: &OpenSpace,
    faces: &mut Faces,
) -> Vec<f64> {
    let band = f64::from(model.settings().band.unwrap_or(0));
    let least = band - f64::from(OVERLAP);
    let depth = per_cell(bricks, |element| {
        before.depth[before.index(bricks, element)]
    });
    for element in CELLS..CELLS * (bricks.active + 1) {
        let e = element as usize;
        for axis in (0..3).filter(|_| depth[e] >= least) {
            let other = bricks.near(element, along(axis, -1));
            let is_deep = other >= CELLS && depth[other as usize] >= least;
            if is_deep && space.open[e][axis] > 0.0 {
                let carried = before.velocity[before.index(bricks, element)][axis];
                faces.change[e][axis] = carried;
                faces.velocity[e][axis] = carried + step.velocity_step[axis];
                faces.layer[e] |= 0x80 << (8 * axis);
            }
        }
    }
    depth
}

/// Makes cells full that are at least as deep as the band less [`SEAM`], whatever particles are in
/// them.
pub fn fill_deep(model: &Model, depth: &[f64], density: &mut [f64]) {
    let full = f64::from(model.settings().band.unwrap_or(0)) - f64::from(SEAM);
    for (density, depth) in density.iter_mut().zip(depth) {
        if *depth >= full {
            *density = 1.0;
        }
    }
}

/// Lagrange's basis polynomials on the nodes -1, 0, 1 and 2.
fn basis(t: f64) -> [f64; 4] {
    let node = |k: usize| k as f64 - 1.0;
    std::array::from_fn(|k| {
        let others = (0..4).filter(|other| *other != k);
        let factor = |other: usize| (t - node(other)) / (node(k) - node(other));
        others.map(factor).product()
    })
}

/// Samples around a position.
struct Around<'a> {
    model: &'a Model,
    bricks: &'a Bricks,
    low: [i64; 3],
    part: DVec3,
    last: [i64; 3],
}

impl<'a> Around<'a> {
    /// Around `x`, in cells, among samples of which number 0 is at `first`.
    fn new(model: &'a Model, bricks: &'a Bricks, x: DVec3, first: DVec3) -> Self {
        let low = (x - first).floor();
        let last = |axis: usize| {
            let on_faces = i64::from(first[axis] == 0.0);
            i64::from(model.cells[axis]) - 1 + on_faces
        };
        Self {
            model,
            bricks,
            low: low.to_array().map(|k| k as i64),
            part: x - first - low,
            last: std::array::from_fn(last),
        }
    }

    /// Index of the sample `step` from the one before the position.
    fn index(&self, step: [i64; 3]) -> usize {
        let cell = std::array::from_fn(|axis| {
            let at = self.low[axis] + step[axis];
            match self.model.scene.periodic[axis] {
                true => at,
                false => at.clamp(0, self.last[axis]),
            }
        });
        self.bricks.element(cell) as usize
    }
}

/// Linear weights on the same nodes.
fn linear(t: f64) -> [f64; 4] {
    [0.0, 1.0 - t, t, 0.0]
}

/// Returns a component of a field of faces at `x`, in cells, within the range of the eight faces
/// around: cubic along z, along y in the inner two planes and along x in their inner two rows,
/// elsewhere linear (32 faces; Ritchie et al. 1995).
fn component_at(model: &Model, bricks: &Bricks, field: &[DVec3], axis: usize, x: DVec3) -> f64 {
    let first = DVec3::splat(0.5) - 0.5 * DVec3::AXES[axis];
    let around = Around::new(model, bricks, x, first);
    let [of_x, of_y, of_z] = around.part.to_array().map(|t| [linear(t), basis(t)]);
    let is_inner = |k: usize| (1..3).contains(&k);
    let (mut sum, mut least, mut most) = (0.0, f64::INFINITY, f64::NEG_INFINITY);
    for k in 0..64 {
        let at = [k % 4, k / 4 % 4, k / 16];
        let value = field[around.index(at.map(|k| k as i64 - 1))][axis];
        let [x, y, z] = at;
        let is_cubic = is_inner(z) && is_inner(y);
        let weight =
            of_z[1][z] * of_y[usize::from(is_inner(z))][y] * of_x[usize::from(is_cubic)][x];
        sum += weight * value;
        if is_cubic && is_inner(x) {
            (least, most) = (value.min(least), value.max(most));
        }
    }
    sum.clamp(least, most)
}

/// Returns the depth at `x`, in cells: linear.
fn depth_at(model: &Model, bricks: &Bricks, depth: &[f64], x: DVec3) -> f64 {
    let around = Around::new(model, bricks, x, DVec3::splat(0.5));
    let corner = |k: usize| {
        let at = [k & 1, k >> 1 & 1, k >> 2];
        let weight = |axis: usize| match at[axis] {
            1 => around.part[axis],
            _ => 1.0 - around.part[axis],
        };
        let weight: f64 = (0..3).map(weight).product();
        weight * depth[around.index(at.map(|k| k as i64))]
    };
    (0..8).map(corner).sum()
}

/// The water's motion over a substep: velocities at faces, m/s, and the density correction's
/// displacements there, metres.
#[derive(Clone, Copy)]
pub struct Motion<'a> {
    /// The scene, in f64.
    pub model: &'a Model,
    /// The substep.
    pub step: &'a FlipSubstep<'a>,
    /// Layout of the faces.
    pub bricks: &'a Bricks,
    /// Velocities.
    pub velocity: &'a [DVec3],
    /// Displacements, where there are any.
    pub displacement: Option<&'a [DVec3]>,
}

impl Motion<'_> {
    /// Returns where water at `x` was before the substep, both in cells: back along the path that
    /// particles take, straight on by the velocity where they started.
    pub fn origin(&self, x: DVec3) -> DVec3 {
        let Self { model, step, .. } = *self;
        let size = model.cell_size();
        let of = |field: &[DVec3], x: DVec3, known: DVec3| {
            velocity_at(model, self.bricks, field, x, known)
        };
        let here = size * x;
        let at_end = of(self.velocity, here, DVec3::ZERO);
        let start = here - step.length * at_end;
        let mut way = step.length * of(self.velocity, start, at_end);
        if let Some(displacement) = self.displacement {
            way += of(displacement, here, DVec3::ZERO);
        }
        let from = x - way.clamp_length_max(model.max_displacement()) / size;
        let wrapped = model.period().wrap(size * from) / size;
        let cells = DVec3::from_array(model.cells.map(f64::from));
        let kept = wrapped.clamp(DVec3::ZERO, cells);
        let is_free = |axis: usize| model.scene.periodic[axis];
        DVec3::from_array(std::array::from_fn(|axis| match is_free(axis) {
            true => wrapped[axis],
            false => kept[axis],
        }))
    }

    /// Returns a component of the velocity at `x`, in cells, as the cubic has it.
    pub fn component(&self, axis: usize, x: DVec3) -> f64 {
        component_at(self.model, self.bricks, self.velocity, axis, x)
    }
}

/// Moves velocity and depth with the water on the grid: semi-Lagrangian (Stam 1999).
pub fn carry_deep(motion: &Motion<'_>, depth: &[f64]) -> DeepCells {
    let Motion { model, bricks, .. } = *motion;
    let wet = CELLS * (bricks.wet + 1);
    let moved = per_cell(bricks, |element| {
        if element >= wet {
            return (0.0, DVec3::ZERO);
        }
        let cell = corner(bricks, element);
        let component = |axis: usize| {
            let face = cell + 0.5 - 0.5 * DVec3::AXES[axis];
            motion.component(axis, motion.origin(face))
        };
        let centre = motion.origin(cell + 0.5);
        (
            depth_at(model, bricks, depth, centre),
            DVec3::new(component(0), component(1), component(2)),
        )
    });
    DeepCells {
        bricks: bricks.clone(),
        depth: moved.iter().map(|it| it.0).collect(),
        velocity: moved.iter().map(|it| it.1).collect(),
    }
}
