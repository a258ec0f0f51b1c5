//! Jobs: each wires rooms together from a typed request to a typed result. No terminal, no printing.

pub mod bake;
pub mod inspect;
pub mod prepare;
pub mod render;
pub mod verify;
