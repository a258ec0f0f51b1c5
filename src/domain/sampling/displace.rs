//! Makes initial water give way to solids.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{
    super::{bounds::Bounds, signed_distance::SignedDistance},
    relax::{ClosedPart, relax},
    uniform,
};
use crate::parallel;

/// Least distance of particles from solids, in spacings: slightly farther than PBF (0.25) and FLIP
/// (0.1) keep them, so that none is pushed in the first step.
pub(in super::super) const CLEARANCE: f64 = 0.3;

/// Subdivisions along each edge of a particle's cube.
const PARTS: usize = 4;

/// Edge of the blocks within which the count is balanced, in spacings.
const BLOCK: f64 = 4.0;

/// Random addition to an open fraction, so that the particles removed among equal ones
/// are scattered.
const SCATTER: f64 = 0.02;

/// Rounds of spreading beside solids. Twice as many change positions by less than 0.01 spacings.
const ROUNDS_BESIDE_SOLIDS: usize = 32;

/// Rounds of spreading below a surface, which layers follow from the start: neighbouring columns
/// that differ by a layer have to agree.
const ROUNDS_BELOW_AIR: usize = 12;

/// Iterations for particles between a solid and a wall, or between two solids.
const ROUNDS: usize = 8;

/// Removes particles in `solid`, moves those that are too close to it outward and spreads those
/// beside it evenly; returns the number removed.
///
/// The count that stays matches the open volume of the particles' cubes to half a particle, unless
/// there is no space outside of the solid.
pub(super) fn displace(
    positions: &mut Vec<DVec3>,
    solid: &SignedDistance,
    domain: &Bounds,
    spacing: f64,
) -> usize {
    displace_below(positions, &[], Some(solid), solid, domain, spacing)
}

/// Does the same where water has a surface: `air` are the places of a lattice above it, and
/// `around` is what is around the water, the solid and the air. Only the solid removes particles.
pub(super) fn displace_below(
    positions: &mut Vec<DVec3>,
    air: &[DVec3],
    solid: Option<&SignedDistance>,
    around: &SignedDistance,
    domain: &Bounds,
    spacing: f64,
) -> usize {
    let lattice = [positions, air].concat();
    let part = |p: &DVec3| match solid {
        Some(solid) => closed_part(solid, *p, spacing),
        None => ClosedPart {
            position: *p,
            volume: 0.0,
        },
    };
    let mut closed: Vec<ClosedPart> = parallel::map_slice(positions, part);
    let open: Vec<f64> = closed.iter().map(|part| 1.0 - part.volume).collect();
    let kept = balanced(positions, &open, spacing);
    let before = positions.len();
    let mut kept = kept.into_iter();
    positions.retain(|_| kept.next() == Some(true));
    let clearance = CLEARANCE * spacing;
    let room = domain.grown(-clearance);
    let distance = |p| around.sample(p);
    let gradient = |p| around.gradient(p);
    parallel::for_each_mut(positions, |_, p| {
        *p = moved_out(*p, distance, gradient, &room, clearance);
    });
    closed.extend(air.iter().map(|p| ClosedPart {
        position: *p,
        volume: 1.0,
    }));
    let rounds = match solid {
        Some(_) => ROUNDS_BESIDE_SOLIDS,
        None => ROUNDS_BELOW_AIR,
    };
    relax(
        positions,
        &lattice,
        &closed,
        around,
        domain,
        (spacing, rounds),
    );
    // Between a solid and a wall, or between two solids, there may be no space.
    positions.retain(|p| around.sample(*p) > 0.0);
    before - positions.len()
}

/// Returns the part of the cube of edge `spacing` around `p` that lies in `solid`, at its centroid,
/// summed over small cubes.
fn closed_part(solid: &SignedDistance, p: DVec3, spacing: f64) -> ClosedPart {
    let distance = solid.sample(p);
    // Half of the cube's diagonal, plus interpolation's error at edges.
    if distance.abs() > spacing {
        return ClosedPart {
            position: p,
            volume: if distance > 0.0 { 0.0 } else { 1.0 },
        };
    }
    const NODES: usize = PARTS + 1;
    let index = |at: [usize; 3]| at[0] + NODES * (at[1] + NODES * at[2]);
    let cell = |k: usize, edge: usize| [k % edge, k / edge % edge, k / (edge * edge)];
    let place = |at: [usize; 3]| DVec3::from_array(at.map(|i| i as f64 / PARTS as f64 - 0.5));
    let nodes: [f64; NODES.pow(3)] =
        std::array::from_fn(|k| solid.sample(p + spacing * place(cell(k, NODES))));
    // Negative distances over all distances at a small cube's eight corners: exact for a face
    // parallel to the cube's, including one that coincides with a face of it.
    let part = |at: [usize; 3]| {
        let (mut closed, mut all) = (0.0, 0.0);
        for corner in 0..8 {
            let distance = nodes[index([0, 1, 2].map(|axis| at[axis] + (corner >> axis & 1)))];
            closed += (-distance).max(0.0);
            all += distance.abs();
        }
        if all > 0.0 { closed / all } else { 0.5 }
    };
    let half = DVec3::splat(0.5 / PARTS as f64);
    let (mut volume, mut moment) = (0.0, DVec3::ZERO);
    for k in 0..PARTS.pow(3) {
        let at = cell(k, PARTS);
        let part = part(at);
        volume += part;
        moment += part * (place(at) + half);
    }
    ClosedPart {
        position: p + spacing * moment / f64::max(volume, f64::MIN_POSITIVE),
        volume: volume / PARTS.pow(3) as f64,
    }
}

/// Selects which particles stay: those whose cubes are at least half open, with more or fewer added
/// block by block until the count matches the sum of the open fractions. The remainder of a block
/// carries over to the next.
fn balanced(positions: &[DVec3], open: &[f64], spacing: f64) -> Vec<bool> {
    let mut kept: Vec<bool> = open.iter().map(|part| *part >= 0.5).collect();
    let mut blocks = BTreeMap::<[i64; 3], Vec<usize>>::new();
    for (i, p) in positions.iter().enumerate() {
        if 0.0 < open[i] && open[i] < 1.0 {
            let block = (*p / (BLOCK * spacing)).floor();
            let block = block.to_array().map(|c| c as i64);
            blocks.entry(block).or_default().push(i);
        }
    }
    let mut lacking = 0.0;
    for cut in blocks.values_mut() {
        let held = |i: &usize| if kept[*i] { 1.0 } else { 0.0 };
        lacking += cut.iter().map(|i| open[*i] - held(i)).sum::<f64>();
        let wanted = lacking.round();
        // Adds those with the largest open fraction, or removes those with the smallest.
        let rank = |i: &usize| {
            let rank = open[*i] + SCATTER * uniform(*i as u64);
            if wanted > 0.0 { -rank } else { rank }
        };
        let mut others: Vec<usize> = (cut.iter().copied())
            .filter(|i| kept[*i] == (wanted < 0.0))
            .collect();
        others.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
        others.truncate(wanted.abs() as usize);
        lacking -= wanted.signum() * others.len() as f64;
        for i in others {
            kept[i] = !kept[i];
        }
    }
    kept
}

/// Moves `p` to at least `clearance` from the solid with this distance and gradient, and into
/// `room`, as far as possible.
pub(in super::super) fn moved_out(
    p: DVec3,
    distance: impl Fn(DVec3) -> f64,
    gradient: impl Fn(DVec3) -> DVec3,
    room: &Bounds,
    clearance: f64,
) -> DVec3 {
    let mut p = p;
    for _ in 0..ROUNDS {
        let distance = distance(p);
        if distance >= clearance {
            break;
        }
        let out = gradient(p).normalize_or_zero();
        p = (p + out * (clearance - distance)).clamp(room.min, room.max);
    }
    p
}
