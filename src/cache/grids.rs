//! The grids that a bake keeps of each frame's water besides its particles.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::vdb::Grids;
use swell_domain::{particles::Particles, sparse_grid::Precision, surface::Raster};

/// Grids that each frame has, as recorded in the manifest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GridRecord {
    /// Whether there is a level set `surface`, metres.
    pub surface: bool,
    /// Whether there is a staggered velocity grid `vel`, m/s.
    pub velocity: bool,
    /// Edge length of a voxel, metres.
    pub voxel_size: f64,
    /// Least corner of the domain, and of voxel (0, 0, 0), metres, relative to the manifest's
    /// origin.
    pub origin: [f64; 3],
    /// Floating-point precision of the stored values.
    pub precision: Precision,
}

impl GridRecord {
    /// Computes the grids of a frame. They depend only on its particles, so that a resumed bake
    /// gives the same bytes. `particle_spacing` is in metres.
    pub fn grids(&self, particles: &Particles, particle_spacing: f64) -> Grids {
        let raster = Raster {
            origin: DVec3::from_array(self.origin),
            voxel_size: self.voxel_size,
            particle_spacing,
        };
        let water = particles.water();
        Grids {
            surface: self.surface.then(|| raster.surface(&water)),
            velocity: self.velocity.then(|| raster.velocity(&water)),
        }
    }

    /// Names of the grids in each file.
    pub fn names(&self) -> impl Iterator<Item = &'static str> + use<> {
        let grids = [(self.surface, "surface"), (self.velocity, "vel")];
        grids
            .into_iter()
            .filter_map(|(is_kept, name)| is_kept.then_some(name))
    }

    /// Refuses a record that no scene could ask for.
    pub(super) fn check(&self) -> Result<(), String> {
        let size = self.voxel_size;
        if !(size > 0.0 && size.is_finite() && self.origin.iter().all(|x| x.is_finite())) {
            return Err(format!("grids of {size} m from {:?}", self.origin));
        }
        if !(self.surface || self.velocity) {
            return Err("grids without any grid".to_owned());
        }
        Ok(())
    }
}
