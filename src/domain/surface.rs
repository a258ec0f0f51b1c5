//! The water of a frame as grids: a level set of its surface, and its velocity on cell faces.
//!
//! The surface is that of Zhu and Bridson 2005, φ = |x − x̄| − r with x̄ the particles' mean
//! position under the kernel (1 − s²)³. In the narrow band it is converted to a distance: next to
//! the surface from the zero crossings along each axis, farther out by the first-order upwind
//! scheme for |∇φ| = 1 (Rouy and Tourin 1992). Velocities are means under trilinear weights, as in
//! particle-to-grid transfer. Both depend only on the frame: the order of summation does not change
//! with the number of threads, so that the same frame gives the same bytes.

use glam::DVec3;

use super::{
    bricks::CELLS, parallel, particles::Particles, sparse_grid::SparseGrid, voxels::Voxels,
};

/// Half-width of the narrow band, voxels; the default of OpenVDB.
pub const BAND: f64 = 3.0;

/// Number of voxels by which velocities are extrapolated beyond the faces that particles reach.
const EXTRAPOLATED: usize = 3;

/// Largest number of bricks in a box that a grid may cover: their table then takes 1 GiB.
pub const MAX_BRICKS: f64 = (1u64 << 28) as f64;

/// Voxel grid onto which a frame is rasterised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Raster {
    /// World position of the corner where the indices begin, metres.
    pub origin: DVec3,
    /// Edge length of a voxel, metres.
    pub voxel_size: f64,
    /// Distance between neighbouring particles at rest, metres.
    pub particle_spacing: f64,
}

impl Raster {
    /// Allowed voxel sizes, particle spacings.
    pub const VOXEL_RATIO: std::ops::RangeInclusive<f64> = 0.25..=8.0;

    /// Radius R of the surface's kernel, metres: two particle spacings (Zhu and Bridson), but at
    /// least 1.5 voxels. φ is more curved for smaller R, and interpolated linearly between voxels:
    /// on still water that displaces the surface by up to 0.2 voxels for R of one voxel, and by 0.1
    /// for 1.5 (measured).
    fn support(&self) -> f64 {
        (2.0 * self.particle_spacing).max(1.5 * self.voxel_size)
    }

    /// Computes the signed distance to the surface of the water at the voxels' centres, metres,
    /// negative inside; the narrow band is active.
    pub fn surface(&self, particles: &Particles) -> SparseGrid<f32> {
        let background = (BAND * self.voxel_size) as f32;
        let mut grid = SparseGrid {
            origin: self.origin,
            voxel_size: self.voxel_size,
            background,
            leaves: Vec::new(),
            inside: Vec::new(),
        };
        let reach = self.support() / self.voxel_size + BAND + 1.0;
        let Some(voxels) = Voxels::new(particles, self.origin, self.voxel_size, reach) else {
            return grid;
        };
        let level = self.averaged_kernel(&voxels);
        let distance = redistanced(&voxels, &level);
        let found: Vec<_> = parallel::map(voxels.slots(), |slot| {
            let leaf = voxels.leaf(slot, |at| {
                let sign = if level[at] < 0.0 { -1.0 } else { 1.0 };
                let is_active = distance[at] < BAND as f32;
                let size = if is_active {
                    distance[at] * self.voxel_size as f32
                } else {
                    background
                };
                (sign * size, is_active)
            });
            // Without a band there is no surface, so all voxels have the sign of the first.
            (
                leaf,
                level[slot * CELLS as usize] < 0.0,
                voxels.origin(slot),
            )
        });
        for (leaf, is_inside, origin) in found {
            match leaf {
                Some(leaf) => grid.leaves.push(leaf),
                None if is_inside => grid.inside.push(origin),
                None => {}
            }
        }
        grid.leaves.sort_unstable_by_key(|leaf| leaf.origin);
        grid.inside.sort_unstable();
        grid
    }

    /// φ of Zhu and Bridson at the voxels' centres, in voxels; where no particle is within reach,
    /// its lower bound there.
    fn averaged_kernel(&self, voxels: &Voxels) -> Vec<f32> {
        let support = self.support() / self.voxel_size;
        let spacing = self.particle_spacing / self.voxel_size;
        let radius = rest_radius(spacing, support) as f32;
        let support = support as f32;
        let mut level = vec![support - radius; voxels.len()];
        voxels.for_each_brick(&mut level, |slot, level| {
            // Σ w dx, Σ w dy, Σ w dz, Σ w, with d = voxel − particle.
            let mut sums = [[0.0f32; CELLS as usize]; 4];
            voxels.for_each_near(slot, support.ceil() as usize, |p, _| {
                add_kernel(&mut sums, p, support);
            });
            let [x, y, z, w] = &sums;
            for (at, level) in level.iter_mut().enumerate() {
                // Below this the quotient is round-off; such a particle is almost out of reach.
                if w[at] > 1e-12 {
                    *level =
                        (x[at] * x[at] + y[at] * y[at] + z[at] * z[at]).sqrt() / w[at] - radius;
                }
            }
        });
        level
    }

    /// Computes the velocity, m/s: component c of voxel (i, j, k) is on the face between it and the
    /// previous voxel along c. Extrapolated a few voxels beyond the water; a voxel is active if all
    /// three components are known.
    pub fn velocity(&self, particles: &Particles) -> SparseGrid<[f32; 3]> {
        let mut grid = SparseGrid {
            origin: self.origin,
            voxel_size: self.voxel_size,
            background: [0.0; 3],
            leaves: Vec::new(),
            inside: Vec::new(),
        };
        let reach = EXTRAPOLATED as f64 + 2.0;
        let Some(voxels) = Voxels::new(particles, self.origin, self.voxel_size, reach) else {
            return grid;
        };
        let faces = face_means(&voxels, particles).map(|means| extrapolated(&voxels, means));
        grid.leaves = parallel::flat_map(voxels.slots(), |slot| {
            voxels.leaf(slot, |at| {
                let [x, y, z] = [0, 1, 2].map(|axis| faces[axis][at]);
                match (x, y, z) {
                    (Some(x), Some(y), Some(z)) => ([x, y, z], true),
                    _ => ([0.0; 3], false),
                }
            })
        });
        grid.leaves.sort_unstable_by_key(|leaf| leaf.origin);
        grid
    }
}

/// Radius r for which water at rest ends half a spacing beyond its outermost particles: |x − x̄|
/// there over half a lattice, interpolated between the voxels above and below, averaged over their
/// positions and along the surface. In voxels, like the arguments.
fn rest_radius(spacing: f64, support: f64) -> f64 {
    const SAMPLES: i32 = 4;
    let middle = |k: i32| (f64::from(k) + 0.5) / f64::from(SAMPLES);
    let sum: f64 = (0..SAMPLES.pow(3))
        .map(|k| {
            let (x, z) = (middle(k % SAMPLES), middle(k / SAMPLES % SAMPLES));
            let below = middle(k / SAMPLES.pow(2));
            let at = |height| lattice_offset(spacing, support, DVec3::new(x, height, z));
            (1.0 - below) * at(-below) + below * at(1.0 - below)
        })
        .sum();
    sum / f64::from(SAMPLES.pow(3))
}

/// Same without voxels, for a spacing of 1: the mean along the surface of |x − x̄| half a spacing
/// above the outermost particles.
pub(super) fn calm_radius(support: f64) -> f64 {
    const SAMPLES: i32 = 16;
    let middle = |k: i32| (f64::from(k) + 0.5) / f64::from(SAMPLES);
    let sum: f64 = (0..SAMPLES.pow(2))
        .map(|k| {
            let (x, z) = (middle(k % SAMPLES), middle(k / SAMPLES));
            lattice_offset(1.0, support, DVec3::new(x, 0.0, z))
        })
        .sum();
    sum / f64::from(SAMPLES.pow(2))
}

/// |x − x̄| at `place` over half a lattice that fills y < 0; x and z in spacings.
fn lattice_offset(spacing: f64, support: f64, place: DVec3) -> f64 {
    let layers = (support / spacing).ceil() as i32 + 1;
    let deepest = ((support - place.y) / spacing).ceil() as i32;
    let (mut weights, mut mean) = (0.0, DVec3::ZERO);
    for x in -layers..=layers {
        for z in -layers..=layers {
            for y in 0..=deepest {
                let [x, y, z] = [x, y, z].map(f64::from);
                let d = DVec3::new(
                    spacing * (x + place.x),
                    -spacing * (y + 0.5) - place.y,
                    spacing * (z + place.z),
                );
                let w = (1.0 - d.length_squared() / (support * support))
                    .max(0.0)
                    .powi(3);
                weights += w;
                mean += w * d;
            }
        }
    }
    if weights > 0.0 {
        mean.length() / weights
    } else {
        support
    }
}

/// Adds a particle at `p`, in voxels from a brick's corner, to the sums of its voxels.
fn add_kernel(sums: &mut [[f32; CELLS as usize]; 4], p: [f32; 3], support: f32) {
    let low = p.map(|x| (x - support - 0.5).ceil().max(0.0) as usize);
    let end = p.map(|x| (x + support + 0.5).floor().clamp(0.0, 8.0) as usize);
    let inverse = 1.0 / (support * support);
    for z in low[2]..end[2] {
        let dz = z as f32 + 0.5 - p[2];
        for y in low[1]..end[1] {
            let dy = y as f32 + 0.5 - p[1];
            for x in low[0]..end[0] {
                let dx = x as f32 + 0.5 - p[0];
                let s = (1.0 - (dx * dx + dy * dy + dz * dz) * inverse).max(0.0);
                let w = s * s * s;
                let at = x + 8 * y + 64 * z;
                sums[0][at] += w * dx;
                sums[1][at] += w * dy;
                sums[2][at] += w * dz;
                sums[3][at] += w;
            }
        }
    }
}

/// Unsigned distance to the zero crossing of `level`, in voxels; infinite beyond the band.
fn redistanced(voxels: &Voxels, level: &[f32]) -> Vec<f32> {
    let mut distance = vec![f32::INFINITY; level.len()];
    voxels.for_each_brick(&mut distance, |slot, distance| {
        for (local, distance) in distance.iter_mut().enumerate() {
            *distance = beside_surface(voxels, level, slot, local);
        }
    });
    let fixed = distance.clone();
    // Each round settles the voxels whose upwind neighbours are settled; that takes at most √3
    // steps per voxel of distance.
    let rounds = (BAND * 3f64.sqrt()).ceil() as usize + 1;
    for _ in 0..rounds {
        let before = distance.clone();
        voxels.for_each_brick(&mut distance, |slot, distance| {
            for (local, distance) in distance.iter_mut().enumerate() {
                if fixed[slot * CELLS as usize + local].is_finite() {
                    continue;
                }
                let upwind = [0, 1, 2].map(|axis| {
                    let at = |step| before[voxels.neighbor(slot, local, axis, step)];
                    at(-1).min(at(1))
                });
                let solved = upwind_distance(upwind);
                if solved < BAND as f32 + 1.0 {
                    *distance = solved;
                }
            }
        });
    }
    distance
}

/// Distance from a voxel's centre to the surface, in voxels, from its crossings on the lines to the
/// neighbours; infinite without any. Exact for a plane that crosses each axis within a voxel or not
/// at all.
fn beside_surface(voxels: &Voxels, level: &[f32], slot: usize, local: usize) -> f32 {
    let here = level[slot * CELLS as usize + local];
    let mut inverse_squares = 0.0;
    for axis in 0..3 {
        let crossing = |step| {
            let at = voxels.neighbor(slot, local, axis, step);
            // Slot 0 holds no particle, and its neighbours have none within reach: both
            // are outside.
            let there = level[at];
            if (here < 0.0) == (there < 0.0) {
                f32::INFINITY
            } else {
                here / (here - there)
            }
        };
        let nearest = crossing(-1).min(crossing(1)).max(1e-6);
        inverse_squares += 1.0 / (nearest * nearest);
    }
    // 1/√0 for a voxel without a crossing.
    1.0 / inverse_squares.sqrt()
}

/// Solves Σ max(d − aᵢ, 0)² = 1, with aᵢ the smaller neighbour along each axis.
fn upwind_distance(mut a: [f32; 3]) -> f32 {
    a.sort_unstable_by(f32::total_cmp);
    let one = a[0] + 1.0;
    if one <= a[1] {
        return one;
    }
    let difference = a[1] - a[0];
    let two = 0.5 * (a[0] + a[1] + (2.0 - difference * difference).sqrt());
    if two <= a[2] {
        return two;
    }
    let sum = a[0] + a[1] + a[2];
    let squares = a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
    (sum + (sum * sum - 3.0 * (squares - 1.0)).max(0.0).sqrt()) / 3.0
}

/// Mean velocity along each axis on the faces that particles reach.
fn face_means(voxels: &Voxels, particles: &Particles) -> [Vec<Option<f32>>; 3] {
    [0, 1, 2].map(|axis| {
        let mut means = vec![None; voxels.len()];
        voxels.for_each_brick(&mut means, |slot, means| {
            let mut sums = [[0.0f32; 2]; CELLS as usize];
            voxels.for_each_near(slot, 1, |p, index| {
                add_weights(&mut sums, p, axis, particles.velocity[index][axis]);
            });
            for (mean, [sum, weight]) in means.iter_mut().zip(sums) {
                // Below this the quotient is round-off.
                *mean = (weight > 1e-6).then(|| sum / weight);
            }
        });
        means
    })
}

/// Adds a particle at `p`, in voxels from a brick's corner, to Σ w v and Σ w of the eight
/// surrounding faces of `axis` that belong to the brick.
fn add_weights(sums: &mut [[f32; 2]; CELLS as usize], p: [f32; 3], axis: usize, velocity: f32) {
    // Face centres have whole coordinates along their axis, and half ones along the others.
    let from_first: [f32; 3] = std::array::from_fn(|a| if a == axis { p[a] } else { p[a] - 0.5 });
    let first = from_first.map(|x| x.floor() as i32);
    for corner in 0..8 {
        let side = [corner & 1, corner >> 1 & 1, corner >> 2];
        let at: [i32; 3] = std::array::from_fn(|a| first[a] + side[a]);
        if at.iter().any(|x| !(0..8).contains(x)) {
            continue;
        }
        let w: f32 = (0..3)
            .map(|a| 1.0 - (at[a] as f32 - from_first[a]).abs())
            .product();
        let sum = &mut sums[(at[0] + 8 * at[1] + 64 * at[2]) as usize];
        sum[0] += w * velocity;
        sum[1] += w;
    }
}

/// Extrapolates outward, layer by layer, by the mean of the known neighbours.
fn extrapolated(voxels: &Voxels, mut values: Vec<Option<f32>>) -> Vec<Option<f32>> {
    for _ in 0..EXTRAPOLATED {
        let before = values.clone();
        voxels.for_each_brick(&mut values, |slot, values| {
            for (local, value) in values.iter_mut().enumerate().filter(|(_, v)| v.is_none()) {
                let (mut sum, mut count) = (0.0, 0.0);
                for axis in 0..3 {
                    for step in [-1, 1] {
                        if let Some(known) = before[voxels.neighbor(slot, local, axis, step)] {
                            sum += known;
                            count += 1.0;
                        }
                    }
                }
                *value = (count > 0.0).then(|| sum / count);
            }
        });
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse_grid::Leaf;

    const D: f64 = 0.1;

    fn raster(voxel_size: f64) -> Raster {
        Raster {
            origin: DVec3::new(-0.3, 0.0, 0.2),
            voxel_size,
            particle_spacing: D,
        }
    }

    /// Lattice points within `inside`, with velocities from `velocity`.
    fn water(
        counts: [i32; 3],
        inside: impl Fn(DVec3) -> bool,
        velocity: impl Fn(DVec3) -> DVec3,
    ) -> Particles {
        let mut particles = Particles::default();
        for z in 0..counts[2] {
            for y in 0..counts[1] {
                for x in 0..counts[0] {
                    let p = D * (DVec3::new(x.into(), y.into(), z.into()) + 0.5);
                    if inside(p) {
                        particles.position.push(p.as_vec3().to_array());
                        particles.velocity.push(velocity(p).as_vec3().to_array());
                        particles.id.push(particles.id.len() as u32);
                    }
                }
            }
        }
        particles
    }

    fn values<T: Copy>(grid: &SparseGrid<T>) -> impl Iterator<Item = (DVec3, [i32; 3], T)> {
        let centre = |at: [i32; 3]| {
            grid.origin + grid.voxel_size * (DVec3::from_array(at.map(f64::from)) + 0.5)
        };
        grid.leaves.iter().flat_map(move |leaf: &Leaf<T>| {
            (0..512)
                .filter(|&e| leaf.is_active(e))
                .map(move |e| (centre(leaf.voxel(e)), leaf.voxel(e), leaf.values[e]))
        })
    }

    /// Volume within a level set: inside leaves fully, each other voxel by the fraction that the
    /// plane at its distance leaves inside.
    fn volume(grid: &SparseGrid<f32>) -> f64 {
        let h = grid.voxel_size;
        let voxels: f64 = grid
            .leaves
            .iter()
            .flat_map(|leaf| &leaf.values)
            .map(|&phi| (0.5 - f64::from(phi) / h).clamp(0.0, 1.0))
            .sum();
        (voxels + 512.0 * grid.inside.len() as f64) * h.powi(3)
    }

    #[test]
    fn still_water_ends_half_a_spacing_beyond_its_particles() {
        let block = water([24, 12, 24], |_| true, |_| DVec3::ZERO);
        for voxel_size in [D, 2.0 * D, 3.0 * D] {
            let surface = raster(voxel_size).surface(&block);
            assert_eq!(surface.background, (3.0 * voxel_size) as f32);
            let mut top = Vec::new();
            for (p, _, phi) in values(&surface) {
                // Above the middle of the block, where the top at 1.2 m is the nearest face.
                let side = (p - DVec3::new(1.2, 0.0, 1.2)).abs();
                if side.x.max(side.z) < 0.4 && (p.y - 1.2).abs() < 2.0 * voxel_size.min(0.2) {
                    top.push((f64::from(phi) - (p.y - 1.2)).abs());
                }
            }
            let worst = top.iter().copied().fold(0.0, f64::max);
            // 0.1 voxels (see `support`), and 0.05 spacings between a particle and the gap
            // beside it.
            assert!(
                !top.is_empty() && worst < 0.1 * voxel_size + 0.05 * D,
                "{voxel_size}: {worst}"
            );
            // The kernel rounds twelve edges and eight corners: a few per cent of
            // 2.4 × 1.2 × 2.4 m.
            let ratio = volume(&surface) / (2.4 * 1.2 * 2.4);
            assert!((0.95..1.01).contains(&ratio), "{voxel_size}: {ratio}");
        }
    }

    #[test]
    fn the_band_of_a_ball_is_a_distance() {
        let (centre, radius) = (DVec3::splat(2.0), 1.5);
        let ball = water([40; 3], |p| (p - centre).length() < radius, |_| DVec3::ZERO);
        let h = 0.1;
        let surface = raster(h).surface(&ball);
        let (mut worst, mut sum, mut count) = (0.0f64, 0.0, 0.0);
        for (p, _, phi) in values(&surface) {
            let error = (f64::from(phi) - ((p - centre).length() - radius)).abs() / h;
            assert!(f64::from(phi).abs() < BAND * h);
            worst = worst.max(error);
            sum += error;
            count += 1.0;
        }
        println!("worst {worst:.3}, mean {:.3} voxels", sum / count);
        // A ball of lattice points is itself rough by half a spacing; the first-order scheme adds
        // its own error over three voxels.
        assert!(worst < 0.5 && sum / count < 0.15, "{worst} {}", sum / count);
        assert!(
            !surface.inside.is_empty(),
            "30 voxels across hold a whole leaf"
        );

        // |∇φ| by central differences, away from the band's ends.
        let lookup: std::collections::BTreeMap<_, _> = values(&surface)
            .map(|(_, at, phi)| (at, f64::from(phi) / h))
            .collect();
        let mut slopes = Vec::new();
        for (at, _) in lookup.iter().filter(|(_, phi)| phi.abs() < 1.8) {
            let side = |axis: usize, step: i32| {
                let mut at = *at;
                at[axis] += step;
                lookup.get(&at).copied()
            };
            let gradient: Option<Vec<f64>> = (0..3)
                .map(|axis| Some(0.5 * (side(axis, 1)? - side(axis, -1)?)))
                .collect();
            slopes.push(
                gradient
                    .map(|g| g.iter().map(|c| c * c).sum::<f64>().sqrt())
                    .unwrap(),
            );
        }
        let mean = slopes.iter().sum::<f64>() / slopes.len() as f64;
        let rough = slopes.iter().filter(|s| (*s - 1.0).abs() > 0.3).count();
        println!(
            "mean slope {mean:.3}, {rough} of {} beyond 0.3",
            slopes.len()
        );
        assert!((mean - 1.0).abs() < 0.05 && rough * 50 < slopes.len());
    }

    #[test]
    fn a_linear_velocity_comes_back_on_the_faces() {
        let field = |p: DVec3| DVec3::new(1.0 + p.y, 2.0 * p.z - p.x, 0.5 * p.x);
        let h = 0.2;
        let block = water([20, 20, 20], |_| true, field);
        let raster = Raster {
            origin: DVec3::ZERO,
            ..raster(h)
        };
        let velocity = raster.velocity(&block);
        let mut inner = 0;
        for (p, _, v) in values(&velocity) {
            // Inside, weights are symmetric about each face, and a linear field equals its mean.
            if (p - 1.0).abs().max_element() < 0.7 {
                let exact = [0, 1, 2].map(|axis| field(p - 0.5 * h * DVec3::AXES[axis])[axis]);
                for axis in 0..3 {
                    assert!((f64::from(v[axis]) - exact[axis]).abs() < 1e-5, "{p} {v:?}");
                }
                inner += 1;
            }
        }
        // Centres 0.1, 0.3 and 0.5 m on each side of the middle.
        assert_eq!(inner, 6 * 6 * 6);
        // Particles reach the x-faces 0 to 10 of ten voxels; extrapolation adds three layers.
        assert_eq!(velocity.active_bounds(), Some(([-3; 3], [13; 3])));
    }

    #[test]
    fn grids_follow_the_particles_and_not_the_place() {
        let block = water([8, 8, 8], |_| true, |p| p);
        let mut moved = block.clone();
        for p in &mut moved.position {
            // 16 voxels of a power of two: nothing is rounded.
            p[0] += 4.0;
        }
        let raster = Raster {
            voxel_size: 0.25,
            ..raster(0.25)
        };
        let (here, there) = (raster.surface(&block), raster.surface(&moved));
        assert_eq!(here.active_count(), there.active_count());
        let (min, _) = here.active_bounds().unwrap();
        let (moved_min, _) = there.active_bounds().unwrap();
        assert_eq!([min[0] + 16, min[1], min[2]], moved_min);
    }

    #[test]
    fn nothing_and_one_particle_are_fine() {
        let raster = raster(0.2);
        let none = Particles::default();
        assert!(raster.surface(&none).leaves.is_empty());
        assert!(raster.velocity(&none).leaves.is_empty());
        let mut one = water([1; 3], |_| true, |_| DVec3::X);
        assert!(raster.velocity(&one).active_count() > 0);
        raster.surface(&one);
        one.position[0][1] = f32::NAN;
        assert!(raster.surface(&one).leaves.is_empty());
    }
}
