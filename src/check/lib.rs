//! Compares a substep on the GPU with the f64 reference, from the same inputs, pass by pass and as
//! a whole.
//!
//! Each pass has a row in the table (`COMPARISONS`) of its solver or effect. It names the pass,
//! the buffers that the pass overwrites and the comparison needs from before it, and a function
//! that runs the reference pass on the pass's inputs. The compared values are declared in the same
//! module (`entries!`): pass, field, unit, and a tolerance as an expression of magnitudes that each
//! value supplies. The `engine` reads the device's buffers, and the `table` keeps the worst values;
//! `substep` runs them along a traced substep.
//!
//! The comparisons of an effect are in one file of `effects`, for both solvers.

pub mod arithmetic;
mod comparison;
pub mod edges;
mod effects;
mod engine;
mod flip;
mod forces;
mod pbf;
pub mod pictures;
pub mod render;
mod solids;
mod sort;
mod substep;
pub mod table;
pub mod whitewater;

pub use substep::{check_flip, check_pbf};
pub use table::{CheckRow, CheckTable};

/// Result of comparing a substep with its reference passes.
#[derive(Clone, Debug, Default)]
pub struct Checked {
    /// Comparisons; empty if there is no water.
    pub table: CheckTable,
    /// Number of the substep in its frame, from 1; `None` if there is no water.
    pub substep: Option<u32>,
}
