//! The streams beside the water that a look draws.

use std::path::Path;

use super::{RenderJobError, whitewater::WhitewaterStream};
use crate::{baked_scene, wet::WetStream};
use swell_cache::{CacheError, CacheReader};
use swell_domain::particles::Particles;
use swell_render::WetSolids;
use swell_scene::look::Look;

/// Opened streams; `None` where the look names none.
pub(super) struct Streams {
    whitewater: Option<WhitewaterStream>,
    wet: Option<WetStream>,
}

impl Streams {
    /// Opens the streams of the cache in `directory` that the look names, and checks that they have
    /// all requested frames.
    pub(super) fn open(
        directory: &Path,
        look: &Look,
        cache: &CacheReader,
        frames: &[u32],
    ) -> Result<Self, RenderJobError> {
        let whitewater = match &look.spec().whitewater {
            Some(look) => Some(WhitewaterStream::open(
                directory,
                &look.stream,
                cache,
                frames,
            )?),
            None => None,
        };
        let wet = match &look.spec().wet {
            Some(look) => {
                let scene = baked_scene(cache, directory)?;
                let made_of = (cache, &scene);
                Some(WetStream::open(directory, &look.stream, made_of, frames)?)
            }
            None => None,
        };
        Ok(Self { whitewater, wet })
    }

    /// Hashes of a frame of each stream, each after a space.
    pub(super) fn frame_hashes(&self, frame: u32) -> Result<String, CacheError> {
        let mut hashes = String::new();
        if let Some(stream) = &self.whitewater {
            hashes += &format!(" {}", stream.frame_hash(frame)?);
        }
        if let Some(stream) = &self.wet {
            hashes += &format!(" wet {}", stream.frame_hash(frame)?);
        }
        Ok(hashes)
    }

    /// Spray, foam and bubbles of a frame.
    pub(super) fn white(&self, frame: u32) -> Result<Particles, CacheError> {
        match &self.whitewater {
            Some(stream) => stream.read(frame),
            None => Ok(Particles::default()),
        }
    }

    /// Wetness of the solids at a frame.
    pub(super) fn wet(&self, frame: u32) -> Result<Option<WetSolids>, RenderJobError> {
        let Some(stream) = &self.wet else {
            return Ok(None);
        };
        Ok(Some(WetSolids {
            surfaces: stream.surfaces().clone(),
            wetness: stream.read(frame)?,
        }))
    }
}
