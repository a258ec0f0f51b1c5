//! What is measured at a point or over all of a frame's water, the same for every solver.
//!
//! Height is along y. Sums run in the order of the particles, so that a frame gives the same numbers every time.

use glam::{DMat3, DVec2, DVec3, Vec3};

use super::{
    bounds::Bounds,
    particles::Particles,
    sparse_grid::{EDGE, SparseGrid},
    surface::{Raster, calm_radius},
};

/// R of the surface's kernel in particle spacings (Zhu and Bridson 2005).
const SUPPORT: f64 = 2.0;

/// Heights at which a column is looked at, a particle spacing.
const SAMPLES: f64 = 8.0;

/// Height of the water's surface over (x, z), metres above the world's y = 0; `None` where there is no water.
///
/// The surface is that of Zhu and Bridson 2005 about the particles, φ = |x − x̄| − r, without a grid: r puts it half a
/// spacing above the topmost layer of water at rest. The domain's faces are mirrors, so that the surface meets them
/// level. Of a column with several stretches of water (a lip that turns over, spray) it is the top of the thickest, the
/// upper one of two alike. Columns are looked at in eighths of a spacing; where φ changes its sign between two, it is
/// taken as straight.
pub fn elevation(particles: &Particles, spacing: f64, domain: &Bounds, at: DVec2) -> Option<f64> {
    let support = SUPPORT * spacing;
    let near = column(particles, domain, support, at);
    let (low, high) = (domain.min.y, near.last()?.y + support);
    let radius = calm_radius(SUPPORT) * spacing;
    let step = spacing / SAMPLES;
    let level = |y: f64| {
        let x = DVec3::new(at.x, y, at.y);
        let first = near.partition_point(|p| p.y <= y - support);
        let end = near.partition_point(|p| p.y < y + support);
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        for p in &near[first..end] {
            let d = x - *p;
            let w = (1.0 - d.length_squared() / (support * support))
                .max(0.0)
                .powi(3);
            sum += w * d;
            weights += w;
        }
        // As in `surface`: below it the quotient is round-off.
        if weights > 1e-12 {
            sum.length() / weights - radius
        } else {
            support - radius
        }
    };
    let mut before = level(low);
    let mut best: Option<(f64, f64)> = None;
    let mut bottom = (before < 0.0).then_some(low);
    for k in 1..=((high - low) / step).ceil() as usize {
        let y = low + k as f64 * step;
        let here = level(y);
        let crossing = y - step * here / (here - before);
        match bottom {
            None if before >= 0.0 && here < 0.0 => bottom = Some(crossing),
            Some(from) if here >= 0.0 => {
                bottom = None;
                let thickness = crossing - from;
                if best.is_none_or(|(most, _)| thickness >= most) {
                    best = Some((thickness, crossing));
                }
            }
            _ => {}
        }
        before = here;
    }
    best.map(|(_, top)| top)
}

/// Particles and their mirror images about the column over `at`, from below.
fn column(particles: &Particles, domain: &Bounds, support: f64, at: DVec2) -> Vec<DVec3> {
    let (min, max) = (domain.min, domain.max);
    let images = |x: f64, axis: usize| [x, 2.0 * min[axis] - x, 2.0 * max[axis] - x];
    let mut near = Vec::new();
    for p in &particles.position {
        let p = Vec3::from_array(*p).as_dvec3();
        let is_near = |x: &f64| (x - at.x).abs() < support;
        for x in images(p.x, 0).into_iter().filter(is_near) {
            let is_near = |z: &f64| DVec2::new(x - at.x, z - at.y).length() < support;
            for z in images(p.z, 2).into_iter().filter(is_near) {
                let reach = min.y - support..max.y + support;
                let heights = images(p.y, 1).into_iter().filter(|y| reach.contains(y));
                near.extend(heights.map(|y| DVec3::new(x, y, z)));
            }
        }
    }
    // Stable, so that ties stay in the order of the ids.
    near.sort_by(|a, b| a.y.total_cmp(&b.y));
    near
}

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

/// Kinetic and potential energy of particles of `mass` kg, joule; the latter against `lowest`.
pub fn energies(particles: &Particles, mass: f64, gravity: DVec3, lowest: DVec3) -> (f64, f64) {
    let (mut kinetic, mut potential) = (0.0, 0.0);
    for (x, v) in particles.position.iter().zip(&particles.velocity) {
        kinetic += 0.5 * mass * Vec3::from_array(*v).as_dvec3().length_squared();
        potential -= mass * gravity.dot(Vec3::from_array(*x).as_dvec3() - lowest);
    }
    (kinetic, potential)
}

/// A field of the particles at `at`, by the plane that fits the particles within `support` best under the kernel
/// (1 − q²)³ (moving least squares): exact for a linear field, also beside walls and surfaces. `None` where no particle
/// is nearer than half of `support`; the kernel's mean where they are too few for a plane.
pub fn fitted(points: impl Iterator<Item = (DVec3, f64)>, at: DVec3, support: f64) -> Option<f64> {
    let (mut near, mut nearest) = (Vec::new(), f64::MAX);
    for (x, value) in points {
        let q2 = (x - at).length_squared() / (support * support);
        if q2 < 1.0 {
            near.push((x - at, value, (1.0 - q2).powi(3)));
            nearest = nearest.min(q2);
        }
    }
    if nearest > 0.25 {
        return None;
    }
    let weights: f64 = near.iter().map(|(.., w)| w).sum();
    let center = near.iter().map(|(d, _, w)| *w * *d).sum::<DVec3>() / weights;
    let mean = near.iter().map(|(_, value, w)| w * value).sum::<f64>() / weights;
    let (mut spread, mut slope) = (DMat3::ZERO, DVec3::ZERO);
    for (d, value, w) in &near {
        let d = *d - center;
        spread += DMat3::from_cols(*w * d.x * d, *w * d.y * d, *w * d.z * d);
        slope += *w * (value - mean) * d;
    }
    // The spread of a half space of neighbours is about a twentieth of support² each way; a sheet has next to none.
    let least = weights * 1e-3 * support * support;
    if spread.determinant() < least.powi(3) {
        return Some(mean);
    }
    Some(mean - (spread.inverse() * slope).dot(center))
}

#[cfg(test)]
mod tests {
    use super::super::sparse_grid::{Leaf, VOXELS};
    use super::*;

    /// A block of n³ particles from 0 on, d = 0.1.
    fn block(n: [usize; 3], shift: DVec3) -> Particles {
        let mut particles = Particles::default();
        for k in 0..n[0] * n[1] * n[2] {
            let cell = [k % n[0], k / n[0] % n[1], k / (n[0] * n[1])];
            let x = DVec3::from_array(cell.map(|c| 0.1 * (c as f64 + 0.5))) + shift;
            particles.position.push(x.as_vec3().to_array());
            particles.velocity.push([3.0, 0.0, 4.0]);
            particles.id.push(k as u32);
        }
        particles
    }

    /// Wide enough for no wall to matter but those at 0.
    fn domain() -> Bounds {
        Bounds {
            min: DVec3::ZERO,
            max: DVec3::new(1.2, 4.0, 1.2),
        }
    }

    fn height(particles: &Particles, at: DVec2) -> Option<f64> {
        elevation(particles, 0.1, &domain(), at)
    }

    /// On still water the surface is where the block ends, to a twentieth of a spacing, wherever one looks, and at the
    /// walls.
    #[test]
    fn elevation_of_a_block_is_its_top() {
        for lift in [0.0, 0.013, 0.037] {
            let particles = block([12, 9, 12], DVec3::new(0.0, lift, 0.0));
            let mut mean = 0.0;
            for k in 0..16 {
                let at = DVec2::new(0.08 * f64::from(k), 0.52 + 0.029 * f64::from(k % 5));
                let found = height(&particles, at).unwrap() - lift;
                assert!((found - 0.9).abs() < 0.005, "{at}: {found}");
                mean += found / 16.0;
            }
            assert!((mean - 0.9).abs() < 0.002, "{mean}");
        }
        // Negative control: a layer less is a spacing less.
        let lower = height(&block([12, 8, 12], DVec3::ZERO), DVec2::splat(0.6)).unwrap();
        assert!((lower - 0.8).abs() < 0.005, "{lower}");
        // One layer on the floor is as thick as it is, by its mirror image.
        let film = height(&block([12, 1, 12], DVec3::ZERO), DVec2::splat(0.6)).unwrap();
        assert!((film - 0.1).abs() < 0.02, "{film}");
    }

    #[test]
    fn spray_and_dry_ground_are_no_surface() {
        let mut particles = block([6, 6, 12], DVec3::ZERO);
        let at = DVec2::new(0.3, 0.6);
        let calm = height(&particles, at).unwrap();
        particles.position.push([0.3, 2.0, 0.6]);
        assert_eq!(height(&particles, at), Some(calm));
        assert_eq!(height(&particles, DVec2::new(1.0, 0.6)), None);
        assert_eq!(height(&Particles::default(), at), None);
    }

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

    /// The mean over a lattice cell of the elevation is the top of the lattice, at two spacings. The column is looked at
    /// right there; along the surface single places are up to 0.0045 spacings off, and on the step of an eighth to the next
    /// height the field is taken as straight: 0.0045 · 0.125 / 2 spacings, and as much again for what is bent.
    #[test]
    fn elevation_is_the_top_of_the_lattice_on_average() {
        for d in [0.1, 0.037] {
            let mut particles = block([12, 9, 12], DVec3::ZERO);
            for x in particles.position.iter_mut().flatten() {
                *x = (f64::from(*x) / 0.1 * d) as f32;
            }
            let domain = Bounds {
                min: DVec3::ZERO,
                max: d * DVec3::new(12.0, 40.0, 12.0),
            };
            let at = |k: u32| {
                let part = |k: u32| (f64::from(k) + 0.5) / 8.0;
                d * (DVec2::splat(5.0) + DVec2::new(part(k % 8), part(k / 8)))
            };
            let sum: f64 = (0..64)
                .map(|k| elevation(&particles, d, &domain, at(k)).unwrap())
                .sum();
            let off = sum / 64.0 / d - 9.0;
            println!("{off} spacings");
            assert!(off.abs() < 0.0045 * 0.125, "{off}");
        }
    }

    /// By hand, too few for a plane: values 2 and 5 at a quarter and at a half of the support, whose weights are
    /// (15/16)³ and (3/4)³.
    #[test]
    fn two_points_have_their_kernels_mean() {
        let pair = |near: f64| {
            let points = [(near * DVec3::X, 2.0), (0.5 * DVec3::Y, 5.0)];
            fitted(points.into_iter(), DVec3::ZERO, 1.0)
        };
        let weights = [(15.0f64 / 16.0).powi(3), 0.75f64.powi(3)];
        let mean = (2.0 * weights[0] + 5.0 * weights[1]) / (weights[0] + weights[1]);
        assert!((pair(0.25).unwrap() - mean).abs() < 1e-12);
        // Water is where a particle is within half of the support.
        let alone = |q: f64| fitted([(q * DVec3::X, 2.0)].into_iter(), DVec3::ZERO, 1.0);
        assert_eq!((alone(0.499), alone(0.501)), (Some(2.0), None));
    }

    #[test]
    fn energies_of_a_block() {
        let particles = block([4, 4, 4], DVec3::new(1.0, 2.0, 3.0));
        let gravity = DVec3::new(0.0, -10.0, 0.0);
        let (kinetic, potential) = energies(&particles, 2.0, gravity, DVec3::new(0.0, 1.0, 0.0));
        // 64 × 2 kg at 5 m/s, 1.2 m up.
        assert!((kinetic - 1600.0).abs() < 1e-9, "{kinetic}");
        assert!((potential - 1536.0).abs() < 1e-3, "{potential}");
    }

    /// A linear field comes back to rounding, at the block's face and corner as in its middle; the mean alone does not.
    #[test]
    fn a_plane_is_fitted_exactly() {
        let particles = block([8, 8, 8], DVec3::ZERO);
        let field = |x: DVec3| 3.0 + x.dot(DVec3::new(1.0, -20.0, 5.0));
        let points = || {
            let all = particles.position.iter();
            all.map(|p| Vec3::from_array(*p).as_dvec3())
        };
        for at in [
            DVec3::splat(0.41),
            DVec3::new(0.4, 0.0, 0.33),
            DVec3::splat(0.8),
        ] {
            let found = fitted(points().map(|x| (x, field(x))), at, 0.2).unwrap();
            assert!((found - field(at)).abs() < 1e-9, "{found} {}", field(at));
        }
        let at = DVec3::splat(2.0);
        assert_eq!(fitted(points().map(|x| (x, 1.0)), at, 0.2), None);
        // One layer is no plane's worth: its mean.
        let sheet = || points().filter(|x| x.y < 0.1);
        let found = fitted(sheet().map(|x| (x, 7.0)), DVec3::new(0.4, 0.05, 0.4), 0.2);
        assert!((found.unwrap() - 7.0).abs() < 1e-12);
    }
}
