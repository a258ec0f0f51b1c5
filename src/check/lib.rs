//! A substep on the GPU against the f64 reference, from the same inputs, pass by pass and as a whole.
//!
//! A pass has a twin: a row in the table of its solver or effect (`TWINS`) that names the pass and the buffers that it
//! overwrites and the twin wants from before, and a function from what the pass read to what it should have written.
//! What is compared is declared beside it (`entries!`): pass, field, unit, and the tolerance as an expression of
//! magnitudes, which each value hands in. The `engine` reads the device, and the `table` keeps what is furthest out.
//!
//! An effect's twins stand in one file of `effects`, for both solvers.

pub mod edges;
mod effects;
mod engine;
pub mod flip;
pub mod pbf;
pub mod pictures;
pub mod render;
mod sort;
pub mod table;
pub mod whitewater;

pub use table::{Row, Table};

/// A substep held against its twins.
#[derive(Clone, Debug, Default)]
pub struct Checked {
    /// What was found; empty where there is no water.
    pub table: Table,
    /// Which substep of its frame it was, from 1; `None` where there is no water.
    pub substep: Option<u32>,
}
