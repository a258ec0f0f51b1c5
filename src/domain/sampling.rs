//! Samples blocks and meshes with water particles, and surfaces with boundary particles.
//!
//! All results depend only on the arguments: random numbers are hashes of indices.

mod displace;
mod relax;

use glam::{DVec2, DVec3};

pub(super) use self::displace::{CLEARANCE, moved_out};
use self::displace::{displace, displace_below};
use super::{
    bounds::Bounds,
    mesh::TriangleMesh,
    particles::Particles,
    signed_distance::{SignedDistance, SignedDistanceError},
};

/// Distance to existing water, in spacings, below which centres are left out where regions of
/// water overlap.
const OVERLAP_SPACINGS: f64 = 0.75;

/// Least distance of boundary samples, in spacings, chosen to give one sample per squared spacing
/// within a few per cent. (0.835 would do if random sequential packing saturated; with the
/// candidates below it does not, and gave 0.8.)
const BOUNDARY_DISTANCE: f64 = 0.75;

/// Candidates per squared spacing. With 12, no point on a box or sphere is farther than 1.2
/// spacings from a sample (tested).
const BOUNDARY_CANDIDATES: f64 = 12.0;

/// Steps of a sequence of low discrepancy in two dimensions (Roberts 2018).
const R2: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// A boundary particle on the surface of a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundarySample {
    /// Position, metres.
    pub position: DVec3,
    /// Unit normal, outward.
    pub normal: DVec3,
    /// Area of the surface that the sample represents, m².
    pub area: f64,
}

/// The water at the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Fill {
    /// Particles at rest, with consecutive ids from 0: blocks first, then meshes, x fastest
    /// in each.
    pub particles: Particles,
    /// Number of particles that were left out because of solids.
    pub removed: usize,
}

/// Fills blocks ([`fill_blocks`]) and meshes with particles on lattices of `spacing` metres, then
/// clears `solid`: as many particles stay as fit into the open volume, each at least 0.3 spacings
/// from the solid.
///
/// # Errors
/// If a water mesh has no inside, or needs too large a grid.
pub fn fill_water<'a>(
    blocks: &[Bounds],
    meshes: impl IntoIterator<Item = &'a TriangleMesh>,
    solid: Option<&SignedDistance>,
    domain: &Bounds,
    spacing: f64,
) -> Result<Fill, SignedDistanceError> {
    let mut positions = fill_blocks(blocks, domain, spacing);
    for mesh in meshes {
        fill_mesh(&mut positions, mesh, domain, spacing)?;
    }
    let removed = solid.map_or(0, |solid| displace(&mut positions, solid, domain, spacing));
    Ok(Fill {
        particles: at_rest(&positions),
        removed,
    })
}

/// Fills `block` with particles below a surface, `surface` metres high at x and z, then clears
/// `solid`. The uppermost layers follow the surface, so that it has no steps. `around` is the
/// distance to the solid and to the air above the surface.
pub fn fill_below(
    surface: impl Fn(DVec2) -> f64,
    block: &Bounds,
    [solid, around]: [Option<&SignedDistance>; 2],
    domain: &Bounds,
    spacing: f64,
) -> Fill {
    let (mut water, mut air) = (Vec::new(), Vec::new());
    // The layers below a surface are not spread up to the ceiling.
    let lattice = Lattice::between(block, domain, spacing, [true, false, true]);
    for (cell, mut p) in lattice.cells() {
        let [column, layer, row] = cell.map(|i| i as f64);
        let height = (surface(DVec2::new(p.x, p.z)) - block.min.y) / lattice.spacing.y;
        let layers = (height + dither(column, row)).floor().max(0.0);
        p.y = block.min.y + lattice.spacing.y * followed(layer, layers, height);
        let side = if layer < layers { &mut water } else { &mut air };
        side.push(p);
    }
    let removed = around.map_or(0, |around| {
        displace_below(&mut water, &air, solid, around, domain, spacing)
    });
    Fill {
        particles: at_rest(&water),
        removed,
    }
}

/// Layers that follow a surface.
const FOLLOWING: f64 = 4.0;

/// Height of the middle of a layer in a column of `layers` layers of water, which is `height` high,
/// all in spacings. The uppermost ones share the height that is left; layers of air go on above.
fn followed(layer: f64, layers: f64, height: f64) -> f64 {
    let still = (layers - FOLLOWING).max(0.0);
    if layer < still {
        layer + 0.5
    } else if layer < layers {
        still + (layer - still + 0.5) * (height - still) / (layers - still)
    } else {
        height + (layer - layers) + 0.5
    }
}

/// Threshold of a column: over neighbours of any number spread evenly from 0 to 1 (Roberts 2018,
/// R2), so that few columns together hold their volume to a part of a particle.
fn dither(column: f64, row: f64) -> f64 {
    (column * R2[0] + row * R2[1]).rem_euclid(1.0)
}

fn at_rest(positions: &[DVec3]) -> Particles {
    Particles {
        position: positions.iter().map(|p| p.as_vec3().to_array()).collect(),
        velocity: vec![[0.0; 3]; positions.len()],
        id: (0..positions.len() as u32).collect(),
        ..Particles::default()
    }
}

/// Returns the size of the water that a block is filled with, metres (see [`fill_blocks`]).
pub fn block_size(block: &Bounds, domain: &Bounds, spacing: f64) -> DVec3 {
    Lattice::of_block(block, domain, spacing).bounds().size()
}

/// Returns the number of particles along each axis of a block (see [`fill_blocks`]).
pub fn block_dims(block: &Bounds, domain: &Bounds, spacing: f64) -> [u64; 3] {
    Lattice::of_block(block, domain, spacing).dims
}

/// Fills blocks with whole layers of particles, each of which represents `spacing`³, x fastest.
/// Where blocks overlap, the first one fills the volume.
///
/// The number of layers along an axis is the block's size over the spacing, rounded. Between two
/// walls of the domain the layers are spread evenly: with a gap at a wall, water would slosh from
/// the start. The spacing along the other axes is chosen so that the density is that of a lattice
/// of `spacing`. A full box is rounded down. A block that reaches only the far wall
/// begins there, and any other at its least corner.
pub fn fill_blocks(blocks: &[Bounds], domain: &Bounds, spacing: f64) -> Vec<DVec3> {
    let mut positions = Vec::new();
    // Extent that each earlier block really covers, after rounding.
    let mut covered = Vec::<Bounds>::new();
    for block in blocks {
        let lattice = Lattice::of_block(block, domain, spacing);
        if covered.is_empty() {
            positions.extend(lattice.centres());
        } else {
            let grid = PointGrid::over(&positions, OVERLAP_SPACINGS * spacing);
            let is_free = |p: &DVec3| {
                !covered.iter().any(|c| c.contains(*p)) && !grid.has_near(&positions, *p)
            };
            let free: Vec<_> = lattice.centres().filter(is_free).collect();
            positions.extend(free);
        }
        covered.push(lattice.bounds());
    }
    positions
}

/// Adds the centres of a lattice over the mesh's bounds that lie inside the mesh and the domain and
/// away from existing water.
///
/// # Errors
/// Those of [`SignedDistance::from_mesh`].
pub fn fill_mesh(
    positions: &mut Vec<DVec3>,
    mesh: &TriangleMesh,
    domain: &Bounds,
    spacing: f64,
) -> Result<(), SignedDistanceError> {
    let Some(bounds) = mesh.bounds() else {
        return Ok(());
    };
    let cells = (bounds.size() / spacing).ceil();
    // The nodes of the distance grid are the lattice's centres: no interpolation.
    let first = bounds.min + DVec3::splat(0.5 * spacing);
    let centres = Bounds {
        min: first,
        max: first + spacing * (cells - DVec3::ONE).max(DVec3::ONE),
    };
    let inside = SignedDistance::from_mesh(mesh, &centres, spacing)?;
    let lattice = Lattice {
        origin: bounds.min,
        dims: inside.dims.map(|n| n as u64),
        spacing: DVec3::splat(spacing),
    };
    let room = domain.grown(-0.4 * spacing);
    let grid = PointGrid::over(positions, OVERLAP_SPACINGS * spacing);
    let found: Vec<_> = lattice
        .centres()
        .zip(&inside.values)
        .filter(|(p, distance)| {
            **distance < 0.0 && room.contains(*p) && !grid.has_near(positions, *p)
        })
        .map(|(p, _)| p)
        .collect();
    positions.extend(found);
    Ok(())
}

#[derive(Clone, Debug)]
struct Lattice {
    origin: DVec3,
    dims: [u64; 3],
    spacing: DVec3,
}

/// Relative difference from a whole number of layers that is a rounding error of the scene's
/// decimal numbers.
const WHOLE: f64 = 1e-9;

/// Least and greatest distance of layers spread between walls, in spacings. A domain of one or two
/// layers may need more than that; its layers are not spread.
const SPREAD: [f64; 2] = [0.8, 1.25];

/// Part of a layer that may be missing between walls.
const NARROWER: f64 = 0.1;

impl Lattice {
    /// Returns the lattice of a block (see [`fill_blocks`]).
    fn of_block(block: &Bounds, domain: &Bounds, spacing: f64) -> Self {
        Self::between(block, domain, spacing, [true; 3])
    }

    /// Does the same; along axes that are not to be `spread`, the block begins at its least corner.
    fn between(block: &Bounds, domain: &Bounds, spacing: f64, spread: [bool; 3]) -> Self {
        let touches = |gap: f64| gap < 0.5 * spacing;
        let room = domain.max - domain.min;
        let number = room / spacing;
        let at_far =
            [0, 1, 2].map(|axis| spread[axis] && touches(domain.max[axis] - block.max[axis]));
        let is_held = |axis: &usize| {
            let between = number[*axis] / number[*axis].round().max(1.0);
            let is_wide = (SPREAD[0]..=SPREAD[1]).contains(&between);
            is_wide && at_far[*axis] && touches(block.min[*axis] - domain.min[*axis])
        };
        let free = (0..3).filter(|axis| !is_held(axis)).count();
        let (mut layers, mut step) = ([0.0; 3], DVec3::splat(spacing));
        for axis in (0..3).filter(is_held) {
            // A full box has no surface that could rise.
            layers[axis] = match free > 0 {
                true => number[axis].round(),
                false => (number[axis] + NARROWER).floor(),
            };
            if layers[axis] > 0.0 && (number[axis] / layers[axis] - 1.0).abs() > WHOLE {
                step[axis] = room[axis] / layers[axis];
            }
        }
        let wider = (step / spacing).element_product();
        let mut origin = block.min;
        for axis in 0..3 {
            if is_held(&axis) {
                origin[axis] = domain.min[axis];
                continue;
            }
            if wider != 1.0 {
                step[axis] = spacing * wider.powf(-1.0 / free as f64);
            }
            let size = block.max[axis] - block.min[axis];
            // From the wall where the layers begin, or from the least corner to the far wall.
            let room = match at_far[axis] {
                true => room[axis],
                false => domain.max[axis] - block.min[axis],
            };
            let most = (room / step[axis] + NARROWER).floor();
            layers[axis] = (size / step[axis] + 0.5 - 1e-6).floor().min(most).max(0.0);
            let from_far = domain.max[axis] - layers[axis] * step[axis];
            if at_far[axis] && (from_far - origin[axis]).abs() > WHOLE * spacing {
                origin[axis] = from_far;
            }
        }
        Self {
            origin,
            dims: layers.map(|n| n as u64),
            spacing: step,
        }
    }

    fn bounds(&self) -> Bounds {
        let layers = DVec3::from_array(self.dims.map(|n| n as f64));
        Bounds {
            min: self.origin,
            max: self.origin + self.spacing * layers,
        }
    }

    /// Indices and centres of the cells, x fastest.
    fn cells(&self) -> impl Iterator<Item = ([u64; 3], DVec3)> + '_ {
        let [nx, ny, nz] = self.dims;
        (0..nx * ny * nz).map(move |n| {
            let cell = [n % nx, n / nx % ny, n / (nx * ny)];
            let middle = DVec3::from_array(cell.map(|i| i as f64 + 0.5));
            (cell, self.origin + self.spacing * middle)
        })
    }

    fn centres(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.cells().map(|(_, centre)| centre)
    }
}

/// Covers a mesh's surface with samples about `spacing` metres apart (one per squared spacing, none
/// nearer than 0.75 spacings to another on the same side), by dart throwing among candidates spread
/// evenly over each triangle. Samples outside of `domain` are left out, and so are those on the
/// domain's own faces whose normal points out of it.
///
/// Areas follow Akinci et al. 2012: a sample's share is 1/ΣW over its neighbours, with W a kernel
/// on the surface; the shares are then scaled so that their sum is the area inside the domain.
pub fn boundary_samples(mesh: &TriangleMesh, domain: &Bounds, spacing: f64) -> Vec<BoundarySample> {
    let mut darts = Darts::new(spacing);
    let area = darts.throw(mesh, domain, |_| true);
    let areas = darts.areas(area);
    let places = darts.positions.into_iter().zip(darts.normals);
    let samples = places.zip(areas);
    samples
        .map(|((position, normal), area)| BoundarySample {
            position,
            normal,
            area,
        })
        .collect()
}

/// Points thrown on a surface, none too near another on the same side.
pub(super) struct Darts {
    spacing: f64,
    /// Index of the triangle of each point.
    pub(super) triangles: Vec<u32>,
    pub(super) positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    grid: PointGrid,
}

impl Darts {
    pub(super) fn new(spacing: f64) -> Self {
        Self {
            spacing,
            triangles: Vec::new(),
            positions: Vec::new(),
            normals: Vec::new(),
            grid: PointGrid::with_cell(BOUNDARY_DISTANCE * spacing),
        }
    }

    /// Moves the points to `mesh`, which has the triangles of the one that they were thrown on;
    /// `place` returns the position of a point, given by its index.
    pub(super) fn carry(&mut self, mesh: &TriangleMesh, place: impl Fn(usize) -> DVec3) {
        self.grid = PointGrid::with_cell(BOUNDARY_DISTANCE * self.spacing);
        for k in 0..self.positions.len() {
            self.positions[k] = place(k);
            let area = mesh.area_vector(self.triangles[k] as usize);
            self.normals[k] = area.normalize_or_zero();
            self.grid.insert(k as u32, self.positions[k]);
        }
    }

    /// Throws points on the triangles that `on` chooses, where none is yet; returns the area of
    /// these triangles inside the domain, m².
    pub(super) fn throw(
        &mut self,
        mesh: &TriangleMesh,
        domain: &Bounds,
        on: impl Fn(usize) -> bool,
    ) -> f64 {
        let spacing = self.spacing;
        let mut area_inside = 0.0;
        for t in (0..mesh.triangles.len()).filter(|&t| on(t)) {
            let corners = mesh.corners(t);
            let area_vector = mesh.area_vector(t);
            let area = area_vector.length();
            if !(area > 0.0 && area.is_finite()) {
                continue;
            }
            let normal = area_vector / area;
            let wanted = (BOUNDARY_CANDIDATES * area / (spacing * spacing)).ceil() as u64;
            let mut inside = 0u64;
            for c in 0..wanted {
                let p = candidate(&corners, t as u64, c);
                if !domain.contains(p) || looks_out(domain, p, normal, 1e-3 * spacing) {
                    continue;
                }
                inside += 1;
                // The two sides of a thin wall do not exclude each other's samples.
                let is_taken = self.grid.any_near(&self.positions, p, |other| {
                    DVec3::dot(self.normals[other as usize], normal) > -0.5
                });
                if !is_taken {
                    self.grid.insert(self.positions.len() as u32, p);
                    self.triangles.push(t as u32);
                    self.positions.push(p);
                    self.normals.push(normal);
                }
            }
            area_inside += area * inside as f64 / wanted as f64;
        }
        area_inside
    }

    /// Returns each point's part of `area`, m².
    pub(super) fn areas(&self, area: f64) -> Vec<f64> {
        let shares = surface_shares(&self.positions, &self.normals, self.spacing);
        let scale = area / shares.iter().sum::<f64>();
        shares.into_iter().map(|share| share * scale).collect()
    }
}

/// 1/ΣW with the cone W ∝ 1 − r/R, R = two spacings.
fn surface_shares(positions: &[DVec3], normals: &[DVec3], spacing: f64) -> Vec<f64> {
    let radius = 2.0 * spacing;
    let grid = PointGrid::over(positions, radius);
    let share = |i: usize| {
        let mut sum = 0.0;
        grid.for_each_near(positions, positions[i], |j, distance| {
            if normals[j as usize].dot(normals[i]) > -0.5 {
                sum += 1.0 - distance / radius;
            }
        });
        1.0 / sum
    };
    (0..positions.len()).map(share).collect()
}

/// Returns whether `p` lies on a face of the domain and `normal` points out of it: no water
/// gets there.
fn looks_out(domain: &Bounds, p: DVec3, normal: DVec3, tolerance: f64) -> bool {
    (0..3).any(|a| {
        (p[a] - domain.min[a] < tolerance && normal[a] < -0.99)
            || (domain.max[a] - p[a] < tolerance && normal[a] > 0.99)
    })
}

/// The `index`-th point of a low-discrepancy sequence (Roberts 2018, R2) over a triangle, shifted
/// by a hash of the triangle's index.
pub(crate) fn candidate([a, b, c]: &[DVec3; 3], triangle: u64, index: u64) -> DVec3 {
    let coordinate = |axis: u64| {
        let shift = uniform(2 * triangle + axis);
        (shift + R2[axis as usize] * (index + 1) as f64).fract()
    };
    let (mut u, mut v) = (coordinate(0), coordinate(1));
    // Folds the far half of the parallelogram back.
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    *a + (*b - *a) * u + (*c - *a) * v
}

/// A pseudo-random number from 0 to 1, determined by `seed`.
pub(super) fn uniform(seed: u64) -> f64 {
    hash(seed) as f64 / u64::MAX as f64
}

fn hash(seed: u64) -> u64 {
    finalized(seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// The finalizer of SplitMix64 (Steele, Lea and Flood 2014): each bit depends on all bits.
pub(crate) fn finalized(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Points in hashed cells with chaining; a search visits the 27 cells around a point.
///
/// Two cells may share a bucket, whose chain then holds the points of both: at least as many
/// buckets as points (a power of two) keep chains short, and every hit is checked for its cell, so
/// that none counts twice.
struct PointGrid {
    cell: f64,
    heads: Vec<u32>,
    /// Cell and next entry of each point.
    entries: Vec<([i64; 3], u32)>,
    /// Point of each entry.
    points: Vec<u32>,
}

const NO_ENTRY: u32 = u32::MAX;

impl PointGrid {
    fn with_cell(cell: f64) -> Self {
        Self {
            cell,
            heads: vec![NO_ENTRY; 1024],
            entries: Vec::new(),
            points: Vec::new(),
        }
    }

    fn over(positions: &[DVec3], cell: f64) -> Self {
        let mut grid = Self::with_cell(cell);
        grid.heads = vec![NO_ENTRY; positions.len().max(1024).next_power_of_two()];
        for (i, p) in positions.iter().enumerate() {
            grid.insert(i as u32, *p);
        }
        grid
    }

    fn cell_of(&self, p: DVec3) -> [i64; 3] {
        (p / self.cell).floor().to_array().map(|x| x as i64)
    }

    fn bucket(&self, cell: [i64; 3]) -> usize {
        let key = cell.iter().fold(0u64, |h, &c| {
            (h ^ c as u64)
                .wrapping_mul(0x9e37_79b9_7f4a_7c15)
                .rotate_left(29)
        });
        key as usize & (self.heads.len() - 1)
    }

    fn insert(&mut self, point: u32, p: DVec3) {
        if self.entries.len() >= self.heads.len() {
            self.grow();
        }
        let cell = self.cell_of(p);
        let bucket = self.bucket(cell);
        self.entries.push((cell, self.heads[bucket]));
        self.points.push(point);
        self.heads[bucket] = self.entries.len() as u32 - 1;
    }

    fn grow(&mut self) {
        self.heads = vec![NO_ENTRY; 2 * self.heads.len()];
        for entry in 0..self.entries.len() {
            let bucket = self.bucket(self.entries[entry].0);
            self.entries[entry].1 = self.heads[bucket];
            self.heads[bucket] = entry as u32;
        }
    }

    /// Visits the points within one cell size of `p`, with their distances.
    fn for_each_near(&self, positions: &[DVec3], p: DVec3, mut visit: impl FnMut(u32, f64)) {
        self.search(positions, p, |point, distance| {
            visit(point, distance);
            false
        });
    }

    fn has_near(&self, positions: &[DVec3], p: DVec3) -> bool {
        self.any_near(positions, p, |_| true)
    }

    fn any_near(&self, positions: &[DVec3], p: DVec3, mut counts: impl FnMut(u32) -> bool) -> bool {
        self.search(positions, p, |point, _| counts(point))
    }

    /// Visits near points until `visit` returns `true`; returns whether it did.
    fn search(
        &self,
        positions: &[DVec3],
        p: DVec3,
        mut visit: impl FnMut(u32, f64) -> bool,
    ) -> bool {
        let [x, y, z] = self.cell_of(p);
        // The centre cell first: most searches end there.
        for n in [13].into_iter().chain(0..13).chain(14..27) {
            let cell = [x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1];
            let mut entry = self.heads[self.bucket(cell)];
            while entry != NO_ENTRY {
                let (entry_cell, next) = self.entries[entry as usize];
                if entry_cell == cell {
                    let point = self.points[entry as usize];
                    let squared = (positions[point as usize] - p).length_squared();
                    if squared < self.cell * self.cell && visit(point, squared.sqrt()) {
                        return true;
                    }
                }
                entry = next;
            }
        }
        false
    }
}

#[cfg(test)]
mod tests;
