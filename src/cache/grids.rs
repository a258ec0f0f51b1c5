//! What a bake keeps of each frame's water beside its particles.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::vdb::Grids;
use swell_domain::{particles::Particles, sparse_grid::Precision, surface::Raster};

/// Grids that each frame has, as the manifest records them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GridRecord {
    /// Whether there is a level set `surface`.
    pub surface: bool,
    /// Whether there is a staggered `vel`.
    pub velocity: bool,
    /// Metres.
    pub voxel_size: f64,
    /// Corner of voxel (0, 0, 0), metres, about the manifest's origin: the domain's least corner.
    pub origin: [f64; 3],
    /// How values are kept.
    pub precision: Precision,
}

impl GridRecord {
    /// The grids of a frame: a function of its particles, so that a resumed bake gives the same
    /// bytes. `particle_spacing` in metres.
    pub fn grids(&self, particles: &Particles, particle_spacing: f64) -> Grids {
        let raster = Raster {
            origin: DVec3::from_array(self.origin),
            voxel_size: self.voxel_size,
            particle_spacing,
        };
        Grids {
            surface: self.surface.then(|| raster.surface(particles)),
            velocity: self.velocity.then(|| raster.velocity(particles)),
        }
    }

    /// Names of the grids in each file.
    pub fn names(&self) -> impl Iterator<Item = &'static str> + use<> {
        let grids = [(self.surface, "surface"), (self.velocity, "vel")];
        grids
            .into_iter()
            .filter_map(|(is_kept, name)| is_kept.then_some(name))
    }

    /// Refuses what no scene asks for.
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
