//! A whitewater stream with the bake that it was made from, for `check`.

use std::path::{Path, PathBuf};

use crate::{
    baked_scene,
    derived::{DerivedError, is_of, water::WaterReader},
    device::SolverError,
    prepare::Start,
};
use swell_cache::CacheReader;
use swell_check::CheckTable;
use swell_domain::{boundary::Boundary, whitewater::CompleteSettings};
use swell_gpu::adapter::Context;
use swell_scene::PbfScene;

use super::{WhitewaterError, recorded};

/// A stream, and everything that its frames are made from.
pub struct Stream {
    stream: CacheReader,
    cache: CacheReader,
    scene: PbfScene<'static>,
    boundary: Boundary,
    settings: CompleteSettings,
    particles: usize,
}

impl Stream {
    /// Opens the stream in `directory`, whose bake is two folders above, and checks that `frames`
    /// were made from that bake.
    ///
    /// # Errors
    /// A bake that is missing or has changed, its scene, its solids; frames whose preceding
    /// whitewater was not kept.
    pub fn open(
        directory: &Path,
        stream: CacheReader,
        frames: &[u32],
    ) -> Result<Self, WhitewaterError> {
        let real = std::path::absolute(directory).unwrap_or_else(|_| directory.to_owned());
        let parent = real.parent().and_then(Path::parent);
        let place = parent.map_or_else(PathBuf::new, Path::to_owned);
        let cache = CacheReader::open(&place)?;
        for &frame in frames {
            if frame == stream.first_frame() {
                let (first, last) = (frame + 1, stream.last_frame());
                return Err(WhitewaterError::Derived(DerivedError::NoFrame {
                    asked: frame,
                    first,
                    last,
                }));
            }
            // A frame is computed from the frame before.
            stream.kept(frame - 1)?;
            if !is_of(stream.entry(frame)?, &cache) {
                return Err(WhitewaterError::NoBake {
                    stream: directory.to_owned(),
                    cache: place,
                    frame,
                });
            }
        }
        let scene = baked_scene(&cache, &place)?.of_whitewater();
        let begin = WaterReader::of(&cache, scene.period()).at(cache.first_frame())?;
        let particles = begin.len();
        let boundary = Start::with(&scene, begin)?.boundary;
        let settings = recorded(&stream, directory)?;
        Ok(Self {
            stream,
            cache,
            scene,
            boundary,
            settings,
            particles,
        })
    }

    /// Number of water particles.
    pub fn water(&self) -> usize {
        self.particles
    }

    /// Compares the passes that made a frame with their reference passes (f64).
    ///
    /// # Errors
    /// Errors of the files or the device.
    pub fn check(&self, context: &Context, frame: u32) -> Result<CheckTable, WhitewaterError> {
        let water = WaterReader::of(&self.cache, self.scene.period()).at(frame)?;
        let time = self.cache.entry(frame)?.clock.time;
        let white = self.stream.read(frame - 1)?;
        let one = swell_check::whitewater::Frame {
            scene: &self.scene,
            boundary: &self.boundary,
            settings: &self.settings,
            water: &water,
            white: &white,
            time,
            seconds: time - self.cache.entry(frame - 1)?.clock.time,
        };
        Ok(swell_check::whitewater::check(context, one).map_err(SolverError::from)?)
    }
}
