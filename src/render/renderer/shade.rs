//! The passes that shade, and what they read beside the frame.

use wgpu::{BindGroup, BindingResource, Buffer, TextureView};

use super::buffers::{Buffers, camera_buffer};
use crate::{
    gpu::adapter::Context,
    render::{
        RenderError,
        frame::Band,
        lighting::{shading, shadow_sampler, sky_sampler, sky_texture},
        pass::{ComputePass, Slot, uniform},
        sky::Sky,
    },
    scene::look::Look,
};

const SLOTS: [Slot; 12] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Uniform,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Read,
    Slot::Texture,
    Slot::Sampler,
    Slot::DepthTexture,
    Slot::CompareSampler,
    Slot::Write,
];

/// Shading of the picture, and of the channels beside it where the look asks for any.
pub(super) struct Shade {
    pub(super) camera: Buffer,
    pub(super) next_camera: Buffer,
    pub(super) pass: ComputePass,
    pub(super) aovs: Option<ComputePass>,
    shading: Buffer,
    sky: TextureView,
    sky_sampler: wgpu::Sampler,
    shadow: TextureView,
    shadow_sampler: wgpu::Sampler,
}

impl Shade {
    /// With the shadow map and what takes the world into it.
    pub(super) fn new(
        context: &Context,
        look: &Look,
        camera: Buffer,
        shadow: TextureView,
        shadow_from_world: [[f32; 4]; 4],
    ) -> Result<Self, RenderError> {
        let baked = Sky::new(look, context.limits.max_texture_dimension_2d)?;
        let pass = |name, define, more: &[Slot]| {
            let slots = [&SLOTS, more].concat();
            ComputePass::new(context, name, "ssfr/shade", define, &slots)
        };
        let aovs = match look.spec().output.aovs.is_empty() {
            false => Some(pass(
                "ssfr/shade_aovs",
                &["AOVS"],
                &[Slot::Read, Slot::Read, Slot::Uniform],
            )?),
            true => None,
        };
        Ok(Self {
            camera,
            next_camera: camera_buffer(context),
            pass: match look.spec().water.spray {
                Some(_) => pass("ssfr/shade", &["SPRAY"], &[Slot::Read])?,
                None => pass("ssfr/shade", &[], &[])?,
            },
            aovs,
            shading: uniform(
                context,
                "shading",
                &shading(look, &baked, shadow_from_world),
            ),
            sky: sky_texture(context, &baked),
            sky_sampler: sky_sampler(context),
            shadow,
            shadow_sampler: shadow_sampler(context),
        })
    }

    /// One group a band, for the picture.
    pub(super) fn bind(
        &self,
        context: &Context,
        bands: &[Band],
        frame: &Buffers,
        surface: &Buffer,
    ) -> Vec<BindGroup> {
        let group = |band: &Band| {
            let mut resources = self.resources(band, frame, surface, &band.colour);
            resources.extend(frame.spray.as_ref().map(Buffer::as_entire_binding));
            self.pass.bind(context, resources)
        };
        bands.iter().map(group).collect()
    }

    /// One group a band, for the channels beside the picture; none where the look asks for none.
    pub(super) fn bind_aovs(
        &self,
        context: &Context,
        bands: &[Band],
        frame: &Buffers,
        surface: &Buffer,
        particles: &Buffer,
    ) -> Vec<BindGroup> {
        let Some(pass) = &self.aovs else {
            return Vec::new();
        };
        // Without `forward` no one is asked for, and any buffer of words stands in.
        let owner = frame.owner.as_ref().unwrap_or(&frame.thickness);
        let group = |(band, aovs): (&Band, &Buffer)| {
            let mut resources = self.resources(band, frame, surface, aovs);
            resources.extend([
                owner.as_entire_binding(),
                particles.as_entire_binding(),
                self.next_camera.as_entire_binding(),
            ]);
            pass.bind(context, resources)
        };
        bands
            .iter()
            .filter_map(|band| Some((band, band.aovs.as_ref()?)))
            .map(group)
            .collect()
    }

    fn resources<'a>(
        &'a self,
        band: &'a Band,
        frame: &'a Buffers,
        surface: &'a Buffer,
        output: &'a Buffer,
    ) -> Vec<BindingResource<'a>> {
        vec![
            self.camera.as_entire_binding(),
            self.shading.as_entire_binding(),
            band.uniform.as_entire_binding(),
            surface.as_entire_binding(),
            frame.thickness.as_entire_binding(),
            frame.solid_depth.as_entire_binding(),
            frame.solid_packed.as_entire_binding(),
            BindingResource::TextureView(&self.sky),
            BindingResource::Sampler(&self.sky_sampler),
            BindingResource::TextureView(&self.shadow),
            BindingResource::Sampler(&self.shadow_sampler),
            output.as_entire_binding(),
        ]
    }
}
