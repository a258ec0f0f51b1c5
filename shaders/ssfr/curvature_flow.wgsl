// z −= dt H on one level, H the mean curvature of the depth image.
#import "shared/camera.wgsl"
#import "shared/ssfr_flow.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> params: FlowParams;
@group(0) @binding(2) var<uniform> level: FlowLevel;
@group(0) @binding(3) var<storage, read> source: array<f32>;
@group(0) @binding(4) var<storage, read_write> smoothed: array<f32>;

fn load(x: i32, y: i32) -> f32 {
    if x < 0 || y < 0 || x >= i32(level.size.x) || y >= i32(level.size.y) {
        return FAR;
    }
    return source[u32(y) * level.size.x + u32(x)];
}

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= level.size.x || id.y >= level.size.y {
        return;
    }
    let at = id.y * level.size.x + id.x;
    let z = source[at];
    smoothed[at] = z;
    if z >= FAR {
        return;
    }
    let share = clamp(level_steps(params, z, camera.focal, level.level) - f32(level.index), 0.0, 1.0);
    if share <= 0.0 {
        return;
    }
    let x = i32(id.x);
    let y = i32(id.y);
    // C_x = 2 / (W F_x) = 1 / focal length in cells; cells are square.
    let c = f32(1u << level.level) / camera.focal;
    let cell = c * z;
    var left = load(x - 1, y);
    var right = load(x + 1, y);
    var above = load(x, y - 1);
    var below = load(x, y + 1);
    let no_left = is_edge(params, z, left, cell);
    let no_right = is_edge(params, z, right, cell);
    let no_above = is_edge(params, z, above, cell);
    let no_below = is_edge(params, z, below, cell);
    if no_left { left = straight(z, right, no_right); }
    if no_right { right = straight(z, left, no_left); }
    if no_above { above = straight(z, below, no_below); }
    if no_below { below = straight(z, above, no_above); }

    let zx = 0.5 * (right - left);
    let zy = 0.5 * (below - above);
    let zxx = right - 2.0 * z + left;
    let zyy = below - 2.0 * z + above;
    var zxy = 0.0;
    if !(no_left || no_right || no_above || no_below) {
        let nw = load(x - 1, y - 1);
        let ne = load(x + 1, y - 1);
        let sw = load(x - 1, y + 1);
        let se = load(x + 1, y + 1);
        if max(max(nw, ne), max(sw, se)) < FAR {
            zxy = 0.25 * (se - sw - ne + nw);
        }
    }

    // Equations 3 to 7 of the paper with C_x = C_y = c.
    let c2 = c * c;
    let d = c2 * (zx * zx + zy * zy + c2 * z * z);
    let dx = 2.0 * c2 * (zx * zxx + zy * zxy + c2 * z * zx);
    let dy = 2.0 * c2 * (zx * zxy + zy * zyy + c2 * z * zy);
    let ex = 0.5 * zx * dx - zxx * d;
    let ey = 0.5 * zy * dy - zyy * d;
    let root = sqrt(d);
    let h = c * (ex + ey) / (2.0 * d * root);

    // H moves the surface along the line of sight; times √(1 + slope²) it moves along its normal, so that the
    // width is the same on a surface seen at a slant. The coefficients of z_xx and z_yy stay at or below
    // their face-on values, and with them the stability limit.
    let slant = root / (c2 * z);
    let dt = params.fraction * 0.5 * z * c * share;
    smoothed[at] = max(z - dt * h * slant, 0.25 * z);
}
