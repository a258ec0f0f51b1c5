// How air slows water by the share of water about it.
#import "shared/air.wgsl"

// The least share of water about what lies in a plane surface.
override PLANE_SHARE: f32;

// A velocity after what gravity adds in a step and drag for `seconds`, implicit in it; `share` is 0 of a drop alone, 1 deep in
// the water.
fn blown(velocity: vec3f, fall: vec3f, share: f32, seconds: f32) -> vec3f {
    let exposure = clamp(1.0 - share / PLANE_SHARE, 0.0, 1.0);
    let against = velocity - wind();
    return wind() + (against + fall) / (1.0 + exposure * seconds * air_drag(length(against)));
}

fn is_exposed(share: f32) -> bool {
    return share < PLANE_SHARE;
}
