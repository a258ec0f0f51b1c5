// Orientation of a spray cloud. Needs the bindings of ssfr_spray_read.wgsl, and `shading`.
#import "shared/ssfr_spray_read.wgsl"
#import "shared/ssfr_slope.wgsl"

// Depth of the cloud's near side at a position; blends into that of a cloud at `z` where coverage
// is low. Near and far sides are equally far from the mean, at the least distance for the cloud's
// optical depth, that of the densest cloud.
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
