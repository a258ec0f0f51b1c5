//! Detects parts of solids that are too thin to hold water back, and thickens their distances.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::{
    bounds::Bounds, bvh::Bvh, mesh::TriangleMesh, parallel, sampling::candidate,
    signed_distance::SignedDistance,
};

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

/// Distance between the points of a surface from which a wall's middle is looked for, spacings: a
/// quarter of the diameter of a plate, which is a cell at least.
const SPREAD: f64 = 0.5;

/// Distance from a thickened surface, in spacings, up to which distances are: what particles and
/// cells of water beside it see.
const NEAR: f64 = 3.0;

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

/// Thickness that a wall needs to separate the water on its sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Needed {
    /// As much along any normal, metres.
    Everywhere(f64),
    /// The extent along the wall's normal of a cell with edges of `cell` metres, so that no cell is
    /// open on both sides: `cell` (|nx| + |ny| + |nz|); and not less than `least` metres.
    OfCells {
        /// Edge of a cell, metres.
        cell: f64,
        /// Least thickness along any normal, metres.
        least: f64,
    },
}

impl Needed {
    /// Returns the thickness along a normal, metres.
    pub fn along(&self, normal: DVec3) -> f64 {
        match *self {
            Self::Everywhere(least) => least,
            Self::OfCells { cell, least } => least.max(cell * normal.abs().element_sum()),
        }
    }

    /// Returns the largest thickness along any normal, metres.
    pub fn most(&self) -> f64 {
        self.along(DVec3::splat(1.0 / 3f64.sqrt()))
    }
}

/// Returns the thinnest part of each of `solids`; `None` if a solid is as thick everywhere as
/// `needed`.
///
/// Rays go inward along the normals from points spread over the surface, one per squared `spacing`,
/// fewer on large meshes. A part counts if they come out into open space within `domain` without
/// passing a layer as thick as needed, of one solid or several, and if solids cover most of the
/// domain perpendicular to the normal within four spacings.
pub fn thin_parts(
    solids: &[&TriangleMesh],
    domain: &Bounds,
    spacing: f64,
    needed: Needed,
) -> Vec<Option<ThinPart>> {
    let trees: Vec<Bvh> = solids.iter().map(|mesh| Bvh::new(mesh)).collect();
    let all = Solids {
        meshes: solids,
        trees: &trees,
        domain,
        spacing,
        needed,
        least: needed.most(),
    };
    let thinnest = |mesh: &&TriangleMesh| {
        let points = spread(mesh, domain, spacing, MOST_RAYS);
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

/// Thickens `solids` where they are thinner than `needed`. `field` holds the distances to their
/// union; only solids that `is_thin` marks are thickened.
///
/// From points spread over their surfaces rays find the middle of a wall with open space on both
/// sides, as in [`thin_parts`]. A plate as thick as needed lies around each middle, with a radius of
/// half its thickness, so that walls meet at edges as thick ones do, and a rim grows by as much as a
/// side. The distance becomes the least of the solids' and the plates'.
pub fn thicken(
    field: &mut SignedDistance,
    solids: &[&TriangleMesh],
    is_thin: &[bool],
    domain: &Bounds,
    needed: Needed,
) {
    if !is_thin.contains(&true) {
        return;
    }
    let trees: Vec<Bvh> = solids.iter().map(|mesh| Bvh::new(mesh)).collect();
    let (origin, spacing, dims) = (field.origin, field.spacing, field.dims);
    let all = Solids {
        meshes: solids,
        trees: &trees,
        domain,
        spacing,
        needed,
        least: needed.most(),
    };
    let reach = 0.5 * needed.most() + NEAR * spacing;
    let mut near: HashMap<[i64; 3], Vec<Plate>> = HashMap::new();
    for (mesh, _) in solids.iter().zip(is_thin).filter(|(_, is_thin)| **is_thin) {
        let points = spread(mesh, &domain.grown(reach), SPREAD * spacing, f64::INFINITY);
        let plates: Vec<Plate> = parallel::flat_map(0..points.len(), |k| {
            let (p, normal) = points[k];
            let part = all.part(p, normal)?;
            Some(Plate {
                middle: part.place,
                normal,
                half: 0.5 * needed.along(normal),
            })
        });
        for plate in plates {
            near.entry(room(plate.middle, reach))
                .or_default()
                .push(plate);
        }
    }
    parallel::for_chunks_mut(&mut field.values, dims[0], |row, values| {
        let (j, k) = (row % dims[1], row / dims[1]);
        for (i, value) in values.iter_mut().enumerate() {
            let x = origin + spacing * DVec3::new(i as f64, j as f64, k as f64);
            let [a, b, c] = room(x, reach);
            let rooms = (0..27).map(|n| [a + n % 3 - 1, b + n / 3 % 3 - 1, c + n / 9 - 1]);
            let plates = rooms.filter_map(|room| near.get(&room)).flatten();
            let least = plates.map(|plate| plate.distance(x));
            *value = least.fold(f64::from(*value), f64::min) as f32;
        }
    });
}

/// The cube of edge `edge` that contains a point.
fn room(p: DVec3, edge: f64) -> [i64; 3] {
    (p / edge).floor().to_array().map(|i| i as i64)
}

/// A round plate around the middle of a thin wall.
#[derive(Clone, Copy)]
struct Plate {
    middle: DVec3,
    normal: DVec3,
    /// Half of its thickness and its radius, metres.
    half: f64,
}

impl Plate {
    fn distance(&self, x: DVec3) -> f64 {
        let way = x - self.middle;
        let along = way.dot(self.normal);
        let (off, beside) = (
            along.abs() - self.half,
            (way - along * self.normal).length() - self.half,
        );
        match beside > 0.0 {
            true => off.max(0.0).hypot(beside),
            false => off,
        }
    }
}

/// All solids of a scene.
struct Solids<'a> {
    meshes: &'a [&'a TriangleMesh],
    trees: &'a [Bvh],
    domain: &'a Bounds,
    spacing: f64,
    needed: Needed,
    /// The largest thickness that is needed, metres.
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
        // A wall that crosses a side of the domain is open where it leaves it.
        let crossed = normal.abs().cmpgt(DVec3::splat(-OPPOSITE));
        let (min, max) = (self.domain.min, self.domain.max);
        let is_within = |way: f64| {
            let q = p - way * normal;
            ((q.cmplt(min) | q.cmpgt(max)) & crossed).bitmask() == 0
        };
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
                // A wall of whole cells, rounded, is none.
                let is_thin = thickness < self.needed.along(normal) * (1.0 - 1e-6)
                    && is_within(way + apart)
                    && !self.is_solid(p + beside * normal);
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

/// Points on a surface within `domain`, with normals: one per area of `spacing` squared, and not
/// many more than `most`.
fn spread(mesh: &TriangleMesh, domain: &Bounds, spacing: f64, most: f64) -> Vec<(DVec3, DVec3)> {
    let each = (spacing * spacing).max(mesh.area() / most);
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
            let field = |half: f64| {
                SignedDistance::from_mesh(&plate(half, turn), &grid, 0.1).expect("closed")
            };
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
                let is_between = (0.2..1.8).contains(&at.x);
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
}
