//! Detects parts of solids that are too thin to hold water back.

use glam::DVec3;
use rayon::prelude::*;

use super::{bounds::Bounds, bvh::Bvh, mesh::TriangleMesh, parallel, sampling::candidate};

/// Largest number of rays cast through one mesh.
const MOST_RAYS: f64 = 131_072.0;

/// Cosine limit for opposite sides of a plate: normals within 30° of opposite. An edge with a
/// larger angle is thin only at its tip.
const OPPOSITE: f64 = -0.866;

/// Radius, in spacings, within which a plate must extend to be a barrier: two cells of FLIP. Water
/// flows around a smaller one.
const AROUND: i32 = 4;

/// Fraction of the points in that radius that a barrier covers: all except its rim. A plate that
/// ends at the centre covers half.
const COVERED: f64 = 0.8;

/// Fraction of the points where a barrier is thin: almost all for a plate, and more than half for a
/// window of seven spacings in a thick wall, but a tenth for a parapet on a house.
const THIN: f64 = 0.4;

/// Distance, in spacings, by which a curved barrier may leave its tangent plane within that radius.
const CURVED: f64 = 3.0;

/// Distance before and behind a surface at which its sides are tested, in spacings.
const BESIDE: f64 = 0.1;

/// Largest number of parts of a mesh that are tested for being a barrier, from the thinnest on; if
/// there are more, as many are picked at regular intervals.
const MOST_PARTS: usize = 4096;

/// A thin part of a solid with open space on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinPart {
    /// Midpoint, metres.
    pub place: DVec3,
    /// Thickness, metres.
    pub thickness: f64,
}

/// Returns the thinnest part of each of `solids`; `None` if a solid is at least `least` metres
/// thick everywhere.
///
/// Rays go inward along the normals from points spread over the surface, one per squared `spacing`,
/// fewer on large meshes. A part counts if they come out into open space within `domain` without
/// passing a layer as thick as `least`, of one solid or several, and if solids cover most of the
/// domain perpendicular to the normal within four spacings.
pub fn thin_parts(
    solids: &[&TriangleMesh],
    domain: &Bounds,
    spacing: f64,
    least: f64,
) -> Vec<Option<ThinPart>> {
    let trees: Vec<Bvh> = solids.iter().map(|mesh| Bvh::new(mesh)).collect();
    let all = Solids {
        meshes: solids,
        trees: &trees,
        domain,
        spacing,
        least,
    };
    let thinnest = |mesh: &&TriangleMesh| {
        let points = spread(mesh, domain, spacing);
        let mut parts: Vec<(ThinPart, DVec3)> = parallel::flat_map(0..points.len(), |k| {
            let (p, normal) = points[k];
            Some((all.part(p, normal)?, normal))
        });
        parts.sort_by(|(a, _), (b, _)| a.thickness.total_cmp(&b.thickness));
        let each = parts.len().div_ceil(MOST_PARTS).max(1);
        let asked = parts.par_iter().step_by(each);
        let is_of_barrier =
            |(part, normal): &&(ThinPart, DVec3)| all.is_barrier(part.place, *normal);
        asked.find_first(is_of_barrier).map(|(part, _)| *part)
    };
    solids.iter().map(thinnest).collect()
}

/// All solids of a scene.
struct Solids<'a> {
    meshes: &'a [&'a TriangleMesh],
    trees: &'a [Bvh],
    domain: &'a Bounds,
    spacing: f64,
    least: f64,
}

impl Solids<'_> {
    fn is_solid(&self, p: DVec3) -> bool {
        (self.trees.iter()).any(|tree| tree.winding_number(p).abs() > 0.5)
    }

    /// Next surface along a ray within `bound`, in lengths of `direction`: its distance and normal.
    fn next(&self, p: DVec3, direction: DVec3, bound: f64) -> Option<(f64, DVec3)> {
        let met = self
            .trees
            .iter()
            .zip(self.meshes)
            .filter_map(|(tree, mesh)| {
                let (distance, t) = tree.first_along(p, direction, bound)?;
                Some((distance, mesh.area_vector(t as usize).normalize()))
            });
        met.min_by(|(a, _), (b, _)| a.total_cmp(b))
    }

    /// Part behind a point of a surface, if it is thin with open space on both sides.
    fn part(&self, p: DVec3, normal: DVec3) -> Option<ThinPart> {
        let is_within = |way: f64| self.domain.contains(p - way * normal);
        let (beside, apart) = (BESIDE * self.spacing, 0.5 * self.spacing);
        if !is_within(-apart) {
            return None;
        }
        let skipped = 1e-6 * self.least;
        let (mut way, mut thickness) = (0.0, None);
        loop {
            let from = p - (way + skipped) * normal;
            let (further, other) = self.next(from, -normal, self.least)?;
            way += skipped + further;
            let thickness = *thickness.get_or_insert(way);
            if other.dot(normal) < OPPOSITE && !self.is_solid(p - (way + beside) * normal) {
                let place = p - 0.5 * thickness * normal;
                let is_thin = is_within(way + apart) && !self.is_solid(p + beside * normal);
                return is_thin.then_some(ThinPart { place, thickness });
            }
            if way > 4.0 * self.least {
                return None;
            }
        }
    }

    /// Whether solids cover the surroundings of `place` perpendicular to `normal`, and are thin
    /// there: not so for a post, a pinnacle or an awning, nor for a parapet on a house.
    fn is_barrier(&self, place: DVec3, normal: DVec3) -> bool {
        let (u, v) = normal.any_orthonormal_pair();
        let steps = || -AROUND..=AROUND;
        let disc = steps().flat_map(|i| steps().map(move |j| (i, j)));
        let layers: Vec<(DVec3, Option<f64>)> = disc
            .filter(|(i, j)| i * i + j * j <= AROUND * AROUND)
            .map(|(i, j)| place + self.spacing * (f64::from(i) * u + f64::from(j) * v))
            .filter(|p| self.domain.contains(*p))
            .map(|p| (p, self.layer(p, normal)))
            .collect();
        let suffice = |count: usize, part: f64| count as f64 >= part * layers.len() as f64;
        let thin = || {
            let is_thin = |layer: f64| layer < 2.0 * self.least;
            layers.iter().filter(move |(_, it)| it.is_some_and(is_thin))
        };
        // Rays are cheap beside winding numbers, and few places pass this test.
        if !suffice(thin().count(), THIN) {
            return false;
        }
        let reach = CURVED * self.spacing;
        let is_apart = |p: DVec3| {
            ![-reach, reach]
                .iter()
                .any(|way| self.is_solid(p + *way * normal))
        };
        let is_covered = |p: DVec3, layer: Option<f64>| layer.is_some() || self.is_solid(p);
        let covered = layers.iter().filter(|(p, layer)| is_covered(*p, *layer));
        suffice(thin().filter(|(p, _)| is_apart(*p)).count(), THIN)
            && suffice(covered.count(), COVERED)
    }

    /// Thickness of what two rays towards `p` from either side meet, if both meet something.
    fn layer(&self, p: DVec3, normal: DVec3) -> Option<f64> {
        let reach = CURVED * self.spacing;
        let met = |side: f64| self.next(p - side * reach * normal, side * normal, 2.0 * reach);
        let ((front, _), (back, _)) = met(1.0).zip(met(-1.0))?;
        Some(2.0 * reach - front - back)
    }
}

/// Points on a surface within `domain`, with normals: one per area of `spacing` squared.
fn spread(mesh: &TriangleMesh, domain: &Bounds, spacing: f64) -> Vec<(DVec3, DVec3)> {
    let each = (spacing * spacing).max(mesh.area() / MOST_RAYS);
    let mut points = Vec::new();
    // Starts with half of a point's area, so that small meshes get a point too.
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
        thin_parts(solids, &domain, 0.1, 0.125)
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
        assert!(thin_parts(&[&across], &domain, 0.1, 0.125)[0].is_some());
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
}
