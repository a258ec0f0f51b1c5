//! swell bakes ocean-wave shots to particle caches and renders them.
//!
//! The program `swell` is a thin layer over this library: what a command does, a function here does, without a terminal. Whoever wants a cache in a
//! pipeline of their own, a solver in a test, or one more stage, begins here.
//!
//! # A bake, and what is in it
//!
//! Without a driver this runs on the CPU, by the f64 reference; with `Device::Gpu(Gpu::default())` on the best adapter.
//!
//! ```
//! use std::{path::Path, sync::atomic::AtomicBool};
//!
//! use swell::{
//!     cache::CacheReader,
//!     domain::frame_range::FrameRange,
//!     scene::Scene,
//!     stage::{bake::{Request, bake}, device::Device},
//! };
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A metre of water in a box two metres wide. `Scene::load` reads a file.
//! let text = r#"
//!     shot = { name = "drop", frames = 24, frames_per_second = 24 }
//!     domain = { min = [0.0, 0.0, 0.0], max = [2.0, 2.0, 1.0] }
//!     water.block = [{ min = [0.0, 0.0, 0.0], max = [0.5, 1.0, 1.0] }]
//!     solver = { method = "pbf", pbf = { particle_spacing = 0.125 } }
//! "#;
//! let scene = Scene::parse(text, Path::new("drop.toml"), Path::new("."), &[])?;
//!
//! let folder = tempfile::tempdir()?;
//! let request = Request {
//!     scene,
//!     directory: folder.path().join("drop"),
//!     frames: FrameRange::inclusive(1, 2),      // the whole shot where `None`
//!     resume: false,
//!     from: None,
//!     device: Device::Cpu,
//!     time_passes: false,
//! };
//! let stop = AtomicBool::new(false);            // set by another thread, ends it after the current frame
//! let outcome = bake(&request, &stop, &mut |_event| {})?;
//! assert_eq!(outcome.last_frame, 2);
//!
//! let cache = CacheReader::open(&request.directory)?;
//! let [start, end] = [cache.read(0)?, cache.read(2)?];    // checksums are checked
//! assert_eq!(start.len(), 4 * 8 * 8);
//! assert_eq!(start.id, end.id);                 // no particle is lost, and each keeps its number
//! let height = |of: &[[f32; 3]]| of.iter().map(|at| f64::from(at[1])).sum::<f64>() / of.len() as f64;
//! assert!(height(&end.position) < height(&start.position), "metres, y up: it falls");
//! # Ok(())
//! # }
//! ```
//!
//! An error says by [`stage::Blame`] whose fault it is: the input's, the device's, the files', the numbers'. The program's exit codes follow from that.
//!
//! # Rooms
//!
//! Data flows one way, and stages share nothing but files:
//!
//! ```text
//! scene.toml -> scene -> stage::bake -> solve (GPU) -> cache -> stage::render -> render (GPU) -> images
//! ```
//!
//! | for | rooms |
//! | --- | --- |
//! | files in | [`scene`]: scene and look files, validated, and the plan of passes and buffers |
//! | a job from end to end | [`stage`]: [bake](stage::bake), [render](stage::render), [export](stage::export), [whitewater](stage::whitewater), [check](stage::check), [diff](stage::diff), [verify](stage::verify); wires the rooms, no terminal |
//! | files between | [`cache`]: frames, ledger, manifest on disk |
//! | computing | [`gpu`]: adapter, shader composition, passes recorded as data, scan and sort; [`solve`]: the particle solvers on the GPU; [`render`]: pictures of frames, by splats in screen space and by rays |
//! | how true it is | [`mod@reference`]: the same solvers on the CPU, in f64; [`check`]: a substep on the GPU against the same one in f64, pass by pass; [`compare`]: by how much two sets of values, two caches or two pictures differ |
//! | studies | [`experiment`]: runs them: points, resumable results, reports; [`study`]: what frames measure, curves, and the page that shows them |
//! | files out | [`export`]: files for other programs, from a frame's mesh or particles |
//! | what all speak | [`domain`]: particles, meshes, signed distance, wave-maker motion |
//! | the terminal | [`cli`]: arguments in, terminal out |
//!
//! # Units, axes, numbers
//!
//! SI units throughout; looks have degrees, millimetres on film, stops. Right-handed axes, y up. Names carry a unit where it is another one. A frame's positions
//! are `f32` about the scene's origin ([`scene::Scene::origin`]), which is zero but for scenes far from the world's.
//!
//! # More
//!
//! In the repository: `docs/first-shot.md` for users of the program, `docs/ARCHITECTURE.md` for who may import whom and how to add a pass, an effect,
//! a format, a stage; `docs/cache.md` for the formats, `docs/keys.md` for every key. Python reads caches by the package in `tools/python`.

pub use swell_cache as cache;
pub use swell_check as check;
pub use swell_cli as cli;
pub use swell_compare as compare;
pub use swell_domain as domain;
pub use swell_experiment as experiment;
pub use swell_export as export;
pub use swell_gpu as gpu;
pub use swell_reference as reference;
pub use swell_render as render;
pub use swell_scene as scene;
pub use swell_solve as solve;
pub use swell_stage as stage;
pub use swell_study as study;
