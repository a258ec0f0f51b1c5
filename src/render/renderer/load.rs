//! A frame's particles on their way to the device.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{
    Renderer,
    build::room,
    shade::draws_spray,
    splats::{Pages, ROWS, filled},
};
use crate::{
    Moment, RenderError,
    aeration::{self, CLEAR, Fall},
    buffers::{
        AIRED, AIRED_GROUPS, BLOCK_GROUPS, BLOCKS, PAGES, PARTICLE_GROUPS, PARTICLES, PATHS,
        SHAPES, SPRAY_PARAMS,
    },
    camera::{camera, pose},
    hidden::Hidden,
    in_frame::{blocks_in_frame, in_frame},
    lighting::spray_density,
    paths::{Path, paths},
    plan::per_particle,
    samples::{Sample, samples_of},
    shapes::shapes,
    uniform::{Block, Camera, Page, Particle, SprayParams},
};
use swell_domain::{level_set::kernels::Kernels, particles::Particles};
use swell_gpu::{buffer::Workgroups, recording::spread};
use swell_scene::look::{AovSpec, MethodSpec};

/// Particle spacings within which a particle has a part in the field at the eye: a kernel's reach and that of the neighbours that
/// shape it.
const ABOUT_THE_EYE: f64 = 6.0;
/// Particles within [`CLOSE`] spacings of the eye below which it is hit by drops and not under water.
const FEW: usize = 6;
const CLOSE: f64 = 2.5;

/// Width of the picture's upright strips, pixels, in which particles are sorted. A software adapter gives each thread of a pass that does
/// not deal its groups out a run of them: with strips both of two threads have near particles, which take longer, and they wait less for
/// each other's pixels.
const STRIP: f32 = 64.0;

/// A frame that stands on the device.
#[derive(Default)]
pub(super) struct Loaded {
    /// Its particles that may be seen.
    pub(super) count: u32,
    /// They again, with the mean velocity of their way to the next frame: for the channels beside the picture, where one asks for
    /// motion and there is a next frame.
    pub(super) ahead: Vec<Particle>,
}

/// A word that is in the order of a number, as `f32::total_cmp` has it.
fn in_order(x: f32) -> u32 {
    let bits = x.to_bits();
    match bits >> 31 {
        0 => bits | 1 << 31,
        _ => !bits,
    }
}

/// The values that have these indices.
fn picked<T: Copy + Send + Sync>(values: &[T], indices: &[u32]) -> Vec<T> {
    let of = |&index: &u32| values[index as usize];
    indices.par_iter().map(of).collect()
}

impl Renderer {
    /// Moves a frame's particles to the device, relative to the domain's least corner.
    pub(super) fn load(&mut self, frame: u32, moment: &Moment<'_>) -> Result<Loaded, RenderError> {
        let water = &moment.water.particles;
        let mut packed = self.pack(frame, water)?;
        if let Some(spray) = &self.look.spec().water.spray {
            let fall = Fall::of(&self.scene, packed.len());
            let standing = aeration::standing(moment, &fall);
            aeration::classify(&mut packed, &standing, spray, &fall);
        }
        let spec = self.look.spec();
        if spec.renderer.method == MethodSpec::Ssfr && self.is_under_water(frame, &packed) {
            return Err(RenderError::UnderWater { frame });
        }
        let wants_motion = self.look.wants(AovSpec::Forward);
        let mut ways = Vec::new();
        if spec.image.shutter > 0.0 || wants_motion {
            let size = self.scene.domain.size();
            ways = paths(water, moment.beside(), self.frame_seconds(), size);
        }
        if let Some(water) = &mut self.water {
            water.take(&packed, &ways);
        }
        if let Some(caustics) = &mut self.caustics {
            caustics.forget();
        }
        if let Some(sea) = &mut self.sea {
            sea.take(&packed, &ways);
        }
        if let Some(cloud) = &mut self.cloud {
            let water = (&packed[..], &ways[..]);
            cloud.take(
                &self.look,
                &self.scene,
                self.plan.radius,
                water,
                moment.white,
            );
        }
        self.load_spray(frame, moment);
        if !self.program.has(PARTICLES.name()) {
            return Ok(Loaded::default());
        }
        // Rays may begin under water, where what the water hides from above is seen.
        let hidden = match self.look.spec().renderer.method {
            MethodSpec::Ssfr => {
                let spacing = self.scene.particle_spacing;
                Some(Hidden::of(&packed, self.scene.domain.size(), spacing))
            }
            MethodSpec::Ray => None,
        };
        let cameras = self.cameras(frame);
        let seen = self.sort(frame, &cameras, hidden.as_ref(), &mut packed, &mut ways);
        let shapes = match self.program.has(SHAPES.name()) {
            true => shapes(&packed, seen, &self.scene, self.plan.radius),
            false => Vec::new(),
        };
        packed.truncate(seen);
        let count = seen as u32;
        self.reserve(seen)?;
        if let Some(hidden) = hidden {
            self.load_blocks(blocks_in_frame(hidden.blocks, &cameras))?;
        }
        let aired = self.load_aired(&packed);
        let pages = self.pages();
        let aired = self.load_pages(pages, packed.len(), &aired);
        for (buffer, shares) in [
            (PARTICLE_GROUPS, pages.shares(seen).collect()),
            (AIRED_GROUPS, aired),
        ] {
            if self.program.has(buffer.name()) {
                let groups = |share: &usize| spread(&self.program.context, ROWS, *share as u64);
                let groups: Vec<Workgroups> = shares.iter().map(|n| groups(n).into()).collect();
                self.program.upload(buffer, 0, &groups);
            }
        }
        self.program.upload(PARTICLES, 0, &packed);
        if self.program.has(SHAPES.name()) {
            self.program.upload(SHAPES, 0, &shapes);
        }
        if self.program.has(PATHS.name()) {
            let packed: Vec<_> = ways.iter().map(Path::packed).collect();
            self.program.upload(PATHS, 0, &packed);
        }
        let mut ahead = Vec::new();
        if wants_motion && moment.beside()[1].is_some() {
            let seconds = self.frame_seconds();
            for (particle, way) in packed.iter_mut().zip(&ways) {
                particle.velocity = (way.way(seconds).as_vec3() / seconds).to_array();
            }
            ahead = packed;
        }
        Ok(Loaded { count, ahead })
    }

    /// Tells the device which particles hold air, few of all, and gives their indices, ascending.
    fn load_aired(&self, packed: &[Particle]) -> Vec<u32> {
        if !self.program.has(AIRED.name()) {
            return Vec::new();
        }
        let aired = (0u32..).zip(packed).filter(|(_, it)| it.air & 0xffff > 0);
        let aired: Vec<u32> = aired.map(|(index, _)| index).collect();
        self.program.upload(AIRED, 0, &aired);
        aired
    }

    /// Tells the device which particles each dispatch sees, and gives how many of each page hold air.
    fn load_pages(&self, pages: Pages, particles: usize, aired: &[u32]) -> Vec<usize> {
        let counts: Vec<usize> = pages.shares(particles).collect();
        let mut windows = Vec::new();
        for (k, &count) in counts.iter().enumerate() {
            let first = k * pages.page;
            let before = |end: usize| aired.partition_point(|&index| (index as usize) < end);
            let aired = before(first)..before(first + count);
            windows.push(Page {
                first: first as u32,
                count: count as u32,
                aired_first: aired.start as u32,
                aired_count: aired.len() as u32,
            });
        }
        self.program.upload_windows(&PAGES, &windows);
        windows
            .iter()
            .map(|page| page.aired_count as usize)
            .collect()
    }

    fn frame_seconds(&self) -> f32 {
        (1.0 / self.scene.frames_per_second) as f32
    }

    fn pack(&self, frame: u32, particles: &Particles) -> Result<Vec<Particle>, RenderError> {
        let origin = self.scene.domain.min;
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

    /// Those of a frame's instant and of its samples.
    fn cameras(&self, frame: u32) -> Vec<Camera> {
        let setting = self.setting(0);
        let samples = [vec![Sample::STILL], samples_of(&self.look)].concat();
        samples
            .into_iter()
            .map(|sample| camera(&self.look, &setting, frame.into(), sample, 0))
            .collect()
    }

    /// First those that may be seen, strip by strip, front to back, so that splats find what hides them already there; how many they are.
    /// Then those that others hide and those beside the frame; of these `ways` keeps none.
    fn sort(
        &self,
        frame: u32,
        cameras: &[Camera],
        hidden: Option<&Hidden>,
        packed: &mut Vec<Particle>,
        ways: &mut Vec<Path>,
    ) -> usize {
        let rate = self.scene.frames_per_second;
        let pose = pose(&self.look, frame.into(), rate);
        let eye = (pose.position - self.scene.origin - self.scene.domain.min).as_vec3();
        let (right, forward) = (pose.right.as_vec3(), pose.forward.as_vec3());
        let depth = |p: &Particle| (Vec3::from(p.position) - eye).dot(forward);
        let focal = cameras.first().map_or(1.0, |camera| camera.focal);
        // Which strip does not depend on the others, so that the order of two particles is the same with overscan and without.
        let strip = |p: &Particle| {
            let aside = (Vec3::from(p.position) - eye).dot(right);
            (focal * aside / depth(p).max(f32::MIN_POSITIVE) / STRIP).floor() as i32
        };
        let in_frame = in_frame(packed, ways, cameras, self.scene.particle_spacing as f32);
        let is_seen =
            |index: usize| in_frame[index] && !hidden.is_some_and(|it| it.particles[index]);
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

    /// Tells the device which blocks of water stand for what is hidden; what there is room for beyond them is empty.
    fn load_blocks(&mut self, mut blocks: Vec<Block>) -> Result<(), RenderError> {
        if !self.program.has(BLOCKS.name()) {
            return Ok(());
        }
        let groups = spread(&self.program.context, ROWS, blocks.len() as u64);
        let room = room(blocks.len());
        if room > self.blocks {
            self.program.refit(&[BLOCKS.sized(room)], &[])?;
            self.blocks = room;
            self.record();
        }
        blocks.resize(self.blocks, Block::default());
        self.program.upload(BLOCK_GROUPS, 0, &[groups.into()]);
        self.program.upload(BLOCKS, 0, &blocks);
        Ok(())
    }

    /// Makes room for so many particles.
    fn reserve(&mut self, particles: usize) -> Result<(), RenderError> {
        if particles <= self.capacity {
            return Ok(());
        }
        let capacity = room(particles);
        let look = &self.look;
        let pages = Pages {
            capacity,
            ..self.pages()
        };
        let mut grown = vec![
            per_particle(&PARTICLES, capacity, look),
            PAGES.sized(pages.count()),
            AIRED.sized(capacity),
            per_particle(&SHAPES, capacity, look),
            per_particle(&PATHS, capacity, look),
        ];
        let groups = [PARTICLE_GROUPS, AIRED_GROUPS];
        grown.extend(groups.map(|groups| groups.sized(pages.count())));
        grown.retain(|spec| self.program.has(&spec.name));
        self.program.refit(&grown, &[])?;
        self.capacity = capacity;
        self.record();
        Ok(())
    }

    /// Tells the device what stands in the sums of spray: depths up to the domain's farthest corner and speeds up to the fastest, both
    /// with some room for what moves within a frame, and as powers of two, so that frames differ little in what is rounded.
    fn load_spray(&self, frame: u32, moment: &Moment<'_>) {
        if !draws_spray(&self.look) {
            return;
        }
        let rate = self.scene.frames_per_second;
        let eye = pose(&self.look, frame.into(), rate).position
            - (self.scene.origin + self.scene.domain.min);
        let farthest = eye
            .abs()
            .max((eye - self.scene.domain.size()).abs())
            .length();
        let fastest = (moment.water.particles.max_speed()).max(moment.white.max_speed());
        let room = |x: f64| (1.25 * x + 1.0).log2().ceil().exp2() as f32;
        let params = SprayParams {
            density: spray_density(&self.look) as f32,
            scale: filled(self.scene.particle_spacing, self.plan.radius) as f32,
            range: room(farthest),
            speed: room(fastest),
        };
        self.program.upload(SPRAY_PARAMS, 0, &[params]);
    }

    /// Whether the field of the body's particles, whose level set rays meet, is positive at the eye at the frame's instant.
    fn is_under_water(&self, frame: u32, packed: &[Particle]) -> bool {
        let rate = self.scene.frames_per_second;
        let origin = self.scene.origin + self.scene.domain.min;
        let eye = pose(&self.look, frame.into(), rate).position - origin;
        let (size, spacing) = (self.scene.domain.size(), self.scene.particle_spacing);
        let is_within = |p: DVec3| p.cmpge(DVec3::ZERO).all() && p.cmple(size).all();
        if !is_within(eye) {
            return false;
        }
        let near: Vec<DVec3> = packed
            .par_iter()
            .filter(|particle| particle.tag & 1 == 1)
            .map(|particle| Vec3::from(particle.position).as_dvec3())
            .filter(|&p| is_within(p) && p.distance(eye) < ABOUT_THE_EYE * spacing)
            .collect();
        let close = near.iter().filter(|p| p.distance(eye) < CLOSE * spacing);
        close.count() >= FEW && Kernels::fit(&near, size, spacing).field().value(eye) > 0.0
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
