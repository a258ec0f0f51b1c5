// Sides of the box for sunlight. Needs the bindings of rays_trace.
#import "shared/rays_trace.wgsl"

// Whether the surface that a ray met is a side of the box at which the water is cut off.
fn is_cut(found: Found, p: vec3f) -> bool {
    let off = min(abs(p), abs(p - rays.size));
    return found.normal.y == 0.0 && min(off.x, off.z) < 3.0 * hair();
}
