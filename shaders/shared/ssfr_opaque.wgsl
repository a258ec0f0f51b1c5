// Shading of opaque geometry under sun and sky. Needs the bindings of ssfr_light.wgsl and the
// declarations of ssfr_solid.wgsl.
#import "shared/ssfr_light.wgsl"
#import "shared/ssfr_noise.wgsl"
#ifdef MATERIALS
#import "shared/materials.wgsl"
#endif
#ifdef WET
#import "shared/wet.wgsl"
#endif

struct Surface {
    position: vec3f,
    normal: vec3f,
    // As in ssfr_solid; 2 = ground.
    material: u32,
    // Index of the triangle, or NO_TRIANGLE.
    triangle: u32,
}

// Where the point is at the sample's instant, for which textures and wetness lie on solids.
fn lies_at(at: Surface) -> vec3f {
#ifdef SHUTTER
    return at_sample(at.triangle, at.position);
#else
    return at.position;
#endif
}

#ifdef WINDOWS
// A box of width `duty` in each unit cell, filtered over `footprint` cells.
fn window_edge(x: f32, duty: f32, footprint: f32) -> f32 {
    let w = max(footprint, 1e-3);
    let inside = 0.5 * duty - abs(fract(x) - 0.5);
    return clamp(inside / w + 0.5, 0.0, 1.0);
}

fn has_windows(at: Surface) -> bool {
#ifdef PALETTE
    if at.material >= FIRST_OF_PALETTE {
        return palette[at.material - FIRST_OF_PALETTE].a > 0.0;
    }
#endif
#ifdef MATERIALS
    let paint = paint_of(at.triangle);
    if paint > 0u {
        return materials[paint - 1u].windows > 0.0;
    }
#endif
    return at.material == 0u;
}

struct Facade {
    glass: f32,
    glow: f32,
}

fn facade(at: Surface, footprint: f32) -> Facade {
    if !has_windows(at) || abs(at.normal.y) > 0.3 {
        return Facade(0.0, 0.0);
    }
    let along = select(at.position.x, at.position.z, abs(at.normal.x) > abs(at.normal.z));
    let cell = vec2f(along / shading.windows.y, at.position.y / shading.windows.x);
    let size = footprint / shading.windows;
    let mean = 0.55 * 0.6;
    let sharp = window_edge(cell.x, 0.55, size.y) * window_edge(cell.y, 0.6, size.x);
    let glass = mix(sharp, mean, clamp(max(size.x, size.y) - 0.5, 0.0, 1.0));
    let side = i32(sign(at.normal.x) + 3.0 * sign(at.normal.z));
    let lit = hash2(vec2i(floor(cell)) * 7 + vec2i(side, 17 * side));
    return Facade(glass, glass * select(0.0, 0.4 + lit, lit < shading.window_lit));
}
#endif

// Radiance of an opaque surface towards the viewer; `view` points to the viewer, `footprint` is the
// size of a pixel there in metres, and `depth` the metres of water above it.
fn radiance_of(at: Surface, view: vec3f, footprint: f32, depth: f32) -> vec3f {
    let sun = shading.sun_irradiance * max(dot(at.normal, shading.sun_direction), 0.0)
        * sunlit(at.position, at.normal);
    return radiance_under(at, view, footprint, depth, sun);
}

// The same with the sun's irradiance `sun` on the surface, before absorption by the water.
fn radiance_under(at: Surface, view: vec3f, footprint: f32, depth: f32, sun: vec3f) -> vec3f {
    let through = exp(-(shading.absorption + shading.scattering) * depth * shading.sun_path);
    // Low faces see less of the sky: an approximation of its occlusion.
    let open = select(1.0, mix(0.45, 1.0, smoothstep(0.0, 0.1 * shading.extent, at.position.y)),
        at.material != 2u);
    let light = (sun + sky_irradiance(at.normal) * open) * through / PI;
    if at.material == 2u {
        let p = at.position.xz / shading.extent;
        let n = 0.5 * value_noise(p * 8.75) + 0.3 * value_noise(p * 32.5)
            + 0.2 * value_noise(p * 127.5);
        return light * shading.ground_colour * (1.0 + shading.ground_variation * (2.0 * n - 1.0));
    }
    var wall = select(shading.solid_colour, shading.ground_colour * 1.1, at.material == 1u);
#ifdef PALETTE
    if at.material >= FIRST_OF_PALETTE {
        wall = palette[at.material - FIRST_OF_PALETTE].rgb;
    }
#endif
    let q = at.position / shading.extent;
    var stain = 1.0 - 0.25 * shading.ground_variation
        * value_noise(vec2f(q.x * 42.5 + q.z * 32.5, q.y * 57.5));
#ifdef MATERIALS
    if paint_of(at.triangle) > 0u {
        wall = painted(at.triangle, lies_at(at), at.normal, view, footprint);
        stain = 1.0;
    }
#endif
    var colour = light * wall * stain;
#ifdef WET
    let wetness = wetness_at(at.triangle, lies_at(at));
    if wetness > 0.0 {
        let sky = sky_irradiance(at.normal) * open;
        let wet = wet_radiance(at.normal, view, wall * stain, sun * through, sky * through, open);
        colour = mix(colour, wet, wetness);
    }
#endif
#ifdef WINDOWS
    let pane = facade(at, footprint);
    if pane.glass > 0.0 {
        let mirrored = reflect(-view, at.normal);
        let r = fresnel(clamp(dot(view, at.normal), 0.0, 1.0), 1.5);
        let glass = light * 0.06 + r * sky_radiance(vec3f(mirrored.x, abs(mirrored.y), mirrored.z));
        colour = mix(colour, glass, pane.glass);
        colour += vec3f(1.0, 0.62, 0.28) * (pane.glow * shading.window_radiance);
    }
#endif
    return colour;
}
