//! Reference passes before the transfer to the grid: the particles' bricks, and their order by
//! cell.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::Model;
use swell_domain::bricks::{Bricks, CELLS};
use swell_domain::parallel;

/// Particles in any order; positions relative to the domain's minimum corner.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cloud {
    /// Positions, metres. Shape (particles).
    pub position: Vec<DVec3>,
    /// Velocities, m/s. Shape (particles).
    pub velocity: Vec<DVec3>,
    /// C of v(x) = v + C (x − x_p), 1/s, with row k for component k. Shape (particles) for APIC,
    /// else empty.
    pub affine: Vec<DMat3>,
    /// Unique ids. Shape (particles).
    pub id: Vec<u32>,
}

/// Data from which a substep is chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    /// Largest particle speed, m/s.
    pub speed: f64,
    /// Number of particles with non-finite values.
    pub not_finite: u32,
    /// Whether each brick of the domain holds particles, x fastest.
    pub is_wet: Vec<bool>,
}

/// Particles sorted by cell, and by id within a cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Sorted {
    /// The particles.
    pub cloud: Cloud,
    /// Element of each particle's cell. Shape (particles).
    pub cell: Vec<u32>,
    /// First particle of each element up to the last wet one, and the total number. Shape (512 (wet
    /// + 1) + 1).
    pub start: Vec<u32>,
}

/// Returns indices into the cloud in the order of the ids.
pub(super) fn by_id(cloud: &Cloud) -> Vec<usize> {
    let mut order: Vec<usize> = (0..cloud.id.len()).collect();
    order.sort_unstable_by_key(|&k| cloud.id[k]);
    order
}

/// Measures the largest speed and finds the bricks that hold particles.
pub fn survey(model: &Model, cloud: &Cloud) -> Survey {
    let mut is_wet = model.no_water();
    let (mut speed, mut not_finite) = (0.0f64, 0);
    for (&x, &v) in cloud.position.iter().zip(&cloud.velocity) {
        not_finite += u32::from(!x.is_finite() || !v.is_finite());
        speed = speed.max(v.length());
        is_wet[model.brick_index(model.cell_of(x))] = true;
    }
    Survey {
        speed,
        not_finite,
        is_wet,
    }
}

/// Returns the element of each particle's cell.
pub fn assign_cells(model: &Model, bricks: &Bricks, position: &[DVec3]) -> Vec<u32> {
    parallel::map_slice(position, |&x| {
        bricks.element(model.cell_of(x).map(i64::from))
    })
}

/// Sorts particles by element, and by id within an element.
pub fn reorder(bricks: &Bricks, cloud: &Cloud, cell: &[u32]) -> Sorted {
    let mut order: Vec<u32> = (0..cell.len() as u32).collect();
    order.par_sort_unstable_by_key(|&k| (cell[k as usize], cloud.id[k as usize]));
    let order: Vec<usize> = order.into_iter().map(|k| k as usize).collect();
    let mut start = vec![0; (CELLS * (bricks.wet + 1) + 1) as usize];
    for &element in cell {
        start[element as usize + 1] += 1;
    }
    for k in 1..start.len() {
        start[k] += start[k - 1];
    }
    let affine = |&k: &usize| cloud.affine.get(k).copied();
    Sorted {
        cell: order.iter().map(|&k| cell[k]).collect(),
        cloud: Cloud {
            position: order.iter().map(|&k| cloud.position[k]).collect(),
            velocity: order.iter().map(|&k| cloud.velocity[k]).collect(),
            affine: order.iter().filter_map(affine).collect(),
            id: order.iter().map(|&k| cloud.id[k]).collect(),
        },
        start,
    }
}

impl Sorted {
    /// Returns the particles of an element; empty for one outside wet slots.
    pub fn of(&self, element: u32) -> std::ops::Range<usize> {
        let element = element as usize;
        match self.start.get(element..element + 2) {
            Some(range) => range[0] as usize..range[1] as usize,
            None => 0..0,
        }
    }
}
