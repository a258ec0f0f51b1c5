//! Uploads the water into which rays are cast.
//!
//! With an open shutter a level set serves all rays whose time is near its instant: it has the
//! water's velocities beside it, by which a ray looks its surface up at the ray's own time. A frame
//! takes as few of them as keep the water within [`FARTHEST`] of where the level set has it and
//! within [`BENT`] of a straight path, at most one for each sample.

use glam::{DVec3, Vec3};

use crate::{
    RenderError, RenderScene,
    buffers::{LEVEL_TABLE, LEVEL_VALUES, SUN_PATHS},
    paths::{Path, body_of},
    rays::{level_set, moved, sun_in_water, voxel},
    samples::{Moments, samples_of},
    uniform::Particle,
};
use swell_domain::{
    level_set::{LevelSet, drift::Drift, sunlight::Sunlight},
    parallel,
};
use swell_gpu::program::Program;
use swell_scene::look::{Look, MethodSpec};

/// Displacement from the level set's instant, particle spacings, up to which its surface is looked
/// up by velocities.
const FARTHEST: f64 = 1.0;
/// Distance between a path and the straight and even one, particle spacings, up to which the latter
/// replaces it.
const BENT: f64 = 0.05;

/// Particles of a frame's body, and the state of their level set on the device.
pub(super) struct RayWater {
    /// Positions of the body's particles with their paths.
    places: Vec<(Vec3, Path)>,
    /// Times of the rays of each sample, seconds from the frame; empty with a closed shutter.
    spans: Vec<[f32; 2]>,
    /// Times that share a level set.
    slices: Vec<[f32; 2]>,
    /// Times for which the device holds the level set; `None` before the first one of this frame.
    stands: Option<[f32; 2]>,
    /// Allocated words of the table, and values.
    capacity: [usize; 2],
    /// Edge length of a voxel, metres.
    voxel: f64,
    sun: DVec3,
    /// Upper bound of the height of the water on the device, metres.
    top: f64,
    /// Largest component of the velocities on the device, m/s.
    speed: f32,
}

/// A level set in the device's layout.
pub(super) struct Built {
    level: LevelSet,
    pub(super) table: Vec<u32>,
    speed: f32,
}

impl Built {
    /// Number of values.
    pub(super) fn values(&self) -> usize {
        self.level.values.len()
    }
}

impl RayWater {
    /// Returns `None` where the look casts no rays.
    pub(super) fn of(look: &Look, scene: &RenderScene) -> Option<Self> {
        (look.spec().renderer.method == MethodSpec::Ray).then(|| Self {
            places: Vec::new(),
            spans: spans_of(look, scene),
            slices: Vec::new(),
            stands: None,
            capacity: [0; 2],
            voxel: voxel(look, scene),
            sun: sun_in_water(look),
            top: 0.0,
            speed: 0.0,
        })
    }

    /// Takes the particles of a frame that belong to the body; without `paths` they move in
    /// straight lines.
    pub(super) fn take(&mut self, particles: &[Particle], paths: &[Path], scene: &RenderScene) {
        self.places = body_of(particles, paths);
        let Motion { way, bend } = self.motion();
        let [way, bend] = [way, bend].map(|metres| metres / scene.particle_spacing);
        self.slices = slices(&self.spans, Motion { way, bend });
        self.stands = None;
    }

    /// How far the particles move while the shutter is open; a thousandth of them may move
    /// farther.
    fn motion(&self) -> Motion {
        let (Some([start, _]), Some([_, end])) = (self.spans.first(), self.spans.last()) else {
            return Motion::default();
        };
        let of = |(_, path): &(Vec3, Path)| {
            let at = |part: f32| path.displacement(start + part * (end - start));
            let [first, middle, last] = [0.0, 0.5, 1.0].map(at);
            let way = first.distance(middle) + middle.distance(last);
            [way, (0.5 * (first + last)).distance(middle)]
        };
        let all = parallel::map_slice(&self.places, of);
        let [way, bend] = [0, 1].map(|k| {
            let mut values: Vec<f64> = all.iter().map(|it| it[k]).collect();
            let rank = (values.len() * 999 / 1000).min(values.len().saturating_sub(1));
            match values.is_empty() {
                true => 0.0,
                false => *values.select_nth_unstable_by(rank, f64::total_cmp).1,
            }
        });
        Motion { way, bend }
    }

    /// Times that share the level set for a sample with the instant `seconds`, whose rays have
    /// different times where `is_open`.
    pub(super) fn slice(&self, seconds: f32, is_open: bool) -> [f32; 2] {
        let has = |slice: &&[f32; 2]| is_open && seconds <= slice[1];
        self.slices
            .iter()
            .find(has)
            .copied()
            .unwrap_or([seconds; 2])
    }

    /// Uploads a level set for these times, in seconds from the frame. Returns whether a buffer was
    /// reallocated.
    pub(super) fn stand_at(
        &mut self,
        slice: [f32; 2],
        program: &mut Program,
        scene: &RenderScene,
    ) -> Result<bool, RenderError> {
        // Rays that all have its instant meet the same surface with and without velocities.
        let serves = |stands: [f32; 2]| slice == [middle(stands); 2];
        if self
            .stands
            .is_some_and(|stands| stands == slice || serves(stands))
        {
            return Ok(false);
        }
        let Built {
            level,
            table,
            speed,
        } = self.build(slice, scene);
        let light = Sunlight::new(&level, self.sun);
        let needed = [table.len(), level.values.len()];
        let grew = needed[0] > self.capacity[0] || needed[1] > self.capacity[1];
        if grew {
            self.capacity = [0, 1].map(|k| needed[k].max(self.capacity[k]));
            let [words, values] = self.capacity;
            program.refit(&[LEVEL_TABLE.sized(words), LEVEL_VALUES.sized(values)], &[])?;
        }
        program.upload(LEVEL_TABLE, 0, &table);
        program.upload(LEVEL_VALUES, 0, &level.values);
        program.upload(SUN_PATHS, 0, &light.paths);
        self.stands = Some(slice);
        self.top = level.top();
        if slice[0] < slice[1] {
            // The surface may rise by as much as the look-up spans.
            self.top += FARTHEST * scene.particle_spacing;
        }
        self.speed = speed;
        Ok(grew)
    }

    /// Builds the level set for these times: of their middle, and where they differ with the
    /// velocities of the water in between.
    pub(super) fn build(&self, slice: [f32; 2], scene: &RenderScene) -> Built {
        let [start, end] = slice;
        let places = moved(&self.places, middle(slice));
        let level = level_set(scene, self.voxel, &places);
        if self.spans.is_empty() {
            return Built {
                table: level.table.clone(),
                level,
                speed: 0.0,
            };
        }
        let velocity = |(_, path): &(Vec3, Path)| match end > start {
            true => (path.displacement(end) - path.displacement(start)) / f64::from(end - start),
            false => DVec3::ZERO,
        };
        let velocities: Vec<DVec3> = self.places.iter().map(velocity).collect();
        let drift = Drift::new(&level, &places, &velocities, f64::from(end - start) / 2.0);
        Built {
            level,
            table: drift.table,
            speed: drift.speed,
        }
    }

    /// Instant of the level set on the device, seconds from the frame, and the largest component of
    /// the velocities beside it, m/s.
    pub(super) fn instant(&self) -> [f32; 2] {
        [self.stands.map_or(0.0, middle), self.speed]
    }

    pub(super) fn top(&self) -> f64 {
        self.top
    }
}

fn middle([start, end]: [f32; 2]) -> f32 {
    0.5 * (start + end)
}

/// Times of the rays of each sample, seconds from the frame; none with a closed shutter.
fn spans_of(look: &Look, scene: &RenderScene) -> Vec<[f32; 2]> {
    if look.spec().image.shutter == 0.0 {
        return Vec::new();
    }
    let seconds = |frames: f64| (frames / scene.frames_per_second) as f32;
    let samples = samples_of(look);
    let spans = samples
        .iter()
        .map(|it| Moments::of(look, it).span.map(seconds));
    spans.collect()
}

/// Paths of the water while the shutter is open.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Motion {
    /// Length, in any unit.
    way: f64,
    /// Distance of the middle from that of the ends.
    bend: f64,
}

/// Groups the samples' times so that water with this motion, in particle spacings, moves at most
/// twice [`FARTHEST`] in a group, and is at most [`BENT`] off a straight and even path.
fn slices(spans: &[[f32; 2]], motion: Motion) -> Vec<[f32; 2]> {
    let wanted = (motion.way / (2.0 * FARTHEST)).max((motion.bend / BENT).sqrt());
    let count = (wanted.ceil().max(1.0) as usize).min(spans.len());
    let group = |k: usize| {
        let [first, next] = [k, k + 1].map(|k| (k * spans.len()).div_ceil(count));
        [spans[first][0], spans[next - 1][1]]
    };
    (0..count).map(group).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_are_as_few_as_the_water_s_displacement_allows() {
        let spans: Vec<[f32; 2]> = (0..8u8).map(|k| [k, k + 1].map(f32::from)).collect();
        let of = |way: f64, bend: f64| slices(&spans, Motion { way, bend });
        assert_eq!(of(0.0, 0.0), [[0.0, 8.0]]);
        assert_eq!(of(2.0, 0.05), [[0.0, 8.0]]);
        assert_eq!(of(2.1, 0.0), [[0.0, 4.0], [4.0, 8.0]]);
        assert_eq!(of(0.0, 0.06), [[0.0, 4.0], [4.0, 8.0]]);
        assert_eq!(of(5.0, 0.2), [[0.0, 3.0], [3.0, 6.0], [6.0, 8.0]]);
        assert_eq!(of(1e9, 0.0), spans);
        assert!(slices(&[], Motion::default()).is_empty());
    }
}
