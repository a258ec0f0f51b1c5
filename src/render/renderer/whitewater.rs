//! Uploads a frame's whitewater.

use crate::{
    RenderError, RenderScene,
    buffers::{WHITEWATER, WHITEWATER_GROUPS, WHITEWATER_PARAMS},
    lighting::spray_density,
    uniform,
};
use swell_domain::{
    particles::Particles,
    whitewater::{KIND, RADIUS, WhitewaterKind},
};
use swell_gpu::{program::Program, recording::spread};
use swell_scene::look::{Look, MethodSpec};

use super::capacity_for;

/// Depth, in particle spacings, at which the water above a bubble has removed 63 % of its white.
const FADING: f64 = 2.0;

/// Settings with which a look draws whitewater.
pub(super) struct WhitewaterDrawing {
    params: uniform::WhitewaterParams,
    /// Whether bubbles are splatted too; rays meet them instead.
    has_bubbles: bool,
    /// Allocated whitewater particles.
    capacity: usize,
}

impl WhitewaterDrawing {
    /// Returns `None` where the look draws no whitewater.
    pub(super) fn of(look: &Look, scene: &RenderScene) -> Option<Self> {
        let spec = look.spec().whitewater.as_ref()?;
        Some(Self {
            params: uniform::WhitewaterParams {
                count: 0,
                size: spec.size as f32,
                density: (spec.density_per_metre / spray_density(look).max(1e-30)) as f32,
                fading: (FADING * scene.particle_spacing) as f32,
            },
            has_bubbles: look.spec().renderer.method == MethodSpec::Ssfr,
            capacity: 1,
        })
    }

    /// Uploads a frame's whitewater, relative to the domain's least corner. Returns whether its
    /// buffer was reallocated.
    pub(super) fn load(
        &mut self,
        program: &mut Program,
        scene: &RenderScene,
        frame: u32,
        white: &Particles,
    ) -> Result<bool, RenderError> {
        let packed = self.packed(scene, frame, white)?;
        let grew = packed.len() > self.capacity;
        if grew {
            self.capacity = capacity_for(packed.len());
            program.refit(&[WHITEWATER.sized(self.capacity)], &[])?;
        }
        self.params.count = packed.len() as u32;
        let groups = spread(&program.context, 64, packed.len() as u64);
        program.upload(WHITEWATER_GROUPS, 0, &[groups.into()]);
        program.upload(WHITEWATER_PARAMS, 0, &[self.params]);
        program.upload(WHITEWATER, 0, &packed);
        Ok(grew)
    }

    /// Converts the part of a frame's whitewater that is splatted; foam is a layer on the water.
    pub(super) fn packed(
        &self,
        scene: &RenderScene,
        frame: u32,
        white: &Particles,
    ) -> Result<Vec<uniform::Whitewater>, RenderError> {
        let origin = scene.domain.min;
        let radii = white.attributes.get(RADIUS).map_or(&[][..], Vec::as_slice);
        let mut packed = Vec::with_capacity(white.len());
        let places = white.position.iter().zip(&white.velocity).zip(radii);
        for (index, ((p, v), &radius)) in places.enumerate() {
            if !p.iter().chain(v).chain([&radius]).all(|x| x.is_finite()) {
                return Err(RenderError::NotFinite { index, frame });
            }
            let is_bubble = match kind(white, index) {
                WhitewaterKind::Spray => false,
                WhitewaterKind::Bubble if self.has_bubbles => true,
                WhitewaterKind::Bubble | WhitewaterKind::Foam => continue,
            };
            packed.push(uniform::Whitewater {
                position: [0, 1, 2].map(|axis| (f64::from(p[axis]) - origin[axis]) as f32),
                radius,
                velocity: *v,
                foam: f32::from(u8::from(is_bubble)),
            });
        }
        Ok(packed)
    }
}

/// Kind of a particle; particles without a kind are spray.
pub(super) fn kind(white: &Particles, index: usize) -> WhitewaterKind {
    let kind = white.attributes.get(KIND).and_then(|all| all.get(index));
    (kind.and_then(|&number| WhitewaterKind::of_number(number))).unwrap_or(WhitewaterKind::Spray)
}
