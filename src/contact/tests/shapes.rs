//! Shapes of bodies and solids.

use super::*;

/// A closed mesh of a cup: a square prism, 1 m wide and high, with a square hole from above, 0.6 m
/// wide and 0.8 m deep.
fn cup() -> TriangleMesh {
    let ring = |half: f64, y: f64| {
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, z]: [f64; 2]| DVec3::new(half * x, y, half * z))
    };
    let rings = [
        ring(0.5, 0.0),
        ring(0.5, 1.0),
        ring(0.3, 1.0),
        ring(0.3, 0.2),
    ];
    let quad = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
    let mut triangles = quad([0, 1, 2, 3]).to_vec();
    for ring in 0..3 {
        for side in 0..4 {
            let [a, b] = [side, (side + 1) % 4].map(|k| 4 * ring + k);
            triangles.extend(quad([a, a + 4, b + 4, b]));
        }
    }
    triangles.extend(quad([12, 15, 14, 13]));
    TriangleMesh {
        vertices: rings.concat(),
        triangles,
    }
}

#[test]
fn a_body_that_is_not_convex_keeps_its_hollow() {
    let cup = cup();
    assert!((cup.signed_volume() - (1.0 - 0.36 * 0.8)).abs() < 1e-12);
    let ball = cuboid(DVec3::new(0.0, 0.6, 0.0), DVec3::splat(0.3));
    let run = Run::new(&[], &[], vec![cup.clone(), ball.clone()]).fall(&floor(), 2.0);
    let height = run.lowest(1);
    // It lies on the ground of the cup. Parts are made of cells of 1/64 of the size.
    assert!((height - 0.2).abs() < 1.0 / 64.0, "{height}");
    assert!(run.lowest(0).abs() < 1e-4 && run.fastest() < 1e-2);
    // Negative control: in the convex hull of the cup it would begin inside.
    let hull = cuboid(DVec3::new(0.0, 0.5, 0.0), DVec3::ONE);
    let run = Run::new(&[], &[], vec![hull, ball]).fall(&floor(), 2.0);
    assert!((run.lowest(1) - 0.2).abs() > 0.1, "{}", run.lowest(1));
}

/// A solid keeps its hollow too: the same in a cup at rest, without a floor.
#[test]
fn a_solid_that_is_not_convex_keeps_its_hollow() {
    let ball = cuboid(DVec3::new(0.0, 0.6, 0.0), DVec3::splat(0.3));
    let run = Run::new(&[&cup()], &[], vec![ball]).fall(&nowhere(), 2.0);
    assert!((run.lowest(0) - 0.2).abs() < 1e-4, "{}", run.lowest(0));
}

/// A body that begins inside a solid, up to its middle, comes out on the nearer side.
#[test]
fn a_solid_pushes_a_body_out() {
    let solid = cuboid(DVec3::new(0.0, -1.0, 0.0), DVec3::new(4.0, 2.0, 4.0));
    let body = cuboid(DVec3::new(0.3, 0.02, 0.1), DVec3::splat(0.4));
    let run = Run::new(&[&solid], &[], vec![body]).fall(&nowhere(), 4.0);
    assert!(run.lowest(0).abs() < 1e-3, "{:?}", run.states[0]);
    assert!(run.fastest() < 1e-3);
}

#[test]
fn meshes_without_inside_are_refused() {
    let empty = TriangleMesh::default();
    let cube = cuboid(DVec3::ZERO, DVec3::ONE);
    let body = free(&cube);
    let flat = TriangleMesh {
        triangles: vec![[0, 1, 2], [2, 1, 0]],
        ..cube.clone()
    };
    let of_body = |mesh| Contacts::new(&[], &[], &[(&body, Some(mesh))], 0.0).err();
    assert_eq!(of_body(&empty), Some(ShapeError::Empty));
    assert_eq!(of_body(&flat), Some(ShapeError::Flat));
    let flipped = TriangleMesh {
        triangles: cube.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(),
        ..cube.clone()
    };
    assert_eq!(of_body(&flipped), Some(ShapeError::Flat));
    assert_eq!(of_body(&cube), None);
    let of_solid = |mesh| Contacts::new(&[mesh], &[], &[], 0.0).err();
    assert_eq!(of_solid(&empty), Some(ShapeError::Empty));
    assert_eq!(of_solid(&cube), None);
    let of_moving = |mesh| Contacts::new(&[], &[mesh], &[], 0.0).err();
    assert_eq!(of_moving(&empty), Some(ShapeError::Empty));
}

/// A body without a mesh passes through everything.
#[test]
fn a_body_without_a_mesh_touches_nothing() {
    let cube = cuboid(DVec3::new(0.0, 0.3, 0.0), DVec3::splat(0.5));
    let mut run = Run::new(&[], &[], vec![cube.clone(), cube]);
    let [a, b] = [&run.bodies[0], &run.bodies[1]];
    run.contacts = Contacts::new(&[], &[], &[(a, Some(&run.meshes[0])), (b, None)], 0.0).unwrap();
    let run = run.fall(&floor(), 1.0);
    assert!(run.lowest(0).abs() < 1e-4 && run.lowest(1) < -4.0);
}
