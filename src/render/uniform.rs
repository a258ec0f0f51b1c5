//! `repr(C)` mirrors of the shaders' uniforms; field meanings stand beside the WGSL.

use bytemuck::{Pod, Zeroable};

/// `shared/camera.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Camera {
    pub(super) position: [f32; 3],
    pub(super) seconds: f32,
    pub(super) right: [f32; 3],
    pub(super) focal: f32,
    pub(super) up: [f32; 3],
    pub(super) particle_count: u32,
    pub(super) forward: [f32; 3],
    pub(super) radius: f32,
    pub(super) centre: [f32; 2],
    pub(super) size: [u32; 2],
    pub(super) margin: [u32; 2],
    pub(super) picture: [u32; 2],
    pub(super) weight: f32,
    pub(super) sample_index: u32,
    pub(super) clock: f32,
    pub(super) frame_seconds: f32,
}

/// `shared/ssfr_splat.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Particle {
    pub(super) position: [f32; 3],
    pub(super) aeration: f32,
    pub(super) velocity: [f32; 3],
    pub(super) tag: u32,
}

/// `shared/ssfr_light.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Shading {
    pub(super) sun_direction: [f32; 3],
    pub(super) roughness: f32,
    pub(super) sun_irradiance: [f32; 3],
    pub(super) index: f32,
    pub(super) absorption: [f32; 3],
    pub(super) sun_path: f32,
    pub(super) scattering: [f32; 3],
    pub(super) spray_density: f32,
    pub(super) ground_colour: [f32; 3],
    pub(super) ground_variation: f32,
    pub(super) solid_colour: [f32; 3],
    pub(super) haze: f32,
    pub(super) ripple: [f32; 2],
    pub(super) windows: [f32; 2],
    pub(super) window_lit: f32,
    pub(super) window_radiance: f32,
    pub(super) background: f32,
    pub(super) disc: f32,
    pub(super) irradiance: [[f32; 4]; 9],
    pub(super) shadow_from_world: [[f32; 4]; 4],
}

/// `shared/ssfr_flow.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Flow {
    pub(super) width: f32,
    pub(super) world: u32,
    pub(super) fraction: f32,
    pub(super) edge: f32,
    pub(super) steps: u32,
    pub(super) levels: u32,
    pub(super) pad: [u32; 2],
}

/// `shared/ssfr_flow.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct FlowLevel {
    pub(super) size: [u32; 2],
    pub(super) level: u32,
    pub(super) index: u32,
}

/// `ssfr/narrow_range.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Narrow {
    pub(super) width: f32,
    pub(super) range: f32,
    pub(super) offset: f32,
    pub(super) axis: u32,
}

/// `ssfr/fill.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Fill {
    pub(super) word: u32,
    pub(super) count: u32,
    pub(super) pad: [u32; 2],
}

/// `shared/ssfr_solid.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Triangle {
    pub(super) a: [f32; 3],
    pub(super) material: u32,
    pub(super) b: [f32; 3],
    pub(super) pad0: u32,
    pub(super) c: [f32; 3],
    pub(super) pad1: u32,
}

/// `ssfr/solid.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Tile {
    pub(super) corner: [f32; 2],
    pub(super) size: [f32; 2],
}

/// `ssfr/shade.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Band {
    pub(super) row: u32,
    pub(super) rows: u32,
    pub(super) pad: [u32; 2],
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use std::mem::size_of;

    use super::*;

    fn offsets(pass: &str, name: &str) -> (Vec<(String, u32)>, u32) {
        let text = crate::gpu::shader::compose(pass, &[]).unwrap();
        let module = naga::front::wgsl::parse_str(&text).unwrap();
        let found = module.types.iter().find_map(|(_, ty)| match &ty.inner {
            naga::TypeInner::Struct { members, span } if ty.name.as_deref() == Some(name) => {
                let members = members
                    .iter()
                    .map(|member| (member.name.clone().unwrap_or_default(), member.offset))
                    .collect();
                Some((members, *span))
            }
            _ => None,
        });
        found.unwrap_or_else(|| panic!("{pass} has no struct {name}"))
    }

    macro_rules! mirrors {
        ($pass:literal, $wgsl:literal, $rust:ident, $($field:ident),+) => {{
            let (members, span) = offsets($pass, $wgsl);
            let ours = [$((stringify!($field), std::mem::offset_of!($rust, $field))),+];
            for (name, offset) in ours {
                let theirs = members.iter().find(|(member, _)| member == name);
                assert_eq!(theirs.map(|(_, at)| *at as usize), Some(offset), "{}.{name}", $wgsl);
            }
            assert_eq!(span as usize, size_of::<$rust>(), "{}", $wgsl);
        }};
    }

    #[test]
    fn mirrors_agree_with_the_shaders() {
        mirrors!(
            "ssfr/shade",
            "Camera",
            Camera,
            position,
            seconds,
            right,
            focal,
            up,
            particle_count,
            forward,
            radius,
            centre,
            size,
            margin,
            picture,
            weight,
            sample_index,
            clock,
            frame_seconds
        );
        mirrors!(
            "ssfr/splat_depth",
            "Particle",
            Particle,
            position,
            aeration,
            velocity,
            tag
        );
        mirrors!(
            "ssfr/shade",
            "Shading",
            Shading,
            sun_direction,
            roughness,
            sun_irradiance,
            index,
            absorption,
            sun_path,
            scattering,
            spray_density,
            ground_colour,
            ground_variation,
            solid_colour,
            haze,
            ripple,
            windows,
            window_lit,
            window_radiance,
            background,
            disc,
            irradiance,
            shadow_from_world
        );
        mirrors!(
            "ssfr/curvature_flow",
            "FlowParams",
            Flow,
            width,
            world,
            fraction,
            edge,
            steps,
            levels
        );
        mirrors!(
            "ssfr/curvature_flow",
            "FlowLevel",
            FlowLevel,
            size,
            level,
            index
        );
        mirrors!(
            "ssfr/narrow_range",
            "NarrowParams",
            Narrow,
            width,
            range,
            offset,
            axis
        );
        mirrors!("ssfr/fill", "FillParams", Fill, word, count);
        mirrors!("ssfr/solid", "Triangle", Triangle, a, material, b, c);
        mirrors!("ssfr/solid", "Tile", Tile, corner, size);
        mirrors!("ssfr/shade", "Band", Band, row, rows);
    }
}
