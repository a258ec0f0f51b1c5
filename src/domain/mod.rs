//! What every stage speaks: particles, meshes, signed distance, sampling, wave-maker motion.

pub mod aggregates;
pub mod boundary;
pub mod bounds;
pub mod bricks;
pub mod budget;
pub mod bvh;
pub mod flip;
pub mod frame_range;
pub mod gauge;
pub mod holes;
pub mod mesh;
pub mod mesh_file;
pub mod motion;
pub mod particles;
pub mod pbf;
pub mod poisson;
pub mod probe;
pub mod sampling;
pub mod signed_distance;
pub mod solver;
pub mod sparse_grid;
pub mod sph;
pub mod statistics;
pub mod substep;
pub mod surface;
pub mod tolerance;
mod voxels;
