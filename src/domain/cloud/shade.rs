//! How deep in drops and bubbles a place lies as the sun sees it, on a coarse lattice.

use glam::DVec3;
use rayon::prelude::*;

use super::Cloud;
use crate::level_set::sunlight::between;

/// Voxels between the lattice's nodes, where there are not too many.
const PITCH: f64 = 2.0;
/// Nodes above which they lie twice as far from each other.
const MOST_NODES: f64 = 4e6;
/// Voxels between places at which density is looked up on the way from a plane of nodes to the one above.
const LOOK: f64 = 1.0;

/// Optical depths towards a distant source, at nodes over a cloud's grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Shade {
    /// Nodes along each axis; the first stand on the grid's least corner.
    pub nodes: [u32; 3],
    /// Metres between nodes.
    pub pitch: f64,
    /// Optical depths, x fastest.
    pub depths: Vec<f32>,
}

impl Shade {
    /// Of a cloud in light straight from `towards`, a unit vector that points upward: plane by plane downward, each from the one above,
    /// which spreads a shadow's edge over about a pitch for every plane that it falls through.
    pub fn new(cloud: &Cloud, towards: DVec3) -> Self {
        let size = cloud.size();
        let mut pitch = PITCH * cloud.voxel;
        let nodes_of = |pitch: f64| (size / pitch).ceil() + 1.0;
        while nodes_of(pitch).element_product() > MOST_NODES {
            pitch *= 2.0;
        }
        let nodes = nodes_of(pitch).to_array().map(|n| n as u32);
        let [nx, ny, nz] = nodes.map(|n| n as usize);
        let mut depths = vec![0.0f32; nx * ny * nz];
        let step = towards * (pitch / towards.y);
        let looks = (step.length() / (LOOK * cloud.voxel)).ceil() as usize;
        let part = step / looks as f64;
        let mut above = vec![0.0f32; nx * nz];
        for y in (0..ny - 1).rev() {
            let plane: Vec<f32> = (0..nx * nz)
                .into_par_iter()
                .map(|at| {
                    let (x, z) = ((at % nx) as f64, (at / nx) as f64);
                    let place = cloud.corner + DVec3::new(x, y as f64, z) * pitch;
                    let density = |k: usize| {
                        let [drops, bubbles] = cloud.densities(place + part * (k as f64 + 0.5));
                        drops + bubbles
                    };
                    let own = part.length() * (0..looks).map(density).sum::<f64>();
                    let (x, z) = (x + step.x / pitch, z + step.z / pitch);
                    (own + between(&above, [nx, nz], x, z)) as f32
                })
                .collect();
            for (z, row) in plane.chunks_exact(nx).enumerate() {
                let start = (z * ny + y) * nx;
                depths[start..start + nx].copy_from_slice(row);
            }
            above = plane;
        }
        Self {
            nodes,
            pitch,
            depths,
        }
    }
}
