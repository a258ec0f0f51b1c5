// Trilinear signed distance of the solids, metres.
#import "shared/confine.wgsl"

// Where the node before x is farther off than this nothing of a cell can be cut: no interpolation is needed.
fn solid_distance_at(x: vec3f) -> f32 {
    let p = clamp((x - solid_grid.origin) / solid_grid.spacing, vec3f(0.0), vec3f(solid_grid.dims - 1u) - 1e-3);
    let node = vec3u(p);
    let t = p - vec3f(node);
    let low = mix(
        mix(solid_node(node), solid_node(node + vec3u(1, 0, 0)), t.x),
        mix(solid_node(node + vec3u(0, 1, 0)), solid_node(node + vec3u(1, 1, 0)), t.x),
        t.y,
    );
    let high = mix(
        mix(solid_node(node + vec3u(0, 0, 1)), solid_node(node + vec3u(1, 0, 1)), t.x),
        mix(solid_node(node + vec3u(0, 1, 1)), solid_node(node + vec3u(1, 1, 1)), t.x),
        t.y,
    );
    return mix(low, high, t.z);
}

// Nearest node's distance, for a first look; far away outside the grid.
fn solid_distance_near(x: vec3f) -> f32 {
    let p = (x - solid_grid.origin) / solid_grid.spacing;
    let is_outside = any(p < vec3f(-1.0)) || any(p > vec3f(solid_grid.dims));
    let node = vec3u(clamp(p + 0.5, vec3f(0.0), vec3f(solid_grid.dims - 1u)));
    return select(solid_node(node), 1e15, is_outside);
}
