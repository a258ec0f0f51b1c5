//! Length of sunlight's path through water, on a coarse lattice.

use glam::DVec3;

use super::LevelSet;
use crate::parallel;

/// Distance between the lattice's nodes, voxels.
const PITCH: f64 = 4.0;

/// Samples between a plane of nodes and the one above at which water is looked up.
const LOOKS: u32 = 4;

/// Length of the path through water of light from a distant source, at nodes over a level
/// set's box.
#[derive(Clone, Debug, PartialEq)]
pub struct Sunlight {
    /// Nodes along each axis; the first lies at the box's least corner.
    pub nodes: [u32; 3],
    /// Distance between nodes, metres.
    pub pitch: f64,
    /// Path lengths, metres, x fastest.
    pub paths: Vec<f32>,
}

/// Returns the number of nodes along each axis over a box of `size` metres with voxels of `voxel`
/// metres, and their distance, metres.
pub fn nodes_over(size: DVec3, voxel: f64) -> ([u32; 3], f64) {
    let pitch = PITCH * voxel;
    let nodes = size
        .to_array()
        .map(|length| (length / pitch).ceil() as u32 + 1);
    (nodes, pitch)
}

impl Sunlight {
    /// Computes the paths through `water` for light from `towards`, a unit vector that points
    /// upward. Planes are swept downward, each one from the plane above, which blurs a shadow's
    /// edge by about one pitch per plane.
    pub fn new(water: &LevelSet, towards: DVec3) -> Self {
        let (nodes, pitch) = nodes_over(water.size, water.voxel);
        let [nx, ny, nz] = nodes.map(|n| n as usize);
        let mut paths = vec![0.0f32; nx * ny * nz];
        let step = towards * (pitch / towards.y);
        let mut above = vec![0.0f32; nx * nz];
        for y in (0..ny.saturating_sub(1)).rev() {
            let plane: Vec<f32> = parallel::map(0..nx * nz, |at| {
                let (x, z) = ((at % nx) as f64, (at / nx) as f64);
                let place = DVec3::new(x, y as f64, z) * pitch;
                let wet = (0..LOOKS)
                    .map(|k| place + step * ((f64::from(k) + 0.5) / f64::from(LOOKS)))
                    .filter(|&p| is_within(p, water.size) && water.value(p) > 0.0)
                    .count();
                let own = step.length() * wet as f64 / f64::from(LOOKS);
                let (x, z) = (x + step.x / pitch, z + step.z / pitch);
                (own + between(&above, [nx, nz], x, z)) as f32
            });
            for z in 0..nz {
                let row = (z * ny + y) * nx;
                paths[row..row + nx].copy_from_slice(&plane[z * nx..][..nx]);
            }
            above = plane;
        }
        Self {
            nodes,
            pitch,
            paths,
        }
    }

    /// Returns the path length at `p` in the box, metres from its least corner, trilinear
    /// between nodes.
    pub fn path(&self, p: DVec3) -> f64 {
        let nodes = self.nodes.map(|n| n as usize);
        let last = DVec3::from_array(nodes.map(|n| (n - 1) as f64));
        let at = (p / self.pitch).clamp(DVec3::ZERO, last);
        let low = at.floor().min((last - 1.0).max(DVec3::ZERO));
        let part = at - low;
        let mut sum = 0.0;
        for corner in 0..8usize {
            let mut index = [0; 3];
            let mut weight = 1.0;
            for axis in 0..3 {
                let bit = corner >> axis & 1;
                index[axis] = (low[axis] as usize + bit).min(nodes[axis] - 1);
                weight *= if bit == 1 {
                    part[axis]
                } else {
                    1.0 - part[axis]
                };
            }
            let element = (index[2] * nodes[1] + index[1]) * nodes[0] + index[0];
            sum += weight * f64::from(self.paths[element]);
        }
        sum
    }
}

fn is_within(p: DVec3, size: DVec3) -> bool {
    p.cmpge(DVec3::ZERO).all() && p.cmple(size).all()
}

/// Bilinear interpolation in a plane of nodes; light that enters through the sides has no path
/// behind it.
pub fn between(plane: &[f32], [nx, nz]: [usize; 2], x: f64, z: f64) -> f64 {
    let last = |n: usize| (n - 1) as f64;
    if !(x >= 0.0 && z >= 0.0 && x <= last(nx) && z <= last(nz)) {
        return 0.0;
    }
    let low = |x: f64, n: usize| (x as usize).min(n.saturating_sub(2));
    let (i, k) = (low(x, nx), low(z, nz));
    let (u, w) = (x - i as f64, z - k as f64);
    let at = |i: usize, k: usize| f64::from(plane[k.min(nz - 1) * nx + i.min(nx - 1)]);
    let row = |k: usize| (1.0 - u) * at(i, k) + u * at(i + 1, k);
    (1.0 - w) * row(k) + w * row(k + 1)
}
