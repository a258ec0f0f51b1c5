//! A stream of wetness beside the water, for renders and exports.

use std::{path::Path, sync::Arc};

use super::{SETTINGS, Settings, WetError, directory, surfaces};
use crate::derived::is_of;
use swell_cache::{CacheError, CacheReader};
use swell_domain::wet::{RefinedSurface, WETNESS};
use swell_scene::Scene;

/// A stream of wetness and the surfaces that it is of.
pub(crate) struct WetStream {
    stream: CacheReader,
    /// Of the scene's solids, static ones first.
    surfaces: Arc<Vec<RefinedSurface>>,
}

impl WetStream {
    /// Opens the stream and checks that it has all requested frames, each made from the water that
    /// is now in `water`, and that it is of the solids of `scene`.
    pub(crate) fn open(
        cache: &Path,
        name: &str,
        (water, scene): (&CacheReader, &Scene),
        frames: &[u32],
    ) -> Result<Self, WetError> {
        let directory = directory(cache, name);
        if !swell_cache::exists(&directory) {
            return Err(WetError::Missing {
                stream: name.to_owned(),
                directory,
                cache: cache.to_owned(),
            });
        }
        let stream = CacheReader::open(&directory)?;
        let unfit = |how: String| WetError::Unfit {
            directory: directory.clone(),
            how,
        };
        let text = stream.asset(SETTINGS)?;
        let settings: Settings = serde_json::from_slice(&text)
            .map_err(|error| unfit(format!("its settings {SETTINGS}: {error}")))?;
        if settings.hash(water)? != stream.manifest().scene_hash {
            return Err(unfit("it was made from another bake".to_owned()));
        }
        for &frame in frames {
            if !stream.has_particles(frame) {
                return Err(unfit(format!("frame {frame} is missing from it")));
            }
            if !is_of(stream.entry(frame)?, water) {
                let how = "was made from water that no longer exists";
                return Err(unfit(format!("frame {frame} {how}")));
            }
        }
        let surfaces = surfaces(scene, settings.edge_m)?;
        let is_same = surfaces.len() == settings.surfaces.len()
            && (surfaces.iter().enumerate()).all(|(index, surface)| {
                // The surface as this program refines it, against the file of the stream.
                let file = surface.file(index);
                let written = stream.asset(&file);
                written.is_ok_and(|bytes| bytes == surface.bytes(scene.origin))
            });
        if !is_same {
            return Err(unfit("its surfaces are not those of the scene".to_owned()));
        }
        let refined = surfaces.into_iter().map(|surface| surface.refined);
        Ok(Self {
            stream,
            surfaces: Arc::new(refined.collect()),
        })
    }

    /// Refined surfaces of the scene's solids, static ones first.
    pub(crate) fn surfaces(&self) -> &Arc<Vec<RefinedSurface>> {
        &self.surfaces
    }

    /// Wetness of each vertex at a frame, surface by surface.
    pub(crate) fn read(&self, frame: u32) -> Result<Vec<f32>, WetError> {
        let mut points = self.stream.read(frame)?;
        let count: usize = self.surfaces.iter().map(RefinedSurface::len).sum();
        match points.attributes.remove(WETNESS) {
            Some(wetness) if wetness.len() == count => Ok(wetness),
            _ => Err(WetError::Unfit {
                directory: self.stream.dir().to_owned(),
                how: format!("frame {frame} has not the wetness of {count} vertices"),
            }),
        }
    }

    /// Hash of a frame.
    pub(crate) fn frame_hash(&self, frame: u32) -> Result<&str, CacheError> {
        self.stream.frame_hash(frame)
    }
}
