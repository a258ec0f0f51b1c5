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
    let all = Solids::new(solids, &trees, (domain, spacing), needed);
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
/// sides, as in [`thin_parts`]. A plate as thick as needed lies around each middle, with a radius
/// of half its thickness, so that walls meet at edges as thick ones do, and a rim grows by as much
/// as a side. The distance becomes the least of the solids' and the plates'.
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
    let all = Solids::new(solids, &trees, (domain, spacing), needed);
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
        let is_near = |value: &f32| f64::from(value.abs()) < reach;
        for (i, value) in values.iter_mut().enumerate().filter(|(_, it)| is_near(it)) {
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
    most: f64,
}

impl<'a> Solids<'a> {
    fn new(
        meshes: &'a [&'a TriangleMesh],
        trees: &'a [Bvh],
        (domain, spacing): (&'a Bounds, f64),
        needed: Needed,
    ) -> Self {
        Self {
            meshes,
            trees,
            domain,
            spacing,
            needed,
            most: needed.most(),
        }
    }

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
        let skipped = 1e-6 * self.most;
        let (mut way, mut thickness) = (0.0, None);
        loop {
            let from = p - (way + skipped) * normal;
            let (further, other) = self.next(from, -normal, self.most)?;
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
            if way > 4.0 * self.most {
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
            let is_thin = |layer: f64| layer < 2.0 * self.needed.along(normal);
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
mod tests;
