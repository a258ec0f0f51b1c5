//! Layout of a substep's elements in the device's arrays, and reading of these.

use std::ops::Range;

use glam::DVec3;

use crate::comparison::{TracedBuffers, names};
use swell_domain::bricks::{Bricks, CELLS};
use swell_gpu::buffer::Buf;
use swell_reference::flip::Faces;
use swell_scene::step::Substep;
use swell_solve::{SolveError, flip::buffers};

/// Buffers that [`Elements::faces`] reads.
pub(super) fn faces_kept() -> Vec<String> {
    names![
        buffers::FACE_VELOCITY,
        buffers::FACE_CHANGE,
        buffers::FACE_LAYER
    ]
}

/// Layout of a substep's elements.
pub(crate) struct Elements {
    pub(super) substep: Substep,
    pub(crate) bricks: Bricks,
    /// Number of elements of the active bricks, including slot 0.
    pub(crate) cells: usize,
    /// Distance between planes of the device's arrays.
    pub(super) stride: usize,
}

/// Iterates over the 27 offsets to a cell and its neighbours.
pub(super) fn neighborhood() -> impl Iterator<Item = [i32; 3]> {
    (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1])
}

impl Elements {
    /// Returns the elements of the active bricks.
    pub(crate) fn active(&self) -> Range<usize> {
        CELLS as usize..self.cells
    }

    /// Returns the elements of the bricks with water.
    pub(super) fn wet(&self) -> Range<usize> {
        CELLS as usize..(CELLS * (self.bricks.wet + 1)) as usize
    }

    /// Returns the largest value over a cell and the 26 cells around it.
    pub(crate) fn largest_about(&self, element: usize, of: impl Fn(usize) -> f64) -> f64 {
        let near = |offset| of(self.bricks.near(element as u32, offset) as usize);
        neighborhood().map(near).fold(0.0, f64::max)
    }

    /// Reads an array of cells.
    pub(crate) fn scalars(
        &self,
        view: &TracedBuffers<'_>,
        buffer: Buf<f32>,
    ) -> Result<Vec<f64>, SolveError> {
        view.scalars(buffer, self.cells)
    }

    /// Reads three planes as one vector per cell.
    pub(crate) fn planes(
        &self,
        view: &TracedBuffers<'_>,
        buffer: Buf<f32>,
    ) -> Result<Vec<DVec3>, SolveError> {
        let values = view.scalars(buffer, 2 * self.stride + self.cells)?;
        let plane = |k: usize, e: usize| values[k * self.stride + e];
        let vector = |e: usize| DVec3::new(plane(0, e), plane(1, e), plane(2, e));
        Ok((0..self.cells).map(vector).collect())
    }

    /// Reads velocities, changes and layers at faces.
    pub(super) fn faces(&self, view: &TracedBuffers<'_>) -> Result<Faces, SolveError> {
        Ok(Faces {
            velocity: self.planes(view, buffers::FACE_VELOCITY)?,
            change: self.planes(view, buffers::FACE_CHANGE)?,
            layer: view.get(buffers::FACE_LAYER, self.cells)?,
            weight: Vec::new(),
        })
    }
}
