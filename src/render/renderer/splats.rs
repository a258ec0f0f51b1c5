//! Particles on the device, and the passes that splat them.

use wgpu::{BindGroup, Buffer};

use super::buffers::Buffers;
use crate::{
    gpu::adapter::Context,
    render::{
        RenderError,
        pass::{ComputePass, Slot, storage, uniform},
        uniform,
    },
    scene::look::{AovSpec, Look},
};

/// The passes that go over particles.
pub(super) struct Splats {
    pub(super) depth: ComputePass,
    pub(super) thickness: ComputePass,
    pub(super) spray: Option<ComputePass>,
    pub(super) owner: Option<ComputePass>,
    /// Of the thickness: what a splat of this radius counts.
    params: Buffer,
}

/// Particles on the device, and the groups that bind them.
pub(super) struct Bound {
    pub(super) buffer: Buffer,
    pub(super) capacity: usize,
    pub(super) depth: BindGroup,
    pub(super) thickness: BindGroup,
    pub(super) spray: Option<BindGroup>,
    pub(super) owner: Option<BindGroup>,
    pub(super) shade_aovs: Vec<BindGroup>,
}

impl Splats {
    /// Those that the look calls for, of particles of a spacing and a splat radius, metres.
    pub(super) fn new(
        context: &Context,
        look: &Look,
        spacing: f64,
        radius: f64,
    ) -> Result<Self, RenderError> {
        use Slot::{Read, Uniform, Write};
        let pass = |name, slots: &[Slot]| ComputePass::new(context, name, name, &[], slots);
        let spray = match look.spec().water.spray {
            Some(_) => Some(pass(
                "ssfr/splat_spray",
                &[Uniform, Uniform, Read, Read, Read, Write],
            )?),
            None => None,
        };
        let owner = match look.wants(AovSpec::Forward) {
            true => Some(pass("ssfr/splat_owner", &[Uniform, Read, Read, Write])?),
            false => None,
        };
        let volume = spacing.powi(3) / (4.0 / 3.0 * std::f64::consts::PI * radius.powi(3));
        Ok(Self {
            depth: pass("ssfr/splat_depth", &[Uniform, Read, Read, Write])?,
            thickness: pass(
                "ssfr/splat_thickness",
                &[Uniform, Uniform, Read, Read, Write],
            )?,
            spray,
            owner,
            params: uniform(context, "thickness", &[volume as f32, 0.0, 0.0, 0.0]),
        })
    }

    /// Room for so many particles.
    pub(super) fn particles(context: &Context, capacity: usize) -> Result<Buffer, RenderError> {
        let bytes = capacity as u64 * size_of::<uniform::Particle>() as u64;
        Ok(storage(context, "render particles", bytes)?)
    }

    /// Groups over `buffer`, which [`Self::particles`] made; `surface` is where the smoothed depth stands.
    pub(super) fn bind(
        &self,
        context: &Context,
        buffer: Buffer,
        capacity: usize,
        camera: &Buffer,
        frame: &Buffers,
        surface: &Buffer,
    ) -> Bound {
        let group = |pass: &ComputePass, buffers: &[&Buffer]| {
            let resources = buffers
                .iter()
                .map(|buffer| buffer.as_entire_binding())
                .collect();
            pass.bind(context, resources)
        };
        let (params, solid) = (&self.params, &frame.solid_depth);
        let spray = self.spray.as_ref().zip(frame.spray.as_ref());
        let owner = self.owner.as_ref().zip(frame.owner.as_ref());
        Bound {
            depth: group(&self.depth, &[camera, &buffer, solid, &frame.depth[0]]),
            thickness: group(
                &self.thickness,
                &[camera, params, &buffer, solid, &frame.thickness],
            ),
            spray: spray.map(|(pass, spray)| {
                group(pass, &[camera, params, &buffer, solid, surface, spray])
            }),
            owner: owner
                .map(|(pass, owner)| group(pass, &[camera, &buffer, &frame.depth[0], owner])),
            shade_aovs: Vec::new(),
            buffer,
            capacity,
        }
    }
}
