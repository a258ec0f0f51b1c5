//! What the shading pass is given: the look as a uniform, the sky as a texture.

use wgpu::TextureView;

use super::sky::Sky;
use super::uniform;
use crate::gpu::adapter::Context;
use crate::scene::look::Look;

pub(super) fn shading(
    look: &Look,
    sky: &Sky,
    shadow_from_world: [[f32; 4]; 4],
) -> uniform::Shading {
    let spec = look.spec();
    let sun = look.sun_direction();
    let colour = |c: [f64; 3]| c.map(|x| x as f32);
    let index = spec.water.index;
    // Snell: the cosine of the sunlight's way through flat water.
    let sun_cosine = (1.0 - (1.0 - sun.y * sun.y) / (index * index)).sqrt();
    let ripple = spec.surface.ripple.as_ref();
    let windows = spec.solids.windows.as_ref();
    uniform::Shading {
        sun_direction: sun.as_vec3().to_array(),
        roughness: spec.surface.roughness as f32,
        sun_irradiance: sky.sun_irradiance.to_array(),
        index: index as f32,
        absorption: colour(spec.water.absorption_per_metre),
        sun_path: (1.0 / sun_cosine) as f32,
        scattering: colour(spec.water.scattering_per_metre),
        spray_density: spec
            .water
            .spray
            .as_ref()
            .map_or(0.0, |spray| spray.density_per_metre as f32),
        ground_colour: colour(spec.ground.colour),
        ground_variation: spec.ground.variation as f32,
        solid_colour: colour(spec.solids.colour),
        haze: spec.ground.haze_m as f32,
        ripple: ripple.map_or([0.0; 2], |r| [r.wavelength_m as f32, r.slope as f32]),
        windows: windows.map_or([0.0; 2], |w| [w.storey_m as f32, w.bay_m as f32]),
        window_lit: windows.map_or(0.0, |w| w.lit as f32),
        // A lit room beside a street at dusk: some percent of the reference light.
        window_radiance: 0.06,
        background: if spec.output.background { 1.0 } else { 0.0 },
        disc: sky.disc,
        irradiance: sky.irradiance,
        shadow_from_world,
    }
}

pub(super) fn sky_texture(context: &Context, sky: &Sky) -> TextureView {
    let size = wgpu::Extent3d {
        width: sky.size[0],
        height: sky.size[1],
        depth_or_array_layers: 1,
    };
    let texture = context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("sky"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let bytes: Vec<u16> = sky.texels.iter().flatten().map(|x| x.to_bits()).collect();
    context.queue.write_texture(
        texture.as_image_copy(),
        bytemuck::cast_slice(&bytes),
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(8 * sky.size[0]),
            rows_per_image: None,
        },
        size,
    );
    texture.create_view(&Default::default())
}

pub(super) fn sky_sampler(context: &Context) -> wgpu::Sampler {
    context.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("sky"),
        address_mode_u: wgpu::AddressMode::Repeat,
        address_mode_v: wgpu::AddressMode::ClampToEdge,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    })
}

pub(super) fn shadow_sampler(context: &Context) -> wgpu::Sampler {
    context.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("shadow"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        compare: Some(wgpu::CompareFunction::LessEqual),
        ..Default::default()
    })
}
