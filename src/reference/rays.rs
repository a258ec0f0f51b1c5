//! Ground truth for the surfaces of a picture: rays cast in f64 through the field of the kernels.
//!
//! No voxels, splats or f32 approximations are involved. The level set only tells in which bricks
//! no surface can be.

use glam::DVec3;

use super::hash::pcg;
use swell_domain::{
    bvh::Bvh,
    eye::Eye,
    level_set::{
        FIRST, LevelSet, VOXELS,
        kernels::{KernelField, Kernels},
    },
    mesh::TriangleMesh,
    parallel,
};

/// Steps through a voxel of the level set: the thinnest sheet of particles is one and a half voxels
/// thick.
const STEPS: f64 = 2.0;
/// Bisections of the step in which a ray meets the surface.
const HALVINGS: u32 = 40;

/// What a pixel's ray hits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Depth along the optical axis of the first opaque surface, metres; infinite in the sky.
    pub opaque: f64,
    /// Depth along the optical axis of water in front of that, and the unit normal out of the
    /// water.
    pub water: Option<(f64, DVec3)>,
}

/// Returns which of 64 moments the ray through a pixel has; positions count from 0 after the
/// picture's padding, and `seed` is that of the sample.
pub fn moment(seed: u32, [x, y]: [u32; 2]) -> usize {
    (pcg(x ^ pcg(y ^ pcg(seed))) >> 26) as usize
}

/// Casts a ray through each pixel, rows from the top. The water is that of `kernels` in a box whose
/// floor is the ground, with particles of `spacing` metres; `solids` are opaque. Positions are
/// relative to the box's minimum corner.
pub fn cast(
    eye: &Eye,
    kernels: &Kernels,
    (size, spacing): (DVec3, f64),
    solids: &TriangleMesh,
) -> Vec<RayHit> {
    let [width, height] = eye.size.map(|n| n as usize);
    let pixels: Vec<usize> = (0..width * height).collect();
    cast_through(&pixels, eye, kernels, (size, spacing), solids)
}

/// Like [`cast`], through some pixels.
pub fn cast_through(
    pixels: &[usize],
    eye: &Eye,
    kernels: &Kernels,
    (size, spacing): (DVec3, f64),
    solids: &TriangleMesh,
) -> Vec<RayHit> {
    let tree = Bvh::new(solids);
    let coarse = LevelSet::of_kernels(kernels, size, spacing / VOXELS);
    let water = TracedWater {
        field: kernels.field(),
        coarse: &coarse,
    };
    parallel::map_slice(pixels, |&pixel| {
        let ray = eye.ray(pixel);
        let ground = match ray.y < 0.0 && eye.position.y > 0.0 {
            true => -eye.position.y / ray.y,
            false => f64::INFINITY,
        };
        let solid = tree.first_along(eye.position, ray, ground);
        let opaque = solid.map_or(ground, |(t, _)| t);
        RayHit {
            opaque,
            water: water.along(eye.position, ray, opaque),
        }
    })
}

struct TracedWater<'a> {
    field: KernelField<'a>,
    coarse: &'a LevelSet,
}

impl TracedWater<'_> {
    /// Returns where a ray from the air first meets the water before `bound`, and the normal there;
    /// on a side of the box, the normal of the side.
    fn along(&self, origin: DVec3, ray: DVec3, bound: f64) -> Option<(f64, DVec3)> {
        let low = -origin / ray;
        let high = (self.coarse.size - origin) / ray;
        let enter = low.min(high);
        let from = enter.max_element().max(0.0);
        let to = low.max(high).min_element().min(bound);
        if from >= to {
            return None;
        }
        let at = |t: f64| self.field.value(origin + t * ray);
        let step = self.coarse.voxel / STEPS / ray.length();
        if at(from + 1e-9 * step) > 0.0 {
            let axis = (0..3).find(|&axis| enter[axis] == from)?;
            let mut normal = DVec3::ZERO;
            normal[axis] = -ray[axis].signum();
            return Some((from, normal));
        }
        let mut last = from;
        let mut t = from;
        while last < to {
            t = (t + step).min(to);
            let p = origin + t * ray;
            if self.coarse.slot(p) >= FIRST && at(t) > 0.0 {
                let (mut dry, mut wet) = (last, t);
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (dry + wet);
                    match at(middle) > 0.0 {
                        true => wet = middle,
                        false => dry = middle,
                    }
                }
                let normal = -self.field.gradient(origin + wet * ray).normalize_or_zero();
                return Some((wet, normal));
            }
            last = t;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pool from wall to wall, half of it behind a plate: depths and normals are a plane's, and
    /// the plate hides water.
    #[test]
    fn a_pool_is_met_where_its_plane_is() {
        const D: f64 = 0.1;
        let size = DVec3::new(2.0, 2.0, 2.0);
        let place = |k: usize| (k as f64 + 0.5) * D;
        let pool: Vec<DVec3> = (0..20 * 8 * 20)
            .map(|k| DVec3::new(place(k % 20), place(k / 20 % 8), place(k / 160)))
            .collect();
        let kernels = Kernels::fit(&pool, size, D);
        let plate = TriangleMesh {
            vertices: vec![
                DVec3::new(0.0, 1.0, 0.0),
                DVec3::new(2.0, 1.0, 0.0),
                DVec3::new(2.0, 1.0, 1.0),
                DVec3::new(0.0, 1.0, 1.0),
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let eye = Eye {
            axis: [0.0; 2],
            position: DVec3::new(1.0, 1.8, 1.0),
            right: DVec3::X,
            up: -DVec3::Z,
            forward: -DVec3::Y,
            focal: 40.0,
            size: [32, 32],
        };
        let seen = cast(&eye, &kernels, (size, D), &plate);
        for (pixel, found) in seen.iter().enumerate() {
            // The upper half of the picture looks at z < 1.
            if pixel < 16 * 32 {
                assert!((found.opaque - 0.8).abs() < 1e-12 && found.water.is_none());
                continue;
            }
            let (depth, normal) = found.water.expect("a pool");
            assert_eq!(found.opaque, 1.8);
            // The field is calibrated so that its mean over a lattice cell is zero there; within a
            // cell it varies.
            assert!((depth - 1.0).abs() < 0.02 * D, "{depth}");
            assert!(normal.y > 0.99, "{normal}");
        }
    }
}
