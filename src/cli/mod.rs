//! cli.

pub mod interrupt;
pub mod verify;
