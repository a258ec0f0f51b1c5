// Interpolates the surface of the coarse level onto the fine one. Beside an edge, where not all
// four coarse cells belong to the fine cell's surface, only applies the change that the flow made
// there.
#import "shared/camera.wgsl"
#import "shared/ssfr_flow.wgsl"
#import "shared/ssfr_tiles.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> params: FlowParams;
// Of the fine level.
@group(0) @binding(2) var<uniform> level: FlowLevel;
@group(0) @binding(3) var<storage, read> coarse_before: array<f32>;
@group(0) @binding(4) var<storage, read> coarse_after: array<f32>;
@group(0) @binding(5) var<storage, read> fine: array<f32>;
@group(0) @binding(6) var<storage, read_write> corrected: array<f32>;
@group(0) @binding(7) var<storage, read> tiles: array<u32>;

// Three depths of a row of the coarse level before and after the flow, the second one at `cell`;
// FAR outside the frame.
struct Coarse {
    before: vec3f,
    after: vec3f,
}

fn coarse_row(cell: vec2i) -> Coarse {
    let last = vec2i((level.size + 1u) / 2u) - 1;
    let columns = cell.x + vec3i(-1, 0, 1);
    let held = clamp(columns, vec3i(0), vec3i(last.x));
    let at = vec3u(clamp(cell.y, 0, last.y) * (last.x + 1) + held);
    let is_in = (columns == held) & vec3<bool>(cell.y >= 0 && cell.y <= last.y);
    let before = vec3f(coarse_before[at.x], coarse_before[at.y], coarse_before[at.z]);
    let after = vec3f(coarse_after[at.x], coarse_after[at.y], coarse_after[at.z]);
    return Coarse(select(vec3f(FAR), before, is_in), after);
}

// New depth of a cell with depth `z` at the fraction `part` between four coarse cells: left and
// right above, left and right below.
fn prolonged(z: f32, before: vec4f, after: vec4f, part: vec2f) -> f32 {
    if z >= FAR || !level_share(params, z, camera.focal, level.level + 1u).reached {
        return z;
    }
    let cell = 2.0 * z * f32(1u << level.level) / camera.focal;
    let weights = vec4f(1.0 - part.x, part.x, 1.0 - part.x, part.x)
        * vec4f(1.0 - part.y, 1.0 - part.y, part.y, part.y);
    var change = 0.0;
    // In 1/z, in which a plane is straight.
    var inverse = 0.0;
    var total = 0.0;
    for (var i = 0; i < 4; i++) {
        if !is_edge(params, z, before[i], cell) {
            change += weights[i] * (after[i] - before[i]);
            inverse += weights[i] / after[i];
            total += weights[i];
        }
    }
    if total > 0.999 {
        return 1.0 / inverse;
    }
    if total > 0.0 {
        return max(z + change / total, 0.25 * z);
    }
    return z;
}

fn store(id: vec2u, above: Coarse, below: Coarse, part: vec2f) {
    if any(id >= level.size) {
        return;
    }
    let at = id.y * level.size.x + id.x;
    let is_left = (id.x & 1u) == 0u;
    let before = vec4f(
        select(above.before.yz, above.before.xy, is_left),
        select(below.before.yz, below.before.xy, is_left));
    let after = vec4f(
        select(above.after.yz, above.after.xy, is_left),
        select(below.after.yz, below.after.xy, is_left));
    corrected[at] = prolonged(fine[at], before, after, part);
}

// Each thread processes the two by two fine cells of a coarse one.
@compute @workgroup_size(16, 4)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_id) thread: vec3u,
) {
    let place = group.x + group.y * groups.x;
    if place >= tiles[WET] {
        return;
    }
    let first = cells_of_tile(tiles[FIRST_TILE + place], thread);
    let coarse = vec2i(first / 2u);
    let above = coarse_row(coarse + vec2i(0, -1));
    let same = coarse_row(coarse);
    let below = coarse_row(coarse + vec2i(0, 1));
    store(first, above, same, vec2f(0.75, 0.75));
    store(first + vec2u(1u, 0u), above, same, vec2f(0.25, 0.75));
    store(first + vec2u(0u, 1u), same, below, vec2f(0.75, 0.25));
    store(first + vec2u(1u, 1u), same, below, vec2f(0.25, 0.25));
}
