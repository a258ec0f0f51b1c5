//! swell bakes ocean-wave shots to particle caches and renders them.
//!
//! Data flows one way, and stages share nothing but files:
//!
//! ```text
//! scene.toml -> scene -> stage::bake -> solve (GPU) -> cache -> stage::render -> render (GPU) -> images
//! ```
//!
//! - [`domain`]: what every stage speaks: particles, meshes, signed distance, wave-maker motion.
//! - [`scene`]: scene and look files, validated, and the plan of passes and buffers.
//! - [`gpu`]: adapter, shader composition, passes recorded as data, scan and sort.
//! - [`solve`]: the particle solvers on the GPU.
//! - [`mod@reference`]: the same solvers on the CPU, in f64: what the GPU is held against.
//! - [`check`]: a substep on the GPU against the same one in f64, pass by pass.
//! - [`cache`]: frames, ledger, manifest on disk.
//! - [`render`]: screen-space fluid rendering.
//! - [`export`]: files for other programs, from a frame's mesh or particles.
//! - [`compare`]: by how much two sets of values, two caches or two pictures differ.
//! - [`study`]: what frames measure, curves, and the page that shows them.
//! - [`experiment`]: runs studies: points, resumable results, reports.
//! - [`stage`]: wires the rooms into jobs; no terminal.
//! - [`cli`]: arguments in, terminal out.

// One way to print, which takes care of writes that fail: cli::output.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod cache;
pub mod check;
pub mod cli;
pub mod compare;
pub mod domain;
pub mod experiment;
pub mod export;
pub mod gpu;
#[cfg(feature = "mutants")]
pub mod mutants;
pub mod reference;
pub mod render;
pub mod scene;
pub mod solve;
pub mod stage;
pub mod study;
