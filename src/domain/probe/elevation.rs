//! Elevation of the water's surface over a point.

use glam::{DVec2, DVec3, Vec3};

use super::SUPPORT;
use crate::{bounds::Bounds, parallel, particles::Particles, surface::calm_radius};

/// Samples along a column per particle spacing.
const SAMPLES: f64 = 8.0;

/// Widest gap that counts as water, in particle spacings: the radius of the surface's kernel.
const BRIDGED: f64 = SUPPORT;

/// Returns the elevation of the water's surface over (x, z), metres above the world's y = 0; `None`
/// if there is no water.
///
/// The surface is that of Zhu and Bridson 2005 around the particles, φ = |x − x̄| − r, without a
/// grid; r puts it half a spacing above the topmost layer of water at rest. The domain's faces are
/// mirrors, so that the surface meets them at a right angle. In a column with several stretches of
/// water (an overturning lip, spray), the result is the top of the thickest, the upper one of two
/// equal ones. Gaps of less than two spacings count as water, since particles leave such gaps
/// within a body that is stretched or stirred. Columns are sampled at an eighth of a spacing; where
/// φ changes its sign between two samples, it is interpolated linearly.
pub fn elevation(particles: &Particles, spacing: f64, domain: &Bounds, at: DVec2) -> Option<f64> {
    let near = column(particles.position.iter(), domain, SUPPORT * spacing, at);
    top(&near, spacing, domain, at)
}

/// Returns the [`elevation`] over each of many places, from one look at all particles.
pub fn elevations(
    particles: &Particles,
    spacing: f64,
    domain: &Bounds,
    at: &[DVec2],
) -> Vec<Option<f64>> {
    let support = SUPPORT * spacing;
    let position = &particles.position;
    let mut by_x: Vec<(f64, usize)> = (position.iter().enumerate())
        .map(|(k, p)| (f64::from(p[0]), k))
        .collect();
    by_x.sort_by(|a, b| a.0.total_cmp(&b.0));
    parallel::map(0..at.len(), |k| {
        let x = at[k].x;
        let images = [x, 2.0 * domain.min.x - x, 2.0 * domain.max.x - x];
        let within = |x: f64| {
            let first = by_x.partition_point(|p| p.0 < x - support);
            let end = by_x.partition_point(|p| p.0 <= x + support);
            by_x[first..end].iter().map(|p| p.1)
        };
        let mut near: Vec<usize> = images.into_iter().flat_map(within).collect();
        near.sort_unstable();
        near.dedup();
        let near = near.iter().map(|&k| &position[k]);
        let near = column(near, domain, support, at[k]);
        top(&near, spacing, domain, at[k])
    })
}

/// Top of the thickest stretch of water in a column; `near` are the particles around it, in
/// ascending order.
fn top(near: &[DVec3], spacing: f64, domain: &Bounds, at: DVec2) -> Option<f64> {
    let support = SUPPORT * spacing;
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
        // As in `surface`: below this the quotient is round-off.
        if weights > 1e-12 {
            sum.length() / weights - radius
        } else {
            support - radius
        }
    };
    let mut before = level(low);
    // From bottom to top: beginning and end of each stretch of water.
    let mut stretches = Vec::<(f64, f64)>::new();
    let mut bottom = (before < 0.0).then_some(low);
    for k in 1..=((high - low) / step).ceil() as usize {
        let y = low + k as f64 * step;
        let here = level(y);
        let crossing = y - step * here / (here - before);
        match bottom {
            None if before >= 0.0 && here < 0.0 => bottom = Some(crossing),
            Some(from) if here >= 0.0 => {
                bottom = None;
                match stretches.last_mut() {
                    Some((_, top)) if from - *top < BRIDGED * spacing => *top = crossing,
                    _ => stretches.push((from, crossing)),
                }
            }
            _ => {}
        }
        before = here;
    }
    // `max_by` returns the last of equal elements.
    let thickness = |(bottom, top): &(f64, f64)| top - bottom;
    let thickest = stretches
        .into_iter()
        .max_by(|a, b| thickness(a).total_cmp(&thickness(b)));
    thickest.map(|(_, top)| top)
}

/// Particles and their mirror images around the column over `at`, in ascending order.
fn column<'a>(
    position: impl Iterator<Item = &'a [f32; 3]>,
    domain: &Bounds,
    support: f64,
    at: DVec2,
) -> Vec<DVec3> {
    let (min, max) = (domain.min, domain.max);
    let images = |x: f64, axis: usize| [x, 2.0 * min[axis] - x, 2.0 * max[axis] - x];
    let mut near = Vec::new();
    for p in position {
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
    // A stable sort, so that ties stay in the order of the ids.
    near.sort_by(|a, b| a.y.total_cmp(&b.y));
    near
}

#[cfg(test)]
mod tests {
    use super::super::tests::{block, domain};
    use super::*;

    fn height(particles: &Particles, at: DVec2) -> Option<f64> {
        elevation(particles, 0.1, &domain(), at)
    }

    /// On still water the surface is the top of the block, to a twentieth of a spacing, at all
    /// sampled points and at the walls.
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
        // One look at all particles finds the same, beside walls too.
        let particles = block([12, 9, 12], DVec3::ZERO);
        let at: Vec<DVec2> = (0..16)
            .map(|k| DVec2::new(0.08 * f64::from(k), 0.003 + 0.08 * f64::from((5 * k) % 16)))
            .collect();
        let one_by_one: Vec<_> = at.iter().map(|at| height(&particles, *at)).collect();
        assert!(one_by_one.iter().flatten().count() > 10);
        assert_eq!(elevations(&particles, 0.1, &domain(), &at), one_by_one);
        // Negative control: a layer less is a spacing less.
        let lower = height(&block([12, 8, 12], DVec3::ZERO), DVec2::splat(0.6)).unwrap();
        assert!((lower - 0.8).abs() < 0.005, "{lower}");
        // Thanks to its mirror image, a single layer on the floor has its own thickness.
        let film = height(&block([12, 1, 12], DVec3::ZERO), DVec2::splat(0.6)).unwrap();
        assert!((film - 0.1).abs() < 0.02, "{film}");
    }

    /// A column from which layers are removed: the gap equals the missing layers, since the surface
    /// lies half a spacing beyond a layer. One missing layer still counts as water; more are air,
    /// and then the thicker part counts.
    #[test]
    fn narrow_gaps_are_bridged() {
        let without = |missing: &[usize]| {
            let mut particles = block([12, 12, 12], DVec3::ZERO);
            let is_kept = |x: &[f32; 3]| !missing.contains(&((x[1] / 0.1) as usize));
            particles.position.retain(is_kept);
            height(&particles, DVec2::splat(0.6)).unwrap()
        };
        for missing in [&[7][..], &[3], &[3, 7]] {
            let found = without(missing);
            assert!((found - 1.2).abs() < 0.005, "{missing:?}: {found}");
        }
        // Negative control: with a wider gap it is the thicker part's top.
        for (missing, top) in [(&[7, 8, 9][..], 0.7), (&[3, 4, 5], 1.2)] {
            let found = without(missing);
            assert!((found - top).abs() < 0.005, "{missing:?}: {found}");
        }
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

    /// The mean of the elevation over a lattice cell is the top of the lattice, for two spacings.
    /// Along the surface single positions are up to 0.0045 spacings off. Linear interpolation over
    /// the step of an eighth adds 0.0045 · 0.125 / 2 spacings, and the curvature as much again.
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
}
