// How far sunlight has gone through water (`Sunlight` of domain/level_set/sunlight.rs). Needs the bindings `rays` and `sun_paths` of
// whoever imports it.
#import "shared/rays_water.wgsl"

// Metres that sunlight has gone through water on its way to `p`: trilinear between the lattice's nodes.
fn sun_path_at(p: vec3f) -> f32 {
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
        sun_paths[row00 + c.x], sun_paths[row10 + c.x], sun_paths[row01 + c.x], sun_paths[row11 + c.x]);
    let after = vec4f(
        sun_paths[row00 + d.x], sun_paths[row10 + d.x], sun_paths[row01 + d.x], sun_paths[row11 + d.x]);
    let along_x = mix(before, after, part.x);
    let along_y = mix(along_x.xz, along_x.yw, part.y);
    return mix(along_y.x, along_y.y, part.z);
}
