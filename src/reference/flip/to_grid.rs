//! Reference passes that cut cells by solids, and transfer particle velocities to faces.

use glam::DVec3;

use super::{
    FlipSubstep, Model, Sorted,
    grid::{corner, neighborhood, per_cell},
    model::ON_FACE,
    solids::{OpenHat, Solid, cut, face_sums, rise},
};
use swell_domain::{
    bricks::Bricks,
    parallel,
    poisson::{AIR, SOLID},
};

/// Added to every hat function, so that a face that no particle in its two cells touches gets the
/// velocity of the particles nearby.
const LEAST_WEIGHT: f64 = 2.4e-7;

/// A face with a smaller open fraction is closed: such faces drive jets at edges and corners in
/// water at rest.
const LEAST_OPEN: f64 = 0.02;

/// Least weight of a closed face in the transfer to particles.
const LEAST_FACING: f64 = 1e-4;

/// A distance that grows by less than this over a cell, in cells, says nothing of a direction, as
/// in the middle of a plate: its faces count fully.
const LEAST_RISE: f64 = 0.1;

/// The space that walls and solids leave open for water.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenSpace {
    /// [`AIR`], [`FLUID`](swell_domain::poisson::FLUID) or [`SOLID`]. Shape (elements), as for
    /// every array here.
    pub kind: Vec<u32>,
    /// Open fractions of the lower faces, 0 to 1.
    pub open: Vec<DVec3>,
    /// Σ ± (1 − f) u_solid over the six faces, outward positive, m/s.
    pub solid_flux: Vec<f64>,
    /// Open fraction of the cell's volume, 0 to 1.
    pub volume: Vec<f64>,
    /// Integral of the hat function around the cell's centre over the volume outside solids,
    /// relative to that outside walls only, 0 to 1.
    pub hats: Vec<f64>,
    /// The same for each of the hat's four layers, half a cell thick, from the lowest up along the
    /// axis closest to gravity.
    pub layers: Vec<[f64; 4]>,
    /// Weights of the lower faces in [`super::grid_to_particle`], see `facing_weights`; all 1
    /// in cells without solids.
    pub weight: Vec<DVec3>,
    /// Velocities of the lower faces where they are closed, m/s.
    pub closed_velocity: Vec<DVec3>,
}

/// Velocities at the lower faces.
#[derive(Clone, Debug, PartialEq)]
pub struct Faces {
    /// Velocities including gravity, m/s. Shape (elements), as for every array here.
    pub velocity: Vec<DVec3>,
    /// Velocities transferred from the particles, m/s; from [`super::find_change`] on, the change
    /// of velocity.
    pub change: Vec<DVec3>,
    /// Eight bits per component: bit 7 is set if particles gave a velocity; the lower bits hold the
    /// layer, see [`super::extrapolate`].
    pub layer: Vec<u32>,
    /// Sum of the particles' weights; rounding errors of their positions are divided by it.
    pub weight: Vec<DVec3>,
}

/// Hat functions of a position, along each axis: for the next cell, its own cell and the previous
/// one. The middle entry of `face` belongs to the lower face of its own cell.
pub(super) struct Hats {
    face: [DVec3; 3],
    pub(super) center: [DVec3; 3],
    /// Position within its cell, 0 to 1.
    place: DVec3,
}

impl Hats {
    fn of(place: DVec3) -> Self {
        let least = DVec3::splat(LEAST_WEIGHT);
        Self {
            // Rounding may have moved a position out of its cell.
            face: [
                DVec3::ZERO,
                (1.0 - place).max(DVec3::ZERO) + least,
                place.max(DVec3::ZERO) + least,
            ],
            center: [
                (0.5 - place).max(DVec3::ZERO) + least,
                1.0 - (place - 0.5).abs() + least,
                (place - 0.5).max(DVec3::ZERO) + least,
            ],
            place,
        }
    }

    /// Returns the weights at the three lower faces of the cell that has this position's cell at
    /// `offset`.
    fn at_faces(&self, offset: [i32; 3]) -> DVec3 {
        let [x, y, z] = offset.map(|step| (1 - step) as usize);
        let (face, center) = (&self.face, &self.center);
        DVec3::new(
            face[x].x * center[y].y * center[z].z,
            center[x].x * face[y].y * center[z].z,
            center[x].x * center[y].y * face[z].z,
        )
    }

    /// Returns the hat functions at the centres of the previous, own and next cell along each axis,
    /// plus those of the position's mirror images at the walls `low` and `high` (from its cell's
    /// corner, in cells) if a centre lies inside the box.
    pub(super) fn mirrored(&self, low: DVec3, high: DVec3) -> [DVec3; 3] {
        let images = [-0.5, 0.5, 1.5].map(|center| {
            let hat = |x: DVec3| (1.0 - (x - center).abs()).max(DVec3::ZERO);
            let images = hat(2.0 * low - self.place) + hat(2.0 * high - self.place);
            let center = DVec3::splat(center);
            let is_open = center.cmpge(low) & center.cmple(high);
            DVec3::select(is_open, images, DVec3::ZERO)
        });
        std::array::from_fn(|k| self.center[k] + images[k])
    }
}

pub(super) fn hats(model: &Model, bricks: &Bricks, sorted: &Sorted) -> Vec<Hats> {
    parallel::map(0..sorted.cell.len(), |k| {
        let cells = sorted.cloud.position[k] / model.cell_size();
        Hats::of(cells - corner(bricks, sorted.cell[k]))
    })
}

/// Open areas of a cell's faces, first the lower, then the upper ones; over Δx².
pub(super) struct CutFaces<'a> {
    /// Areas within the walls that are perpendicular to the faces.
    across: DVec3,
    /// Open areas beside walls alone.
    pub(super) of_walls: [DVec3; 2],
    /// Open areas beside walls and solids.
    pub(super) open: [DVec3; 2],
    /// Solids that may cut the cell.
    pub(super) near: Vec<&'a Solid<'a>>,
    /// Distances at the cell's corners, if any may.
    corners: Option<[f64; 8]>,
    /// Velocity of the solid nearest to each face, along that face's axis, m/s.
    velocity: [DVec3; 2],
    /// Index of that solid.
    pub(super) solid: [[usize; 3]; 2],
}

/// Cuts the faces of a cell, given by its minimum corner in cells.
pub(super) fn cut_faces<'a>(model: &Model, step: &'a FlipSubstep<'_>, cell: DVec3) -> CutFaces<'a> {
    let extent = step.open_extent(cell);
    let across = DVec3::new(
        extent.y * extent.z,
        extent.z * extent.x,
        extent.x * extent.y,
    );
    let of_walls = [cell, cell + 1.0]
        .map(|plane| DVec3::select(step.is_plane_open(plane), across, DVec3::ZERO));
    let mut found = CutFaces {
        across,
        of_walls,
        open: of_walls,
        near: Vec::new(),
        corners: None,
        velocity: [DVec3::ZERO; 2],
        solid: [[0; 3]; 2],
    };
    for (index, solid) in step.solids.iter().enumerate() {
        let Some(corners) = solid.corners(cell, model.cell_size()) else {
            continue;
        };
        found.near.push(solid);
        // A velocity component of a rigid body does not change along its own axis: the value at the
        // centre is that at both faces.
        let pushing = solid.velocity_at((cell + 0.5) * model.cell_size());
        for side in 0..2 {
            let nearest = found.corners.as_ref();
            let sums = nearest.map_or(DVec3::MAX, |nearest| face_sums(nearest, side));
            let is_nearer = face_sums(&corners, side).cmplt(sums);
            found.velocity[side] = DVec3::select(is_nearer, pushing, found.velocity[side]);
            for axis in (0..3).filter(|&axis| is_nearer.test(axis)) {
                found.solid[side][axis] = index;
            }
        }
        found.corners = Some(match found.corners {
            Some(nearest) => std::array::from_fn(|k| nearest[k].min(corners[k])),
            None => corners,
        });
    }
    if let Some(corners) = &found.corners {
        let faces = cut(corners).faces;
        let least = LEAST_OPEN * across;
        for (open, part) in found.open.iter_mut().zip(faces) {
            *open *= part;
            *open = DVec3::select(open.cmplt(least), DVec3::ZERO, *open);
        }
    }
    if !step.solids.is_empty() {
        let on_face = DVec3::splat(ON_FACE);
        for open in &mut found.open {
            *open = DVec3::select(open.cmplt(on_face), DVec3::ZERO, *open);
        }
    }
    found
}

/// Returns the growth of the distance to solids about each lower face of a cell, towards the face's
/// open side and along the face, metres over a cell.
fn growth_at_faces(
    model: &Model,
    step: &FlipSubstep<'_>,
    cell: DVec3,
    corners: &[f64; 8],
) -> [(f64, f64); 3] {
    let size = model.cell_size();
    let near = step.solids.iter().filter(|solid| solid.may_cut(cell, size));
    let near: Vec<&Solid<'_>> = near.collect();
    let nearest = |x: DVec3| {
        let distances = near.iter().map(|solid| solid.at_corner(x, size));
        distances.fold(f64::INFINITY, f64::min)
    };
    [0, 1, 2].map(|axis| {
        let [b, c] = [1, 2].map(|k| DVec3::AXES[(axis + k) % 3]);
        let least = cell - DVec3::AXES[axis];
        let points = [least, least + b, least + c, least + b + c];
        let sum: f64 = points.iter().map(|x| nearest(*x)).sum();
        let before = 0.25 * (face_sums(corners, 0)[axis] - sum);
        let across = rise(corners)[axis].max(-before).max(0.0);
        let slope = |other: usize| {
            let of = |k: usize| match k >> axis & 1 {
                0 => (2.0 * (k >> other & 1) as f64 - 1.0) * corners[k],
                _ => 0.0,
            };
            0.5 * (0..8).map(of).sum::<f64>()
        };
        (across, slope((axis + 1) % 3).hypot(slope((axis + 2) % 3)))
    })
}

/// Distances of the nearest solid at a cell's corners, metres, if one may cut it.
fn nearest_corners(model: &Model, step: &FlipSubstep<'_>, cell: DVec3) -> Option<[f64; 8]> {
    let all = (step.solids.iter()).filter_map(|solid| solid.corners(cell, model.cell_size()));
    all.reduce(|a, b| std::array::from_fn(|k| a[k].min(b[k])))
}

/// Returns the weights that a cell's lower faces have in the transfer to particles where a solid
/// closes them. A face that faces the solid counts fully, with the solid's velocity, which stops
/// the water. One that the water slides along does not count: it would drag the water. At 45° and
/// more between the two normals the weight is the least one, which gives particles between closed
/// faces alone the solid's velocity.
fn facing_weights(growth: [(f64, f64); 3], least: f64) -> DVec3 {
    let weight = |(across, along): (f64, f64)| {
        let square = across * across + least * least;
        let part = (2.0 * square / (square + along * along) - 1.0).max(0.0);
        (part * part).max(LEAST_FACING)
    };
    DVec3::from_array(growth.map(weight))
}

/// Returns the least growth of the distance to solids about the lower faces of a cell by which
/// [`OpenSpace::weight`] is found, metres; `None` if no solid may cut the cell.
pub fn growth_over(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    element: u32,
) -> Option<f64> {
    let cell = corner(bricks, element);
    let corners = nearest_corners(model, step, cell)?;
    let growth = growth_at_faces(model, step, cell, &corners);
    let least = LEAST_RISE * model.cell_size();
    let all = growth.map(|(across, along)| across.hypot(along).hypot(least));
    all.into_iter().reduce(f64::min)
}

/// Computes the open fractions of each cell and of its lower faces, and the flux of solids through
/// the closed parts (Batty et al. 2007). [`super::find_water`] later decides which open cells are
/// water.
pub fn cut_cells(model: &Model, step: &FlipSubstep<'_>, bricks: &Bricks) -> OpenSpace {
    #[derive(Clone, Default)]
    struct CutCell {
        kind: u32,
        open: DVec3,
        flux: f64,
        volume: f64,
        hat: OpenHat,
        weight: DVec3,
        closed_velocity: DVec3,
    }
    let of_cell = |element: u32| {
        let cell = corner(bricks, element);
        let CutFaces {
            across,
            of_walls,
            open,
            near,
            corners,
            velocity,
            ..
        } = cut_faces(model, step, cell);
        let planes = [cell, cell + 1.0];
        let mut volume = step.open_extent(cell).element_product();
        let mut hat = OpenHat::WHOLE;
        let mut closed = DVec3::ONE;
        if let Some(corners) = corners {
            volume *= cut(&corners).volume;
            hat = OpenHat::of(model, step, &near, cell, &corners);
            let by_solid = of_walls[0].cmpgt(DVec3::ZERO);
            let growth = growth_at_faces(model, step, cell, &corners);
            let weights = facing_weights(growth, LEAST_RISE * model.cell_size());
            closed = DVec3::select(by_solid, weights, closed);
        }
        let weight = match step.solids.is_empty() {
            true => DVec3::ONE,
            false => DVec3::select(open[0].cmpeq(DVec3::ZERO), closed, open[0]),
        };
        let [low, high] = [0, 1].map(|side| {
            (across - of_walls[side]) * step.closing_velocity(planes[side])
                + (of_walls[side] - open[side]) * velocity[side]
        });
        let is_open = volume >= ON_FACE * ON_FACE || (open[0] + open[1]).cmpgt(DVec3::ZERO).any();
        CutCell {
            kind: if is_open { AIR } else { SOLID },
            open: open[0],
            flux: (high - low).element_sum(),
            volume,
            hat,
            weight,
            closed_velocity: DVec3::select(
                step.is_plane_open(cell),
                velocity[0],
                step.closing_velocity(cell),
            ),
        }
    };
    let cells = per_cell(bricks, of_cell);
    OpenSpace {
        kind: cells.iter().map(|cell| cell.kind).collect(),
        open: cells.iter().map(|cell| cell.open).collect(),
        solid_flux: cells.iter().map(|cell| cell.flux).collect(),
        volume: cells.iter().map(|cell| cell.volume).collect(),
        hats: cells.iter().map(|cell| cell.hat.part).collect(),
        layers: cells.iter().map(|cell| cell.hat.layers).collect(),
        weight: cells.iter().map(|cell| cell.weight).collect(),
        closed_velocity: cells.iter().map(|cell| cell.closed_velocity).collect(),
    }
}

/// Particle-to-grid transfer (Zhu and Bridson 2005; APIC: Jiang et al. 2015): `flip/spread_faces`
/// and `flip/gather_faces` together.
pub fn gather_faces(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    sorted: &Sorted,
    space: &OpenSpace,
) -> Faces {
    let hats = hats(model, bricks, sorted);
    let sums = per_cell(bricks, |element| {
        let (mut momentum, mut weight) = (DVec3::ZERO, DVec3::ZERO);
        for offset in neighborhood() {
            for i in sorted.of(bricks.near(element, offset)) {
                let part = hats[i].at_faces(offset);
                weight += part;
                momentum += part * velocity_at_faces(model, sorted, &hats[i], offset, i);
            }
        }
        (momentum, weight)
    });
    let mean = |&(momentum, weight): &(DVec3, DVec3)| {
        let is_known = weight.cmpgt(DVec3::ZERO);
        DVec3::select(is_known, momentum / weight, DVec3::ZERO)
    };
    let change: Vec<DVec3> = sums.iter().map(mean).collect();
    let velocity = per_cell(bricks, |element| {
        let e = element as usize;
        let is_closed = space.open[e].cmpeq(DVec3::ZERO);
        let moved = change[e] + step.velocity_step;
        DVec3::select(is_closed, space.closed_velocity[e], moved)
    });
    let is_known = |weight: DVec3| weight.cmpgt(DVec3::ZERO).bitmask();
    let layer = |&(_, weight): &(DVec3, DVec3)| {
        let known = is_known(weight);
        (0..3)
            .map(|axis| (known >> axis & 1) << (8 * axis + 7))
            .sum()
    };
    Faces {
        velocity,
        layer: sums.iter().map(layer).collect(),
        weight: sums.iter().map(|sums| sums.1).collect(),
        change,
    }
}

/// Returns particle `i`'s velocity at the lower faces of the cell that has the particle's cell at
/// `offset`, each along its own axis.
fn velocity_at_faces(
    model: &Model,
    sorted: &Sorted,
    hats: &Hats,
    offset: [i32; 3],
    i: usize,
) -> DVec3 {
    let v = sorted.cloud.velocity[i];
    let Some(affine) = sorted.cloud.affine.get(i) else {
        return v;
    };
    let center = DVec3::from_array(offset.map(|step| 0.5 - f64::from(step)));
    let slope = |axis: usize| {
        let face = center - 0.5 * DVec3::AXES[axis];
        model.cell_size() * affine.row(axis).dot(face - hats.place)
    };
    v + DVec3::new(slope(0), slope(1), slope(2))
}
