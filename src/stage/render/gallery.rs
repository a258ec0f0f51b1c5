//! Draws frames of a cache with one look after another and compares them with a ground truth.

use std::{path::Path, time::Instant};

use glam::DVec3;

use super::{
    RenderJobError,
    near::{Near, NearbyFrames},
    render_scene,
    surfaces::{FINER, Set, truth},
    told,
};
use crate::baked_scene;
use swell_cache::CacheReader;
use swell_check::{
    pictures::{score, shown},
    render::Surfaces,
};
use swell_compare::{perceptual, pictures::Picture};
use swell_domain::{eye::Eye, frame_range::FrameRange, particles::Particles};
use swell_gpu::adapter::Context;
use swell_reference::rays::RayHit;
use swell_render::{RenderScene, Renderer, eye};
use swell_scene::{
    Scene,
    look::{Look, MethodSpec},
};

pub use swell_check::render::Summary;
pub use swell_render::REACH;

/// Frames of a cache with their ground truth for one look: f64 rays, and finer rays if pictures are
/// scored.
pub struct Gallery<'a> {
    context: &'a Context,
    frames: Vec<Framed>,
}

struct Framed {
    number: u32,
    set: RenderScene,
    around: NearbyFrames,
    eye: Eye,
    seen: Vec<RayHit>,
    /// Picture by finer rays; `None` if pictures are not scored.
    picture: Option<Picture>,
}

/// Result of drawing the frames with a look.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct DrawnLook {
    /// Wall-clock seconds of each repeat for the pictures of all frames.
    pub seconds: Vec<f64>,
    /// Error of the surface over all frames; `None` if no water was visible.
    pub surface: Option<Summary>,
    /// SSIMULACRA 2 score against finer rays, mean over the frames; `None` if pictures are not
    /// scored.
    pub score: Option<f64>,
}

/// Checks that this build can score pictures.
///
/// # Errors
/// [`RenderJobError::MissingFeature`].
pub fn require_scores() -> Result<(), RenderJobError> {
    Ok(perceptual::require()?)
}

impl<'a> Gallery<'a> {
    /// Opens frames of a cache and computes their ground truth for the camera of `look`; with
    /// `is_scored` also their pictures by finer rays.
    ///
    /// # Errors
    /// Errors of the cache, its scene or the device.
    pub fn open(
        context: &'a Context,
        cache: &Path,
        look: &Look,
        frames: &FrameRange,
        is_scored: bool,
    ) -> Result<Self, RenderJobError> {
        let reader = CacheReader::open(cache)?;
        let scene = baked_scene(&reader, cache)?;
        let frames = frames.iter().map(|number| {
            let framed = Framed::of((&reader, &scene), look, number)?;
            match is_scored {
                true => framed.scored(context, (&reader, &scene), look),
                false => Ok(framed),
            }
        });
        Ok(Self {
            context,
            frames: frames.collect::<Result<_, RenderJobError>>()?,
        })
    }

    /// Number of particles of all frames.
    pub fn particles(&self) -> usize {
        self.frames
            .iter()
            .map(|frame| frame.particles().len())
            .sum()
    }

    /// Draws the frames `repeats` times, after one uncounted run that warms up the device's
    /// pipelines.
    ///
    /// # Errors
    /// A device error, or a frame that cannot be drawn.
    pub fn draw(&self, look: &Look, repeats: u32) -> Result<DrawnLook, RenderJobError> {
        let mut drawn = DrawnLook {
            seconds: vec![0.0; repeats as usize],
            surface: None,
            score: None,
        };
        let mut surfaces = Surfaces::default();
        let mut scores = Vec::new();
        let white = Particles::default();
        for frame in &self.frames {
            let picture = look.of_water(look.spec().renderer.method);
            let mut renderer = frame.renderer(self.context, &picture)?;
            let inputs = frame.around.inputs(&white);
            let image = renderer.render_inputs(frame.number, &inputs)?;
            for seconds in &mut drawn.seconds {
                let around = frame.around.anew();
                let begun = Instant::now();
                renderer.render_inputs(frame.number, &around.inputs(&white))?;
                *seconds += begun.elapsed().as_secs_f64();
            }
            if let Some(truth) = &frame.picture {
                scores.extend(score(&shown(&image, &look.spec().view), truth)?);
            }
            let surface = look.of_surface(look.spec().renderer.method);
            let mut renderer = frame.renderer(self.context, &surface)?;
            let image = renderer.render(frame.number, frame.particles())?;
            surfaces.add(&image, &frame.seen, &frame.eye, frame.set.particle_spacing);
        }
        drawn.surface = surfaces.summary();
        let count = scores.len() as f64;
        drawn.score = (!scores.is_empty()).then(|| scores.iter().sum::<f64>() / count);
        Ok(drawn)
    }
}

impl Framed {
    fn of(
        (cache, scene): (&CacheReader, &Scene),
        look: &Look,
        number: u32,
    ) -> Result<Self, RenderJobError> {
        let around = Near::new(scene).around(cache, look, number)?;
        let water = &around.water.particles;
        let set = render_scene(scene, look, number, &around.state())?;
        let (seen, _) = truth(look, &set, number, water)?;
        Ok(Self {
            number,
            around,
            eye: eye(look, DVec3::ZERO, number.into(), set.frames_per_second),
            seen,
            picture: None,
            set,
        })
    }

    fn scored(
        self,
        context: &Context,
        (cache, scene): (&CacheReader, &Scene),
        look: &Look,
    ) -> Result<Self, RenderJobError> {
        let set = Set {
            cache,
            scene,
            context,
        };
        let (samples, voxels) = FINER;
        let finer = look.of_water(MethodSpec::Ray).finer(samples, voxels);
        Ok(Self {
            picture: Some(set.draw(&finer, self.number)?),
            ..self
        })
    }

    fn particles(&self) -> &Particles {
        &self.around.water.particles
    }

    fn renderer(&self, context: &Context, look: &Look) -> Result<Renderer, RenderJobError> {
        Renderer::new(context, look, &self.set).map_err(|error| told(error, look))
    }
}
