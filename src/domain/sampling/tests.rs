use std::collections::BTreeSet;

use super::super::mesh::tests::{box_mesh, sphere};
use super::*;

fn cuboid(min: [f64; 3], max: [f64; 3]) -> Bounds {
    Bounds {
        min: min.into(),
        max: max.into(),
    }
}

/// Brute-force search, the reference for the hashed one.
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
    // 5.88 layers become 6, and 58.8 along z, from wall to wall, 59.
    assert_eq!(block_dims(&block, &domain, 0.17), [6, 6, 59]);
    assert_eq!(
        block_dims(&cuboid([0.0; 3], [0.0; 3]), &domain, 0.17),
        [0; 3]
    );
}

/// Layers reach both walls where a block does, and the density is that of the spacing: what a gap
/// at a wall lacks would slosh. Control: a block that ends before the wall has the spacing itself.
#[test]
fn layers_between_walls_are_spread_evenly() {
    let (domain, spacing) = (cuboid([-0.1, 0.0, 0.2], [0.9, 0.8, 0.9]), 0.03);
    let span = |places: &[DVec3], axis: usize| {
        let all = places.iter().map(|p| p[axis]);
        let (least, most) = (
            all.clone().fold(f64::INFINITY, f64::min),
            all.fold(-1e9, f64::max),
        );
        [least, most]
    };
    let lattice = |block: &Bounds| Lattice::of_block(block, &domain, spacing);
    for (max, is_full) in [([0.9, 0.5, 0.9], false), ([0.9, 0.8, 0.9], true)] {
        let block = cuboid([-0.1, 0.0, 0.2], max);
        let (
            Lattice {
                dims,
                spacing: step,
                ..
            },
            places,
        ) = (lattice(&block), fill_blocks(&[block], &domain, spacing));
        assert_eq!(places.len() as u64, dims.iter().product::<u64>());
        for axis in if is_full { 0..3 } else { 0..1 } {
            let [least, most] = span(&places, axis);
            let (low, high) = (least - domain.min[axis], domain.max[axis] - most);
            assert!((low - 0.5 * step[axis]).abs() < 1e-12 && (high - low).abs() < 1e-12);
        }
        let volume = step.element_product() / spacing.powi(3);
        if is_full {
            // 33, 26 and 23 layers where 33.33, 26.67 and 23.33 would fit: never overfull.
            assert_eq!(dims, [33, 26, 23]);
            assert!(volume > 1.0, "{volume}");
        } else {
            assert_eq!(dims, [33, 17, 23]);
            assert!((volume - 1.0).abs() < 1e-12, "{volume}");
            // Within half a layer of what is asked for.
            assert!((17.0 * step.y - 0.5).abs() < 0.5 * step.y);
        }
    }
    let dam = cuboid([-0.1, 0.0, 0.2], [0.4, 0.5, 0.7]);
    assert_eq!(lattice(&dam).spacing, DVec3::splat(spacing));
    assert_eq!(lattice(&dam).origin, dam.min);
    // A block at the far walls only begins there, and is rounded up where that is nearer.
    let far = cuboid([0.73, 0.0, 0.41], [0.9, 0.5, 0.9]);
    assert_eq!(lattice(&far).dims, [6, 17, 16]);
    let [_, most] = span(&fill_blocks(&[far], &domain, spacing), 2);
    assert!((most - (0.9 - 0.5 * spacing)).abs() < 1e-12, "{most}");
    // A full box keeps the layers that a spacing of rounded digits has, to a tenth of one.
    let cube = cuboid([0.0; 3], [1.0; 3]);
    for (spacing, layers) in [(0.016666667, 60), (0.05001, 20), (0.0335, 29)] {
        assert_eq!(block_dims(&cube, &cube, spacing), [layers; 3], "{spacing}");
    }
    // Layers are not spread over a domain that is much thinner or thicker than they are.
    for (thickness, layers) in [(0.53, 0), (0.9, 1), (1.24, 1), (1.47, 1), (1.7, 2)] {
        let thin = cuboid([0.0; 3], [1.0, 1.0, 0.1 * thickness]);
        let block = cuboid([0.0; 3], [0.5, 0.5, 0.1 * thickness]);
        let found = Lattice::of_block(&block, &thin, 0.1);
        assert_eq!(found.dims[2], layers, "{thickness}");
        let widest = found
            .spacing
            .max_element()
            .max(0.1 * 0.1 / found.spacing.min_element());
        assert!(widest < 0.1251, "{thickness}: {found:?}");
    }
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

/// A harbour pier whose faces are aligned with the water's lattice: no particle moves.
#[test]
fn water_beside_a_solid_that_fits_is_whole() {
    let domain = cuboid([0.0; 3], [24.0, 6.0, 16.0]);
    let water = cuboid([0.0; 3], [24.0, 2.0, 16.0]);
    let pier = cuboid([15.0, -0.1, 10.0], [21.0, 2.4, 11.5]);
    let pier_mesh = box_mesh(pier);
    let solid = SignedDistance::from_mesh(&pier_mesh, &domain, 0.25).expect("closed");
    let fill = fill_water(&[water], [], Some(&solid), &domain, 0.25).expect("no mesh");
    // 24 by 8 by 6 cells of the lattice belong to the pier.
    assert_eq!(fill.removed, 24 * 8 * 6);
    let key = |p: &[f32; 3]| p.map(f32::to_bits);
    let lattice = fill_blocks(&[water], &domain, 0.25);
    let lattice: BTreeSet<_> = lattice
        .iter()
        .map(|p| key(&p.as_vec3().to_array()))
        .collect();
    let moved = |fill: &Fill| {
        let places = fill.particles.position.iter();
        places.filter(|p| !lattice.contains(&key(p))).count()
    };
    assert_eq!(moved(&fill), 0);
    // Negative control: beside a pier shifted by 0.4 spacings, particles are moved.
    let off = TriangleMesh {
        vertices: (pier_mesh.vertices.iter())
            .map(|v| *v + DVec3::splat(0.4 * 0.25))
            .collect(),
        ..pier_mesh.clone()
    };
    let solid = SignedDistance::from_mesh(&off, &domain, 0.25).expect("closed");
    let fill = fill_water(&[water], [], Some(&solid), &domain, 0.25).expect("no mesh");
    assert!(moved(&fill) > 100, "{}", moved(&fill));
}

#[test]
fn a_water_mesh_is_filled_and_a_solid_displaces() {
    let domain = cuboid([-2.0; 3], [2.0; 3]);
    let drop = sphere(DVec3::ZERO, 0.8, 24);
    let fill = fill_water(&[], [&drop], None, &domain, 0.1).expect("closed");
    let volume = fill.particles.len() as f64 * 1e-3;
    // Each surface cell counts fully or not at all: 800 cells of 1e-3 m³, off by half at random,
    // are √800/2 of 2 130, 0.7 %; four times that is allowed.
    let exact = drop.signed_volume();
    assert!((volume / exact - 1.0).abs() < 0.03, "{volume} {exact}");

    let block = cuboid([-1.0; 3], [1.0; 3]);
    let solid = SignedDistance::from_mesh(&drop, &domain, 0.1).expect("closed");
    let wet = fill_water(&[block], [], Some(&solid), &domain, 0.1).expect("no mesh");
    assert_eq!(wet.particles.len() + wet.removed, 8000);
    // As many are removed as the solid's volume holds: interpolation takes 3/8 · spacing² / R off
    // its radius, three times that fraction off its volume, and there is half a particle.
    let removed = wet.removed as f64 * 1e-3;
    assert!(
        removed < exact && removed > 0.97 * exact,
        "{removed} {exact}"
    );
    let nearest = wet
        .particles
        .position
        .iter()
        .map(|p| DVec3::new(p[0].into(), p[1].into(), p[2].into()).length() - 0.8);
    // 0.3 spacings, less the mesh's sagitta and the interpolation's error.
    assert!(nearest.fold(f64::INFINITY, f64::min) > 0.02);
    assert_eq!(
        wet.particles.id,
        (0..wet.particles.len() as u32).collect::<Vec<_>>()
    );
}

/// Slopes of 1:1, 1:4 and 1:20, and a box rotated about two axes, all in water: the volume is that
/// of the polyhedra.
#[test]
fn water_beside_slopes_has_its_volume() {
    let domain = cuboid([0.0; 3], [2.0; 3]);
    let spacing = 0.05;
    let body = cuboid([0.45, 0.62, 0.53], [1.55, 1.31, 1.42]);
    let middle = 0.5 * (body.min + body.max);
    let volume = 8.0 - body.size().element_product();
    for (about_z, about_x) in [
        (45.0, 0.0),
        (14.036, 0.0),
        (2.862, 0.0),
        (31.0, 23.0),
        (0.0, 0.0),
    ] {
        let turn = glam::DQuat::from_rotation_z(f64::to_radians(about_z))
            * glam::DQuat::from_rotation_x(f64::to_radians(about_x));
        let turned = |v: DVec3| middle + turn * (v - middle);
        let mut mesh = box_mesh(body);
        mesh.vertices.iter_mut().for_each(|v| *v = turned(*v));
        let solid = SignedDistance::from_mesh(&mesh, &domain, spacing).expect("closed");
        let fill = fill_water(&[domain], [], Some(&solid), &domain, spacing).expect("no mesh");
        let error = fill.particles.len() as f64 * spacing.powi(3) / volume - 1.0;
        assert!(error.abs() < 1e-3, "{about_z} {about_x}: {error}");
        // Control: without the particles nearer than half a spacing, as for a lattice beside an
        // aligned face.
        let lattice = fill_blocks(&[domain], &domain, spacing);
        let far = lattice
            .iter()
            .filter(|p| solid.sample(**p) >= 0.499 * spacing);
        let error = far.count() as f64 * spacing.powi(3) / volume - 1.0;
        assert!(error < -5e-3, "{about_z} {about_x}: {error}");
        // At edges, none is nearer than a third of the target distance.
        let places = fill.particles.position.iter();
        let places: Vec<_> = places
            .map(|p| DVec3::from_array(p.map(f64::from)))
            .collect();
        for p in &places {
            assert!(solid.sample(*p) > 0.1 * spacing, "{p}");
        }
        // A particle that was half a spacing deep is now 0.3 outside, and the next in its
        // column 0.5.
        let near = PointGrid::over(&places, 0.15 * spacing);
        for (i, p) in places.iter().enumerate() {
            let is_shared = near.any_near(&places, *p, |j| j as usize != i);
            assert!(!is_shared, "two particles at {p}");
        }
    }
}

/// Largest relative deviation of the density from the lattice's, over all water within three
/// spacings of `body`, with a quadratic kernel. `body` counts as filled, by samples a fifth of a
/// spacing apart.
fn unevenness(water: &[DVec3], body: Bounds, domain: &Bounds, spacing: f64) -> f64 {
    const PARTS: f64 = 5.0;
    let radius = 2.2 * spacing;
    let kernel = |distance: f64| (1.0 - distance / radius).max(0.0).powi(2);
    let inside = fill_blocks(&[body], domain, spacing / PARTS);
    let [water_grid, body_grid] = [water, &inside].map(|points| PointGrid::over(points, radius));
    let density = |p: DVec3| {
        let mut sum = 0.0;
        water_grid.for_each_near(water, p, |_, r| sum += kernel(r));
        body_grid.for_each_near(&inside, p, |_, r| sum += kernel(r) / PARTS.powi(3));
        sum
    };
    let lattice = fill_blocks(&[*domain], domain, spacing);
    let lattice_grid = PointGrid::over(&lattice, radius);
    let mut exact = 0.0;
    let middle = lattice
        .iter()
        .min_by(|a, b| a.length().total_cmp(&b.length()));
    lattice_grid.for_each_near(&lattice, *middle.expect("some"), |_, r| exact += kernel(r));
    let shell = body.grown(3.0 * spacing);
    let near = water.iter().filter(|p| shell.contains(**p));
    near.map(|p| (density(*p) / exact - 1.0).abs())
        .fold(0.0, f64::max)
}

#[test]
fn water_beside_a_solid_that_fits_no_lattice_is_even() {
    let spacing = 0.05;
    let domain = cuboid([-1.0; 3], [1.0; 3]);
    for shift in [0.02, 0.025, 0.04] {
        let body = cuboid(
            [-0.5 + shift, -0.4, -0.3 - shift],
            [0.5, 0.4 + 0.6 * shift, 0.3],
        );
        let mesh = box_mesh(body);
        let solid = SignedDistance::from_mesh(&mesh, &domain, spacing).expect("closed");
        let fill = fill_water(&[domain], [], Some(&solid), &domain, spacing).expect("no mesh");
        let places = fill.particles.position.iter();
        let places: Vec<_> = places
            .map(|p| DVec3::from_array(p.map(f64::from)))
            .collect();
        let after = unevenness(&places, body, &domain, spacing);
        // Control: the lattice without what is in the solid.
        let lattice = fill_blocks(&[domain], &domain, spacing);
        let open = lattice.into_iter().filter(|p| solid.sample(*p) > 0.0);
        let before = unevenness(&open.collect::<Vec<_>>(), body, &domain, spacing);
        println!("{shift}: {before} {after}");
        // A neighbour one spacing away is 6 % of the density. Counts are right to half a particle
        // in a block, so that one neighbour and a half may be amiss.
        assert!(after < 0.1 && before > 0.14, "{shift}: {before} {after}");
    }
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
        // No point on the surface is farther from a sample than this.
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
    // A row one spacing apart on one side, and a sample of the other side at the position of the
    // middle one.
    let row = [-0.1, 0.0, 0.1, 0.0].map(|x| DVec3::new(x, 0.0, 0.0));
    let normals = [DVec3::Y, DVec3::Y, DVec3::Y, -DVec3::Y];
    // 1 − r/R with R two spacings: 1 for itself, ½ for each neighbour; from end to end r = R.
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
    // Four walls of 0.5 by 2.0; the candidates estimate the part of a wall inside to 1/√n.
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

/// Below a surface that rises and falls by a few spacings, the uppermost particle of each column is
/// half a layer below it, and the count is that of the volume. Control: whole layers have steps.
#[test]
fn water_below_a_surface_follows_it_and_has_its_volume() {
    let (domain, spacing) = (cuboid([0.0; 3], [6.0, 2.0, 4.0]), 0.1);
    let surface = |at: DVec2| 1.0 + 0.23 * (1.3 * at.x).sin() + 0.11 * (2.1 * at.y).cos();
    let fill = fill_below(surface, &domain, [None; 2], &domain, spacing);
    let volume: f64 = (0..60 * 40)
        .map(|n| DVec2::new(f64::from(n % 60) + 0.5, f64::from(n / 60) + 0.5))
        .map(|at| surface(spacing * at) * spacing.powi(2))
        .sum();
    let made = fill.particles.len() as f64 * spacing.powi(3);
    // The dither of 2400 columns has a mean within a hundredth of a half.
    assert!(
        (made - volume).abs() < 0.01 * 24.0 * spacing,
        "{made} {volume}"
    );
    let worst = |places: &mut dyn Iterator<Item = DVec3>| {
        let mut tops = std::collections::BTreeMap::<[i64; 2], DVec3>::new();
        for p in places {
            let column = [p.x, p.z].map(|x| (x / spacing).floor() as i64);
            let top = tops.entry(column).or_insert(p);
            top.y = top.y.max(p.y);
        }
        let depth = |p: &DVec3| (surface(DVec2::new(p.x, p.z)) - p.y) / spacing;
        let off = tops.values().map(|p| (depth(p) - 0.5).abs());
        off.fold(0.0, f64::max)
    };
    let places = fill.particles.position.iter();
    let followed = worst(&mut places.map(|p| DVec3::from_array(p.map(f64::from))));
    let mut layers = fill_blocks(&[domain], &domain, spacing);
    layers.retain(|p| p.y < surface(DVec2::new(p.x, p.z)));
    let stepped = worst(&mut layers.into_iter());
    // Half of a quarter of the layer that four share, and f32.
    assert!(followed < 0.126, "{followed}");
    assert!(stepped > 0.45, "{stepped}");
}
