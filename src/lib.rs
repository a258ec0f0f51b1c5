//! swell bakes ocean-wave shots to particle caches and renders them.
//!
//! The program `swell` is a thin layer over this library: every command corresponds to a function
//! here that needs no terminal. Start here to use caches in your own pipeline, to run a solver in a
//! test, or to add a stage.
//!
//! # Example: bake a scene and read the result
//!
//! This runs on the CPU with the f64 reference and needs no driver. Without `device` the best
//! adapter is used.
//!
//! ```
//! use swell::{cache::CacheReader, files::SceneBuilder, stage::device::Device};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A column of water one metre high in a box two metres wide. `files::load_scene` reads a file.
//! let scene = SceneBuilder::new("drop")
//!     .frames(24, 24.0)
//!     .domain([0.0; 3], [2.0, 2.0, 1.0])
//!     .block([0.0; 3], [0.5, 1.0, 1.0])
//!     .pbf(0.125)
//!     .build()?;
//!
//! let folder = tempfile::tempdir()?;
//! let directory = folder.path().join("drop");
//! let outcome = swell::bake(&scene).to(&directory).device(Device::Cpu).frames(1..=2).run()?;
//! assert_eq!(outcome.last_frame, 2);
//!
//! let cache = CacheReader::open(&directory)?;
//! let [start, end] = [cache.read(0)?, cache.read(2)?];    // verifies checksums
//! assert_eq!(start.len(), 4 * 8 * 8);
//! assert_eq!(start.id, end.id);                 // no particle is lost, and each keeps its id
//! let height = |of: &[[f32; 3]]| {
//!     of.iter().map(|at| f64::from(at[1])).sum::<f64>() / of.len() as f64
//! };
//! assert!(height(&end.position) < height(&start.position), "metres, y up: it falls");
//! # Ok(())
//! # }
//! ```
//!
//! `examples/` has programs that bake and render a drop, make waves with FLIP, read a cache into
//! arrays, run a GPU pass of their own beside its reference, and observe substeps
//! (`cargo run --release --example bake_and_render`).
//!
//! [`stage::Blame`]`::from(&error)` tells where the fault of an error lies: in the input, the
//! device, the files, or the numbers. The program's exit codes follow from it.
//!
//! # Crates
//!
//! Data flows in one direction, and stages share nothing but files:
//!
//! ```text
//! scene.toml -> scene -> stage::bake -> solve (GPU) -> cache
//! cache -> stage::render -> render (GPU) -> images
//! ```
//!
//! - Input: [`scene`] has scenes and looks as validated types; [`files`] reads them, and studies,
//!   from the files that users write.
//! - Complete jobs: [`stage`] combines the other crates without a terminal. Its jobs are
//!   [bake](stage::bake), [render](stage::render), [export](stage::export),
//!   [whitewater](stage::whitewater), [wet](stage::wet), [check](stage::check),
//!   [diff](stage::diff) and [verify](stage::verify), among others.
//! - Intermediate files: [`cache`] stores frames, ledger and manifest on disk.
//! - Computation: [`gpu`] provides adapters, shader composition, passes recorded as data, scan and
//!   sort; [`solve`] the particle solvers on the GPU; [`mod@render`] pictures of frames, by
//!   screen-space splats and by rays.
//! - Accuracy: [`mod@reference`] implements the same solvers on the CPU in f64; [`check`] compares
//!   a substep on the GPU with the reference, pass by pass; [`compare`] measures how much two sets
//!   of values, two caches or two pictures differ.
//! - Studies: [`experiment`] runs points, resumes results and writes reports; [`study`] measures
//!   frames, draws curves and builds the page that shows them.
//! - Output files: [`export`] writes files for other programs from a frame's mesh or particles.
//! - Shared vocabulary: [`domain`] defines particles, meshes, signed distance and wave-maker
//!   motion.
//! - Terminal: [`cli`] parses arguments and prints results.
//!
//! # Features
//!
//! Both are on by default. Without one, what needs it fails with
//! [`MissingFeature`](domain::feature::MissingFeature).
//!
//! - `charts`: charts of studies and contact sheets as PNG ([`study::raster`]), by resvg.
//! - `perceptual`: the SSIMULACRA 2 score of pictures ([`compare::perceptual`]), which comparisons
//!   of renders and checks of colour contain.
//!
//! # Units and axes
//!
//! All quantities are in SI units; looks also use degrees, millimetres on film, and stops. Axes are
//! right-handed with y up. Names carry a unit if it is a different one. A frame's positions are
//! `f32` relative to the scene's origin ([`scene::Scene::origin`]), which is zero except for scenes
//! far from the world's origin.
//!
//! # More
//!
//! In the repository: `docs/first-shot.md` introduces the program, `docs/ARCHITECTURE.md` describes
//! the dependencies between crates and how to add a pass, an effect, a format or a stage,
//! `docs/cache.md` the file formats, and `docs/keys.md` every key. The package in `tools/python`
//! reads caches from Python.

mod jobs;

pub use jobs::{Bake, Render, bake, render};

pub use swell_cache as cache;
pub use swell_check as check;
pub use swell_cli as cli;
pub use swell_compare as compare;
pub use swell_domain as domain;
pub use swell_experiment as experiment;
pub use swell_export as export;
pub use swell_files as files;
pub use swell_gpu as gpu;
pub use swell_reference as reference;
pub use swell_render as render;
pub use swell_scene as scene;
pub use swell_solve as solve;
pub use swell_stage as stage;
pub use swell_study as study;
