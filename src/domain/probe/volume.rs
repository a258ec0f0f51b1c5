//! Volume of the water of a frame.

use super::SUPPORT;
use crate::{
    bounds::Bounds,
    bricks::CELLS,
    parallel,
    particles::Particles,
    sparse_grid::{EDGE, SparseGrid},
    surface::Raster,
    voxels::Voxels,
};

/// Returns the volume of the water in the domain, m³: that of one spacing cubed per particle, as
/// far as there is space for it.
///
/// Each particle is spread over voxels of one spacing by hat functions that reach two spacings and
/// add up to one on a lattice; no voxel holds more than its own volume within the domain. The
/// domain's faces are mirrors. A drop, a torn sheet or a film thus counts as the sum of its
/// particles, and water whose particles are compressed counts as less. In disordered water some
/// voxels overflow by chance: with each particle anywhere within its own cell of the lattice that
/// loses 2.4 % of the volume, with half of that displacement 1.3 %. Water that has spread apart
/// does not count as more; [`enclosed_volume`] measures that.
pub fn volume(particles: &Particles, spacing: f64, domain: &Bounds) -> f64 {
    // A voxel that a face cuts has its centre up to half a voxel beyond.
    let reach = SUPPORT + 0.5;
    let water = mirrored(particles, domain, reach * spacing);
    let Some(voxels) = Voxels::new(&water, domain.min, spacing, reach + 1.0) else {
        return 0.0;
    };
    let mut fill = vec![0.0f32; voxels.len()];
    voxels.for_each_brick(&mut fill, |slot, fill| {
        voxels.for_each_near(slot, reach.ceil() as usize, |place, _| {
            add_hats(fill, place);
        });
    });
    let by_slot: Vec<f64> = parallel::map(voxels.slots(), |slot| {
        let origin = voxels.origin(slot);
        let fill = &fill[slot * CELLS as usize..(slot + 1) * CELLS as usize];
        let held = |(at, fill): (usize, &f32)| {
            let local = [at % 8, at / 8 % 8, at / 64].map(|k| k as i32);
            let voxel = [0, 1, 2].map(|axis| origin[axis] + local[axis]);
            f64::from(fill.min(1.0)) * room(domain, spacing, voxel)
        };
        fill.iter().enumerate().map(held).sum()
    });
    by_slot.iter().sum::<f64>() * spacing.powi(3)
}

/// Adds a particle at `place`, in voxels from the corner of a brick of 8³, to the voxels that its
/// hat reaches.
fn add_hats(fill: &mut [f32], place: [f32; 3]) {
    const WIDTH: f32 = SUPPORT as f32;
    let part = |axis: usize, k: usize| {
        let distance = (k as f32 + 0.5 - place[axis]).abs();
        (1.0 - distance / WIDTH).max(0.0) / WIDTH
    };
    let near = |axis: usize| {
        let low = (place[axis] - WIDTH - 0.5).ceil().max(0.0) as usize;
        let end = (place[axis] + WIDTH + 0.5).floor().clamp(0.0, 8.0) as usize;
        low..end
    };
    for z in near(2) {
        for y in near(1) {
            let across = part(2, z) * part(1, y);
            for x in near(0) {
                fill[x + 8 * y + 64 * z] += across * part(0, x);
            }
        }
    }
}

/// Fraction of a voxel that lies in the domain; voxel indices count from its least corner.
fn room(domain: &Bounds, spacing: f64, voxel: [i32; 3]) -> f64 {
    (0..3)
        .map(|axis| within(domain, spacing, voxel[axis], axis))
        .product()
}

/// Same along one axis.
fn within(domain: &Bounds, spacing: f64, voxel: i32, axis: usize) -> f64 {
    let low = f64::from(voxel) * spacing;
    let size = domain.size()[axis];
    ((low + spacing).min(size) - low.max(0.0)).max(0.0) / spacing
}

/// Returns the volume that the water's surface encloses in the domain, m³: that within the level
/// set of [`Raster::surface`] at voxels of one spacing. A voxel that the surface crosses counts by
/// the fraction that a plane at its distance leaves inside. The domain's faces are mirrors; edges
/// of the free surface are rounded by two spacings. Air between particles counts where the surface
/// closes over it; water whose particles are too far apart does not.
pub fn enclosed_volume(particles: &Particles, spacing: f64, domain: &Bounds) -> f64 {
    let raster = Raster {
        origin: domain.min,
        voxel_size: spacing,
        particle_spacing: spacing,
    };
    let water = mirrored(particles, domain, SUPPORT * spacing);
    volume_within(&raster.surface(&water), domain)
}

/// Volume within a level set and a domain, m³; indices count from the domain's least corner.
fn volume_within(grid: &SparseGrid<f32>, domain: &Bounds) -> f64 {
    let spacing = grid.voxel_size;
    let part = |distance: f32| (0.5 - f64::from(distance) / spacing).clamp(0.0, 1.0);
    let mut sum = 0.0;
    for leaf in &grid.leaves {
        for (element, distance) in leaf.values.iter().enumerate() {
            sum += part(*distance) * room(domain, spacing, leaf.voxel(element));
        }
    }
    for origin in &grid.inside {
        let extent = |axis: usize| {
            (0..EDGE)
                .map(|k| within(domain, spacing, origin[axis] + k, axis))
                .sum::<f64>()
        };
        sum += extent(0) * extent(1) * extent(2);
    }
    sum * spacing.powi(3)
}

/// Positions and their mirror images within `reach` beyond the domain's faces, edges and corners.
fn mirrored(particles: &Particles, domain: &Bounds, reach: f64) -> Particles {
    let mut position = particles.position.clone();
    for axis in 0..3 {
        for wall in [domain.min[axis], domain.max[axis]] {
            for k in 0..position.len() {
                let mut image = position[k];
                let x = f64::from(image[axis]);
                if (x - wall).abs() < reach {
                    image[axis] = (2.0 * wall - x) as f32;
                    position.push(image);
                }
            }
        }
    }
    Particles {
        position,
        ..Particles::default()
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::super::tests::{block, domain};
    use super::*;
    use crate::sparse_grid::{Leaf, VOXELS};

    /// A pseudo-random number from 0 to 1 for `k`.
    fn chance(k: usize) -> f64 {
        let mut x = (k as u32).wrapping_mul(2_654_435_761) ^ 0x9e37_79b9;
        x = (x ^ (x >> 15)).wrapping_mul(0x85eb_ca6b);
        f64::from((x ^ (x >> 13)) % 65_536) / 65_536.0
    }

    /// Relative and expected volume of particles at these positions, d = 0.1, in a domain of
    /// 6 × 6 × 6.
    fn of(places: impl Iterator<Item = DVec3>) -> (f64, f64) {
        let position: Vec<_> = places.map(|x| x.as_vec3().to_array()).collect();
        let expected = position.len() as f64 * 1e-3;
        let particles = Particles {
            position,
            ..Particles::default()
        };
        let domain = Bounds {
            min: DVec3::ZERO,
            max: DVec3::splat(6.0),
        };
        (volume(&particles, 0.1, &domain) / expected, expected)
    }

    /// Drops, sheets and blocks of a lattice in any position and orientation: hats add up to one
    /// voxel's worth per particle, and nowhere to more than a voxel if the lattice is aligned with
    /// the voxels. For a rotated lattice, the sum of hats is off by up to 2 % in places, a quarter
    /// of which is an excess that is cut.
    #[test]
    fn what_is_thin_counts_as_what_it_is_made_of() {
        let drops = (0..125).map(|k| {
            let cell = DVec3::new((k % 5) as f64, (k / 5 % 5) as f64, (k / 25) as f64);
            let shift = DVec3::new(chance(3 * k), chance(3 * k + 1), chance(3 * k + 2));
            0.5 + 0.7 * cell + 0.1 * shift
        });
        let (found, _) = of(drops);
        assert!((found - 1.0).abs() < 1e-5, "{found}");
        for tilt in [0.0f64, 0.3, 0.7] {
            for layers in [1, 2, 3, 10] {
                // At 1.6 spacings the sheet is torn.
                for spread in [1.0, 1.6] {
                    let sheet = (0..400 * layers).map(|k| {
                        let place = [k % 20, k / 400, k / 20 % 20].map(|c| c as f64);
                        let [x, y, z] = [spread * place[0], place[1], spread * place[2]];
                        let (sin, cos) = tilt.sin_cos();
                        let turned = DVec3::new(x * cos - y * sin, x * sin + y * cos, z);
                        DVec3::new(1.3, 0.3, 0.3) + 0.1 * turned
                    });
                    let (found, _) = of(sheet);
                    println!("{layers} layers at {tilt}, {spread}: {found}");
                    let allowed = if tilt == 0.0 { 1e-5 } else { 5e-3 };
                    assert!(
                        (found - 1.0).abs() < allowed,
                        "{layers} at {tilt}, {spread}: {found}"
                    );
                }
            }
        }
    }

    /// Particles anywhere within their lattice cells, and anywhere within half of them.
    #[test]
    fn disorder_takes_the_part_that_is_named() {
        for (jitter, most) in [(1.0, 0.026), (0.5, 0.015)] {
            let block = (0..16_000).map(|k| {
                let cell = DVec3::new((k % 20) as f64, (k / 20 % 20) as f64, (k / 400) as f64);
                let shift = DVec3::new(chance(3 * k), chance(3 * k + 1), chance(3 * k + 2));
                0.1 * (cell + 0.5 + jitter * (shift - 0.5))
            });
            let (found, _) = of(block);
            println!("{jitter}: {found}");
            assert!((1.0 - most..1.0).contains(&found), "{jitter}: {found}");
        }
    }

    /// Negative control: a block of 20 × 20 × 20 in a corner, compressed by a tenth, is smaller by
    /// as much as its edges, except for the layer at its three free faces, where a hat finds space
    /// outside: at most a spacing each.
    #[test]
    fn what_is_pressed_together_counts_as_less() {
        let block = (0..8000).map(|k| {
            let cell = DVec3::new((k % 20) as f64, (k / 20 % 20) as f64, (k / 400) as f64);
            0.09 * (cell + 0.5)
        });
        let (found, expected) = of(block);
        let (least, most) = (1.8f64.powi(3) / expected, 1.9f64.powi(3) / expected);
        println!("{found} between {least} and {most}");
        assert!((least..most).contains(&found), "{found}");
    }

    /// On the lattice the volume is exact to rounding, even if faces of the domain cut voxels:
    /// there the lattice begins at the least corner, and the last layer's hats are mirrored.
    #[test]
    fn volume_of_a_lattice_is_exact() {
        for n in [[12, 9, 12], [8, 9, 12], [12, 11, 5], [12, 1, 1]] {
            let expected = n.iter().product::<usize>() as f64 * 1e-3;
            let found = volume(&block(n, DVec3::ZERO), 0.1, &domain());
            assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
        }
        assert_eq!(volume(&Particles::default(), 0.1, &domain()), 0.0);
    }

    /// Between walls it is the volume of the lattice; a free edge of the block is rounded, which
    /// removes up to half a square of two spacings from each of its cross sections.
    #[test]
    fn enclosed_volume_of_a_block() {
        for (n, edges) in [([12, 9, 12], 0.0), ([8, 9, 12], 12.0), ([12, 11, 5], 12.0)] {
            let particles = block(n, DVec3::ZERO);
            let expected = n.iter().product::<usize>() as f64 * 1e-3;
            let found = enclosed_volume(&particles, 0.1, &domain());
            println!("{found} of {expected}");
            // A free face is off by the voxels' error for a plane, a twentieth of a spacing.
            let faces = 0.05 * 0.1 * (1.2 * 1.2 + if edges > 0.0 { 1.2 * 1.1 } else { 0.0 });
            let least = expected - faces - edges * 0.1 * 0.02;
            assert!(
                (least..expected + faces).contains(&found),
                "{found} {expected}"
            );
        }
        assert_eq!(enclosed_volume(&Particles::default(), 0.1, &domain()), 0.0);
    }

    /// A plane that every voxel represents exactly, in a box whose far faces cut voxels: its
    /// volume to the rounding of f32, 3 voxels' worth at 2⁻²⁴ beside a depth of 17. The leaves
    /// below are full.
    #[test]
    fn volume_below_a_plane_is_exact() {
        let h = 0.05;
        let domain = Bounds {
            min: DVec3::new(-1.0, 2.0, 0.5),
            max: DVec3::new(-1.0, 2.0, 0.5) + h * DVec3::new(11.3, 30.0, 9.6),
        };
        let leaf = |origin: [i32; 3], depth: f64| {
            let value = |element: usize| {
                let above = f64::from(origin[1]) + (element / 8 % 8) as f64 + 0.5 - depth;
                (h * above.clamp(-3.0, 3.0)) as f32
            };
            Leaf {
                origin,
                active: [u64::MAX; 8],
                values: (0..VOXELS).map(value).collect(),
            }
        };
        for depth in [17.0, 17.3, 19.75] {
            let columns = || (0..2).flat_map(|x| (0..2).map(move |z| (8 * x, 8 * z)));
            let rows = [8, 16, 24];
            let grid = SparseGrid {
                origin: domain.min,
                voxel_size: h,
                background: (3.0 * h) as f32,
                leaves: columns()
                    .flat_map(|(x, z)| rows.map(|y| leaf([x, y, z], depth)))
                    .collect(),
                inside: columns().map(|(x, z)| [x, 0, z]).collect(),
            };
            let part = volume_within(&grid, &domain) / (h.powi(3) * 11.3 * 9.6 * depth);
            assert!((part - 1.0).abs() < 1e-6, "{depth}: {part}");
        }
    }

    /// The positions of voxels relative to the particles are arbitrary; on average, still water
    /// ends half a spacing beyond its outermost layer. Measures the thickness of five layers over
    /// 16 shifts of a slab against its voxels. Single shifts are off by 0.036 spacings per face;
    /// the radius cancels the first order, which leaves 0.036² per face.
    #[test]
    fn a_level_set_is_as_thick_as_its_layers() {
        for d in [0.1, 0.04] {
            let raster = Raster {
                origin: DVec3::ZERO,
                voxel_size: d,
                particle_spacing: d,
            };
            let mut thickness = 0.0;
            for shift in 0..16u32 {
                let part = |k: u32| (f64::from(k) + 0.5) / 4.0;
                let shift = DVec3::new(part(shift / 4 % 2), part(shift % 4), part(shift / 8));
                let mut slab = block([11, 5, 11], DVec3::ZERO);
                for x in &mut slab.position {
                    let place = d * (Vec3::from_array(*x).as_dvec3() / 0.1 + shift);
                    *x = place.as_vec3().to_array();
                }
                let grid = raster.surface(&slab);
                assert!(grid.inside.is_empty());
                for leaf in &grid.leaves {
                    let middle = |e: &usize| leaf.voxel(*e)[0] == 5 && leaf.voxel(*e)[2] == 5;
                    let column = (0..VOXELS).filter(middle);
                    let parts =
                        column.map(|e| (0.5 - f64::from(leaf.values[e]) / d).clamp(0.0, 1.0));
                    thickness += parts.sum::<f64>() / 16.0;
                }
            }
            println!("{thickness} of 5 layers");
            assert!(
                (thickness - 5.0).abs() < 2.0 * 0.036f64.powi(2),
                "{thickness}"
            );
        }
    }
}
