//! Optical depth of drops and bubbles towards the sun, on a coarse lattice.

use glam::DVec3;

use super::density::Cloud;
use swell_domain::{level_set::sunlight::between, parallel};

/// Distance between the lattice's nodes, voxels, unless that gives too many nodes.
const PITCH: f64 = 2.0;
/// Number of nodes above which the spacing doubles.
const MOST_NODES: f64 = 4e6;
/// Distance between density samples on the path from one plane of nodes to the next, voxels.
const LOOK: f64 = 1.0;

/// Optical depths towards a distant source, at nodes over a cloud's grid.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Shade {
    /// Nodes along each axis; the first lies at the grid's least corner.
    pub(super) nodes: [u32; 3],
    /// Distance between nodes, metres.
    pub(super) pitch: f64,
    /// Optical depths, x fastest.
    pub(super) depths: Vec<f32>,
}

impl Shade {
    /// Computes the depths for light from `towards`, a unit vector that points upward. Planes are
    /// swept downward, each one from the plane above, which blurs a shadow's edge by about one
    /// pitch per plane.
    pub(super) fn new(cloud: &Cloud, towards: DVec3) -> Self {
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
            let plane: Vec<f32> = parallel::map(0..nx * nz, |at| {
                let (x, z) = ((at % nx) as f64, (at / nx) as f64);
                let place = cloud.corner + DVec3::new(x, y as f64, z) * pitch;
                let density = |k: usize| {
                    let [drops, bubbles] = cloud.densities(place + part * (k as f64 + 0.5));
                    drops + bubbles
                };
                let own = part.length() * (0..looks).map(density).sum::<f64>();
                let (x, z) = (x + step.x / pitch, z + step.z / pitch);
                (own + between(&above, [nx, nz], x, z)) as f32
            });
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
