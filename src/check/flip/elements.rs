//! Where the elements of a substep lie in the device's arrays, and how those are read.

use std::ops::Range;

use glam::DVec3;

use crate::{
    check::engine::{Io, names},
    domain::bricks::{Bricks, CELLS},
    gpu::buffer::Buf,
    reference::flip::Faces,
    scene::step::Substep,
    solve::{SolveError, flip::buffers},
};

/// What [`Elements::faces_before`] reads.
pub(super) fn faces_kept() -> Vec<String> {
    names![
        buffers::FACE_VELOCITY,
        buffers::FACE_CHANGE,
        buffers::FACE_LAYER
    ]
}

/// Where the elements of a substep lie.
pub(in crate::check) struct Elements {
    pub(super) substep: Substep,
    pub(in crate::check) bricks: Bricks,
    /// Elements of the active bricks, slot 0 included.
    pub(in crate::check) cells: usize,
    /// Between planes of the device's arrays.
    pub(super) stride: usize,
}

/// The 27 steps to a cell and its neighbours.
pub(super) fn neighborhood() -> impl Iterator<Item = [i32; 3]> {
    (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1])
}

impl Elements {
    /// Elements of the active bricks.
    pub(in crate::check) fn active(&self) -> Range<usize> {
        CELLS as usize..self.cells
    }

    /// Elements of the bricks with water.
    pub(super) fn wet(&self) -> Range<usize> {
        CELLS as usize..(CELLS * (self.bricks.wet + 1)) as usize
    }

    /// The largest over a cell and the 26 about it.
    pub(in crate::check) fn largest_about(&self, element: usize, of: impl Fn(usize) -> f64) -> f64 {
        let near = |offset| of(self.bricks.near(element as u32, offset) as usize);
        neighborhood().map(near).fold(0.0, f64::max)
    }

    /// An array of cells.
    pub(super) fn scalars(&self, io: &Io<'_>, buffer: Buf<f32>) -> Result<Vec<f64>, SolveError> {
        io.scalars(buffer, self.cells)
    }

    /// Three planes as one vector a cell.
    pub(in crate::check) fn planes(
        &self,
        io: &Io<'_>,
        buffer: Buf<f32>,
    ) -> Result<Vec<DVec3>, SolveError> {
        Ok(self.joined(&io.after(buffer, 2 * self.stride + self.cells)?))
    }

    /// The same from before the pass.
    pub(in crate::check) fn planes_before(
        &self,
        io: &Io<'_>,
        buffer: Buf<f32>,
    ) -> Result<Vec<DVec3>, SolveError> {
        Ok(self.joined(&io.before(buffer, 2 * self.stride + self.cells)?))
    }

    fn joined(&self, values: &[f32]) -> Vec<DVec3> {
        let at = |k: usize| f64::from(values[k]);
        (0..self.cells)
            .map(|e| DVec3::new(at(e), at(self.stride + e), at(2 * self.stride + e)))
            .collect()
    }

    /// Velocities, changes and layers at faces.
    pub(super) fn faces(&self, io: &Io<'_>) -> Result<Faces, SolveError> {
        Ok(Faces {
            velocity: self.planes(io, buffers::FACE_VELOCITY)?,
            change: self.planes(io, buffers::FACE_CHANGE)?,
            layer: io.after(buffers::FACE_LAYER, self.cells)?,
            weight: Vec::new(),
        })
    }

    /// The same from before the pass.
    pub(super) fn faces_before(&self, io: &Io<'_>) -> Result<Faces, SolveError> {
        Ok(Faces {
            velocity: self.planes_before(io, buffers::FACE_VELOCITY)?,
            change: self.planes_before(io, buffers::FACE_CHANGE)?,
            layer: io.before(buffers::FACE_LAYER, self.cells)?,
            weight: Vec::new(),
        })
    }
}
