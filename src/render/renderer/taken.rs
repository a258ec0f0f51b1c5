//! Prepares a frame's particles for the device: their visibility, order and paths.

use glam::Vec3;
use rayon::prelude::*;

use crate::{
    FrameInputs, RenderError, RenderScene,
    aeration::{self, CLEAR, Fall},
    camera::{Setting, camera, pose},
    hidden::Hidden,
    in_frame::in_frame,
    paths::{Path, paths},
    samples::{Sample, samples_of},
    uniform::{Camera, Particle},
};
use swell_domain::particles::Particles;
use swell_scene::look::{AovSpec, Look, MethodSpec};

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
    indices.par_iter().map(of).collect()
}

/// Particles of a frame relative to the domain's least corner, with their air.
pub(super) struct Taken {
    pub(super) packed: Vec<Particle>,
    /// Path of each particle; empty where the look needs no motion.
    pub(super) ways: Vec<Path>,
}

impl Taken {
    pub(super) fn of(
        look: &Look,
        scene: &RenderScene,
        frame: u32,
        inputs: &FrameInputs<'_>,
    ) -> Result<Self, RenderError> {
        let water = &inputs.water.particles;
        let spec = look.spec();
        let mut packed = pack(scene, frame, water)?;
        if let Some(spray) = &spec.water.spray {
            let fall = Fall::of(scene, packed.len());
            let standing = aeration::standing(inputs, &fall);
            aeration::classify(&mut packed, &standing, spray, &fall);
        }
        let ways = match spec.image.shutter > 0.0 || look.wants(AovSpec::Forward) {
            true => paths(
                water,
                inputs.beside(),
                frame_seconds(scene),
                scene.domain.size(),
            ),
            false => Vec::new(),
        };
        Ok(Self { packed, ways })
    }
}

pub(super) fn frame_seconds(scene: &RenderScene) -> f32 {
    (1.0 / scene.frames_per_second) as f32
}

/// Finds particles hidden by other water. Ray casting keeps all, because rays may begin under water
/// and see what is hidden from above.
pub(super) fn hidden(look: &Look, scene: &RenderScene, packed: &[Particle]) -> Option<Hidden> {
    match look.spec().renderer.method {
        MethodSpec::Ssfr => Some(Hidden::of(
            packed,
            scene.domain.size(),
            scene.particle_spacing,
        )),
        MethodSpec::Ray => None,
    }
}

/// Converts particles to positions relative to the domain's least corner.
fn pack(
    scene: &RenderScene,
    frame: u32,
    particles: &Particles,
) -> Result<Vec<Particle>, RenderError> {
    let origin = scene.domain.min;
    let (places, velocities) = (&particles.position, &particles.velocity);
    let is_finite = |(p, v): (&[f32; 3], &[f32; 3])| p.iter().chain(v).all(|x| x.is_finite());
    let both = places.par_iter().zip(velocities);
    if let Some(index) = both.position_first(|it| !is_finite(it)) {
        return Err(RenderError::NotFinite { index, frame });
    }
    let pack = |(index, (p, v)): (usize, (&[f32; 3], &[f32; 3]))| Particle {
        position: [0, 1, 2].map(|axis| (f64::from(p[axis]) - origin[axis]) as f32),
        air: CLEAR,
        velocity: *v,
        tag: particles.id.get(index).map_or(index as u32, |&id| id) << 1 | 1,
    };
    Ok(places
        .par_iter()
        .zip(velocities)
        .enumerate()
        .map(pack)
        .collect())
}

/// Cameras of the frame's instant and of its samples.
pub(super) fn cameras(look: &Look, setting: &Setting, frame: u32) -> Vec<Camera> {
    let samples = [vec![Sample::STILL], samples_of(look)].concat();
    samples
        .into_iter()
        .map(|sample| camera(look, setting, frame.into(), sample, 0))
        .collect()
}

/// Sorts visible particles to the front, strip by strip and front to back, so that occluders are
/// splatted first, and returns their number. Hidden particles and those outside the frame follow;
/// `ways` keeps visible ones only.
pub(super) fn sort(
    (look, scene): (&Look, &RenderScene),
    (frame, cameras): (u32, &[Camera]),
    hidden: Option<&Hidden>,
    packed: &mut Vec<Particle>,
    ways: &mut Vec<Path>,
) -> usize {
    let rate = scene.frames_per_second;
    let pose = pose(look, frame.into(), rate);
    let eye = (pose.position - scene.origin - scene.domain.min).as_vec3();
    let (right, forward) = (pose.right.as_vec3(), pose.forward.as_vec3());
    let depth = |p: &Particle| (Vec3::from(p.position) - eye).dot(forward);
    let focal = cameras.first().map_or(1.0, |camera| camera.focal);
    // The strip does not depend on other particles, so that overscan does not change the order of
    // two particles.
    let strip = |p: &Particle| {
        let aside = (Vec3::from(p.position) - eye).dot(right);
        (focal * aside / depth(p).max(f32::MIN_POSITIVE) / STRIP).floor() as i32
    };
    let in_frame = in_frame(packed, ways, cameras, scene.particle_spacing as f32);
    let is_seen = |index: usize| in_frame[index] && !hidden.is_some_and(|it| it.particles[index]);
    let all = || 0u32..packed.len() as u32;
    let mut order: Vec<(i32, u32, u32, u32)> = all()
        .into_par_iter()
        .filter(|&index| is_seen(index as usize))
        .map(|index| {
            let particle = &packed[index as usize];
            let depth = in_order(depth(particle));
            (strip(particle), depth, particle.tag, index)
        })
        .collect();
    order.par_sort_unstable();
    let seen = order.len();
    let mut indices: Vec<u32> = order.into_iter().map(|(.., index)| index).collect();
    if !ways.is_empty() {
        *ways = picked(ways, &indices);
    }
    indices.extend(all().filter(|&index| !is_seen(index as usize)));
    *packed = picked(packed, &indices);
    seen
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
