// Length of sunlight's path through water (`Sunlight` of domain/level_set/sunlight.rs). The
// importing shader must bind `rays` and `sun_paths`.
#import "shared/rays_water.wgsl"

// Metres of water that light from direction `towards` passes through on its path to `p`; for a
// point beyond the box, the value where the light left the box.
fn sun_path_at(p: vec3f, towards: vec3f) -> f32 {
    let off = abs(p - clamp(p, vec3f(0.0), rays.size));
    if max(off.x, max(off.y, off.z)) <= 0.5 * rays.voxel {
        return sun_path_within(p);
    }
    // Avoids division by zero for directions parallel to a side.
    let along = select(towards, vec3f(1e-6), abs(towards) < vec3f(1e-6));
    let low = -p / along;
    let high = (rays.size - p) / along;
    let first = min(low, high);
    let last = max(low, high);
    let start = max(max(first.x, max(first.y, first.z)), 0.0);
    if start > min(last.x, min(last.y, last.z)) {
        return 0.0;
    }
    return sun_path_within(p + along * start);
}

// The same within the box: trilinear between the lattice's nodes.
fn sun_path_within(p: vec3f) -> f32 {
    let last = vec3f(rays.nodes - 1u);
    let at = clamp(p / rays.pitch, vec3f(0.0), last);
    let low = min(floor(at), max(last - 1.0, vec3f(0.0)));
    let part = at - low;
    let c = vec3u(low);
    let d = min(c + 1u, rays.nodes - 1u);
    let row00 = (c.z * rays.nodes.y + c.y) * rays.nodes.x;
    let row10 = (c.z * rays.nodes.y + d.y) * rays.nodes.x;
    let row01 = (d.z * rays.nodes.y + c.y) * rays.nodes.x;
    let row11 = (d.z * rays.nodes.y + d.y) * rays.nodes.x;
    let before = vec4f(
        sun_paths[row00 + c.x], sun_paths[row10 + c.x], sun_paths[row01 + c.x],
        sun_paths[row11 + c.x]);
    let after = vec4f(
        sun_paths[row00 + d.x], sun_paths[row10 + d.x], sun_paths[row01 + d.x],
        sun_paths[row11 + d.x]);
    let along_x = mix(before, after, part.x);
    let along_y = mix(along_x.xz, along_x.yw, part.y);
    return mix(along_y.x, along_y.y, part.z);
}
