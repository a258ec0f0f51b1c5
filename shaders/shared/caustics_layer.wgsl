// Layers of the caustics map. The importing shader must bind `caustics` and the bindings of
// rays_set.
#import "shared/caustics.wgsl"
#import "shared/rays_set.wgsl"

// Layer of a point: 0 where the refracted sun of flat water would reach it, 1 in the shadow of
// opaque geometry, where only waves deflect light. Points behind one another in the map thus have
// separate values.
fn caustic_layer(p: vec3f, n: vec3f) -> u32 {
    // Starts off the face by the possible deviation between two paths to the same point.
    let start = p + 4e-3 * rays.voxel * n;
    return select(0u, 1u, opaque_along(start, caustics.sun, FAR).kind == OPAQUE);
}
