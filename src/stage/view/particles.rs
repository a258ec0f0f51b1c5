//! Draws frames of a cache as balls: a quick look that needs neither a device nor a render.

use std::path::Path;

use glam::{DVec3, Vec3};

use super::{
    ViewError,
    points::{Aspect, Projection, Scenery},
    reader,
    strip::{Label, PictureSource, Strip},
};
use crate::baked_scene;
use swell_cache::CacheReader;
use swell_domain::{
    bounds::Bounds, frame_range::FrameRange, particles::Particles, statistics::percentile,
};
use swell_scene::Scene;
use swell_study::rgb::Rgb;

/// Width of a picture, pixels.
const WIDTH: usize = 960;
/// Number of frames that are read for the colour scale, and the percentile of the speeds that sets
/// it.
const LOOKED: usize = 5;
const SLOWER: f64 = 0.995;

/// A cache whose frames are drawn.
pub(super) struct Balls {
    cache: CacheReader,
    scene: Scene,
    projection: Projection,
    /// Speed of the brightest colour, m/s.
    pub(super) top: f64,
}

/// Opens a cache, seen from `aspect`.
pub(super) fn open(
    path: &Path,
    aspect: Aspect,
    frames: Option<&FrameRange>,
) -> Result<Strip, ViewError> {
    let cache = reader(path)?;
    let scene = baked_scene(&cache, path)?;
    let numbers = cache.entries().iter().map(|entry| entry.frame);
    let kept: Vec<u32> = numbers
        .filter(|&frame| cache.has_particles(frame))
        .collect();
    let wanted = |frame: &&u32| frames.is_none_or(|frames| frames.contains(**frame));
    let looked: Vec<u32> = kept.iter().filter(wanted).copied().collect();
    let top = top_speed(&cache, &looked)?;
    let manifest = cache.manifest();
    let rate = manifest.frames_per_second;
    let projection = Projection::of(aspect, &scene.domain, WIDTH);
    Ok(Strip {
        path: path.to_owned(),
        title: format!("{} {}", manifest.shot, manifest.solver),
        note: String::new(),
        labels: kept.into_iter().map(Label::Frame).collect(),
        size: projection.size(),
        frames_per_second: Some(rate),
        source: PictureSource::Cache(Box::new(Balls {
            cache,
            scene,
            projection,
            top,
        })),
    })
}

/// The speed that most particles of some of these frames do not exceed, m/s.
fn top_speed(cache: &CacheReader, frames: &[u32]) -> Result<f64, ViewError> {
    let many = frames.len().min(LOOKED);
    let mut top = 0.0f64;
    for k in 0..many {
        let frame = frames[(k + 1) * frames.len() / many - 1];
        let water = cache.read(frame)?;
        let speeds = water.velocity.iter();
        let speeds = speeds.map(|v| f64::from(Vec3::from_array(*v).length()));
        top = top.max(percentile(speeds.collect(), SLOWER).unwrap_or(0.0));
    }
    Ok(top)
}

impl Balls {
    /// Describes the picture for the viewer.
    pub(super) fn note(&self) -> String {
        format!(
            "Particles as balls, coloured by speed from dark blue (0) to white ({:.1} m/s and \
             more): a quick look, no render.",
            self.top
        )
    }

    pub(super) fn draw(&self, frame: u32) -> Result<Rgb, ViewError> {
        let water = self.cache.read(frame)?;
        let scene = &self.scene;
        let time = scene.shot.time(frame);
        let moving = scene.drawn_movers();
        let moving = moving.map(|solid| solid.mesh(&water.bodies, time));
        let still = scene.solids.iter().map(|solid| solid.mesh.clone());
        let solids: Vec<_> = still.chain(moving).collect();
        let around = Scenery {
            domain: scene.domain,
            walls: self.walls(&water, time),
            solids: &solids,
        };
        let spacing = scene.particle_spacing();
        Ok(self.projection.draw(&water, spacing, self.top, &around))
    }

    /// The box that wave makers leave to the water.
    fn walls(&self, water: &Particles, time: f64) -> Bounds {
        let scene = &self.scene;
        let mut walls = scene.domain;
        let now = scene.walls(&water.walls, time);
        for maker in &scene.wave_makers {
            let (axis, corner) = (maker.wall.axis, scene.domain.min);
            match maker.wall.is_max {
                true => walls.max[axis] = corner[axis] + now.max[axis],
                false => walls.min[axis] = corner[axis] + now.min[axis],
            }
        }
        walls
    }

    pub(super) fn lacks(&self, frame: u32) -> ViewError {
        let fault = self.cache.kept(frame).err();
        let other = || ViewError::Asked(format!("there is no frame {frame}"));
        fault.map_or_else(other, ViewError::Cache)
    }

    /// Uses the colour scale and the view of another cache, so that both can be compared.
    pub(super) fn like(&mut self, other: &Self) {
        self.top = other.top;
        let moved: DVec3 = other.scene.origin - self.scene.origin;
        self.projection = other.projection.moved(moved);
    }
}
