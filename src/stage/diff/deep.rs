//! Compares the deep cells of two frames.

use std::collections::BTreeMap;

use glam::DVec3;
use serde_json::{Value as Json, json};

use swell_compare::streams::{self, Difference};
use swell_domain::{
    deep::Deep,
    sparse_grid::{EDGE, Leaf, SparseGrid, VOXELS},
};

/// Differences of the cells and their values.
pub(super) fn differences(a: &Deep, b: &Deep) -> Vec<Difference> {
    let settings = streams::keys("deep_grid", &settings(a), &settings(b));
    if !settings.is_empty() {
        return settings;
    }
    let [depth_a, depth_b] = [a, b].map(|deep| grid(deep, &deep.depth));
    let [velocity_a, velocity_b] = [a, b].map(|deep| grid(deep, &deep.velocity));
    let mut found = vec![
        streams::grids("depth", &depth_a, &depth_b),
        streams::grids("deep velocity", &velocity_a, &velocity_b),
    ];
    found.retain(|grid| grid.different > 0);
    found.into_iter().map(Difference::Grid).collect()
}

fn settings(deep: &Deep) -> Json {
    let grid = &deep.grid;
    json!({
        "cell_size": grid.cell_size,
        "cells": grid.cells,
        "per_edge": grid.per_edge,
        "band": grid.band,
    })
}

/// The values of the cells as a sparse grid.
fn grid<T: Copy + Default>(deep: &Deep, values: &[T]) -> SparseGrid<T> {
    let mut leaves: BTreeMap<[i32; 3], Leaf<T>> = BTreeMap::new();
    for (cell, value) in deep.cell.iter().zip(values) {
        let at = cell.map(|k| k as i32);
        let origin = at.map(|k| k / EDGE * EDGE);
        let leaf = leaves.entry(origin).or_insert_with(|| Leaf {
            origin,
            active: [0; 8],
            values: vec![T::default(); VOXELS],
        });
        let [x, y, z] = at.map(|k| (k % EDGE) as usize);
        let element = 64 * x + 8 * y + z;
        leaf.active[element / 64] |= 1 << (element % 64);
        leaf.values[element] = *value;
    }
    SparseGrid {
        origin: DVec3::ZERO,
        voxel_size: deep.grid.cell_size,
        background: T::default(),
        leaves: leaves.into_values().collect(),
        inside: Vec::new(),
    }
}
