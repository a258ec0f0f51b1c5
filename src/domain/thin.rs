//! Where solids are too thin to hold water.

use glam::DVec3;
use rayon::prelude::*;

use super::{bounds::Bounds, bvh::Bvh, mesh::TriangleMesh, sampling::candidate};

/// Most rays cast through one mesh.
const MOST_RAYS: f64 = 131_072.0;

/// Opposite sides of a plate: normals within 30° of opposite. A blunter edge is thin only at its tip.
const OPPOSITE: f64 = -0.866;

/// Spacings across which a plate is a barrier: four cells of FLIP. Water goes around a smaller one.
const BARRIER: f64 = 8.0;

/// A part of a solid with open space on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinPart {
    /// Midway through it, metres.
    pub place: DVec3,
    /// Metres.
    pub thickness: f64,
}

/// The thinnest part of each of `solids`, `None` where all of a solid is as thick as `least` metres.
///
/// Rays go inward along the normals from points spread over the surface, one in `spacing` squared, fewer on large meshes. A part counts
/// where water could stand on both sides of it, half of `spacing` away, within `domain` and outside of every solid, and where it is eight
/// spacings wide in all directions across the thickness.
pub fn thin_parts(
    solids: &[&TriangleMesh],
    domain: &Bounds,
    spacing: f64,
    least: f64,
) -> Vec<Option<ThinPart>> {
    let trees: Vec<Bvh> = solids.iter().map(|mesh| Bvh::new(mesh)).collect();
    let is_open = |p: DVec3| {
        domain.contains(p) && trees.iter().all(|tree| tree.winding_number(p).abs() <= 0.5)
    };
    let thickness = |mesh: &TriangleMesh, tree: &Bvh, p: DVec3, normal: DVec3| {
        let skipped = 1e-6 * least;
        let (further, t) = tree.first_along(p - skipped * normal, -normal, least)?;
        let thickness = further + skipped;
        let place = p - 0.5 * thickness * normal;
        let is_thin = thickness < least
            && mesh.area_vector(t as usize).normalize().dot(normal) < OPPOSITE
            && is_plate(tree, place, normal, BARRIER * spacing)
            && is_open(p + 0.5 * spacing * normal)
            && is_open(p - (thickness + 0.5 * spacing) * normal);
        is_thin.then_some(ThinPart { place, thickness })
    };
    let thinnest = |(mesh, tree): (&&TriangleMesh, &Bvh)| {
        let points = spread(mesh, domain, spacing);
        let parts = (points.par_iter()).filter_map(|&(p, normal)| thickness(mesh, tree, p, normal));
        parts.min_by(|a, b| {
            let place = |part: &ThinPart| part.place.to_array();
            (a.thickness.total_cmp(&b.thickness))
                .then_with(|| place(a).partial_cmp(&place(b)).expect("finite"))
        })
    };
    solids.iter().zip(&trees).map(thinnest).collect()
}

/// Whether the solid about `place` is `least` metres wide in all directions across `normal`, as a post or a pinnacle is not.
fn is_plate(tree: &Bvh, place: DVec3, normal: DVec3, least: f64) -> bool {
    let (u, v) = normal.any_orthonormal_pair();
    let reach = |direction: DVec3| {
        let met = tree.first_along(place, direction, least);
        met.map_or(least, |(distance, _)| distance)
    };
    [u, v, (u + v).normalize(), (u - v).normalize()]
        .iter()
        .all(|&across| reach(across) + reach(-across) >= least)
}

/// Points on a surface within `domain` and the normals there, one in an area of `spacing` squared.
fn spread(mesh: &TriangleMesh, domain: &Bounds, spacing: f64) -> Vec<(DVec3, DVec3)> {
    let each = (spacing * spacing).max(mesh.area() / MOST_RAYS);
    let mut points = Vec::new();
    // Half of the first point's area: small meshes have one too.
    let mut area = 0.5 * each;
    for t in 0..mesh.triangles.len() {
        let vector = mesh.area_vector(t);
        let size = vector.length();
        if !(size > 0.0 && size.is_finite()) {
            continue;
        }
        area += size;
        let corners = mesh.corners(t);
        for index in 0..(area / each) as u64 {
            let p = candidate(&corners, t as u64, index);
            if domain.contains(p) {
                points.push((p, vector / size));
            }
        }
        area %= each;
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::box_mesh;

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
        thin_parts(solids, &domain, 0.1, 0.125)
    }

    /// A plate across the domain, its thickness and place; one as thick as it has to be.
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

    /// A skin over the floor, and two plates that lie on each other, have water on one side alone. Apart they are thin, both.
    #[test]
    fn what_lies_on_something_is_not_thin() {
        assert_eq!(
            found(&[&boxed([-1.0, -1.0, -1.0], [3.0, 0.06, 3.0])]),
            [None]
        );
        let (left, right) = ([0.9, -1.0, -1.0], [0.98, 3.0, 3.0]);
        let pair = |gap: f64| {
            let near = boxed(left, right);
            let beside = boxed([0.98 + gap, -1.0, -1.0], [1.06 + gap, 3.0, 3.0]);
            found(&[&near, &beside])
                .iter()
                .filter(|it| it.is_some())
                .count()
        };
        assert_eq!((pair(0.0), pair(0.3)), (0, 2));
    }

    /// Water goes around a post and an awning.
    #[test]
    fn small_plates_are_not_thin() {
        let width = |width: f64| found(&[&boxed([0.9, 0.0, 0.9], [0.98, 1.0, 0.9 + width])])[0];
        assert_eq!((width(0.08), width(0.6)), (None, None));
        assert!(width(1.0).is_some());
    }

    /// A beach ends thinner than anything, on the floor; in mid-water its end is thin.
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
}
