//! stage.

pub mod verify;
