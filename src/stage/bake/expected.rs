//! `bake --dry-run`: what a bake would make, without a device, and with nothing written.

use std::io;

use super::{
    BakeError, Beginning, Request, beginning, check_count, check_first, grid_record, last_frame,
};
use crate::prepare::{Start, Volume};
use swell_cache::{CacheError, CacheReader, Parent, frame, refuse_occupied, vdb};
use swell_domain::{keep::Keep, particles::Particles};
use swell_scene::Scene;

/// What frames that are not there yet will take on the disk, against what it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Room {
    /// Of the frames that will be computed and kept, each as large as the start's: more where emitters add water.
    pub bytes: u64,
    /// Whether they are compressed, and `bytes` is what they would take if they were not.
    pub is_compressed: bool,
    /// That the disk has; `None` where the system does not tell.
    pub free: Option<u64>,
}

impl Room {
    /// Of frames after a start, in a cache in this folder.
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

    /// What is free, where that is less than the frames will take.
    pub fn short_of(self) -> Option<u64> {
        self.free.filter(|&free| free < self.bytes)
    }
}

/// What a bake would make.
#[derive(Clone, Debug)]
pub struct Expected {
    /// First frame that would be computed.
    pub first: u32,
    /// Last one.
    pub last: u32,
    /// Frames that stand there from an earlier bake, the start aside.
    pub standing: u32,
    /// Particles at the start.
    pub particles: usize,
    /// Left out because a solid is there.
    pub removed: usize,
    /// Water at the start.
    pub volume: Volume,
    /// What the frames would take on the disk, and what it has.
    pub room: Room,
    /// Where a new bake begins from a frame of another cache, that frame.
    pub parent: Option<Parent>,
    /// What a user has to know, a sentence each.
    pub warnings: Vec<String>,
}

/// Looks at the scene and at what stands there, as a bake would; which device a cache was baked on is not looked at.
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
    let room = Room::of(request, &start.particles, first, last)?;
    Ok(Expected {
        first,
        last,
        standing,
        particles: start.particles.len(),
        removed: start.removed,
        room,
        parent,
        volume: start.volume(scene),
        warnings: [start.warnings(scene), notes].concat(),
    })
}

/// Bytes of the frames of a whole bake of a scene, the start among them, each as large as the start's.
///
/// # Errors
/// The scene's solids; what cannot stand in a frame.
pub fn shot_bytes(scene: &Scene) -> Result<u64, BakeError> {
    let start = Start::of(scene)?;
    let [particles, grids] = frame_bytes(scene, &start.particles)?;
    let later = bytes_of(scene, &start.particles, 1, scene.shot.frames)?;
    Ok(particles + grids + later)
}

/// Of these frames what stays on the disk, each as large as one of these particles.
fn bytes_of(scene: &Scene, start: &Particles, first: u32, last: u32) -> Result<u64, CacheError> {
    let [particles, grids] = frame_bytes(scene, start)?;
    let keep = scene.keep.unwrap_or(Keep::All);
    let bytes = (first..=last).map(|frame| match keep.keeps(frame) || frame == last {
        true => particles + grids,
        false => grids,
    });
    Ok(bytes.sum())
}

/// Bytes of the files of a frame with these particles: its own, and the grids' where the scene asks for them.
fn frame_bytes(scene: &Scene, particles: &Particles) -> Result<[u64; 2], CacheError> {
    let stamp = frame::Stamp {
        program: swell_domain::PROGRAM,
        program_version: swell_domain::VERSION,
        shot: &scene.shot.name,
        frame: 0,
        time: 0.0,
        origin: scene.origin,
    };
    // Nothing is written, so nothing but what is to be written can be at fault.
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
