//! Types and algorithms that every stage shares: particles, meshes, signed distance, sampling,
//! wave-maker motion, probes.

/// Name of the program, as written to manifests and image metadata.
pub const PROGRAM: &str = "swell";
/// Version of the program, as written to manifests and image metadata. All crates of the workspace
/// share it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

pub mod absorber;
pub mod absorption;
pub mod aggregates;
pub mod air;
pub mod band;
pub mod body;
pub mod boundary;
pub mod bounds;
pub mod bricks;
pub mod budget;
pub mod bvh;
pub mod chunk;
pub mod cut_cell;
pub mod deep;
pub mod eye;
pub mod feature;
mod filled;
pub mod flip;
pub mod fog;
pub mod forces;
pub mod frame;
pub mod frame_range;
pub mod gauge;
pub mod holes;
pub mod initial_waves;
pub mod inside;
pub mod isosurface;
pub mod keep;
pub mod lanes;
pub mod level_set;
pub mod mesh;
pub mod mesh_file;
pub mod motion;
pub mod name_pattern;
pub mod named;
pub mod open_waves;
pub mod output;
pub mod parallel;
pub mod particles;
pub mod pbf;
pub mod period;
pub mod places;
pub mod poisson;
pub mod pose;
pub mod posix;
pub mod probe;
pub mod relaxation;
pub mod sampling;
pub mod shape;
pub mod shores;
pub mod signed_distance;
pub mod solitary_wave;
pub mod solver;
pub mod sources;
pub mod sparse_grid;
pub mod sph;
pub mod statistics;
pub mod substep;
pub mod surface;
pub mod text;
pub mod thin;
pub mod tolerance;
pub mod vdb;
mod voxels;
pub mod water_mesh;
pub mod wet;
pub mod whitewater;
