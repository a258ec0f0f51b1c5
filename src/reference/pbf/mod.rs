//! Position-based fluids (Macklin and Müller 2013), the same model as on the GPU.
//!
//! Positions are relative to the domain's minimum corner, in metres, in sorted order. [`passes`]
//! and [`effects`] are the reference passes of the GPU passes; [`Pbf`] runs whole frames;
//! [`constraint`] solves exactly what iterations approach.

pub mod constraint;
pub mod effects;
pub mod forces;
mod model;
mod pairs;
pub mod passes;
mod solver;

pub use model::{Colour, Model, Substep};
pub use solver::{Pbf, Sorted, Visit, iterate, iterate_among, local};
