//! Volume of a frame's water.

use super::SUPPORT;
use crate::domain::{
    bounds::Bounds,
    particles::Particles,
    sparse_grid::{EDGE, SparseGrid},
    surface::Raster,
};

/// Volume of the water in the domain, m³: of what lies within the level set of [`Raster::surface`] at voxels of one
/// spacing, a voxel that the surface crosses by the part that a plane at its distance leaves inside. The domain's faces
/// are mirrors; edges of the free surface are rounded by two spacings.
pub fn volume(particles: &Particles, spacing: f64, domain: &Bounds) -> f64 {
    let raster = Raster {
        origin: domain.min,
        voxel_size: spacing,
        particle_spacing: spacing,
    };
    let water = mirrored(particles, domain, SUPPORT * spacing);
    volume_within(&raster.surface(&water), domain)
}

/// Volume within a level set and a domain at whose least corner its indices begin, m³.
fn volume_within(grid: &SparseGrid<f32>, domain: &Bounds) -> f64 {
    let spacing = grid.voxel_size;
    let within = |voxel: i32, axis: usize| {
        let low = f64::from(voxel) * spacing;
        let size = domain.size()[axis];
        ((low + spacing).min(size) - low.max(0.0)).max(0.0) / spacing
    };
    let room = |voxel: [i32; 3]| {
        (0..3)
            .map(|axis| within(voxel[axis], axis))
            .product::<f64>()
    };
    let part = |distance: f32| (0.5 - f64::from(distance) / spacing).clamp(0.0, 1.0);
    let mut sum = 0.0;
    for leaf in &grid.leaves {
        for (element, distance) in leaf.values.iter().enumerate() {
            sum += part(*distance) * room(leaf.voxel(element));
        }
    }
    for origin in &grid.inside {
        let extent = |axis: usize| {
            (0..EDGE)
                .map(|k| within(origin[axis] + k, axis))
                .sum::<f64>()
        };
        sum += extent(0) * extent(1) * extent(2);
    }
    sum * spacing.powi(3)
}

/// Positions with their mirror images within `reach` beyond the domain's faces, edges and corners.
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
    use crate::domain::sparse_grid::{Leaf, VOXELS};

    /// Between walls it is what the lattice fills; where the block has a free edge, that is rounded, which takes up to
    /// half a square of two spacings from each of its cross sections.
    #[test]
    fn volume_of_a_block() {
        for (n, edges) in [([12, 9, 12], 0.0), ([8, 9, 12], 12.0), ([12, 11, 5], 12.0)] {
            let particles = block(n, DVec3::ZERO);
            let expected = n.iter().product::<usize>() as f64 * 1e-3;
            let found = volume(&particles, 0.1, &domain());
            println!("{found} of {expected}");
            // A free face is off by what the voxels have of a plane, a twentieth of a spacing.
            let faces = 0.05 * 0.1 * (1.2 * 1.2 + if edges > 0.0 { 1.2 * 1.1 } else { 0.0 });
            let least = expected - faces - edges * 0.1 * 0.02;
            assert!(
                (least..expected + faces).contains(&found),
                "{found} {expected}"
            );
        }
        assert_eq!(volume(&Particles::default(), 0.1, &domain()), 0.0);
    }

    /// By a plane that is exact on every voxel, in a box whose far faces cut voxels: its volume to the rounding of f32,
    /// 3 voxels' worth at 2⁻²⁴ beside a depth of 17. The leaves below are whole.
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

    /// Where voxels lie about the particles is chance; over all of that, still water ends half a spacing beyond its
    /// outermost layer. The thickness of five layers, over 16 shifts of a slab against its voxels: the radius is
    /// right to first order in what single shifts are off by, 0.036 spacings a face; what is left is of second order, 0.036²
    /// a face.
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
