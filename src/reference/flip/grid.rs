//! Values on the elements of bricks.

use glam::DVec3;
use rayon::prelude::*;

use swell_domain::bricks::{Bricks, CELLS};

/// One value a cell of every active brick, in the order of the elements; zero in slot 0.
pub(super) fn per_cell<T: Clone + Default + Send>(
    bricks: &Bricks,
    value: impl Fn(u32) -> T + Sync,
) -> Vec<T> {
    let mut values = vec![T::default(); CELLS as usize * bricks.slots()];
    let active = CELLS as usize..CELLS as usize * (bricks.active as usize + 1);
    values[active]
        .par_chunks_mut(CELLS as usize)
        .enumerate()
        .for_each(|(brick, values)| {
            for (cell, element) in values.iter_mut().zip(CELLS * (brick as u32 + 1)..) {
                *cell = value(element);
            }
        });
    values
}

/// Least corner of an element's cell, in cells.
pub(super) fn corner(bricks: &Bricks, element: u32) -> DVec3 {
    DVec3::from_array(bricks.cell(element).map(f64::from))
}

/// Values at lower faces, one vector a cell, as three planes one after the other: as the GPU has them.
pub fn planes(faces: &[DVec3]) -> Vec<f64> {
    (0..3)
        .flat_map(|axis| faces.iter().map(move |face| face[axis]))
        .collect()
}

/// The 27 steps to a cell and its neighbours, x fastest.
pub(super) fn neighborhood() -> impl Iterator<Item = [i32; 3]> {
    (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1])
}

/// One cell on along an axis, `step` times.
pub(super) fn along(axis: usize, step: i32) -> [i32; 3] {
    std::array::from_fn(|k| if k == axis { step } else { 0 })
}
