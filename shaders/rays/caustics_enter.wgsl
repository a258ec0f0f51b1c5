// First intersections with the water of a lattice of rays from the sun that begins in a horizontal
// plane.
#import "shared/camera.wgsl"
#import "shared/caustics_sides.wgsl"
#import "shared/caustics.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> rays: Rays;
@group(0) @binding(2) var<uniform> caustics: Caustics;
@group(0) @binding(3) var<storage, read> level_table: array<u32>;
@group(0) @binding(4) var<storage, read> level_values: array<f32>;
@group(0) @binding(5) var<storage, read> set_nodes: array<SetNode>;
@group(0) @binding(6) var<storage, read> set_triangles: array<Triangle>;
// Normal, zero at a side of the box, and the distance just after the surface; FAR without a hit.
@group(0) @binding(7) var<storage, read_write> sun_rays: array<vec4f>;
#ifdef SEA
@group(0) @binding(8) var<uniform> sea: Sea;
@group(0) @binding(9) var<storage, read> sea_values: array<vec4f>;
#endif

#ifdef SHUTTER
@group(0) @binding(16) var<uniform> moments: array<Moment, 64>;
#endif

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= caustics.rays) {
        return;
    }
#ifdef SHUTTER
    // The map is at the sample's instant.
    take_moment(MOMENTS / 2u);
#endif
    let at = caustics.first + caustics.step * vec2f(id.xy);
    let origin = vec3f(at.x, caustics.top, at.y);
    var entry = vec4f(0.0, 1.0, 0.0, FAR);
    if opaque_along(origin, caustics.towards, FAR).kind != OPAQUE {
        // Leaves out waves of the sea that the spacing of the rays cannot resolve.
        let found = trace(origin, -caustics.towards, false, caustics.spacing * camera.focal, FAR);
        if found.kind == WATER {
            let p = origin - caustics.towards * found.after;
            entry = vec4f(select(found.normal, vec3f(0.0), is_cut(found, p)), found.after);
        }
    }
    sun_rays[id.y * caustics.rays.x + id.x] = entry;
}
