//! Inputs of the shading pass: the look as a uniform and the sky as a texture.

use super::RenderScene;
use super::plan::Plan;
use super::sky::{Sky, extinction};
use super::uniform;
use super::wet::film;
use swell_gpu::texture::{SamplerSpec, TextureSpec};
use swell_scene::look::{Look, LookSpec, SkySpec};

/// Offset along the normal of a shadow lookup, relative to the domain's longer horizontal side:
/// about three texels of the shadow map, which covers little more than the domain.
const SHADOW_OFFSET: f64 = 0.0016;

pub(super) fn shading(
    look: &Look,
    scene: &RenderScene,
    sky: &Sky,
    shadow_from_world: [[f32; 4]; 4],
) -> uniform::Shading {
    let spec = look.spec();
    let sun = look.sun_direction();
    let colour = |c: [f64; 3]| c.map(|x| x as f32);
    let index = spec.water.index;
    // Snell: cosine of the sunlight's direction in flat water.
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
        spacing: scene.particle_spacing as f32,
        ground_colour: colour(spec.ground.colour),
        ground_variation: spec.ground.variation as f32,
        solid_colour: colour(spec.solids.colour),
        haze: haze(spec) as f32,
        ripple: ripple.map_or([0.0; 2], |r| [r.wavelength_m as f32, r.slope as f32]),
        windows: windows.map_or([0.0; 2], |w| [w.storey_m as f32, w.bay_m as f32]),
        window_lit: windows.map_or(0.0, |w| w.lit as f32),
        // Radiance of a lit room beside a street at dusk: some percent of the reference light.
        window_radiance: 0.06,
        background: if spec.output.background { 1.0 } else { 0.0 },
        disc: sky.disc,
        extent: scene.extent() as f32,
        shadow_offset: (SHADOW_OFFSET * scene.extent()) as f32,
        film: film(spec).map(|x| x as f32),
        irradiance: sky.irradiance,
        shadow_from_world,
    }
}

/// Defines `RIPPLES` and `WINDOWS` in the shading passes where the look has them.
pub(super) fn plan_details(plan: &mut Plan, look: &Look, passes: &[&'static str]) {
    let spec = look.spec();
    for pass in passes {
        if spec.surface.ripple.is_some() {
            plan.define(pass, "RIPPLES");
        }
        if spec.solids.windows.is_some() {
            plan.define(pass, "WINDOWS");
        }
    }
}

/// Distance in metres at which air has removed 63 % of the contrast.
fn haze(spec: &LookSpec) -> f64 {
    match spec.sky {
        SkySpec::HosekWilkie {
            turbidity,
            haze: true,
            ..
        } => 1.0 / extinction(turbidity),
        _ => spec.ground.haze_m,
    }
}

/// Optical density of the spray sums, 1/m: that of the look's spray, else that of its whitewater.
pub(super) fn spray_density(look: &Look) -> f64 {
    let own = look
        .spec()
        .water
        .spray
        .as_ref()
        .map(|s| s.density_per_metre);
    let white = look.spec().whitewater.as_ref().map(|w| w.density_per_metre);
    own.or(white).unwrap_or(0.0)
}

/// Plans the textures and samplers of light, except the shadow map itself.
pub(super) fn plan_light(plan: &mut Plan, sky: &Sky) {
    let spec = TextureSpec {
        name: "sky".into(),
        size: sky.size,
        format: wgpu::TextureFormat::Rgba16Float,
    };
    let texels: Vec<u16> = sky.texels.iter().flatten().map(|x| x.to_bits()).collect();
    plan.texture(spec, bytemuck::cast_slice(&texels).to_vec());
    plan.samplers.push(SamplerSpec {
        name: "sky_sampler",
        repeats_x: true,
        compare: None,
    });
    plan.samplers.push(SamplerSpec {
        name: "shadow_sampler",
        repeats_x: false,
        compare: Some(wgpu::CompareFunction::LessEqual),
    });
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use std::path::Path;

    use super::*;
    use swell_files::parse_look;

    #[test]
    fn air_is_the_grounds_or_the_skys() {
        let of = |line: &str| {
            let text = format!(
                "[camera]\nfocal_length_mm = 35.0\nposition = [0.0, 1.0, 0.0]\n\
                 target = [1.0, 1.0, 0.0]\n[image]\nwidth = 64\n\
                 height = 36\n[sky]\nmodel = \"hosek_wilkie\"\nturbidity = 5.0\n{line}\n\
                 [ground]\nhaze_m = 700.0\n"
            );
            let look = parse_look(&text, Path::new("t.toml")).unwrap();
            haze(look.spec())
        };
        assert_eq!(of(""), 700.0);
        assert_eq!(of("haze = false"), 700.0);
        assert_eq!(of("haze = true"), 1.0 / extinction(5.0));
    }
}
