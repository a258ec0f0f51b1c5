//! GPU layer: devices, shaders, buffers and recorded passes, independent of fluids.

pub mod adapter;
pub mod bindings;
pub mod buffer;
pub mod ceilings;
mod compiled;
pub mod copies;
mod edited;
mod error;
mod hidden;
pub mod imprecision;
pub mod operations;
pub mod program;
pub mod raster;
pub mod readback;
pub mod recording;
pub mod reflect;
pub mod rounding;
pub mod shader;
pub mod sort;
mod statements;
pub mod texture;
mod timer;
pub mod traffic;
mod uniforms;
pub mod variants;
