//! Renders additional channels and reads them back from the device.

use super::{Renderer, Shot, parts::PartProgress};
use crate::{
    RenderError,
    buffers::{NEXT_CAMERA, PARTICLES, aovs},
    camera::{Setting, camera},
    frame::FAR,
    image::Aovs,
    samples::{Sample, samples_of},
    uniform::Particle,
};
use swell_scene::look::{AovFilterSpec, AovSpec};

/// Values per pixel: Z, N, P, forward, thickness.
const VALUES: usize = 10;
/// Index of the thickness, which is 0 where a ray meets nothing; the other channels are then
/// undefined.
const THICKNESS: usize = 9;

/// Weighted sums over samples.
struct Means {
    /// Total weight of all samples.
    all: f64,
    /// For each pixel, total weight of the samples that met a surface.
    met: Vec<f64>,
    sums: Vec<[f64; VALUES]>,
}

impl Means {
    fn new(pixels: usize) -> Self {
        Self {
            all: 0.0,
            met: vec![0.0; pixels],
            sums: vec![[0.0; VALUES]; pixels],
        }
    }

    fn add(&mut self, values: &[[f32; VALUES]], weight: f64) {
        self.all += weight;
        for ((sum, met), v) in self.sums.iter_mut().zip(&mut self.met).zip(values) {
            sum[THICKNESS] += weight * f64::from(v[THICKNESS]);
            if is_seen(v) {
                *met += weight;
                for (sum, value) in sum[..THICKNESS].iter_mut().zip(v) {
                    *sum += weight * f64::from(*value);
                }
            }
        }
    }

    /// Weighted means: of the thickness over all samples, of the other channels over those that met
    /// a surface. Pixels without such a sample take the values of `still`.
    fn over(self, still: &[[f32; VALUES]]) -> Vec<[f32; VALUES]> {
        let pixels = self.sums.iter().zip(&self.met).zip(still);
        pixels
            .map(|((sum, &met), nothing)| {
                let mut mean = match met > 0.0 {
                    true => sum.map(|value| (value / met) as f32),
                    false => *nothing,
                };
                mean[THICKNESS] = (sum[THICKNESS] / self.all) as f32;
                mean
            })
            .collect()
    }
}

fn is_seen(v: &[f32; VALUES]) -> bool {
    v[0] < 0.1 * FAR
}

impl Renderer {
    /// Renders the additional channels of a frame. `ahead` holds the particles with the mean
    /// velocities to the next frame, or nothing where these are unknown.
    pub(super) fn draw_aovs(
        &mut self,
        frame: u32,
        setting: &Setting,
        ahead: &[Particle],
        parts: &mut PartProgress<'_>,
    ) -> Result<Aovs, RenderError> {
        if !ahead.is_empty() {
            self.program.upload(PARTICLES, 0, ahead);
        }
        let filter = self.look.spec().output.aov_filter;
        let mut means = Means::new(self.plan.extent.shaded());
        let mut last = Vec::new();
        for (order, sample) in (0u32..).zip(self.aov_samples()) {
            let next = camera(&self.look, setting, f64::from(frame) + 1.0, sample, 0);
            self.program.upload(NEXT_CAMERA, 0, &[next]);
            let shot = Shot {
                frame,
                order,
                index: 0,
                sample,
                setting,
            };
            self.sample(&shot, true, parts)?;
            last = self.read_bands(aovs, 1)?;
            if filter == AovFilterSpec::Beauty {
                means.add(&last, sample.weight);
            }
        }
        Ok(self.named(&match filter {
            AovFilterSpec::Centre => last,
            AovFilterSpec::Beauty => means.over(&last),
        }))
    }

    /// Samples with which additional channels are rendered.
    pub(super) fn aov_samples(&self) -> Vec<Sample> {
        match self.look.spec().output.aov_filter {
            AovFilterSpec::Centre => vec![Sample::STILL],
            AovFilterSpec::Beauty => samples_of(&self.look),
        }
    }

    /// Splits pixel values into the channels that the look requests.
    fn named(&self, values: &[[f32; VALUES]]) -> Aovs {
        let origin = self.scene.origin + self.scene.domain.min;
        let place = |v: &[f32; VALUES]| {
            if !is_seen(v) {
                return [0.0; 3];
            }
            [0, 1, 2].map(|axis| (f64::from(v[4 + axis]) + origin[axis]) as f32)
        };
        let wants = |aov| self.look.wants(aov);
        Aovs {
            z: wants(AovSpec::Z).then(|| values.iter().map(|v| v[0]).collect()),
            n: wants(AovSpec::N).then(|| values.iter().map(|v| [v[1], v[2], v[3]]).collect()),
            p: wants(AovSpec::P).then(|| values.iter().map(place).collect()),
            forward: wants(AovSpec::Forward).then(|| values.iter().map(|v| [v[7], v[8]]).collect()),
            thickness: wants(AovSpec::Thickness)
                .then(|| values.iter().map(|v| v[THICKNESS]).collect()),
        }
    }
}
