//! Twins of the passes that find the water: densities at cell centres, and what follows from them.

use glam::DVec3;
use rayon::prelude::*;

use super::{
    Model, Room, Sorted, Step,
    grid::{along, corner, neighborhood, per_cell},
    to_grid::hats,
};
use swell_domain::{
    bricks::{Bricks, CELLS},
    flip::{HALF, part_of_solids},
    poisson::{AIR, FLUID, SOLID},
};
use swell_scene::sources::Inlet;

/// Of a cell's excess a substep corrects at most this much either way.
const MOST_EXCESS: f64 = 0.5;

/// Part of the hats below which a cell counts as having room for that part.
const LEAST_ROOM: f64 = 0.02;

/// Part of its room that a film fills at least.
pub const LEAST_FILM: f64 = 0.1;

/// Least distance of the surface from the centre of a cell of water, in cells: every way to the air from there knows of the
/// same one, as the pressure there does.
const LEAST_DEPTH: f64 = 0.02;

/// What cell centres know of the water about them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Centers {
    /// Over that of a full cell, in cells of every kind. Shape (elements), as of every array here.
    pub density: Vec<f64>,
    /// What the density correction carries out of the cell.
    pub excess: Vec<f64>,
    /// Of the surface, metres; negative inside.
    pub distance: Vec<f64>,
}

/// Integral of the hat from minus infinity to `t`.
fn hat_below(t: f64) -> f64 {
    let s = 1.0 - t.abs().min(1.0);
    if t < 0.0 {
        0.5 * s * s
    } else {
        1.0 - 0.5 * s * s
    }
}

/// Part of the hats about a cell's centre that walls leave, where nothing is mirrored in them: behind them, or at all.
fn room_of_hats(is_mirrored: bool, step: &Step<'_>, bricks: &Bricks, element: u32) -> f64 {
    let cell = corner(bricks, element);
    let along_axis = |axis: usize| {
        let center = cell[axis] + 0.5;
        let (low, high) = (step.cut.min[axis], step.cut.max[axis]);
        match is_mirrored && (low..=high).contains(&center) {
            // Hats see all of the water.
            true => 1.0,
            false => hat_below(high - center) - hat_below(low - center),
        }
    };
    along_axis(0) * along_axis(1) * along_axis(2)
}

/// Weight at the centre of the cell from which the place's own lies `offset` away.
fn at_center(weights: &[DVec3; 3], offset: [i32; 3]) -> f64 {
    let [x, y, z] = offset.map(|step| (1 - step) as usize);
    weights[x].x * weights[y].y * weights[z].z
}

/// Densities at cell centres: what `flip/spread_centers` and `flip/gather_centers` do between them. Where a density correction
/// goes by them, particles count with their mirror images in walls. Shape (elements).
pub fn gather_centers(
    model: &Model,
    step: &Step<'_>,
    bricks: &Bricks,
    sorted: &Sorted,
    room: &Room,
) -> Vec<f64> {
    let hats = hats(model, bricks, sorted);
    let is_mirrored = model.settings().density_correction;
    let weights: Vec<[DVec3; 3]> = (hats.par_iter().zip(&sorted.cell))
        .map(|(hats, &element)| {
            let cell = corner(bricks, element);
            match is_mirrored {
                true => hats.mirrored(step.cut.min - cell, step.cut.max - cell),
                false => hats.center,
            }
        })
        .collect();
    let particle_share = 1.0 / f64::from(model.settings().particles_per_cell);
    per_cell(bricks, |element| {
        let given = neighborhood().map(|offset| {
            (sorted.of(bricks.near(element, offset)))
                .map(|i| at_center(&weights[i], offset))
                .sum::<f64>()
        });
        let sum: f64 = given.sum();
        // What has room for less than a particle counts as having it for one.
        let of_solids = match step.solids.is_empty() {
            true => 1.0,
            false => room.hats[element as usize].max(particle_share),
        };
        let of_walls = room_of_hats(is_mirrored, step, bricks, element).max(LEAST_ROOM);
        sum * particle_share / (of_walls * of_solids)
    })
}

/// What walls leave of a cell along each axis, and what solids leave of that.
pub(super) fn open_parts(step: &Step<'_>, bricks: &Bricks, room: &Room, element: u32) -> [f64; 4] {
    let extent = step.open_extent(corner(bricks, element));
    let part = match step.solids.is_empty() {
        true => 1.0,
        false => part_of_solids(extent, room.volume[element as usize]),
    };
    [extent.x, extent.y, extent.z, part]
}

/// Whether a cell's centre lies within a wall or a solid.
fn is_buried(step: &Step<'_>, bricks: &Bricks, room: &Room, element: u32) -> bool {
    let parts = open_parts(step, bricks, room, element);
    parts.into_iter().any(|part| part < HALF)
}

/// Whether a cell, if it is water, lacks most of it: as in gaps that close (flip/close_gaps).
pub fn is_filling(
    step: &Step<'_>,
    bricks: &Bricks,
    room: &Room,
    density: &[f64],
    element: u32,
) -> bool {
    density[element as usize] < 0.5 && !is_buried(step, bricks, room, element)
}

/// Which cells have their centre within a wall or a solid. Shape (elements).
pub fn find_buried(step: &Step<'_>, bricks: &Bricks, room: &Room) -> Vec<bool> {
    per_cell(bricks, |element| is_buried(step, bricks, room, element))
}

/// What entered where water was already makes room for itself: the projection lets as much flow out of such cells as they hold too
/// much, and the density correction leaves it alone.
pub fn let_in(
    inlets: &[Inlet],
    cell_size: f64,
    bricks: &Bricks,
    room: &mut Room,
    density: &[f64],
    excess: &mut [f64],
) {
    for element in CELLS..room.kind.len() as u32 {
        let (e, cell) = (element as usize, bricks.cell(element));
        let within = inlets.iter().filter(|inlet| inlet.contains(cell));
        let rate = within.map(|inlet| inlet.rate).fold(0.0, f64::max);
        if room.kind[e] != FLUID || rate == 0.0 {
            continue;
        }
        let over = (density[e] - 1.0).clamp(0.0, MOST_OVER);
        room.solid_flux[e] -= over * room.volume[e] * cell_size * rate;
        if let Some(excess) = excess.get_mut(e) {
            *excess = excess.min(0.0);
        }
    }
}

/// Of a cell's room that what entered may fill beyond it.
const MOST_OVER: f64 = 1.0;

/// Whether rounding of `error` may decide where the centre of a cell, or of one of those about it, lies.
pub fn is_near_half(
    step: &Step<'_>,
    bricks: &Bricks,
    room: &Room,
    element: u32,
    error: f64,
) -> bool {
    neighborhood().any(|offset| {
        let parts = open_parts(step, bricks, room, bricks.near(element, offset));
        parts.into_iter().any(|part| (part - HALF).abs() < error)
    })
}

/// Density before the walls and solids that a cell's centre lies in: in the cell inward of the walls, and where that is
/// buried too, the mean over the faces that lead out of it, by how far they are open.
fn density_before(
    step: &Step<'_>,
    bricks: &Bricks,
    room: &Room,
    density: &[f64],
    element: u32,
) -> f64 {
    let cell = corner(bricks, element);
    let (extent, is_plane_open) = (step.open_extent(cell), step.is_plane_open(cell));
    let inward = [0, 1, 2].map(
        |axis| match (extent[axis] < HALF, is_plane_open.test(axis)) {
            (false, _) => 0,
            (true, false) => 1,
            (true, true) => -1,
        },
    );
    let is_open = |other: u32| other >= CELLS && !is_buried(step, bricks, room, other);
    let there = bricks.near(element, inward);
    if inward != [0; 3] && is_open(there) {
        return density[there as usize];
    }
    let (mut sum, mut weights) = (0.0, 0.0);
    for (axis, side) in (0..3).flat_map(|axis| [(axis, -1), (axis, 1)]) {
        let other = bricks.near(element, along(axis, side));
        if is_open(other) {
            let face = if side < 0 { element } else { other };
            let weight = room.open[face as usize][axis];
            sum += weight * density[other as usize];
            weights += weight;
        }
    }
    if weights > 0.0 {
        sum / weights
    } else {
        density[element as usize]
    }
}

/// What a cell's centre says of the water about it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Depth {
    /// What of the room there is water.
    pub share: f64,
    /// Whether it is a film on a floor that passes above the centre.
    pub is_film: bool,
    /// How deep it is below the surface, up to a cell either way.
    pub cells: f64,
    /// By how much rounding of the rooms beside it moves what lies below the surface, over that rounding; infinite where they are all
    /// alike.
    pub lean: f64,
}

/// Water at a centre over the room there. Where the centre is in a solid, the little room that is left may hold no particle for
/// a while, or one too many, so that the cells beyond the open faces count as well.
fn share_of_room(
    bricks: &Bricks,
    room: &Room,
    density: &[f64],
    particle_share: f64,
    element: u32,
) -> f64 {
    let water = |e: u32| density[e as usize] * room.hats[e as usize].max(particle_share);
    let own = room.hats[element as usize];
    let (mut sum, mut rooms) = (water(element), own.max(LEAST_ROOM));
    let alone = sum / rooms;
    if own < 0.5 {
        for (axis, side) in (0..3).flat_map(|axis| [(axis, -1), (axis, 1)]) {
            let other = bricks.near(element, along(axis, side));
            if other >= CELLS {
                let face = if side < 0 { element } else { other };
                let open = room.open[face as usize][axis];
                sum += open * water(other);
                rooms += open * room.hats[other as usize];
            }
        }
    }
    alone.max(sum / rooms)
}

/// Part of the hat at a centre that lies below a level surface, solids included, and the lean (see [`Depth`]); `of_room` is that
/// part of the open hat. A solid counts as below the surface where it is a floor, as above it where it is a ceiling, and as the
/// open hat does where it is a wall.
fn below_surface(
    step: &Step<'_>,
    bricks: &Bricks,
    room: &Room,
    element: u32,
    of_room: f64,
) -> (f64, f64) {
    let own = room.hats[element as usize];
    if own <= LEAST_ROOM {
        return (of_room, 0.0);
    }
    let to_open = DVec3::from_array([0, 1, 2].map(|axis| {
        let [before, after] = [-1, 1].map(|side| {
            let other = bricks.near(element, along(axis, side));
            if other >= CELLS {
                room.hats[other as usize]
            } else {
                own
            }
        });
        after - before
    }));
    let up = -step.velocity_step;
    let lengths = to_open.length() * up.length();
    let upright = to_open.dot(up) / lengths.max(1e-20);
    let side = if upright > 0.0 { 1.0 } else { 0.0 };
    let of_solid = of_room + (side - of_room) * upright.abs();
    let lean = (1.0 - own) / to_open.length();
    (of_solid + (of_room - of_solid) * own, lean)
}

/// What the densities say of the water about each cell's centre. Shape (elements).
pub fn find_depth(
    model: &Model,
    step: &Step<'_>,
    bricks: &Bricks,
    room: &Room,
    density: &[f64],
) -> Vec<Depth> {
    let particle_share = 1.0 / f64::from(model.settings().particles_per_cell);
    per_cell(bricks, |element| {
        let extent = step.open_extent(corner(bricks, element));
        let is_cut = room.hats[element as usize] < 1.0;
        let share = if extent.cmplt(DVec3::splat(HALF)).any() {
            density_before(step, bricks, room, density, element)
        } else if is_cut {
            share_of_room(bricks, room, density, particle_share, element)
        } else {
            density[element as usize]
        };
        let of_room = share.clamp(0.0, 1.0);
        let (below, lean) = match is_cut {
            true => below_surface(step, bricks, room, element, of_room),
            false => (of_room, 0.0),
        };
        // Across a flat surface the density is 1/2 at it, and falls as s − s²/2 with the distance s in cells.
        let off = below - 0.5;
        let way = 1.0 - (1.0 - 2.0 * off.abs()).max(0.0).sqrt();
        Depth {
            share,
            is_film: is_cut && share > LEAST_FILM && off >= 0.0,
            cells: if off == 0.0 { 0.0 } else { way * off.signum() },
            lean,
        }
    })
}

/// Which cells are water, those whose centre is not above the surface, and how far the surface is: kinds and metres. Shapes
/// (elements). Whether a cell has particles does not count.
pub fn find_water(
    model: &Model,
    bricks: &Bricks,
    room: &Room,
    depth: &[Depth],
) -> (Vec<u32>, Vec<f64>) {
    let cells = per_cell(bricks, |element| {
        let Depth {
            share,
            is_film,
            cells,
            ..
        } = depth[element as usize];
        let is_water = (share >= 0.5 || is_film) && element < CELLS * (bricks.wet + 1);
        let kind = match room.kind[element as usize] {
            SOLID => SOLID,
            _ if is_water => FLUID,
            _ => AIR,
        };
        let kept = if is_water {
            cells.max(LEAST_DEPTH)
        } else {
            cells
        };
        (kind, -kept * model.cell_size())
    });
    cells.into_par_iter().unzip()
}

/// What of the density is too much, or too little within the water, in parts of a cell (Kugelstadt et al. 2019): what the
/// density correction takes away. Shape (elements).
pub fn find_excess(step: &Step<'_>, bricks: &Bricks, room: &Room, density: &[f64]) -> Vec<f64> {
    per_cell(bricks, |element| {
        let e = element as usize;
        if room.kind[e] != FLUID {
            return 0.0;
        }
        // Beyond the domain there is no cell and no air. Water that fills a gap is air still.
        let is_air = |other: u32| {
            let kind = room.kind[other as usize];
            let is_filling = || is_filling(step, bricks, room, density, other);
            other >= CELLS && (kind == AIR || is_filling())
        };
        let touches_air = neighborhood().any(|offset| is_air(bricks.near(element, offset)));
        let least = if touches_air { 0.0 } else { -MOST_EXCESS };
        (density[e] - 1.0).clamp(least, MOST_EXCESS) * room.volume[e]
    })
}
