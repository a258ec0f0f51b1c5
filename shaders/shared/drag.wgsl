// Air drag on water, reduced by the water fraction around it.
#import "shared/air.wgsl"

// Smallest water fraction around a particle in a plane surface.
override PLANE_SHARE: f32;

// The velocity after gravity's change `fall` and drag over `seconds`, implicit in the velocity.
// `share` is the water fraction: 0 for a lone droplet, 1 deep in water.
fn blown(velocity: vec3f, fall: vec3f, share: f32, seconds: f32) -> vec3f {
    let exposure = clamp(1.0 - share / PLANE_SHARE, 0.0, 1.0);
    let against = velocity - wind();
    return wind() + (against + fall) / (1.0 + exposure * seconds * air_drag(length(against)));
}

fn is_exposed(share: f32) -> bool {
    return share < PLANE_SHARE;
}
