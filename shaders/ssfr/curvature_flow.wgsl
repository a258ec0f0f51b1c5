// z −= dt H on one level, H the mean curvature of the depth image.
#import "shared/camera.wgsl"
#import "shared/ssfr_flow.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> params: FlowParams;
@group(0) @binding(2) var<uniform> level: FlowLevel;
@group(0) @binding(3) var<storage, read> source: array<f32>;
@group(0) @binding(4) var<storage, read_write> smoothed: array<f32>;

// Tangent of the steepest slope that counts as one.
const STEEPEST: f32 = 1.0;


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
    let share = clamp(level_share(params, z, camera.focal, level.level).steps - f32(level.index), 0.0, 1.0);
    if share <= 0.0 {
        return;
    }
    let x = i32(id.x);
    let y = i32(id.y);
    // C_x = 2 / (W F_x) = 1 / focal length in cells; cells are square.
    let c = f32(1u << level.level) / camera.focal;
    let cell = c * z;
    let row = level.size.x;
    let at_left = x == 0;
    let at_right = id.x + 1u == level.size.x;
    let at_top = y == 0;
    let at_bottom = id.y + 1u == level.size.y;
    var left = source[select(at - 1u, at, at_left)];
    var right = source[select(at + 1u, at, at_right)];
    var above = source[select(at - row, at, at_top)];
    var below = source[select(at + row, at, at_bottom)];
    left = select(left, FAR, at_left);
    right = select(right, FAR, at_right);
    above = select(above, FAR, at_top);
    below = select(below, FAR, at_bottom);
    let no_left = is_edge(params, z, left, cell);
    let no_right = is_edge(params, z, right, cell);
    let no_above = is_edge(params, z, above, cell);
    let no_below = is_edge(params, z, below, cell);
    if no_left { left = straight(z, right, no_right); }
    if no_right { right = straight(z, left, no_left); }
    if no_above { above = straight(z, below, no_below); }
    if no_below { below = straight(z, above, no_above); }

    // The equations of the paper, 3 to 7, in w = 1/z. With a = z_x / (C z), b = z_y / (C z):
    //   H = z ((1 + b²) w_xx − 2 a b w_xy + (1 + a²) w_yy) / (2 C (1 + a² + b²)^(3/2)),
    // less a remainder of theirs that moves a slanted plane by σ²/z; a plane is straight in w, so here it stays.
    let w = 1.0 / z;
    let wxx = 1.0 / right - 2.0 * w + 1.0 / left;
    let wyy = 1.0 / below - 2.0 * w + 1.0 / above;
    var wxy = 0.0;
    if !(no_left || no_right || no_above || no_below) {
        // None of the four sides is past the frame.
        let nw = source[at - row - 1u];
        let ne = source[at - row + 1u];
        let sw = source[at + row - 1u];
        let se = source[at + row + 1u];
        if max(max(nw, ne), max(sw, se)) < FAR {
            wxy = 0.25 * (1.0 / se - 1.0 / sw - 1.0 / ne + 1.0 / nw);
        }
    }
    var slope = 0.5 * vec2f(right - left, below - above) / cell;
    // A step from splat to splat is no slope of the water: taken as one, it would hold up the flow across it
    // (by 1 / (1 + slope²)) and stay as a scale on the surface.
    slope *= min(1.0, STEEPEST / max(length(slope), 1e-6));
    let s2 = slope * slope;
    let bend = (1.0 + s2.y) * wxx - 2.0 * slope.x * slope.y * wxy + (1.0 + s2.x) * wyy;

    // H moves the surface along the line of sight; times √(1 + slope²) it moves along its normal, so that the
    // width is the same on a surface seen at a slant. The coefficients of w_xx and w_yy stay at or below
    // their face-on values, and with them the stability limit.
    let h_slant = z * bend / (2.0 * c * (1.0 + s2.x + s2.y));
    let dt = params.fraction * 0.5 * z * c * share;
    smoothed[at] = max(z - dt * h_slant, 0.25 * z);
}
