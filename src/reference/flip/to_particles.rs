//! Reference passes that transfer grid velocities to the particles and advect them.

use glam::{DMat3, DVec3};

use super::{
    Faces, FlipSubstep, Model, OpenSpace, Sorted,
    contraction::bend_at,
    grid::{along, neighborhood, per_cell},
    solids,
};
use crate::hash::pair_direction;
use swell_domain::{
    bricks::{Bricks, CELLS},
    parallel,
    poisson::{AIR, FLUID, SOLID},
};

/// Bits of a component's layer, and the bit that is set if particles gave it a velocity.
const LAYER: u32 = 0x7f;
const KNOWN: u32 = 0x80;

/// Layer of closed faces away from water, later than all that are extrapolated.
const CLOSED: u32 = 0x7f;

/// Tags of cells beyond the stored layer of the upper walls, whose faces are never used.
const NO_NEED: u32 = 0x7f_7f7f;

/// Values transferred from the grid to each particle, in sorted order.
#[derive(Clone, Debug, PartialEq)]
pub struct GridTransfer {
    /// New velocity of the particle, m/s. Shape (particles).
    pub velocity: Vec<DVec3>,
    /// New affine matrix, 1/s. Shape (particles) for APIC, else empty.
    pub affine: Vec<DMat3>,
    /// The grid's velocity at the particle, m/s. Shape (particles).
    pub carried: Vec<DVec3>,
    /// Whether the particle is an isolated droplet: none of the 27 cells around it is water. Shape
    /// (particles).
    pub is_drop: Vec<bool>,
    /// The density correction's displacement at the particle, metres. Shape (particles).
    pub displacement: Vec<DVec3>,
}

/// Particles after a substep, in sorted order.
#[derive(Clone, Debug, PartialEq)]
pub struct Moved {
    /// Positions, metres. Shape (particles).
    pub position: Vec<DVec3>,
    /// Velocities, m/s. Shape (particles).
    pub velocity: Vec<DVec3>,
    /// Number of particles whose displacement was reduced to the cap.
    pub capped: u64,
}

fn layer_of(tags: u32, axis: usize) -> u32 {
    tags >> (8 * axis) & LAYER
}

fn is_known(tags: u32, axis: usize) -> bool {
    tags >> (8 * axis) & KNOWN != 0
}

/// Marks the faces to which the projection gave a velocity (layer 1), and stores the change of
/// velocity. Closed faces away from water keep the velocity of their wall or solid, which is not
/// extrapolated.
pub fn find_change(model: &Model, bricks: &Bricks, space: &OpenSpace, faces: &mut Faces) {
    let tags = per_cell(bricks, |element| {
        let e = element as usize;
        let own = space.kind[e];
        if (bricks.cell(element).iter().zip(&model.cells)).any(|(cell, cells)| cell > cells) {
            return NO_NEED;
        }
        let layer = |axis: usize| {
            let before = bricks.near(element, along(axis, -1));
            let kind = space.kind[before as usize];
            let is_closed = space.open[e][axis] == 0.0;
            // A closed face between two solid cells has no velocity of its own; slot 0 lies beyond
            // the domain.
            let is_buried = own == SOLID && (kind == SOLID || before < CELLS);
            if own == FLUID || kind == FLUID {
                1
            } else if is_closed && !is_buried {
                CLOSED
            } else {
                0
            }
        };
        let layers = (0..3).map(|axis| layer(axis) << (8 * axis));
        faces.layer[e] | layers.sum::<u32>()
    });
    faces.layer = tags;
    for (change, velocity) in faces.change.iter_mut().zip(&faces.velocity) {
        *change = velocity - *change;
    }
}

/// Extrapolates velocities by one layer: a face gets the mean of its neighbours in earlier layers.
/// On faces with a velocity from particles only the change is extrapolated.
pub fn extrapolate(step: &FlipSubstep<'_>, bricks: &Bricks, layer: u32, faces: &mut Faces) {
    let filled = per_cell(bricks, |element| {
        let e = element as usize;
        let tags = faces.layer[e];
        let (mut velocity, mut change, mut new) = (faces.velocity[e], faces.change[e], tags);
        for axis in (0..3).filter(|&axis| layer_of(tags, axis) == 0) {
            let is_older =
                |&other: &usize| (1..layer).contains(&layer_of(faces.layer[other], axis));
            let sources: Vec<usize> = (0..6)
                .map(|k| bricks.near(element, along(k / 2, k as i32 % 2 * 2 - 1)) as usize)
                .filter(is_older)
                .collect();
            if sources.is_empty() {
                continue;
            }
            new |= layer << (8 * axis);
            if is_known(tags, axis) {
                let seen = sources
                    .iter()
                    .filter(|&&other| is_known(faces.layer[other], axis));
                let changes: Vec<f64> = seen.map(|&other| faces.change[other][axis]).collect();
                let mean = if changes.is_empty() {
                    step.velocity_step[axis]
                } else {
                    changes.iter().sum::<f64>() / changes.len() as f64
                };
                // Gravity's change is included in both.
                velocity[axis] += mean - change[axis];
                change[axis] = mean;
            } else {
                let sum: f64 = sources
                    .iter()
                    .map(|&other| faces.velocity[other][axis])
                    .sum();
                velocity[axis] = sum / sources.len() as f64;
            }
        }
        (velocity, change, new)
    });
    faces.velocity = filled.iter().map(|cell| cell.0).collect();
    faces.change = filled.iter().map(|cell| cell.1).collect();
    faces.layer = filled.iter().map(|cell| cell.2).collect();
}

/// Returns the elements of the 2 × 3 × 3 faces of component `axis` around a cell: a fastest, then
/// b, then c, where (a, b, c) are the axes permuted so that the component's own is first. Beyond
/// the domain the cell's own row or column is used.
fn stencil(model: &Model, bricks: &Bricks, element: u32, axis: usize) -> [usize; 18] {
    std::array::from_fn(|k| {
        let mut offset = [0; 3];
        offset[(axis + 1) % 3] = (k / 2 % 3) as i32 - 1;
        offset[(axis + 2) % 3] = (k / 6) as i32 - 1;
        let mut offset = within(model, bricks, element, offset);
        offset[axis] = (k % 2) as i32;
        bricks.near(element, offset) as usize
    })
}

/// Clamps an offset from a cell to the domain.
fn within(model: &Model, bricks: &Bricks, element: u32, offset: [i32; 3]) -> [i32; 3] {
    let cell = bricks.cell(element);
    std::array::from_fn(|axis| {
        let goes_on = model.scene.periodic[axis];
        let before = goes_on || cell[axis] > 0;
        let after = goes_on || cell[axis] + 1 < model.cells[axis];
        offset[axis].clamp(-i32::from(before), i32::from(after))
    })
}

/// Returns the hat functions of a position in a cell at the centres of the previous, own and next
/// cell.
fn center_hats(f: f64) -> [f64; 3] {
    [
        (0.5 - f).max(0.0),
        1.0 - (f - 0.5).abs(),
        (f - 0.5).max(0.0),
    ]
}

/// Returns the derivatives of [`center_hats`], per cell.
fn center_slopes(f: f64) -> [f64; 3] {
    if f < 0.5 {
        [-1.0, 1.0, 0.0]
    } else {
        [0.0, -1.0, 1.0]
    }
}

/// Returns the sum over a stencil's faces of the products of weights along a, b and c and the
/// values.
fn weighted(values: &[f64; 18], a: [f64; 2], b: [f64; 3], c: [f64; 3]) -> f64 {
    let of = |k: usize| a[k % 2] * b[k / 2 % 3] * c[k / 6] * values[k];
    (0..18).map(of).sum()
}

/// Returns each value times its weight, plus the weighted mean of all times the rest.
fn settled(values: [f64; 18], parts: &[f64; 18]) -> [f64; 18] {
    let sum: f64 = values
        .iter()
        .zip(parts)
        .map(|(value, part)| value * part)
        .sum();
    let mean = sum / parts.iter().sum::<f64>().max(1e-6);
    std::array::from_fn(|k| values[k] * parts[k] + mean * (1.0 - parts[k]))
}

/// Returns the smallest and the largest velocity.
fn range_of(values: &[f64; 18]) -> [f64; 2] {
    let low = values.iter().fold(f64::INFINITY, |low, &v| low.min(v));
    let high = values
        .iter()
        .fold(f64::NEG_INFINITY, |high, &v| high.max(v));
    [low, high]
}

/// Transfers grid velocities to particles: v = α u + (1 − α)(v + Δu) (Zhu and Bridson 2005), or u
/// and its gradient (APIC, Jiang et al. 2015); isolated droplets get v + g Δt. Also interpolates
/// the density correction's displacements, if it is on. Partly open faces are weighted by their
/// open fraction, as in the projection, and those that solids close by how much they face them; at
/// the surface v is clamped to the range of the faces' velocities, extended by a margin.
pub fn grid_to_particle(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    sorted: &Sorted,
    faces: &Faces,
    space: &OpenSpace,
    displacement: Option<&[DVec3]>,
) -> GridTransfer {
    let is_apic = !sorted.cloud.affine.is_empty();
    let size = model.cell_size();
    let of_cell = |element: u32| {
        let stencils = [0, 1, 2].map(|axis| stencil(model, bricks, element, axis));
        let parts = [0, 1, 2].map(|axis| stencils[axis].map(|e| space.weight[e][axis]));
        let values = |of: &[DVec3]| -> [[f64; 18]; 3] {
            [0, 1, 2].map(|axis| stencils[axis].map(|e| of[e][axis]))
        };
        let raw = values(&faces.velocity);
        let by_parts = |of: [[f64; 18]; 3]| -> [[f64; 18]; 3] {
            [0, 1, 2].map(|axis| std::array::from_fn(|k| parts[axis][k] * of[axis][k]))
        };
        let (velocity, change) = (by_parts(raw), by_parts(values(&faces.change)));
        let shift = displacement.map(|of| by_parts(values(of)));
        let cell = super::grid::corner(bricks, element);
        let is_near = |kind| {
            let of = |offset| space.kind[bricks.near(element, offset) as usize];
            neighborhood().any(|offset| of(within(model, bricks, element, offset)) == kind)
        };
        let is_drop = !is_near(FLUID);
        let is_surface = is_near(AIR);
        let ranges = [0, 1, 2].map(|axis| range_of(&settled(raw[axis], &parts[axis])));
        let fastest = ranges
            .iter()
            .flatten()
            .fold(0.0, |most: f64, v| most.max(v.abs()));
        let beyond = match is_surface {
            true => fastest * (fastest * step.length / size).min(1.0),
            false => f64::INFINITY,
        };
        let of_particle = move |i: usize| {
            let place = sorted.cloud.position[i] / size - cell;
            let v = sorted.cloud.velocity[i];
            let mut given = (DVec3::ZERO, DMat3::ZERO, DVec3::ZERO, DVec3::ZERO, is_drop);
            let mut rows = [DVec3::ZERO; 3];
            for axis in 0..3 {
                let [f, g, h] = [0, 1, 2].map(|turn| place[(axis + turn) % 3]);
                let (a, b, c) = ([1.0 - f, f], center_hats(g), center_hats(h));
                // An isolated droplet falls freely: around it nothing is projected, and closed
                // faces have the wall's velocity.
                let falling = v[axis] + step.velocity_step[axis];
                let whole = match step.solids.is_empty() {
                    true => 1.0,
                    false => weighted(&parts[axis], a, b, c).max(1e-6),
                };
                let advanced = v[axis] + weighted(&change[axis], a, b, c) / whole;
                let u = match is_drop {
                    true => falling,
                    false => weighted(&velocity[axis], a, b, c) / whole,
                };
                given.0[axis] = if is_drop || is_apic {
                    u
                } else {
                    let [low, high] = ranges[axis];
                    (advanced + step.pic_blend * (u - advanced)).clamp(low - beyond, high + beyond)
                };
                given.2[axis] = u;
                given.3[axis] = shift.map_or(0.0, |shift| weighted(&shift[axis], a, b, c) / whole);
                if is_apic {
                    let along = [
                        ([-1.0, 1.0], b, c),
                        (a, center_slopes(g), c),
                        (a, b, center_slopes(h)),
                    ];
                    for (turn, (a, b, c)) in along.into_iter().enumerate() {
                        let of_parts = match step.solids.is_empty() {
                            true => 0.0,
                            false => weighted(&parts[axis], a, b, c),
                        };
                        // Not divided by `whole`: the slope of the quotient is not bounded where
                        // faces are almost closed.
                        let slope = weighted(&velocity[axis], a, b, c) - u * of_parts;
                        rows[axis][(axis + turn) % 3] = slope / size;
                    }
                }
            }
            if is_surface {
                let film = solids::Film {
                    velocity_step: step.velocity_step,
                    kick: step.kick,
                    cell_size: size,
                    particle_share: 1.0 / f64::from(model.settings().particles_per_cell),
                    is_drop,
                };
                for solid in &step.solids {
                    given.0 = solid.slowed(sorted.cloud.position[i], given.0, &film);
                    if is_drop {
                        given.2 = given.0;
                    }
                }
            }
            given.1 = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
            given
        };
        sorted.of(element).map(of_particle)
    };
    let wet = CELLS as usize..(CELLS * (bricks.wet + 1)) as usize;
    let all = parallel::flat_map(wet, |element| {
        let holds_any = !sorted.of(element as u32).is_empty();
        holds_any
            .then(|| of_cell(element as u32))
            .into_iter()
            .flatten()
    });
    GridTransfer {
        velocity: all.iter().map(|given| given.0).collect(),
        affine: (all.iter().filter(|_| is_apic))
            .map(|given| given.1)
            .collect(),
        carried: all.iter().map(|given| given.2).collect(),
        displacement: all.iter().map(|given| given.3).collect(),
        is_drop: all.iter().map(|given| given.4).collect(),
    }
}

/// Displaces each particle so that its own new velocity takes it to where the grid's velocity would
/// take it from its original position; isolated droplets keep theirs. Adds the displacement of each
/// (flip/aim). Metres. Shape (particles), in sorted order.
pub fn aim(step: &FlipSubstep<'_>, position: &[DVec3], given: &GridTransfer) -> Vec<DVec3> {
    let one = |(i, &x): (usize, &DVec3)| {
        let beside = match given.is_drop[i] {
            true => DVec3::ZERO,
            false => given.carried[i] - given.velocity[i],
        };
        x + step.length * beside + given.displacement[i]
    };
    position.iter().enumerate().map(one).collect()
}

/// Returns the grid's velocity at `x`, m/s; `otherwise` if there is no brick.
pub(super) fn velocity_at(
    model: &Model,
    bricks: &Bricks,
    velocity: &[DVec3],
    x: DVec3,
    otherwise: DVec3,
) -> DVec3 {
    let cells = DVec3::from_array(model.cells.map(f64::from));
    let p = (model.period().wrap(x) / model.cell_size()).clamp(DVec3::ZERO, cells);
    let cell = p.min(cells - 1.0).floor();
    let f = p - cell;
    let at = cell.to_array().map(|c| c as i64);
    if bricks.element(at) < CELLS {
        return otherwise;
    }
    // Two neighbours along each axis, and the interpolation weight of the second: between faces
    // along the component's own axis, between centres across it. Beyond the outermost centres the
    // velocity is that of the outermost.
    let across = |axis: usize| {
        let last = i64::from(model.cells[axis]) - 1;
        let first = if f[axis] < 0.5 {
            at[axis] - 1
        } else {
            at[axis]
        };
        let t = if f[axis] < 0.5 {
            f[axis] + 0.5
        } else {
            f[axis] - 0.5
        };
        match model.scene.periodic[axis] {
            true => ([first, first + 1], t),
            false => ([first.max(0), (first + 1).min(last)], t),
        }
    };
    let component = |own: usize| {
        let ways: [_; 3] = std::array::from_fn(|axis| {
            if axis == own {
                ([at[axis], at[axis] + 1], f[axis])
            } else {
                across(axis)
            }
        });
        let corner = |k: usize| {
            let high = [k & 1, k >> 1 & 1, k >> 2];
            let weight = |axis: usize| {
                let t = ways[axis].1;
                if high[axis] == 1 { t } else { 1.0 - t }
            };
            let there = std::array::from_fn(|axis| ways[axis].0[high[axis]]);
            weight(0) * weight(1) * weight(2) * velocity[bricks.element(there) as usize][own]
        };
        (0..8).map(corner).sum()
    };
    DVec3::new(component(0), component(1), component(2))
}

/// Fraction of the missing distance that each of a pair moves.
const SHARE: f64 = 0.25;

/// Largest displacement, as a fraction of the target distance.
const MOST: f64 = 0.25;

/// Returns displacements that move particles apart which are closer to each other, or to a wall,
/// than in water at rest, metres: half of what each pair lacks, shared between the two (the weak
/// springs of Ando and Tsuruno 2011, without their velocity). Isolated droplets may rest as close
/// to a wall as they can. Shape (particles).
pub fn push_apart(
    model: &Model,
    step: &FlipSubstep<'_>,
    bricks: &Bricks,
    sorted: &Sorted,
    is_drop: &[bool],
) -> Vec<DVec3> {
    let (apart, period) = (model.settings().apart(), model.period());
    let from_walls = model.settings().apart_from_walls();
    let one = |i: usize| {
        let (x, own) = (sorted.cloud.position[i], sorted.cloud.id[i]);
        let place = x / model.cell_size() - super::grid::corner(bricks, sorted.cell[i]);
        // The target distance is below half a cell: closer particles lie in one of eight cells.
        let side = place.to_array().map(|f| if f < 0.5 { -1 } else { 1 });
        let lacks = |way: DVec3| (from_walls - 2.0 * way).max(DVec3::ZERO);
        // Walls at the substep's start, when the particles are at these positions.
        let [low, high] = [step.cut.min, step.cut.max].map(|wall| wall * model.cell_size());
        let of_walls = lacks(x - low) - lacks(high - x);
        let of_walls = if is_drop[i] { DVec3::ZERO } else { of_walls };
        let mut push = DVec3::select(period.0.cmpgt(DVec3::ZERO), DVec3::ZERO, of_walls);
        for k in 0..8 {
            let offset = std::array::from_fn(|axis| side[axis] * (k >> axis & 1));
            for j in sorted.of(bricks.near(sorted.cell[i], offset)) {
                let way = period.shortest(x - sorted.cloud.position[j]);
                let distance = way.length();
                if j != i && distance < apart {
                    let direction = match distance {
                        0.0 => pair_direction(own, sorted.cloud.id[j]),
                        distance => way / distance,
                    };
                    push += (apart - distance) * direction;
                }
            }
        }
        (SHARE * push).clamp_length_max(MOST * apart)
    };
    parallel::map(0..sorted.cell.len(), one)
}

/// The field that particles go by, and where they do not go straight on.
#[derive(Clone, Copy)]
pub struct Paths<'a> {
    /// Layout of the elements.
    pub bricks: &'a Bricks,
    /// Velocities at the lower faces, m/s.
    pub velocity: &'a [DVec3],
    /// Element of each particle's cell.
    pub cell: &'a [u32],
    /// Weight of the midpoint rule by slot (flip/bend_paths); everywhere 1 if empty.
    pub bend: &'a [f64],
}

/// Advects particles by the grid's velocity at their positions, or, where paths are bent, by the
/// midpoint rule, and by the density correction's displacement; keeps them out of solids and walls,
/// and removes their velocity component into these. A particle that would move farther than the cap
/// is slowed.
pub fn advect(
    model: &Model,
    step: &FlipSubstep<'_>,
    paths: &Paths<'_>,
    position: &[DVec3],
    given: &GridTransfer,
) -> Moved {
    let contact = model.contact_distance();
    let (low, high) = (step.walls.min + contact, step.walls.max - contact);
    let one = |i: usize| {
        let (start, here) = (position[i], given.carried[i]);
        let bend = match paths.bend {
            [] => 1.0,
            bend => bend_at(paths.bricks, bend, paths.cell[i], start / model.cell_size()),
        };
        // A droplet continues ballistically: faces along its path may belong to other water.
        let between = match given.is_drop[i] {
            true => here,
            false => {
                let middle = start + 0.5 * step.length * here;
                here.lerp(
                    velocity_at(model, paths.bricks, paths.velocity, middle, here),
                    bend,
                )
            }
        };
        let mut way = step.length * between + given.displacement[i];
        let distance = way.length();
        let is_capped = distance > model.max_displacement();
        if is_capped {
            way *= model.max_displacement() / distance;
        }
        let (x, v) = solids::go(model, step, start, way, given.velocity[i]);
        let v = solids::at_walls(model, step, v, x);
        (model.period().wrap(x.clamp(low, high)), v, is_capped)
    };
    let all: Vec<_> = parallel::map(0..position.len(), one);
    Moved {
        position: all.iter().map(|moved| moved.0).collect(),
        velocity: all.iter().map(|moved| moved.1).collect(),
        capped: all.iter().map(|moved| u64::from(moved.2)).sum(),
    }
}
