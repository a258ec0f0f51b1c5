//! `repr(C)` mirrors of the shaders' uniforms; field meanings stand beside the WGSL.

use crate::gpu::reflect::mirror;

mirror!(
    /// `Camera` of shared/camera.wgsl.
    Camera {
        position: [f32; 3],
        seconds: f32,
        right: [f32; 3],
        focal: f32,
        up: [f32; 3],
        particle_count: u32,
        forward: [f32; 3],
        radius: f32,
        centre: [f32; 2],
        size: [u32; 2],
        margin: [u32; 2],
        picture: [u32; 2],
        weight: f32,
        sample_index: u32,
        clock: f32,
        frame_seconds: f32,
    }
);

mirror!(
    /// `Particle` of shared/ssfr_splat.wgsl.
    Particle {
        position: [f32; 3],
        aeration: f32,
        velocity: [f32; 3],
        tag: u32,
    }
);

mirror!(
    /// `Shading` of shared/ssfr_light.wgsl.
    Shading {
        sun_direction: [f32; 3],
        roughness: f32,
        sun_irradiance: [f32; 3],
        index: f32,
        absorption: [f32; 3],
        sun_path: f32,
        scattering: [f32; 3],
        spray_density: f32,
        ground_colour: [f32; 3],
        ground_variation: f32,
        solid_colour: [f32; 3],
        haze: f32,
        ripple: [f32; 2],
        windows: [f32; 2],
        window_lit: f32,
        window_radiance: f32,
        background: f32,
        disc: f32,
        irradiance: [[f32; 4]; 9],
        shadow_from_world: [[f32; 4]; 4],
    }
);

mirror!(
    /// `FlowParams` of shared/ssfr_flow.wgsl.
    Flow {
        width: f32,
        world: u32,
        fraction: f32,
        edge: f32,
        steps: u32,
        levels: u32,
        pad0: u32,
        pad1: u32,
    }
);

mirror!(
    /// `FlowLevel` of shared/ssfr_flow.wgsl.
    FlowLevel {
        size: [u32; 2],
        level: u32,
        index: u32,
    }
);

mirror!(
    /// `NarrowParams` of ssfr/narrow_range.wgsl.
    Narrow {
        width: f32,
        range: f32,
        offset: f32,
        axis: u32,
    }
);

mirror!(
    /// `FillParams` of ssfr/fill.wgsl.
    Fill {
        word: u32,
        count: u32,
        pad0: u32,
        pad1: u32,
    }
);

mirror!(
    /// `Triangle` of shared/ssfr_solid.wgsl.
    Triangle {
        a: [f32; 3],
        material: u32,
        b: [f32; 3],
        pad0: u32,
        c: [f32; 3],
        pad1: u32,
    }
);

mirror!(
    /// `ThicknessParams` of ssfr/splat_thickness.wgsl and ssfr/splat_spray.wgsl.
    Thickness {
        scale: f32,
        pad0: f32,
        pad1: f32,
        pad2: f32,
    }
);

mirror!(
    /// `Tile` of ssfr/solid.wgsl.
    Tile {
        corner: [f32; 2],
        size: [f32; 2],
    }
);

mirror!(
    /// `Band` of ssfr/shade.wgsl.
    Band {
        row: u32,
        rows: u32,
        pad0: u32,
        pad1: u32,
    }
);

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use super::*;
    use crate::gpu::{
        reflect::{Layout, reflect},
        shader::compose,
    };

    /// What the WGSL of a pass says of a struct.
    fn layout(pass: &str, name: &str) -> Layout {
        let layouts = reflect(pass, &compose(pass, &[]).unwrap()).unwrap().layouts;
        let found = layouts.into_iter().find(|layout| layout.name == name);
        found.unwrap_or_else(|| panic!("{pass} has no struct {name}"))
    }

    macro_rules! mirrors {
        ($($pass:literal $wgsl:literal $rust:ident),+ $(,)?) => {
            [$(($pass, $wgsl, size_of::<$rust>() as u32, $rust::members())),+]
        };
    }

    #[test]
    fn mirrors_agree_with_the_shaders() {
        let mirrors = mirrors![
            "ssfr/shade" "Camera" Camera,
            "ssfr/splat_depth" "Particle" Particle,
            "ssfr/shade" "Shading" Shading,
            "ssfr/curvature_flow" "FlowParams" Flow,
            "ssfr/curvature_flow" "FlowLevel" FlowLevel,
            "ssfr/narrow_range" "NarrowParams" Narrow,
            "ssfr/fill" "FillParams" Fill,
            "ssfr/solid" "Triangle" Triangle,
            "ssfr/splat_thickness" "ThicknessParams" Thickness,
            "ssfr/splat_spray" "ThicknessParams" Thickness,
            "ssfr/solid" "Tile" Tile,
            "ssfr/shade" "Band" Band,
        ];
        for (pass, name, size, members) in mirrors {
            let found = layout(pass, name);
            assert_eq!(found.members, members, "{pass} {name}");
            assert_eq!(found.size, size, "{pass} {name}");
        }
        // The control: two fields that changed places are seen.
        let mut swapped = Camera::members();
        swapped.swap(1, 3);
        assert_ne!(layout("ssfr/shade", "Camera").members, swapped);
    }
}
