//! Everything that touches the device and knows nothing of fluids.

pub mod adapter;
pub mod shader;
