// Flow step z −= dt H on one level, in the tiles of a list; H is the mean curvature of the depth
// image.
#import "shared/camera.wgsl"
#import "shared/ssfr_flow.wgsl"
#import "shared/ssfr_tiles.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> params: FlowParams;
@group(0) @binding(2) var<uniform> level: FlowLevel;
@group(0) @binding(3) var<storage, read> source: array<f32>;
@group(0) @binding(4) var<storage, read_write> smoothed: array<f32>;
@group(0) @binding(5) var<storage, read> tiles: array<u32>;

// Tangent of the steepest slope that counts as part of the surface.
const STEEPEST: f32 = 1.0;

// Each thread processes two by two cells: together with their neighbours these need sixteen depths,
// a single cell nine.

fn depth_at(cell: vec2i) -> f32 {
    let size = vec2i(level.size);
    let held = clamp(cell, vec2i(0), size - 1);
    let z = source[u32(held.y * size.x + held.x)];
    return select(FAR, z, all(held == cell));
}

// Row of four depths, beginning at a cell.
fn row_at(cell: vec2i) -> vec4f {
    return vec4f(
        depth_at(cell), depth_at(cell + vec2i(1, 0)), depth_at(cell + vec2i(2, 0)),
        depth_at(cell + vec2i(3, 0)));
}

// Depth after the step at the middle of three rows: above, own and below.
fn stepped(above_row: vec3f, row: vec3f, below_row: vec3f) -> f32 {
    let z = row.y;
    if z >= FAR {
        return z;
    }
    let share = clamp(
        level_share(params, z, camera.focal, level.level).steps - f32(level.index), 0.0, 1.0);
    if share <= 0.0 {
        return z;
    }
    // C_x = 2 / (W F_x) = 1 / focal length in cells; cells are square.
    let c = f32(1u << level.level) / camera.focal;
    let cell = c * z;
    var left = row.x;
    var right = row.z;
    var above = above_row.y;
    var below = below_row.y;
    let no_left = is_edge(params, z, left, cell);
    let no_right = is_edge(params, z, right, cell);
    let no_above = is_edge(params, z, above, cell);
    let no_below = is_edge(params, z, below, cell);
    if no_left { left = straight(z, right, no_right); }
    if no_right { right = straight(z, left, no_left); }
    if no_above { above = straight(z, below, no_below); }
    if no_below { below = straight(z, above, no_above); }

    // Equations 3 to 7 of the paper, in w = 1/z. With a = z_x / (C z), b = z_y / (C z): H = z ((1 +
    // b²) w_xx − 2 a b w_xy + (1 + a²) w_yy) / (2 C (1 + a² + b²)^(3/2)), without a remainder in
    // the paper that moves a slanted plane by σ²/z; a plane is straight in w, so here it stays in
    // place.
    let w = 1.0 / z;
    let wxx = 1.0 / right - 2.0 * w + 1.0 / left;
    let wyy = 1.0 / below - 2.0 * w + 1.0 / above;
    var wxy = 0.0;
    if !(no_left || no_right || no_above || no_below) {
        let nw = above_row.x;
        let ne = above_row.z;
        let sw = below_row.x;
        let se = below_row.z;
        if max(max(nw, ne), max(sw, se)) < FAR {
            wxy = 0.25 * (1.0 / se - 1.0 / sw - 1.0 / ne + 1.0 / nw);
        }
    }
    var slope = 0.5 * vec2f(right - left, below - above) / cell;
    // A step between splats is no slope of the water: counted as one, it would slow the flow across
    // it (by 1 / (1 + slope²)) and remain as a scale on the surface.
    slope *= min(1.0, STEEPEST / max(length(slope), 1e-6));
    let s2 = slope * slope;
    let bend = (1.0 + s2.y) * wxx - 2.0 * slope.x * slope.y * wxy + (1.0 + s2.x) * wyy;

    // H moves the surface along the line of sight; times √(1 + slope²) it moves along its normal,
    // so that the width is the same on slanted surfaces. The coefficients of w_xx and w_yy stay at
    // or below their face-on values, which preserves the stability limit.
    let h_slant = z * bend / (2.0 * c * (1.0 + s2.x + s2.y));
    let dt = params.fraction * 0.5 * z * c * share;
    return max(z - dt * h_slant, 0.25 * z);
}

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
    let id = cells_of_tile(tiles[FIRST_TILE + place], thread);
    if any(id >= level.size) {
        return;
    }
    let first = vec2i(id);
    let row_a = row_at(first + vec2i(-1, -1));
    let row_b = row_at(first + vec2i(-1, 0));
    let row_c = row_at(first + vec2i(-1, 1));
    let row_d = row_at(first + vec2i(-1, 2));
    let at = id.y * level.size.x + id.x;
    let has_right = id.x + 1u < level.size.x;
    let has_below = id.y + 1u < level.size.y;
    smoothed[at] = stepped(row_a.xyz, row_b.xyz, row_c.xyz);
    if has_right {
        smoothed[at + 1u] = stepped(row_a.yzw, row_b.yzw, row_c.yzw);
    }
    if has_below {
        smoothed[at + level.size.x] = stepped(row_b.xyz, row_c.xyz, row_d.xyz);
    }
    if has_right && has_below {
        smoothed[at + level.size.x + 1u] = stepped(row_b.yzw, row_c.yzw, row_d.yzw);
    }
}
