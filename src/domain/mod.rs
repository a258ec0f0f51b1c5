//! What every stage speaks: particles, meshes, signed distance, sampling, wave-maker motion.

pub mod bounds;
pub mod bricks;
pub mod bvh;
pub mod frame_range;
pub mod mesh;
pub mod mesh_file;
pub mod motion;
pub mod particles;
pub mod pbf;
pub mod poisson;
pub mod sampling;
pub mod signed_distance;
pub mod solver;
pub mod sparse_grid;
pub mod sph;
pub mod surface;
mod voxels;
