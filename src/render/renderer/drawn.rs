//! Chooses the particles that a frame draws, and their order.

use glam::Vec3;
use rayon::prelude::*;

use super::taken::Taken;
use crate::{
    RenderScene,
    camera::{Setting, camera, pose},
    hidden::Hidden,
    in_frame::{blocks_in_frame, in_frame},
    paths::Path,
    samples::{Moments, Sample, samples_of},
    uniform::{Block, Camera, Particle},
};
use swell_domain::parallel;
use swell_scene::look::{Look, MethodSpec};

/// Width in pixels of the vertical strips by which particles are sorted. In passes that do not
/// interleave their workgroups, each thread of a software adapter gets a contiguous run of them.
/// With strips, every thread gets some near particles, which take longer, and threads contend less
/// for the same pixels.
const STRIP: f32 = 64.0;

/// Maps a float to a word with the order of `f32::total_cmp`.
fn in_order(x: f32) -> u32 {
    let bits = x.to_bits();
    match bits >> 31 {
        0 => bits | 1 << 31,
        _ => !bits,
    }
}

/// Gathers values by index.
fn picked<T: Copy + Send + Sync>(values: &[T], indices: &[u32]) -> Vec<T> {
    let of = |&index: &u32| values[index as usize];
    parallel::map_slice(indices, of)
}

/// Particles of a frame in the order in which they are drawn.
pub(super) struct DrawnParticles {
    /// Visible particles first, strip by strip and front to back, so that occluders are splatted
    /// first; then those that are hidden or outside the frame.
    pub(super) packed: Vec<Particle>,
    /// Paths of the visible ones; empty where the look needs no motion.
    pub(super) ways: Vec<Path>,
    /// Number of visible particles.
    pub(super) seen: usize,
    /// Blocks in the frame that replace hidden particles; `None` where rays are cast.
    pub(super) blocks: Option<Vec<Block>>,
}

impl DrawnParticles {
    /// Culls and sorts particles for a frame's cameras.
    pub(super) fn of(
        taken: Taken,
        look: &Look,
        scene: &RenderScene,
        frame: u32,
        cameras: &[Camera],
    ) -> Self {
        let Taken { packed, mut ways } = taken;
        let hidden = hidden(look, scene, &packed);
        let in_frame = in_frame(&packed, &ways, cameras, scene.particle_spacing as f32);
        let is_hidden = |index: usize| hidden.as_ref().is_some_and(|it| it.particles[index]);
        let is_seen = |index: u32| in_frame[index as usize] && !is_hidden(index as usize);
        let mut indices = Sight::of(look, scene, frame, cameras).order(&packed, is_seen);
        let seen = indices.len();
        if !ways.is_empty() {
            ways = picked(&ways, &indices);
        }
        indices.extend((0..packed.len() as u32).filter(|&index| !is_seen(index)));
        Self {
            packed: picked(&packed, &indices),
            ways,
            seen,
            blocks: hidden.map(|it| blocks_in_frame(it.blocks, cameras)),
        }
    }
}

/// Cameras of the frame's instant and of its samples; where rays are cast also of the first and
/// last times of a sample's rays.
pub(super) fn cameras(look: &Look, setting: &Setting, frame: u32) -> Vec<Camera> {
    let is_ray = look.spec().renderer.method == MethodSpec::Ray;
    let samples = [vec![Sample::STILL], samples_of(look)].concat();
    let instants = |sample: Sample| {
        let ends = is_ray.then(|| Moments::of(look, &sample).span);
        let ends = ends.filter(|[first, last]| first < last);
        let all = [sample.instant]
            .into_iter()
            .chain(ends.into_iter().flatten());
        all.map(move |instant| Sample { instant, ..sample })
    };
    (samples.into_iter().flat_map(instants))
        .map(|sample| camera(look, setting, frame.into(), sample, 0))
        .collect()
}

/// Finds particles hidden by other water. Ray casting keeps all, because rays may begin under water
/// and see what is hidden from above.
fn hidden(look: &Look, scene: &RenderScene, packed: &[Particle]) -> Option<Hidden> {
    match look.spec().renderer.method {
        MethodSpec::Ssfr => Some(Hidden::of(
            packed,
            scene.domain.size(),
            scene.particle_spacing,
        )),
        MethodSpec::Ray => None,
    }
}

/// How a frame's camera sees particles.
struct Sight {
    eye: Vec3,
    right: Vec3,
    forward: Vec3,
    /// Focal length, pixels.
    focal: f32,
}

impl Sight {
    fn of(look: &Look, scene: &RenderScene, frame: u32, cameras: &[Camera]) -> Self {
        let pose = pose(look, frame.into(), scene.frames_per_second);
        Self {
            eye: (pose.position - scene.origin - scene.domain.min).as_vec3(),
            right: pose.right.as_vec3(),
            forward: pose.forward.as_vec3(),
            focal: cameras.first().map_or(1.0, |camera| camera.focal),
        }
    }

    fn depth(&self, particle: &Particle) -> f32 {
        (Vec3::from(particle.position) - self.eye).dot(self.forward)
    }

    /// Strip of a particle. It does not depend on other particles, so that overscan does not change
    /// the order of two particles.
    fn strip(&self, particle: &Particle) -> i32 {
        let aside = (Vec3::from(particle.position) - self.eye).dot(self.right);
        let depth = self.depth(particle).max(f32::MIN_POSITIVE);
        (self.focal * aside / depth / STRIP).floor() as i32
    }

    /// Indices of visible particles, strip by strip and front to back.
    fn order(&self, packed: &[Particle], is_seen: impl Fn(u32) -> bool + Sync) -> Vec<u32> {
        let mut order: Vec<(i32, u32, u32, u32)> = parallel::flat_map(0..packed.len(), |k| {
            let (index, particle) = (k as u32, &packed[k]);
            is_seen(index).then(|| {
                let depth = in_order(self.depth(particle));
                (self.strip(particle), depth, particle.tag, index)
            })
        });
        order.par_sort_unstable();
        order.into_iter().map(|(.., index)| index).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::in_order;

    #[test]
    fn words_are_in_the_order_of_numbers() {
        let numbers = [
            -f32::NAN,
            f32::NEG_INFINITY,
            -2.5,
            -1e-40,
            -0.0,
            0.0,
            1e-40,
            1.0,
            1.5,
        ];
        let numbers = [&numbers[..], &[f32::MAX, f32::INFINITY, f32::NAN]].concat();
        for (a, b) in numbers
            .iter()
            .flat_map(|a| numbers.iter().map(move |b| (a, b)))
        {
            assert_eq!(in_order(*a).cmp(&in_order(*b)), a.total_cmp(b), "{a} {b}");
        }
    }
}
