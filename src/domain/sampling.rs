//! Particles from blocks, meshes and surfaces.
//!
//! Everything here is a function of its arguments alone: random numbers are hashed from indices.

use glam::DVec3;

use super::{
    bounds::Bounds,
    mesh::TriangleMesh,
    particles::Particles,
    signed_distance::{SignedDistance, SignedDistanceError},
};

/// Centres nearer than this many spacings to water that is there already are left out where
/// regions of water overlap.
const OVERLAP_SPACINGS: f64 = 0.75;

/// Least distance of boundary samples in spacings, chosen so that there is one sample a spacing
/// squared within a few per cent. (0.835 would do if random sequential packing saturated; with
/// the candidates below it does not, and gave 0.8.)
const BOUNDARY_DISTANCE: f64 = 0.75;

/// Candidates a spacing squared. With 12 no place on a box or sphere is farther than 1.2 spacings
/// from a sample (tested).
const BOUNDARY_CANDIDATES: f64 = 12.0;

/// A boundary particle of a solid's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundarySample {
    /// Metres.
    pub position: DVec3,
    /// Unit length, outward.
    pub normal: DVec3,
    /// Area of the surface that it stands for, m².
    pub area: f64,
}

/// The water at the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Fill {
    /// Particles at rest, ids from 0 without gaps, in the order of blocks, then meshes, x fastest in each.
    pub particles: Particles,
    /// How many were left out because a solid is there.
    pub removed: usize,
}

/// Fills blocks and meshes with particles on lattices of `spacing` metres and removes those less
/// than half a spacing from `solid`.
///
/// # Errors
/// A water mesh without inside, or too large a grid for it.
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
    let removed = solid.map_or(0, |solid| {
        remove_inside(&mut positions, solid, 0.5 * spacing)
    });
    let particles = Particles {
        position: positions.iter().map(|p| p.as_vec3().to_array()).collect(),
        velocity: vec![[0.0; 3]; positions.len()],
        id: (0..positions.len() as u32).collect(),
        ..Particles::default()
    };
    Ok(Fill { particles, removed })
}

/// Particles along each axis of a block: its size over the spacing, rounded to the nearest so
/// that the volume is kept, but never a layer less than half a spacing (less a tenth, for the
/// rounding) from the domain's far wall.
pub fn block_dims(block: &Bounds, domain: &Bounds, spacing: f64) -> [u64; 3] {
    [0, 1, 2].map(|axis| {
        let size = block.max[axis] - block.min[axis];
        let room = domain.max[axis] - block.min[axis];
        let nearest = (size / spacing + 0.5 - 1e-6).floor();
        let most = (room / spacing + 0.1).floor();
        nearest.min(most).max(0.0) as u64
    })
}

/// Centres at `min + (i + ½) · spacing` in each block, x fastest. Where blocks overlap, the first
/// one fills the place.
pub fn fill_blocks(blocks: &[Bounds], domain: &Bounds, spacing: f64) -> Vec<DVec3> {
    let mut positions = Vec::new();
    // What each earlier block really covers, after the rounding.
    let mut covered = Vec::<Bounds>::new();
    for block in blocks {
        let dims = block_dims(block, domain, spacing);
        let lattice = Lattice {
            origin: block.min,
            dims,
            spacing,
        };
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
        let size = spacing * DVec3::from_array(dims.map(|n| n as f64));
        covered.push(Bounds {
            min: block.min,
            max: block.min + size,
        });
    }
    positions
}

/// Adds the centres of a lattice over the mesh's bounds that lie inside the mesh and the domain,
/// and not where water is already.
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
    // Nodes of the distance are the lattice's own centres: no interpolation.
    let first = bounds.min + DVec3::splat(0.5 * spacing);
    let centres = Bounds {
        min: first,
        max: first + spacing * (cells - DVec3::ONE).max(DVec3::ONE),
    };
    let inside = SignedDistance::from_mesh(mesh, &centres, spacing)?;
    let lattice = Lattice {
        origin: bounds.min,
        dims: inside.dims.map(|n| n as u64),
        spacing,
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

/// Removes what is less than `clearance` metres outside of `solid`, or inside; returns how many.
pub fn remove_inside(positions: &mut Vec<DVec3>, solid: &SignedDistance, clearance: f64) -> usize {
    let before = positions.len();
    positions.retain(|p| solid.sample(*p) >= clearance);
    before - positions.len()
}

struct Lattice {
    origin: DVec3,
    dims: [u64; 3],
    spacing: f64,
}

impl Lattice {
    fn centres(&self) -> impl Iterator<Item = DVec3> + '_ {
        let [nx, ny, nz] = self.dims;
        (0..nx * ny * nz).map(move |n| {
            let cell = [n % nx, n / nx % ny, n / (nx * ny)].map(|i| i as f64 + 0.5);
            self.origin + self.spacing * DVec3::from_array(cell)
        })
    }
}

/// Covers a mesh's surface with samples about `spacing` metres apart (one a spacing squared, none
/// nearer than 0.75 of it to another on the same side), by throwing darts at candidates that lie
/// evenly over each triangle. Samples outside of `domain`, and those on the domain's own faces
/// that look out of it, are left out.
///
/// Areas follow Akinci et al. 2012: a sample's share is 1/ΣW over its neighbours, W a kernel on
/// the surface; all shares together are then scaled to the area inside the domain.
pub fn boundary_samples(mesh: &TriangleMesh, domain: &Bounds, spacing: f64) -> Vec<BoundarySample> {
    let least = BOUNDARY_DISTANCE * spacing;
    let mut positions = Vec::new();
    let mut normals = Vec::new();
    let mut grid = PointGrid::with_cell(least);
    let mut area_inside = 0.0;
    for t in 0..mesh.triangles.len() {
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
            // Two sides of a thin wall do not crowd each other out.
            let is_taken = grid.any_near(&positions, p, |other| {
                DVec3::dot(normals[other as usize], normal) > -0.5
            });
            if !is_taken {
                grid.insert(positions.len() as u32, p);
                positions.push(p);
                normals.push(normal);
            }
        }
        area_inside += area * inside as f64 / wanted as f64;
    }
    let shares = surface_shares(&positions, &normals, spacing);
    let scale = area_inside / shares.iter().sum::<f64>();
    positions
        .into_iter()
        .zip(normals)
        .zip(shares)
        .map(|((position, normal), share)| BoundarySample {
            position,
            normal,
            area: share * scale,
        })
        .collect()
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

/// Whether `p` lies on a face of the domain and `normal` points out of it: no water comes there.
fn looks_out(domain: &Bounds, p: DVec3, normal: DVec3, tolerance: f64) -> bool {
    (0..3).any(|a| {
        (p[a] - domain.min[a] < tolerance && normal[a] < -0.99)
            || (domain.max[a] - p[a] < tolerance && normal[a] > 0.99)
    })
}

/// The `c`-th point of a low-discrepancy sequence (Roberts 2018, R2) over a triangle, shifted by
/// a hash of the triangle's index.
fn candidate([a, b, c]: &[DVec3; 3], triangle: u64, index: u64) -> DVec3 {
    const R2: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    let coordinate = |axis: u64| {
        let shift = uniform(2 * triangle + axis);
        (shift + R2[axis as usize] * (index + 1) as f64).fract()
    };
    let (mut u, mut v) = (coordinate(0), coordinate(1));
    // The far half of the parallelogram, folded back.
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    *a + (*b - *a) * u + (*c - *a) * v
}

/// A number from 0 to 1 by chance, the same for the same `seed`.
pub(super) fn uniform(seed: u64) -> f64 {
    hash(seed) as f64 / u64::MAX as f64
}

/// SplitMix64's finaliser (Steele et al. 2014).
fn hash(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Points in hashed cells, chained; a search looks at the 27 cells around.
///
/// Two cells may share a bucket, and their points are then met in both: an even bucket count of
/// at least the points keeps chains short, and every hit is tested by its cell before use, so
/// that none counts twice.
struct PointGrid {
    cell: f64,
    heads: Vec<u32>,
    /// Cell and next entry of each point.
    entries: Vec<([i64; 3], u32)>,
    /// The point of each entry.
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

    /// Visits points within one cell size of `p`, with their distances.
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

    /// Visits near points until `visit` says that it is enough; whether it did.
    fn search(
        &self,
        positions: &[DVec3],
        p: DVec3,
        mut visit: impl FnMut(u32, f64) -> bool,
    ) -> bool {
        let [x, y, z] = self.cell_of(p);
        // The middle first: most searches end there.
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
mod tests {
    use super::super::mesh::tests::{box_mesh, sphere};
    use super::*;

    fn cuboid(min: [f64; 3], max: [f64; 3]) -> Bounds {
        Bounds {
            min: min.into(),
            max: max.into(),
        }
    }

    /// The naive search that the hashed one is held against.
    fn least_distance(positions: &[DVec3]) -> f64 {
        let mut least = f64::INFINITY;
        for (i, a) in positions.iter().enumerate() {
            for b in &positions[..i] {
                least = least.min((*a - *b).length());
            }
        }
        least
    }

    #[test]
    fn the_city_scene_starts_with_201_000_particles() {
        let domain = cuboid([0.0; 3], [25.0, 12.6, 15.0]);
        let block = cuboid([0.0; 3], [13.4, 1.0, 15.0]);
        let positions = fill_blocks(&[block], &domain, 0.1);
        assert_eq!(positions.len(), 134 * 10 * 150);
        assert!((positions[0] - DVec3::splat(0.05)).length() < 1e-15);
        assert!((positions[1] - DVec3::new(0.15, 0.05, 0.05)).length() < 1e-15);
        assert!(positions.iter().all(|p| domain.grown(-0.0499).contains(*p)));
    }

    #[test]
    fn a_block_that_is_no_whole_number_of_spacings_keeps_its_volume() {
        let domain = cuboid([0.0; 3], [10.0; 3]);
        let block = cuboid([0.0; 3], [1.0, 1.0, 10.0]);
        // 5.88 layers become 6; 58.8 along z would pass the wall, where 58 fit.
        assert_eq!(block_dims(&block, &domain, 0.17), [6, 6, 58]);
        assert_eq!(
            block_dims(&cuboid([0.0; 3], [0.0; 3]), &domain, 0.17),
            [0; 3]
        );
    }

    #[test]
    fn overlapping_blocks_leave_no_twins() {
        let domain = cuboid([0.0; 3], [4.0; 3]);
        let first = cuboid([0.0; 3], [1.0, 1.0, 1.0]);
        for shift in [0.0, 0.5, 0.53, 0.95, 1.0] {
            let second = cuboid([shift, 0.0, 0.0], [1.0 + shift, 1.0, 1.0]);
            let positions = fill_blocks(&[first, second], &domain, 0.1);
            assert!(least_distance(&positions) >= 0.074, "{shift}");
            let volume = positions.len() as f64 * 1e-3;
            // A misaligned seam loses at most one layer of 0.1 m.
            assert!(
                volume <= 1.0 + shift + 1e-9 && volume > 0.9 + shift - 1e-9,
                "{shift} {volume}"
            );
        }
        let whole = fill_blocks(&[first, first], &domain, 0.1);
        assert_eq!(whole, fill_blocks(&[first], &domain, 0.1));
    }

    #[test]
    fn a_water_mesh_is_filled_and_a_solid_displaces() {
        let domain = cuboid([-2.0; 3], [2.0; 3]);
        let drop = sphere(DVec3::ZERO, 0.8, 24);
        let fill = fill_water(&[], [&drop], None, &domain, 0.1).expect("closed");
        let volume = fill.particles.len() as f64 * 1e-3;
        // Each surface cell is counted whole or not at all: 800 cells of 1e-3 m³, off by half at
        // random, are √800/2 of 2 130, 0.7 %; four times that is allowed.
        let exact = drop.signed_volume();
        assert!((volume / exact - 1.0).abs() < 0.03, "{volume} {exact}");

        let block = cuboid([-1.0; 3], [1.0; 3]);
        let solid = SignedDistance::from_mesh(&drop, &domain, 0.1).expect("closed");
        let wet = fill_water(&[block], [], Some(&solid), &domain, 0.1).expect("no mesh");
        assert_eq!(wet.particles.len() + wet.removed, 8000);
        assert!(wet.removed > fill.particles.len());
        let nearest = wet
            .particles
            .position
            .iter()
            .map(|p| DVec3::new(p[0].into(), p[1].into(), p[2].into()).length() - 0.8);
        // Half a spacing, less the mesh's sagitta and the interpolation's error.
        assert!(nearest.fold(f64::INFINITY, f64::min) > 0.045);
        assert_eq!(
            wet.particles.id,
            (0..wet.particles.len() as u32).collect::<Vec<_>>()
        );
    }

    #[test]
    fn water_meshes_do_not_double_blocks() {
        let domain = cuboid([0.0; 3], [2.0; 3]);
        let block = cuboid([0.0; 3], [1.0; 3]);
        let fill = fill_water(&[block], [&box_mesh(block)], None, &domain, 0.1).expect("closed");
        assert_eq!(fill.particles.len(), 1000);
    }

    #[test]
    fn boundary_samples_are_even_and_share_the_area() {
        let spacing = 0.1;
        let domain = cuboid([-5.0; 3], [5.0; 3]);
        let box_bounds = cuboid([0.0; 3], [1.5, 0.9, 1.1]);
        for mesh in [box_mesh(box_bounds), sphere(DVec3::ZERO, 0.9, 30)] {
            let samples = boundary_samples(&mesh, &domain, spacing);
            let positions: Vec<_> = samples.iter().map(|s| s.position).collect();
            assert!(least_distance(&positions) >= 0.75 * spacing);
            let area = mesh.area();
            let share = area / samples.len() as f64;
            assert!((share / (spacing * spacing) - 1.0).abs() < 0.15, "{share}");
            let sum: f64 = samples.iter().map(|s| s.area).sum();
            assert!((sum / area - 1.0).abs() < 1e-9);
            let spread = samples.iter().map(|s| s.area / share);
            assert!(spread.clone().fold(0.0, f64::max) < 1.7);
            assert!(spread.fold(f64::INFINITY, f64::min) > 0.5);
            // No place on the surface is farther from a sample than this.
            let grid = PointGrid::over(&positions, 1.2 * spacing);
            for t in 0..mesh.triangles.len() {
                for c in 0..200 {
                    let p = candidate(&mesh.corners(t), 77_000 + t as u64, c);
                    assert!(grid.has_near(&positions, p), "a hole at {p}");
                }
            }
            for s in &samples {
                assert!((s.normal.length() - 1.0).abs() < 1e-12);
            }
            assert_eq!(samples, boundary_samples(&mesh, &domain, spacing));
        }
    }

    #[test]
    fn a_share_is_one_over_the_sum_of_the_kernel_on_its_own_side() {
        // A row one spacing apart on one side, and a sample of the other side at the middle's place.
        let row = [-0.1, 0.0, 0.1, 0.0].map(|x| DVec3::new(x, 0.0, 0.0));
        let normals = [DVec3::Y, DVec3::Y, DVec3::Y, -DVec3::Y];
        // 1 − r/R with R two spacings: 1 of itself, ½ of each neighbour; from end to end r = R.
        let expected = [1.0 / 1.5, 1.0 / 2.0, 1.0 / 1.5, 1.0];
        for (share, exact) in surface_shares(&row, &normals, 0.1).iter().zip(expected) {
            // A handful of operations, each rounded once.
            assert!(
                (share - exact).abs() < 8.0 * f64::EPSILON,
                "{share} {exact}"
            );
        }
    }

    #[test]
    fn samples_outside_the_domain_and_on_its_floor_are_left_out() {
        let domain = cuboid([0.0; 3], [2.0; 3]);
        let tower = box_mesh(cuboid([0.5, 0.0, 0.5], [1.0, 3.0, 1.0]));
        let samples = boundary_samples(&tower, &domain, 0.1);
        assert!(samples.iter().all(|s| domain.contains(s.position)));
        assert!(samples.iter().all(|s| s.normal.y.abs() < 1e-9));
        let sum: f64 = samples.iter().map(|s| s.area).sum();
        // Four walls of 0.5 by 2.0; the candidates on a wall count its part inside to 1/√n.
        assert!((sum / 4.0 - 1.0).abs() < 0.02, "{sum}");
    }

    #[test]
    fn both_sides_of_a_thin_wall_are_covered() {
        let domain = cuboid([-1.0; 3], [3.0; 3]);
        let wall = box_mesh(cuboid([0.0; 3], [2.0, 1.0, 0.03]));
        let samples = boundary_samples(&wall, &domain, 0.1);
        let front = samples.iter().filter(|s| s.normal.z > 0.5).count() as f64;
        let back = samples.iter().filter(|s| s.normal.z < -0.5).count() as f64;
        assert!(
            (front / back - 1.0).abs() < 0.2 && front > 130.0,
            "{front} {back}"
        );
    }

    #[test]
    fn a_city_of_surface_takes_a_second_or_two() {
        let domain = cuboid([0.0; 3], [40.0; 3]);
        let block = box_mesh(cuboid([1.0; 3], [21.0, 11.0, 19.0]));
        let start = std::time::Instant::now();
        let samples = boundary_samples(&block, &domain, 0.1);
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "{} samples on {} m² in {seconds:.2} s",
            samples.len(),
            block.area()
        );
        assert!(seconds < 15.0);
        assert!(samples.len() > 100_000);
    }
}
