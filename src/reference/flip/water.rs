//! Reference passes that find the water: densities at cell centres, and what follows from them.

use glam::DVec3;

use super::{
    FlipSubstep, Model, OpenSpace, Sorted,
    grid::{along, corner, neighborhood, per_cell},
    to_grid::hats,
};
use swell_domain::{
    bricks::{Bricks, CELLS},
    flip::{HALF, part_of_solids},
    parallel,
    poisson::{AIR, FLUID, SOLID},
};
use swell_scene::sources::Inlet;

/// Bound on the excess of a cell that a substep corrects, in both directions.
const MOST_EXCESS: f64 = 0.5;

/// Lower bound for a cell's open fraction of the hat function.
const LEAST_ROOM: f64 = 0.02;

/// Least fraction of its open volume that a film fills.
pub const LEAST_FILM: f64 = 0.1;

/// Least distance of the surface from the centre of a cell of water, in cells; all directions
/// towards air use the same distance.
const LEAST_DEPTH: f64 = 0.02;

/// State of the water at cell centres.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Centers {
    /// Density relative to a full cell, in cells of every kind. Shape (elements), as for every
    /// array here.
    pub density: Vec<f64>,
    /// Excess that the density correction carries out of the cell, as a fraction of a cell.
    pub excess: Vec<f64>,
    /// Signed distance to the surface, metres; negative in water.
    pub distance: Vec<f64>,
}

/// Returns the integral of the hat function from minus infinity to `t`.
fn hat_below(t: f64) -> f64 {
    let s = 1.0 - t.abs().min(1.0);
    if t < 0.0 {
        0.5 * s * s
    } else {
        1.0 - 0.5 * s * s
    }
}

/// Returns the part of the hat function around a cell's centre that walls leave open; 1 along an
/// axis where particles are mirrored.
fn room_of_hats(is_mirrored: bool, step: &FlipSubstep<'_>, bricks: &Bricks, element: u32) -> f64 {
    let cell = corner(bricks, element);
    let along_axis = |axis: usize| {
        let center = cell[axis] + 0.5;
        let (low, high) = (step.cut.min[axis], step.cut.max[axis]);
        match is_mirrored && (low..=high).contains(&center) {
            // With mirror images, the hat function sees all of the water.
            true => 1.0,
            false => hat_below(high - center) - hat_below(low - center),
        }
    };
    along_axis(0) * along_axis(1) * along_axis(2)
}

/// Returns the weight at the centre of the cell that has the position's own cell at `offset`.
fn at_center(weights: &[DVec3; 3], offset: [i32; 3]) -> f64 {
    let [x, y, z] = offset.map(|step| (1 - step) as usize);
    weights[x].x * weights[y].y * weights[z].z
}

/// Computes densities at cell centres: `flip/spread_centers` and `flip/gather_centers` together.
/// With a density correction, particles count with their mirror images at walls. Shape (elements).
pub fn gather_centers(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    sorted: &Sorted,
    space: &OpenSpace,
) -> Vec<f64> {
    let hats = hats(model, bricks, sorted);
    let is_mirrored = model.settings().density_correction;
    let weights: Vec<[DVec3; 3]> = parallel::map(0..hats.len(), |k| {
        let (hats, cell) = (&hats[k], corner(bricks, sorted.cell[k]));
        match is_mirrored {
            true => hats.mirrored(step.cut.min - cell, step.cut.max - cell),
            false => hats.center,
        }
    });
    let particle_share = 1.0 / f64::from(model.settings().particles_per_cell);
    per_cell(bricks, |element| {
        let given = neighborhood().map(|offset| {
            (sorted.of(bricks.near(element, offset)))
                .map(|i| at_center(&weights[i], offset))
                .sum::<f64>()
        });
        let sum: f64 = given.sum();
        // A smaller open volume counts as that of one particle.
        let of_solids = match step.solids.is_empty() {
            true => 1.0,
            false => space.hats[element as usize].max(particle_share),
        };
        let of_walls = room_of_hats(is_mirrored, step, bricks, element).max(LEAST_ROOM);
        sum * particle_share / (of_walls * of_solids)
    })
}

/// Returns the open part of a cell's extent along each axis, given walls, and the fraction of it
/// that solids leave open.
pub(super) fn open_parts(
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
    element: u32,
) -> [f64; 4] {
    let extent = step.open_extent(corner(bricks, element));
    let part = match step.solids.is_empty() {
        true => 1.0,
        false => part_of_solids(extent, space.volume[element as usize]),
    };
    [extent.x, extent.y, extent.z, part]
}

/// Returns whether a cell's centre is inside a wall or solid.
fn is_buried(step: &FlipSubstep<'_>, bricks: &Bricks, space: &OpenSpace, element: u32) -> bool {
    let parts = open_parts(step, bricks, space, element);
    parts.into_iter().any(|part| part < HALF)
}

/// Returns whether a cell, if it is water, is mostly empty, as in closing gaps (flip/close_gaps).
pub fn is_filling(
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
    density: &[f64],
    element: u32,
) -> bool {
    density[element as usize] < 0.5 && !is_buried(step, bricks, space, element)
}

/// Returns which cells have their centre inside a wall or solid. Shape (elements).
pub fn find_buried(step: &FlipSubstep<'_>, bricks: &Bricks, space: &OpenSpace) -> Vec<bool> {
    per_cell(bricks, |element| is_buried(step, bricks, space, element))
}

/// Makes room for water that enters where water already is: the projection lets the excess of such
/// cells flow out, and the density correction ignores it.
pub fn let_in(
    inlets: &[Inlet],
    cell_size: f64,
    bricks: &Bricks,
    space: &mut OpenSpace,
    density: &[f64],
    excess: &mut [f64],
) {
    for element in CELLS..space.kind.len() as u32 {
        let (e, cell) = (element as usize, bricks.cell(element));
        let within = inlets.iter().filter(|inlet| inlet.contains(cell));
        let rate = within.map(|inlet| inlet.rate).fold(0.0, f64::max);
        if space.kind[e] != FLUID || rate == 0.0 {
            continue;
        }
        let over = (density[e] - 1.0).clamp(0.0, MOST_OVER);
        space.solid_flux[e] -= over * space.volume[e] * cell_size * rate;
        if let Some(excess) = excess.get_mut(e) {
            *excess = excess.min(0.0);
        }
    }
}

/// Largest excess by entering water, in units of the cell's open volume.
const MOST_OVER: f64 = 1.0;

/// Returns whether a rounding error of `error` may decide if the centre of a cell, or of one up to
/// two cells away, is inside a wall or solid.
pub fn is_near_half(
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
    element: u32,
    error: f64,
) -> bool {
    let mut about = neighborhood().flat_map(|offset| [offset, offset.map(|step| 2 * step)]);
    about.any(|offset| {
        let parts = open_parts(step, bricks, space, bricks.near(element, offset));
        parts.into_iter().any(|part| (part - HALF).abs() < error)
    })
}

/// Returns the density where walls and solids contain a cell's centre. Walls: continued linearly
/// from the two cells inward of them, rising by at most what the second holds and falling by at
/// most what it lacks, so that the surface keeps its slope. Otherwise, or if the centre inward is
/// inside too: the mean over the cell's faces to other cells, weighted by their open fractions.
fn density_before(
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
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
    let is_open = |other: u32| other >= CELLS && !is_buried(step, bricks, space, other);
    let there = bricks.near(element, inward);
    if inward != [0; 3] && is_open(there) {
        let further = bricks.near(element, inward.map(|step| 2 * step));
        if !is_open(further) {
            return density[there as usize];
        }
        let [near, far] = [there, further].map(|e| density[e as usize].clamp(0.0, 1.0));
        return near + (near - far).clamp(far - 1.0, far);
    }
    let (mut sum, mut weights) = (0.0, 0.0);
    for (axis, side) in (0..3).flat_map(|axis| [(axis, -1), (axis, 1)]) {
        let other = bricks.near(element, along(axis, side));
        if is_open(other) {
            let face = if side < 0 { element } else { other };
            let weight = space.open[face as usize][axis];
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

/// The water around a cell's centre, as derived from densities.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Depth {
    /// Fraction of the open volume there that is water.
    pub share: f64,
    /// Whether it is a film on a floor that passes above the centre.
    pub is_film: bool,
    /// Depth below the surface, in cells, from −1 to 1.
    pub cells: f64,
}

/// How errors change the fraction of a cell's hat function that lies below the surface
/// ([`sensitivity`]).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sensitivity {
    /// Factor for rounding errors of the open volumes around the cell, relative to 1; infinite if
    /// these volumes are all equal.
    pub to_tilt: f64,
    /// Factor for errors of the water around the cell; 0 without solids, where they pass
    /// unchanged.
    pub to_water: f64,
}

/// Least open fraction, over all faces together, through which a gap fills from beside it.
const LEAST_OPEN: f64 = 0.02;

/// Returns the water at a centre relative to the open volume there. If the centre is inside a
/// solid, the small open volume may hold no particle for a while, or one too many, so that cells
/// beyond the open faces count as well. A gap closed above is as full as the cells beside it, the
/// mean over its open faces: particles, at their distance from solids, may not fit into it, and as
/// air, without pressure, it would draw in the water around it without end.
fn share_of_room(
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
    density: &[f64],
    particle_share: f64,
    element: u32,
) -> f64 {
    let water = |e: u32| density[e as usize] * space.hats[e as usize].max(particle_share);
    let own = space.hats[element as usize];
    let (mut sum, mut rooms) = (water(element), own.max(LEAST_ROOM));
    let alone = sum / rooms;
    let up = -step.velocity_step;
    let mut is_roofed = own < 0.5 && up != DVec3::ZERO;
    // Sums over the open faces beside: open fraction times density, and open fraction.
    let mut beside = (0.0, 0.0);
    if own < 0.5 {
        for (axis, side) in (0..3).flat_map(|axis| [(axis, -1), (axis, 1)]) {
            let other = bricks.near(element, along(axis, side));
            let face = if side < 0 { element } else { other };
            let open = match other >= CELLS {
                true => space.open[face as usize][axis],
                false => 0.0,
            };
            // Faces up to 60° off the direction are above, others beside or below. Positions
            // without a brick are air.
            let upward = f64::from(side) * up[axis];
            if upward > 0.5 * up.length() {
                is_roofed &= other >= CELLS && open == 0.0;
            } else if upward >= -0.5 * up.length() {
                beside.0 += open * density[other as usize];
                beside.1 += open;
            }
            if other >= CELLS {
                sum += open * water(other);
                rooms += open * space.hats[other as usize];
            }
        }
    }
    let fed = match is_roofed && beside.1 >= LEAST_OPEN {
        true => beside.0 / beside.1,
        false => 0.0,
    };
    alone.max(sum / rooms).max(fed)
}

/// Integrals of the hat function over its four layers.
const LAYERS: [f64; 4] = [0.125, 0.375, 0.375, 0.125];

/// Changes of the water, or of the tilt, by which [`sensitivity`] is measured.
const CHANGES: [f64; 4] = [-1e-5, -1e-7, 1e-7, 1e-5];

/// How the solid in a cut cell's hat function leans.
struct Tilt {
    /// Squared cosine of its angle to the upward direction, negative under a ceiling.
    level: f64,
    /// Change of the open volume across the cell, by which the angle is found.
    size: f64,
}

/// Returns the tilt of the solid in a hat function; `None` if the hat is whole or closed, or
/// nothing points up.
fn tilt_of(
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
    element: u32,
) -> Option<Tilt> {
    let own = space.hats[element as usize];
    let up = -step.velocity_step;
    if own >= 1.0 || own <= LEAST_ROOM || up == DVec3::ZERO {
        return None;
    }
    let to_open = DVec3::from_array([0, 1, 2].map(|axis| {
        let [before, after] = [-1, 1].map(|side| {
            let other = bricks.near(element, along(axis, side));
            if other >= CELLS {
                space.hats[other as usize]
            } else {
                own
            }
        });
        after - before
    }));
    let upward = to_open.dot(up);
    let squares = to_open.length_squared() * up.length_squared();
    Some(Tilt {
        level: (upward * upward / squares.max(1e-30)).copysign(upward),
        size: to_open.length(),
    })
}

/// Returns how the fraction of a hat function below the surface changes with errors of its water
/// and of the open volumes around it, by differences. The solver does not need it: it bounds the
/// rounding errors of other solvers.
pub fn sensitivity(
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
    depth: &Depth,
    element: u32,
) -> Sensitivity {
    let Some(tilt) = tilt_of(step, bricks, space, element) else {
        return Sensitivity::default();
    };
    let open = &space.layers[element as usize];
    let of_room = depth.share.clamp(0.0, 1.0);
    let part = below_level(open, tilt.level, of_room);
    let most = |changed: &dyn Fn(f64) -> f64| {
        let slopes = CHANGES.map(|by| ((changed(by) - part) / by).abs());
        slopes.into_iter().fold(0.0, f64::max)
    };
    Sensitivity {
        to_tilt: most(&|by| below_level(open, tilt.level + by, of_room)) / tilt.size,
        to_water: most(&|by| below_level(open, tilt.level, of_room + by)),
    }
}

/// Returns the fraction of a hat that lies below a level surface, from the open parts of its
/// layers, the squared cosine of the solid's tilt, negative under a ceiling, and the fraction of
/// the open part that is water. Water fills the open part layer by layer, from the lowest up.
/// Within a layer, the part of a solid counts like the open part if it is a wall; like the layer
/// below if it is a floor; like the layer above if it is a ceiling.
fn below_level(open: &[f64; 4], level: f64, of_room: f64) -> f64 {
    let shares: [f64; 4] = std::array::from_fn(|k| LAYERS[k] * open[k]);
    let mut left = of_room * shares.iter().sum::<f64>();
    let filled: [f64; 4] = std::array::from_fn(|k| {
        let filled = left / (LAYERS[k] * open[k].max(LEAST_ROOM));
        left = (left - shares[k]).max(0.0);
        filled.clamp(0.0, 1.0)
    });
    let (mut beneath, mut below) = (1.0, 0.0);
    for k in 0..4 {
        let above = filled.get(k + 1).copied().unwrap_or(0.0);
        let beside = if level > 0.0 { beneath } else { above };
        let of_solid = filled[k] + (beside - filled[k]) * level.abs();
        beneath = of_solid + (filled[k] - of_solid) * open[k];
        below += LAYERS[k] * beneath;
    }
    below
}

/// Derives the water around each cell's centre from the densities. Shape (elements).
pub fn find_depth(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
    density: &[f64],
) -> Vec<Depth> {
    let particle_share = 1.0 / f64::from(model.settings().particles_per_cell);
    per_cell(bricks, |element| {
        let extent = step.open_extent(corner(bricks, element));
        let is_cut = space.hats[element as usize] < 1.0;
        let share = if extent.cmplt(DVec3::splat(HALF)).any() {
            density_before(step, bricks, space, density, element)
        } else if is_cut {
            share_of_room(step, bricks, space, density, particle_share, element)
        } else {
            density[element as usize]
        };
        let of_room = share.clamp(0.0, 1.0);
        let below = match tilt_of(step, bricks, space, element) {
            Some(tilt) => below_level(&space.layers[element as usize], tilt.level, of_room),
            None => of_room,
        };
        // Across a flat surface the density is 1/2 at the surface, and falls as s − s²/2 with the
        // distance s in cells.
        let off = below - 0.5;
        let way = 1.0 - (1.0 - 2.0 * off.abs()).max(0.0).sqrt();
        Depth {
            share,
            is_film: is_cut && share > LEAST_FILM && off >= 0.0,
            cells: if off == 0.0 { 0.0 } else { way * off.signum() },
        }
    })
}

/// Finds the cells of water, whose centres are not above the surface, and the distance to the
/// surface: kinds and metres. Shapes (elements). The presence of particles does not decide.
pub fn find_water(
    model: &Model,
    bricks: &Bricks,
    space: &OpenSpace,
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
        let kind = match space.kind[element as usize] {
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
    cells.into_iter().unzip()
}

/// Returns the excess of density, or deficit inside the water, as a fraction of a cell: the source
/// of the density correction (Kugelstadt et al. 2019). Shape (elements).
pub fn find_excess(
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    space: &OpenSpace,
    density: &[f64],
) -> Vec<f64> {
    per_cell(bricks, |element| {
        let e = element as usize;
        if space.kind[e] != FLUID {
            return 0.0;
        }
        // Beyond the domain there is neither a cell nor air. A gap filled by close_gaps still
        // counts as air.
        let is_air = |other: u32| {
            let kind = space.kind[other as usize];
            let is_filling = || is_filling(step, bricks, space, density, other);
            other >= CELLS && (kind == AIR || is_filling())
        };
        let touches_air = neighborhood().any(|offset| is_air(bricks.near(element, offset)));
        let least = if touches_air { 0.0 } else { -MOST_EXCESS };
        (density[e] - 1.0).clamp(least, MOST_EXCESS) * space.volume[e]
    })
}
