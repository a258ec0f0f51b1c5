//! Twins of the passes that bring solids to the grid, and particles' velocities to its faces.

use glam::DVec3;
use rayon::prelude::*;

use super::{
    Model, Sorted, Step,
    grid::{corner, neighborhood, per_cell},
    model::ON_FACE,
    solids::{cut, face_sums, open_part_of_hat},
};
use swell_domain::{
    bricks::Bricks,
    poisson::{AIR, SOLID},
};

/// What each hat has beyond itself, so that a face that no particle of its two cells touches takes the velocity of
/// the particles nearby.
const LEAST_WEIGHT: f64 = 2.4e-7;

/// A face with a smaller open fraction is closed: such faces drive jets at edges and corners in water at rest.
const LEAST_OPEN: f64 = 0.02;

/// The room that there is for water.
#[derive(Clone, Debug, PartialEq)]
pub struct Room {
    /// [`AIR`], [`FLUID`](swell_domain::poisson::FLUID) or [`SOLID`]. Shape (elements), as of every array here.
    pub kind: Vec<u32>,
    /// Open fractions of the lower faces, 0..1.
    pub open: Vec<DVec3>,
    /// Σ ± (1 − f) u_solid over the six faces, outward, m/s.
    pub solid_flux: Vec<f64>,
    /// Open part of the cell, 0..1.
    pub volume: Vec<f64>,
    /// Part of the hat about the cell's centre that solids leave of what walls do, 0..1.
    pub hats: Vec<f64>,
    /// What the lower faces have where they are closed, m/s.
    pub closed_velocity: Vec<DVec3>,
}

/// Velocities at the lower faces.
#[derive(Clone, Debug, PartialEq)]
pub struct Faces {
    /// With gravity, m/s. Shape (elements), as of every array here.
    pub velocity: Vec<DVec3>,
    /// The particles' own, m/s; its change from [`super::find_change`] on.
    pub change: Vec<DVec3>,
    /// Eight bits a component: bit 7 whether particles gave a velocity, below it the layer, of
    /// [`super::extrapolate`].
    pub layer: Vec<u32>,
    /// What the particles' hats add up to: it divides the rounding of their places.
    pub weight: Vec<DVec3>,
}

/// Hats of a place at the cells after, at and before its own along each axis: of the cell that sees it one step
/// down, in itself, one step up. The middle entry of `face` is that of its cell's lower face.
pub(super) struct Hats {
    face: [DVec3; 3],
    pub(super) center: [DVec3; 3],
    /// Place in its cell.
    place: DVec3,
}

impl Hats {
    fn of(place: DVec3) -> Self {
        let least = DVec3::splat(LEAST_WEIGHT);
        Self {
            // Rounding may have taken a place out of its cell.
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

    /// Weights at the three lower faces of the cell from which this place's cell lies `offset` away.
    fn at_faces(&self, offset: [i32; 3]) -> DVec3 {
        let [x, y, z] = offset.map(|step| (1 - step) as usize);
        let (face, center) = (&self.face, &self.center);
        DVec3::new(
            face[x].x * center[y].y * center[z].z,
            center[x].x * face[y].y * center[z].z,
            center[x].x * center[y].y * face[z].z,
        )
    }

    /// Hats at the centres of the cells before, of its own and after along each axis, with the place's images in the walls at
    /// `low` and `high` (from its cell's corner, in cells) where a centre lies in the open.
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
    (sorted.cloud.position.par_iter().zip(&sorted.cell))
        .map(|(&x, &element)| Hats::of(x / model.cell_size() - corner(bricks, element)))
        .collect()
}

/// What of each cell and of its lower faces is open, and what solids push through the rest (Batty et al. 2007).
/// Which cells with room are water is found later, by [`super::find_water`].
pub fn cut_cells(model: &Model, step: &Step<'_>, bricks: &Bricks) -> Room {
    #[derive(Clone, Default)]
    struct Cell {
        kind: u32,
        open: DVec3,
        flux: f64,
        volume: f64,
        hats: f64,
        closed_velocity: DVec3,
    }
    let is_mirrored = model.settings().density_correction;
    let of_cell = |element: u32| {
        let cell = corner(bricks, element);
        let extent = step.open_extent(cell);
        let across = DVec3::new(
            extent.y * extent.z,
            extent.z * extent.x,
            extent.x * extent.y,
        );
        let planes = [cell, cell + 1.0];
        let of_walls =
            planes.map(|plane| DVec3::select(step.is_plane_open(plane), across, DVec3::ZERO));
        let (mut open, mut volume) = (of_walls, extent.element_product());
        let (mut nearest, mut hats): (Option<[f64; 8]>, f64) = (None, 1.0);
        let mut near = Vec::new();
        // Of what is nearest to each face, along that face's axis.
        let mut velocity = [DVec3::ZERO; 2];
        for solid in &step.solids {
            let Some(found) = solid.corners(cell, model.cell_size()) else {
                continue;
            };
            near.push(solid);
            velocity = [0, 1].map(|side| {
                let sums = nearest.map_or(DVec3::MAX, |nearest| face_sums(&nearest, side));
                let is_nearer = face_sums(&found, side).cmplt(sums);
                // A component does not change along its own axis: that at the middle is that at both faces.
                let pushing = solid.velocity_at((cell + 0.5) * model.cell_size());
                DVec3::select(is_nearer, pushing, velocity[side])
            });
            nearest = Some(nearest.map_or(found, |nearest| {
                std::array::from_fn(|k| nearest[k].min(found[k]))
            }));
        }
        if let Some(corners) = nearest {
            let cut = cut(&corners);
            open = [open[0] * cut.faces[0], open[1] * cut.faces[1]];
            volume *= cut.volume;
            let least = LEAST_OPEN * across;
            open = open.map(|open| DVec3::select(open.cmplt(least), DVec3::ZERO, open));
            hats = open_part_of_hat(
                &near,
                &step.cut,
                is_mirrored,
                cell,
                model.cell_size(),
                &corners,
            );
        }
        if !step.solids.is_empty() {
            let on_face = DVec3::splat(ON_FACE);
            open = open.map(|open| DVec3::select(open.cmplt(on_face), DVec3::ZERO, open));
        }
        let [low, high] = [0, 1].map(|side| {
            (across - of_walls[side]) * step.closing_velocity(planes[side])
                + (of_walls[side] - open[side]) * velocity[side]
        });
        let is_open = volume >= ON_FACE * ON_FACE || (open[0] + open[1]).cmpgt(DVec3::ZERO).any();
        Cell {
            kind: if is_open { AIR } else { SOLID },
            open: open[0],
            flux: (high - low).element_sum(),
            volume,
            hats,
            closed_velocity: DVec3::select(
                step.is_plane_open(cell),
                velocity[0],
                step.closing_velocity(cell),
            ),
        }
    };
    let cells = per_cell(bricks, of_cell);
    Room {
        kind: cells.iter().map(|cell| cell.kind).collect(),
        open: cells.iter().map(|cell| cell.open).collect(),
        solid_flux: cells.iter().map(|cell| cell.flux).collect(),
        volume: cells.iter().map(|cell| cell.volume).collect(),
        hats: cells.iter().map(|cell| cell.hats).collect(),
        closed_velocity: cells.iter().map(|cell| cell.closed_velocity).collect(),
    }
}

/// Particle-to-grid (Zhu and Bridson 2005; APIC: Jiang et al. 2015): what `flip/spread_faces` and
/// `flip/gather_faces` do between them.
pub fn gather_faces(
    model: &Model,
    step: &Step<'_>,
    bricks: &Bricks,
    sorted: &Sorted,
    room: &Room,
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
        let is_closed = room.open[e].cmpeq(DVec3::ZERO);
        let moved = change[e] + step.velocity_step;
        DVec3::select(is_closed, room.closed_velocity[e], moved)
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

/// Particle `i`'s velocity at the lower faces of the cell from which its own lies `offset` away, each along its axis.
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
