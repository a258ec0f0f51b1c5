// Adds samples to the picture. The importing shader must bind `output`.
#import "shared/ssfr_lights.wgsl"

#ifdef LIGHTS
// Bit mask of the light components that are written.
override WRITTEN_LIGHTS: u32;
// Vectors per pixel in `output`: the picture and the written components.
override STRIDE: u32;
#endif

fn put(at: u32, value: vec4f, is_first: bool) {
    // Not a branch: lavapipe compiles a pass again for each sample if a branch depends on uniforms
    // only (docs/performance.md).
    output[at] = select(output[at], vec4f(0.0), is_first) + value;
}

// Adds a sample's picture and light components to the pixel's mean; the first sample overwrites the
// previous content.
fn store_light(pixel: u32, value: vec4f, weight: f32, is_first: bool) {
#ifdef LIGHTS
    var at = pixel * STRIDE;
    put(at, value * weight, is_first);
    for (var part = 0u; part < LIGHT_PARTS; part++) {
        if (WRITTEN_LIGHTS >> part & 1u) == 1u {
            at += 1u;
            put(at, vec4f(light_parts[part], 0.0) * weight, is_first);
        }
    }
#else
    put(pixel, value * weight, is_first);
#endif
}
