// Which way a cloud of spray faces. Needs what ssfr_spray_read.wgsl needs, and `shading`.
#import "shared/ssfr_spray_read.wgsl"
#import "shared/ssfr_slope.wgsl"

// Depth of the cloud's near side at a position; where it hides little, goes over to that of a cloud at `z`. Its far side lies as far
// behind the mean as its near side before it, and the way between them is what the densest cloud of this optical depth needs.
fn spray_front(position: vec2f, z: f32) -> f32 {
    let mist = spray_at(position);
    return mix(z, mist.depth, mist.cover) - 0.5 * mist.optical_depth / spray_params.density;
}

// Normal of the near side towards the viewer, in eye space.
fn spray_normal(position: vec2f, z: f32) -> vec3f {
    let h = spacing_in_pixels(z);
    let a = spray_front(position + vec2f(h, h), z);
    let b = spray_front(position + vec2f(h, -h), z);
    let c = spray_front(position + vec2f(-h, h), z);
    let d = spray_front(position - vec2f(h, h), z);
    let slope = slope_between(a, b, c, d, h, z);
    return normalize(vec3f(slope.x, -slope.y, -1.0));
}
