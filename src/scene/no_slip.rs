//! No-slip walls.

use super::{Scene, Wall};

impl Scene {
    /// Returns the mask of no-slip walls, made of [`Wall::bit`].
    pub fn no_slip_bits(&self) -> u32 {
        self.no_slip.iter().map(Wall::bit).sum()
    }
}
