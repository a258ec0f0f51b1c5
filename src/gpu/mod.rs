//! Everything that touches the device and knows nothing of fluids.

pub mod adapter;
pub mod buffer;
pub mod program;
pub mod recording;
pub mod reflect;
pub mod shader;
pub mod sort;
