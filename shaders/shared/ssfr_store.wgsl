// Adds a sample to the picture. Needs the binding `output` of whoever imports it.
#import "shared/ssfr_lights.wgsl"

#ifdef LIGHTS
// Which of them are written: a bit each.
override WRITTEN_LIGHTS: u32;
// Vectors of a pixel in `output`: the picture, and those that are written.
override STRIDE: u32;
#endif

fn put(at: u32, value: vec4f, is_first: bool) {
    // Not a branch: lavapipe compiles a pass with one that uniforms alone decide again for each sample (docs/performance.md).
    output[at] = select(output[at], vec4f(0.0), is_first) + value;
}

// Adds a sample's picture, and the parts of its light, to the pixel's mean; the first one replaces what was there.
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
