use glam::{DQuat, EulerRot};

use super::*;
use crate::mesh::tests::{box_mesh, sphere};

fn boxed(min: [f64; 3], max: [f64; 3]) -> TriangleMesh {
    box_mesh(Bounds {
        min: DVec3::from_array(min),
        max: DVec3::from_array(max),
    })
}

fn found(solids: &[&TriangleMesh]) -> Vec<Option<ThinPart>> {
    let domain = Bounds {
        min: DVec3::ZERO,
        max: DVec3::splat(2.0),
    };
    thin_parts(solids, &domain, 0.1, Needed::Everywhere(0.125))
}

/// Thickness and position of a plate across the domain; a plate of sufficient thickness
/// is none.
#[test]
fn plates_between_water_are_thin_as_far_as_they_are() {
    let plate = boxed([0.9, -1.0, -1.0], [0.98, 3.0, 3.0]);
    let thin = found(&[&plate])[0].expect("a plate");
    assert!((thin.thickness - 0.08).abs() < 1e-9, "{thin:?}");
    assert!((thin.place.x - 0.94).abs() < 1e-9, "{thin:?}");
    assert_eq!(
        found(&[&boxed([0.9, -1.0, -1.0], [1.026, 3.0, 3.0])]),
        [None]
    );
}

/// A plate becomes one of the least thickness, and where it crosses the domain's sides too;
/// beyond its rim nothing changes but around the rim itself. One that is not marked stays.
#[test]
fn a_thin_plate_has_the_distances_of_a_thick_one() {
    let domain = Bounds {
        min: DVec3::ZERO,
        max: DVec3::splat(2.0),
    };
    let grid = domain.grown(0.3);
    let turn = DQuat::from_euler(EulerRot::XYZ, 0.5, 0.4, 0.3);
    let plate = |half: f64, turn: DQuat| {
        let mut mesh = boxed([-half, -0.6, -3.0], [half, 3.0, 3.0]);
        for v in &mut mesh.vertices {
            *v = turn * *v + DVec3::splat(0.97);
        }
        mesh
    };
    let cells = Needed::OfCells {
        cell: 0.2,
        least: 0.15,
    };
    let asked = [Needed::Everywhere(0.15), cells].map(|needed| {
        let turns = [DQuat::IDENTITY, turn];
        turns.map(|turn| (needed, turn))
    });
    for (needed, turn) in asked.into_iter().flatten() {
        let half = 0.5 * needed.along(turn * DVec3::X);
        let field =
            |half: f64| SignedDistance::from_mesh(&plate(half, turn), &grid, 0.1).expect("closed");
        let thickened = |is_thin: bool| {
            let mut thin = field(0.01);
            let solids = [&plate(0.01, turn)];
            thicken(&mut thin, &solids, &[is_thin], &domain, needed);
            thin
        };
        let (thin, thick, as_is) = (thickened(true), field(half), thickened(false));
        assert_eq!(as_is, field(0.01));
        let [nx, ny, _] = thin.dims;
        let mut compared = 0;
        for (n, value) in thin.values.iter().enumerate() {
            let [i, j, k] = [n % nx, n / nx % ny, n / (nx * ny)].map(|i| 0.1 * i as f64);
            let at = grid.min + DVec3::new(i, j, k);
            let x = turn.inverse() * (at - DVec3::splat(0.97));
            // Beyond the sides that the plate faces there is nothing to hold back.
            let is_between = (0.2..1.8).contains(&at.x) && domain.contains(at);
            if x.x.abs() < half + 0.3 && x.y > half - 0.6 && is_between {
                // Stored as f32, of at most a metre.
                assert!((value - thick.values[n]).abs() < 2e-7, "{x} {value}");
                compared += 1;
            }
            // A rim grows by half the thickness, and is as deep inside at most.
            let grown = f64::from(as_is.values[n] - value);
            assert!((-1e-7..=2.0 * half).contains(&grown), "{x} {grown}");
        }
        assert!(compared > 1000, "{compared}");
    }
}

/// An open tank: its outer box, and the inner one turned around, joined at the rim.
fn tank(half: f64) -> TriangleMesh {
    let outer = Bounds {
        min: DVec3::splat(0.53 - half),
        max: DVec3::new(1.48 + half, 1.5, 1.43 + half),
    };
    let corner = |k: usize, wall: f64| {
        let (min, max) = (
            outer.min + DVec3::splat(wall),
            outer.max - DVec3::new(wall, 0.0, wall),
        );
        DVec3::new(
            if k & 1 == 0 { min.x } else { max.x },
            if k & 2 == 0 { min.y } else { max.y },
            if k & 4 == 0 { min.z } else { max.z },
        )
    };
    let vertices = (0..16).map(|k| corner(k & 7, if k < 8 { 0.0 } else { 2.0 * half }));
    // Corner k has bits x, y, z.
    let quads: [[u32; 4]; 14] = [
        [0, 1, 5, 4],
        [0, 2, 3, 1],
        [1, 3, 7, 5],
        [5, 7, 6, 4],
        [4, 6, 2, 0],
        [8, 12, 13, 9],
        [8, 9, 11, 10],
        [9, 13, 15, 11],
        [13, 12, 14, 15],
        [12, 8, 10, 14],
        [2, 10, 11, 3],
        [3, 11, 15, 7],
        [7, 15, 14, 6],
        [6, 14, 10, 2],
    ];
    TriangleMesh {
        vertices: vertices.collect(),
        triangles: (quads.iter())
            .flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]])
            .collect(),
    }
}

/// Walls meet at edges as thick ones do. Round plates do not fill a corner of three.
#[test]
fn a_tank_of_thin_walls_has_thick_ones() {
    let domain = Bounds {
        min: DVec3::ZERO,
        max: DVec3::splat(2.0),
    };
    let needed = Needed::Everywhere(0.2);
    let field = |half: f64| {
        let mesh = tank(half);
        assert!(mesh.signed_volume() > 0.0 && mesh.open_edges().is_empty());
        SignedDistance::from_mesh(&mesh, &domain, 0.1).expect("closed")
    };
    let (mut thin, thick) = (field(0.01), field(0.1));
    thicken(&mut thin, &[&tank(0.01)], &[true], &domain, needed);
    let [nx, ny, _] = thin.dims;
    let (mut compared, mut rounded) = (0, 0);
    for (n, value) in thin.values.iter().enumerate() {
        let at = [n % nx, n / nx % ny, n / (nx * ny)].map(|i| 0.1 * i as f64);
        // Rims grow too.
        let exact = thick.values[n];
        if exact.abs() < 0.15 && at[1] < 1.3 {
            assert!((value - exact).abs() < 0.07, "{at:?}: {value} {exact}");
            compared += 1;
            rounded += usize::from((value - exact).abs() > 0.02);
        }
    }
    assert!(rounded < compared / 20, "{rounded} of {compared}");
}

/// A skin on the floor or on a block stays as thin as it is, and so does a beach at its end.
#[test]
fn what_has_water_on_one_side_is_not_thickened() {
    let domain = Bounds {
        min: DVec3::ZERO,
        max: DVec3::splat(2.0),
    };
    let skin = boxed([-1.0, -0.02, -1.0], [3.0, 0.06, 3.0]);
    let block = boxed([0.0, 0.0, 0.0], [1.0, 1.0, 2.0]);
    let cover = boxed([0.0, 1.0, 0.0], [1.0, 1.06, 2.0]);
    for solids in [vec![&skin], vec![&block, &cover]] {
        let marks = vec![true; solids.len()];
        let field = SignedDistance::from_meshes(solids.iter().copied(), &domain, 0.1);
        let mut field = field.expect("closed").expect("a solid");
        let before = field.clone();
        thicken(
            &mut field,
            &solids,
            &marks,
            &domain,
            Needed::Everywhere(0.15),
        );
        assert_eq!(field, before);
    }
}

/// A skin on the floor or on a block has water on only one side. Two thin plates are thin, even
/// if they touch: the distance is that of either.
#[test]
fn what_lies_on_something_is_not_thin() {
    assert_eq!(
        found(&[&boxed([-1.0, -1.0, -1.0], [3.0, 0.06, 3.0])]),
        [None]
    );
    let block = boxed([0.0, 0.0, 0.0], [1.0, 1.0, 2.0]);
    assert_eq!(
        found(&[&block, &boxed([0.0, 1.0, 0.0], [1.0, 1.06, 2.0])]),
        [None, None]
    );
    let (left, right) = ([0.9, -1.0, -1.0], [0.98, 3.0, 3.0]);
    let pair = |gap: f64| {
        let near = boxed(left, right);
        let beside = boxed([0.98 + gap, -1.0, -1.0], [1.06 + gap, 3.0, 3.0]);
        let found = found(&[&near, &beside]);
        found.iter().filter(|it| it.is_some()).count()
    };
    assert_eq!([0.0, 0.02, 0.3].map(pair), [2; 3]);
}

/// A plate that ends at the domain's ends is as good a barrier as one that continues; so is a
/// curved one, however finely it is tessellated.
#[test]
fn barriers_end_at_walls_and_may_be_curved() {
    let domain = Bounds {
        min: DVec3::ZERO,
        max: DVec3::new(2.0, 2.0, 0.3),
    };
    let across = boxed([0.9, 0.0, 0.0], [0.98, 2.0, 0.3]);
    assert!(thin_parts(&[&across], &domain, 0.1, Needed::Everywhere(0.125))[0].is_some());
    let shell = |thickness: f64| {
        let outer = sphere(DVec3::ONE, 0.8, 48);
        let inner = sphere(DVec3::ONE, 0.8 - thickness, 48);
        let count = outer.vertices.len() as u32;
        let turned = inner
            .triangles
            .iter()
            .map(|[a, b, c]| [*a, *c, *b].map(|v| v + count));
        TriangleMesh {
            triangles: outer.triangles.iter().copied().chain(turned).collect(),
            vertices: [outer.vertices, inner.vertices].concat(),
        }
    };
    assert!(found(&[&shell(0.08)])[0].is_some());
    assert_eq!(found(&[&shell(0.2)]), [None]);
}

/// Water flows around a post and an awning.
#[test]
fn small_plates_are_not_thin() {
    let width = |width: f64| found(&[&boxed([0.9, 0.0, 0.9], [0.98, 1.0, 0.9 + width])])[0];
    assert_eq!((width(0.08), width(0.4)), (None, None));
    assert!(width(1.0).is_some());
}

/// A beach becomes arbitrarily thin where it ends on the floor; in mid-water its end is thin.
#[test]
fn a_wedge_is_thin_where_it_ends_in_the_water() {
    let wedge = |height: f64| {
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let mut vertices = Vec::new();
        for z in [-1.0, 3.0] {
            vertices.extend([
                at(0.5, height, z),
                at(3.0, height, z),
                at(3.0, height + 0.5, z),
            ]);
        }
        TriangleMesh {
            vertices,
            triangles: vec![
                [0, 2, 1],
                [3, 4, 5],
                [0, 1, 4],
                [0, 4, 3],
                [1, 2, 5],
                [1, 5, 4],
                [2, 0, 3],
                [2, 3, 5],
            ],
        }
    };
    assert!(wedge(0.0).signed_volume() > 0.0);
    assert_eq!(found(&[&wedge(0.0)]), [None]);
    assert!(found(&[&wedge(0.6)])[0].is_some());
}
