//! Disk space that a bake needs.

use std::{io, path::Path};

use swell_cache::{CacheError, frame, vdb};
use swell_domain::{keep::Keep, particles::Particles};
use swell_scene::Scene;

use super::{BakePlan, manifest::grid_record};

/// Disk space that the frames still to be baked will need, and that is free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DiskSpace {
    /// Bytes of the frames that will be computed and kept, each assumed as large as the start's. An
    /// underestimate if emitters add water.
    pub bytes: u64,
    /// Whether frames are compressed; `bytes` is then their uncompressed size.
    pub is_compressed: bool,
    /// Free bytes on the disk; `None` if the system does not report them.
    pub free: Option<u64>,
}

impl DiskSpace {
    /// Space for the frames of a plan from `first` on, in the cache `directory`.
    ///
    /// # Errors
    /// Particles that cannot be stored in a frame.
    pub fn of(directory: &Path, plan: &BakePlan<'_>, first: u32) -> Result<Self, CacheError> {
        let scene = plan.scene;
        let frame = frame_bytes(scene, &plan.start.particles)?;
        Ok(Self {
            bytes: bytes_of(scene, frame, first, plan.last),
            is_compressed: scene.compression.is_some(),
            free: swell_cache::free_bytes(directory),
        })
    }

    /// The free bytes, if there are fewer than the frames need.
    pub fn short_of(self) -> Option<u64> {
        self.free.filter(|&free| free < self.bytes)
    }
}

/// Bytes of what stays on disk of these frames, each with these bytes of particles and of grids.
pub(super) fn bytes_of(scene: &Scene, [particles, grids]: [u64; 2], first: u32, last: u32) -> u64 {
    let keep = scene.keep.unwrap_or(Keep::All);
    let bytes = (first..=last).map(|frame| match keep.keeps(frame) || frame == last {
        true => particles + grids,
        false => grids,
    });
    bytes.sum()
}

/// Bytes of a frame's particle file, and of its grids if the scene asks for them.
pub(super) fn frame_bytes(scene: &Scene, particles: &Particles) -> Result<[u64; 2], CacheError> {
    let stamp = frame::Stamp {
        program: swell_domain::PROGRAM,
        program_version: swell_domain::VERSION,
        shot: &scene.shot.name,
        frame: 0,
        time: 0.0,
        origin: scene.origin,
    };
    // Writing to a sink cannot fail, so an error is a fault of the content.
    let unfit = |error: io::Error| CacheError::Unfit(error.to_string());
    let own = frame::length(&stamp, particles).map_err(unfit)?;
    let grids = match &scene.grids {
        Some(grids) => {
            let record = grid_record(scene, grids);
            let grids = record
                .grids(particles, scene.particle_spacing())
                .moved(scene.origin);
            let written = vdb::encode(&mut io::sink(), &stamp, &grids, record.precision);
            written.map_err(unfit)?.bytes
        }
        None => 0,
    };
    Ok([own, grids])
}
