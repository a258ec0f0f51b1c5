//! `bake --dry-run`: predicts a bake without a device and without writing anything.

use std::io;

use super::{
    BakeError, Beginning, Request, beginning, check_count, check_first, grid_record, last_frame,
};
use crate::prepare::{Start, Volume};
use swell_cache::{CacheError, CacheReader, Parent, frame, refuse_occupied, vdb};
use swell_domain::{keep::Keep, particles::Particles};
use swell_scene::Scene;

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
    /// Space for the frames `first` to `last` of the request's cache, given the particles at its
    /// start.
    pub(super) fn of(
        request: &Request,
        start: &Particles,
        first: u32,
        last: u32,
    ) -> Result<Self, CacheError> {
        Ok(Self {
            bytes: bytes_of(&request.scene, start, first, last)?,
            is_compressed: request.scene.compression.is_some(),
            free: swell_cache::free_bytes(&request.directory),
        })
    }

    /// The free bytes, if there are fewer than the frames need.
    pub fn short_of(self) -> Option<u64> {
        self.free.filter(|&free| free < self.bytes)
    }
}

/// Prediction of a bake.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Expected {
    /// First frame that would be computed.
    pub first: u32,
    /// Last frame that would be computed.
    pub last: u32,
    /// Number of frames that exist from an earlier bake, not counting the start.
    pub standing: u32,
    /// Number of particles at the start.
    pub particles: usize,
    /// Particles left out because a solid covers them or they lie behind a wall.
    pub removed: usize,
    /// Volume of water at the start.
    pub volume: Volume,
    /// Disk space that the frames would need, and that is free.
    pub disk: DiskSpace,
    /// The frame of another cache that a new bake would begin from, if it does.
    pub parent: Option<Parent>,
    /// Warnings about the scene and its beginning, a sentence each.
    pub warnings: Vec<String>,
}

/// Examines the scene and the existing cache as a bake would; ignores which device the cache was
/// baked on.
///
/// # Errors
/// Those of [`bake`](super::bake) that need no device.
pub fn expected(request: &Request) -> Result<Expected, BakeError> {
    let scene = &request.scene;
    let last = last_frame(request)?;
    let Beginning {
        start,
        clock,
        parent,
        notes,
    } = beginning(request, last)?;
    check_count(scene, &start, parent.as_ref(), last)?;
    let directory = &request.directory;
    let stands = request.resume && swell_cache::exists(directory);
    let (first, standing) = if stands {
        let cached = CacheReader::open(directory)?;
        let text = scene.to_toml(&swell_scene::asset_path);
        if let Some(difference) = swell_scene::physics_difference(cached.scene_toml(), &text)? {
            return Err(BakeError::OtherPhysics {
                directory: directory.clone(),
                difference,
            });
        }
        let newest = cached.last_frame();
        (newest + 1, newest - cached.first_frame())
    } else {
        refuse_occupied(directory)?;
        (clock.frame + 1, 0)
    };
    check_first(request, first)?;
    let disk = DiskSpace::of(request, &start.particles, first, last)?;
    Ok(Expected {
        first,
        last,
        standing,
        particles: start.particles.len(),
        removed: start.removed,
        disk,
        parent,
        volume: start.volume(scene),
        warnings: [start.warnings(scene), notes].concat(),
    })
}

/// Bytes of all frames of a full bake including the start, each assumed as large as the start's.
///
/// # Errors
/// A fault in the scene's solids, or particles that cannot be stored in a frame.
pub fn shot_bytes(scene: &Scene) -> Result<u64, BakeError> {
    let start = Start::of(scene)?;
    let [particles, grids] = frame_bytes(scene, &start.particles)?;
    let later = bytes_of(scene, &start.particles, 1, scene.shot.frames)?;
    Ok(particles + grids + later)
}

/// Bytes of what stays on disk of these frames, each assumed as large as the start.
fn bytes_of(scene: &Scene, start: &Particles, first: u32, last: u32) -> Result<u64, CacheError> {
    let [particles, grids] = frame_bytes(scene, start)?;
    let keep = scene.keep.unwrap_or(Keep::All);
    let bytes = (first..=last).map(|frame| match keep.keeps(frame) || frame == last {
        true => particles + grids,
        false => grids,
    });
    Ok(bytes.sum())
}

/// Bytes of a frame's particle file, and of its grids if the scene asks for them.
fn frame_bytes(scene: &Scene, particles: &Particles) -> Result<[u64; 2], CacheError> {
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
    let own = frame::encode(&mut io::sink(), &stamp, particles).map_err(unfit)?;
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
    Ok([own.bytes, grids])
}
