//! Signed distance of meshes against parry3d (f64), which finds distances with its own tree and
//! signs with pseudonormals; and the hard cases of meshes.
use std::path::Path;

use glam::DVec3;
use parry3d_f64::{
    math::Vector,
    query::PointQuery as _,
    shape::{TriMesh, TriMeshFlags},
};
use rayon::prelude::*;
use swell::domain::{
    bounds::Bounds,
    inside::NoInside,
    mesh::TriangleMesh,
    signed_distance::{SignedDistance, SignedDistanceError},
};

fn asset(name: &str) -> TriangleMesh {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/assets");
    TriangleMesh::load(&folder.join(name)).unwrap()
}

fn trusted(mesh: &TriangleMesh) -> TriMesh {
    let vertices = mesh.vertices.iter().map(|v| Vector::new(v.x, v.y, v.z));
    let triangles = mesh.triangles.clone();
    TriMesh::with_flags(vertices.collect(), triangles, TriMeshFlags::ORIENTED).unwrap()
}

fn field(mesh: &TriangleMesh, spacing: f64) -> SignedDistance {
    // A margin that is no multiple of the spacing puts the nodes at general positions.
    let bounds = mesh.bounds().unwrap().grown(3.3 * spacing);
    SignedDistance::from_mesh(mesh, &bounds, spacing).unwrap()
}

/// Difference between a field and the trusted library's distances to `distances` and
/// signs of `signs`.
#[derive(Clone, Copy, Debug, Default)]
struct Difference {
    nodes: usize,
    /// Largest difference over all nodes, in spacings.
    distance: f64,
    /// Nodes with the other sign, without those on a surface.
    signs: usize,
}

fn compare(field: &SignedDistance, distances: &TriMesh, signs: &TriMesh) -> Difference {
    let [nx, ny, nz] = field.dims;
    let one = |n: usize| {
        let (i, j, k) = (n % nx, n / nx % ny, n / (nx * ny));
        let p = field.origin + field.spacing * DVec3::new(i as f64, j as f64, k as f64);
        let p = Vector::new(p.x, p.y, p.z);
        let value = field.node(i, j, k);
        let exact = (distances.project_local_point(p, false).point - p).length();
        let inside = signs.project_local_point(p, false);
        let on_surface = (inside.point - p).length() < 1e-6 * field.spacing;
        Difference {
            nodes: 1,
            distance: (value.abs() - exact).abs() / field.spacing,
            signs: usize::from(!on_surface && inside.is_inside != (value < 0.0)),
        }
    };
    let both = |a: Difference, b: Difference| Difference {
        nodes: a.nodes + b.nodes,
        distance: a.distance.max(b.distance),
        signs: a.signs + b.signs,
    };
    (0..nx * ny * nz)
        .into_par_iter()
        .map(one)
        .reduce(Difference::default, both)
}

/// Distances are exact in f64 and stored as f32: 6e-8 of ten metres is 6e-6 of a spacing of 0.1 m.
const DISTANCE: f64 = 1e-3;

#[test]
fn closed_assets_agree_with_parry_everywhere() {
    for (name, spacing) in [("city.obj", 0.2), ("beach.obj", 0.1)] {
        let mesh = asset(name);
        let trusted = trusted(&mesh);
        let found = compare(&field(&mesh, spacing), &trusted, &trusted);
        println!("{name}: {found:?}");
        assert!(
            found.distance < DISTANCE && found.signs == 0,
            "{name}: {found:?}"
        );

        // Negative control: a shift by a hundredth of a spacing.
        let mut moved = mesh.clone();
        for v in &mut moved.vertices {
            v.x += 0.01 * spacing;
        }
        let mut spoilt = field(&moved, spacing);
        spoilt.origin.x -= 0.01 * spacing;
        let off = compare(&spoilt, &trusted, &trusted);
        assert!(off.distance < DISTANCE, "moved back: {off:?}");
        spoilt.origin.x += 0.01 * spacing;
        let off = compare(&spoilt, &trusted, &trusted);
        assert!(off.distance > 5.0 * DISTANCE, "{off:?}");
    }
}

#[test]
fn a_slightly_open_city_keeps_its_distances_and_its_inside() {
    let closed = asset("city.obj");
    let mut open = closed.clone();
    // Every 120th triangle of 2 442.
    let mut index = 0;
    open.triangles.retain(|_| {
        index += 1;
        index % 120 != 0
    });
    assert_eq!(closed.triangles.len() - open.triangles.len(), 20);
    assert!(!open.open_edges().is_empty());
    let found = compare(&field(&open, 0.2), &trusted(&open), &trusted(&closed));
    println!("{found:?}");
    assert!(found.distance < DISTANCE, "{found:?}");
    assert!(found.signs * 1000 <= found.nodes, "{found:?}");
    // Negative control: without a part of the mesh the sign differs.
    let mut half = closed.clone();
    half.triangles.truncate(1200);
    let half = compare(&field(&closed, 0.2), &trusted(&closed), &trusted(&half));
    assert!(half.signs * 1000 > half.nodes, "{half:?}");
}

fn box_mesh(min: DVec3, max: DVec3) -> TriangleMesh {
    let corner = |i: usize| {
        let pick = |axis: usize| {
            if i >> axis & 1 == 0 {
                min[axis]
            } else {
                max[axis]
            }
        };
        DVec3::new(pick(0), pick(1), pick(2))
    };
    let quads = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
    TriangleMesh {
        vertices: (0..8).map(corner).collect(),
        triangles: quads.into_iter().flat_map(halves).collect(),
    }
}

fn joined(a: &TriangleMesh, b: &TriangleMesh) -> TriangleMesh {
    let base = a.vertices.len() as u32;
    let moved = b.triangles.iter().map(|t| t.map(|v| v + base));
    TriangleMesh {
        vertices: a.vertices.iter().chain(&b.vertices).copied().collect(),
        triangles: a.triangles.iter().copied().chain(moved).collect(),
    }
}

#[test]
fn flipped_and_non_manifold_meshes_have_their_inside_where_one_sees_it() {
    // The whole city is inverted.
    let city = asset("city.obj");
    let mut turned = city.clone();
    turned.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let found = compare(&field(&turned, 0.25), &trusted(&city), &trusted(&city));
    assert!(found.distance < DISTANCE && found.signs == 0, "{found:?}");

    // Two boxes that share an edge, which then has four triangles; one box is inverted.
    let left = box_mesh(DVec3::ZERO, DVec3::ONE);
    let mut right = box_mesh(DVec3::new(1.0, 1.0, 0.0), DVec3::new(2.0, 2.0, 1.0));
    right.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let mut shared = joined(&left, &right);
    // Vertices 3 and 7 of the left box are 0 and 4 of the right one.
    for v in shared.triangles.iter_mut().flatten() {
        *v = match *v {
            8 => 3,
            12 => 7,
            v => v,
        };
    }
    let field = field(&shared, 0.13);
    let [nx, ny, nz] = field.dims;
    for n in 0..nx * ny * nz {
        let (i, j, k) = (n % nx, n / nx % ny, n / (nx * ny));
        let p = field.origin + field.spacing * DVec3::new(i as f64, j as f64, k as f64);
        let is_in = |low: f64| {
            let q = p - DVec3::new(low, low, 0.0);
            q.min_element() > 0.0 && q.max_element() < 1.0
        };
        assert_eq!(field.node(i, j, k) < 0.0, is_in(0.0) || is_in(1.0), "{p}");
    }

    // One triangle inverted against its neighbours: refused, and the message names its edge.
    let mut wrong = city;
    wrong.triangles[7].swap(0, 1);
    let bounds = wrong.bounds().unwrap();
    let error = SignedDistance::from_mesh(&wrong, &bounds, 0.25).unwrap_err();
    let SignedDistanceError::NoInside(NoInside::Inconsistent {
        first,
        second,
        edge,
    }) = &error
    else {
        panic!("{error}");
    };
    assert!([*first, *second].contains(&7));
    assert_named(&wrong, edge);
}

/// Asserts that a message names an edge by two vertices of the mesh.
fn assert_named(mesh: &TriangleMesh, edges: &str) {
    let name = |v: &DVec3| format!("({:.4}, {:.4}, {:.4})", v.x, v.y, v.z);
    let named = mesh.vertices.iter().filter(|v| edges.contains(&name(v)));
    assert!(named.count() >= 2, "{edges}");
}

#[test]
fn plates_without_thickness_are_refused_with_their_place_and_thin_ones_are_not_inside() {
    let sheet = TriangleMesh {
        vertices: [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)]
            .map(|(x, z)| DVec3::new(x, 0.5, z))
            .into(),
        triangles: vec![[0, 2, 1], [0, 3, 2]],
    };
    let mut two_sided = sheet.clone();
    two_sided.triangles.extend([[0, 1, 2], [0, 2, 3]]);
    let bounds = sheet.bounds().unwrap().grown(0.5);
    for mesh in [&sheet, &two_sided] {
        match SignedDistance::from_mesh(mesh, &bounds, 0.1).unwrap_err() {
            SignedDistanceError::NoInside(NoInside::Open { holes, .. }) => {
                assert_eq!((holes.0.len(), holes.edges()), (1, 4));
                assert_eq!(holes.0[0].centre, DVec3::new(1.0, 0.5, 0.5));
            }
            SignedDistanceError::NoInside(NoInside::Flat { place }) => {
                assert_eq!(place, "(0.0000, 0.5000, 0.0000)");
            }
            other => panic!("{other}"),
        }
    }

    // A fifth of a spacing thick, between two layers of nodes: no node is inside.
    let thin = box_mesh(DVec3::new(0.0, 0.54, 0.0), DVec3::new(2.0, 0.56, 1.0));
    let field = SignedDistance::from_mesh(&thin, &bounds, 0.1).unwrap();
    assert!(field.values.iter().all(|value| *value > 0.0));
    // Negative control: two layers thick, it contains nodes.
    let thick = box_mesh(DVec3::new(0.0, 0.36, 0.0), DVec3::new(2.0, 0.56, 1.0));
    let field = SignedDistance::from_mesh(&thick, &bounds, 0.1).unwrap();
    assert!(field.values.iter().any(|value| *value < 0.0));
}

#[test]
fn halfway_between_surfaces_closer_than_a_cell_the_sign_is_right() {
    // Gaps and walls of 0.4 cells, with a node halfway between the two surfaces.
    let (spacing, width) = (0.1, 0.04);
    let bounds = Bounds {
        min: DVec3::ZERO,
        max: DVec3::new(2.0, 1.0, 1.0),
    };
    let middle = DVec3::new(1.0, 0.5, 0.5);
    let half = 0.5 * width;
    let left = box_mesh(DVec3::splat(0.13), DVec3::new(1.0 - half, 0.87, 0.87));
    let right = box_mesh(
        DVec3::new(1.0 + half, 0.13, 0.13),
        DVec3::new(1.87, 0.87, 0.87),
    );
    let gap = SignedDistance::from_mesh(&joined(&left, &right), &bounds, spacing).unwrap();
    assert!((gap.sample(middle) - half).abs() < 1e-6);
    let wall = box_mesh(
        DVec3::new(1.0 - half, 0.13, 0.13),
        DVec3::new(1.0 + half, 0.87, 0.87),
    );
    let wall = SignedDistance::from_mesh(&wall, &bounds, spacing).unwrap();
    assert!((wall.sample(middle) + half).abs() < 1e-6);
    // Shifted by half a cell, where no node lies between the surfaces, a gap counts as closed and a
    // wall as open, which is all that a grid of this spacing can represent.
    let aside = DVec3::new(0.5 * spacing, 0.0, 0.0);
    assert!(gap.sample(middle + aside) < 0.0 && wall.sample(middle + aside) > 0.0);
}
