//! Spreads initial water evenly beside solids.

use glam::DVec3;

use super::{
    super::{bounds::Bounds, signed_distance::SignedDistance},
    OVERLAP_SPACINGS, PointGrid,
    displace::{CLEARANCE, moved_out},
};
use crate::parallel;

/// Distance from a solid within which particles move, in spacings.
const REACH: f64 = 3.0;

/// Radius of the kernel, in spacings: the cubic lattice has 80 neighbours within it.
const RADIUS: f64 = 2.5;

/// Rounds between updates of the search grid.
const SEARCH_ROUNDS: usize = 8;

/// Longest move of a round, in spacings.
const LONGEST_MOVE: f64 = 0.1;

/// Shorter moves are rounding errors: water on a lattice that fits its solids stays there.
const SHORTEST_MOVE: f64 = 1e-6;

/// The part of a particle's cube that a solid fills: its centroid and volume, cubed spacings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ClosedPart {
    pub position: DVec3,
    pub volume: f64,
}

/// Moves the `water` that is near `solid` until its density is as even as a lattice's.
///
/// `lattice` are the places of all particles before any gave way to the solid. `closed` are the
/// parts of their cubes that lie in the solid, each at its centroid. These and the places where the
/// lattice would go on beyond the water stand for what is around the water.
///
/// Each round is a step of gradient descent on the sum of a Wendland C2 kernel over all pairs, half
/// as long as the one that returns a single particle of the lattice to its place. The longest waves
/// of compression have up to three times the curvature of such a displacement, so that the descent
/// is stable.
pub(super) fn relax(
    water: &mut [DVec3],
    lattice: &[DVec3],
    closed: &[ClosedPart],
    solid: &SignedDistance,
    domain: &Bounds,
    (spacing, rounds): (f64, usize),
) {
    let within = |least: f64, most: f64| {
        move |p: &DVec3| {
            let distance = solid.sample(*p) / spacing;
            least < distance && distance < most
        }
    };
    // Points deeper in the solid have no water within the kernel's radius.
    const DEPTH: f64 = RADIUS + 1.0;
    let near = |reach: f64| within(-DEPTH, reach);
    let moving: Vec<usize> =
        parallel::flat_map(0..water.len(), |i| near(REACH)(&water[i]).then_some(i));
    let is_moving = near(REACH);
    let fixed = parallel::flat_map(0..water.len(), |i| {
        let p = &water[i];
        (!is_moving(p) && near(REACH + RADIUS)(p)).then_some((*p, 1.0))
    });
    let in_solid = parallel::flat_map(0..closed.len(), |i| {
        let part = &closed[i];
        (part.volume > 0.0 && is_moving(&part.position)).then_some((part.position, part.volume))
    });
    let is_around = within(-DEPTH - RADIUS, REACH + RADIUS);
    let around = parallel::flat_map(0..lattice.len(), |i| {
        is_around(&lattice[i]).then_some(lattice[i])
    });
    let beyond = beyond(&around, near(REACH), spacing);
    let (mut places, volumes): (Vec<DVec3>, Vec<f64>) = (moving.iter())
        .map(|&i| (water[i], 1.0))
        .chain(fixed)
        .chain(in_solid)
        .chain(beyond.into_iter().map(|p| (p, 1.0)))
        .unzip();
    let radius = RADIUS * spacing;
    let clearance = CLEARANCE * spacing;
    let room = domain.grown(-clearance);
    let distance = |p| solid.sample(p);
    let gradient = |p| solid.gradient(p);
    let mut grid = PointGrid::with_cell(radius);
    for round in 0..rounds {
        if round % SEARCH_ROUNDS == 0 {
            grid = PointGrid::over(&places, radius);
        }
        let moved = |i: usize| {
            let p = places[i];
            let mut push = DVec3::ZERO;
            grid.for_each_near(&places, p, |j, distance| {
                let weight = 0.5 * volumes[j as usize] * (1.0 - distance / radius).powi(3);
                push += weight * (p - places[j as usize]);
            });
            if push.length() < SHORTEST_MOVE * spacing {
                return p;
            }
            let p = p + push.clamp_length_max(LONGEST_MOVE * spacing);
            moved_out(
                p.clamp(room.min, room.max),
                distance,
                gradient,
                &room,
                clearance,
            )
        };
        let next: Vec<DVec3> = parallel::map(0..moving.len(), moved);
        places[..next.len()].copy_from_slice(&next);
    }
    for (i, p) in moving.into_iter().zip(&places) {
        water[i] = *p;
    }
}

/// Returns the places near water where its lattice would go on: above its surface and beyond walls.
fn beyond(lattice: &[DVec3], is_near: impl Fn(&DVec3) -> bool + Sync, spacing: f64) -> Vec<DVec3> {
    let reach = RADIUS.floor() as i32;
    let offsets: Vec<DVec3> = (0..(2 * reach + 1).pow(3))
        .map(|n| {
            let edge = 2 * reach + 1;
            let at = [n % edge, n / edge % edge, n / (edge * edge)].map(|k| f64::from(k - reach));
            DVec3::from_array(at)
        })
        .filter(|at| at.length() < RADIUS)
        .collect();
    let neighbors = PointGrid::over(lattice, RADIUS * spacing);
    let is_inner = |p: &DVec3| {
        let mut count = 0;
        neighbors.for_each_near(lattice, *p, |_, _| count += 1);
        count == offsets.len()
    };
    let edge = parallel::flat_map(0..lattice.len(), |i| {
        let p = &lattice[i];
        (is_near(p) && !is_inner(p)).then_some(p)
    });
    let mut taken = lattice.to_vec();
    let mut grid = PointGrid::over(lattice, OVERLAP_SPACINGS * spacing);
    for p in edge {
        for offset in &offsets {
            let place = *p + spacing * *offset;
            if !grid.has_near(&taken, place) {
                grid.insert(taken.len() as u32, place);
                taken.push(place);
            }
        }
    }
    taken.split_off(lattice.len())
}
