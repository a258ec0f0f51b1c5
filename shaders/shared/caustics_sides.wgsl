// Sides of the box as sunlight meets them. Needs what rays_trace needs.
#import "shared/rays_trace.wgsl"

// Whether the surface that a ray met is no surface but a side of the box, where the water is cut off.
fn is_cut(found: Found, p: vec3f) -> bool {
    let off = min(abs(p), abs(p - rays.size));
    return found.normal.y == 0.0 && min(off.x, off.z) < 3.0 * hair();
}
