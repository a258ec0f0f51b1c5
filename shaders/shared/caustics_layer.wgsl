// Layers of the map of bent sunlight. Needs the bindings `caustics` and those of rays_set of whoever imports it.
#import "shared/caustics.wgsl"
#import "shared/rays_set.wgsl"

// The map has two layers: what the sun seen from within flat water would shine on, and what stands in the shadow of something opaque
// there, where light comes only as waves bend it. So what lies behind one another in the map has a value each.
fn caustic_layer(p: vec3f, n: vec3f) -> u32 {
    // Off its face by what two ways to one place may differ.
    let start = p + 4e-3 * rays.voxel * n;
    return select(0u, 1u, opaque_along(start, caustics.sun, FAR).kind == OPAQUE);
}
