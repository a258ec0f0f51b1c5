//! Values on the elements of bricks.

use glam::DVec3;

use swell_domain::bricks::{Bricks, CELLS};
use swell_domain::parallel;

/// Evaluates a function on the cells of all active bricks, in the order of the elements; slot 0 is
/// zero.
pub(super) fn per_cell<T: Clone + Default + Send>(
    bricks: &Bricks,
    value: impl Fn(u32) -> T + Sync,
) -> Vec<T> {
    let mut values = vec![T::default(); CELLS as usize * bricks.slots()];
    let active = CELLS as usize..CELLS as usize * (bricks.active as usize + 1);
    parallel::for_chunks_mut(&mut values[active], CELLS as usize, |brick, values| {
        for (cell, element) in values.iter_mut().zip(CELLS * (brick as u32 + 1)..) {
            *cell = value(element);
        }
    });
    values
}

/// Returns the minimum corner of an element's cell, in cells.
pub(super) fn corner(bricks: &Bricks, element: u32) -> DVec3 {
    DVec3::from_array(bricks.cell(element).map(f64::from))
}

/// Converts values at lower faces, one vector per cell, to three planes in sequence, the layout of
/// the GPU.
pub fn planes(faces: &[DVec3]) -> Vec<f64> {
    (0..3)
        .flat_map(|axis| faces.iter().map(move |face| face[axis]))
        .collect()
}

/// Iterates over the 27 offsets to a cell and its neighbours, x fastest.
pub(super) fn neighborhood() -> impl Iterator<Item = [i32; 3]> {
    (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1])
}

/// Returns the offset of `step` cells along an axis.
pub(super) fn along(axis: usize, step: i32) -> [i32; 3] {
    std::array::from_fn(|k| if k == axis { step } else { 0 })
}
