// The sea beyond the box (src/render/sea.rs): height of its surface, and its intersection with
// rays. The importing shader must bind `sea` and `sea_values`.
#import "shared/angle.wgsl"
#import "shared/camera.wgsl"
#import "shared/shutter.wgsl"
#import "shared/box.wgsl"

struct Sea {
    // Size of the box that contains the simulated water, metres.
    size: vec3f,
    // Still-water level above the floor, metres.
    level: f32,
    // Least and greatest height of the surface, metres.
    low: f32,
    high: f32,
    // Width over which the box's edge blends into the sea, metres.
    band: f32,
    // Lengths below this count as zero, metres.
    hair: f32,
    // Number of height samples along the box's edges, x and z.
    nodes: vec2u,
    // Number of wave components, in order of decreasing wavelength.
    lines: u32,
    // Sides beyond which the sea extends: bit 2 × axis, plus 1 for the upper end.
    sides: u32,
}

// Capacity of wave components, each with two vectors: k, phase and amplitude; ω and amplitude of
// the horizontal velocity.
const MOST_LINES: u32 = 64u;
// A component whose wave number times the pixel's footprint exceeds this contributes to the slope
// variance only.
const FINEST: f32 = 6.0;
// Number of steps after which a ray along the sea counts as a miss.
const MOST_SEA_STEPS: i32 = 320;
const SEA_HALVINGS: i32 = 12;
// Distance, in multiples of `hair`, by which a ray that leaves the surface may begin on its other
// side, because heights within the box and beyond differ: half a voxel.
const SKIN: f32 = 500.0;
// Upper bound of the waves' slope, so that no step jumps over a wave.
const STEEP: f32 = 0.6;
// Least step of a ray relative to its distance: a pixel of a picture with a thousand is a tenth of
// it.
const LEAST_STEP: f32 = 0.008;

// Distance at which the sea ends: ten million particle spacings.
fn sea_end() -> f32 {
    return 2e10 * sea.hair;
}

// Whether the sea extends to x and z.
fn is_sea(at: vec2f) -> bool {
    let below = at < vec2f(sea.hair);
    let above = at > sea.size.xz - sea.hair;
    let sides = sea.sides;
    return (below.x && (sides & 1u) != 0u) || (above.x && (sides & 2u) != 0u)
        || (below.y && (sides & 16u) != 0u) || (above.y && (sides & 32u) != 0u);
}

fn edge_value(k: u32) -> f32 {
    return sea_values[2u * MOST_LINES + k / 4u][k % 4u];
}

// Height of the simulated water at the edge point nearest to a point beyond.
fn edge_height(beyond: vec2f) -> f32 {
    let size = sea.size.xz;
    let is_across = beyond.x < sea.hair || beyond.x > size.x - sea.hair;
    let nodes = select(sea.nodes.x, sea.nodes.y, is_across);
    let far = select(beyond.y > 0.5 * size.y, beyond.x > 0.5 * size.x, is_across);
    let along = select(beyond.x / size.x, beyond.y / size.y, is_across);
    let first = select(2u * sea.nodes.y, 0u, is_across) + select(0u, nodes, far);
    let at = clamp(along, 0.0, 1.0) * f32(nodes - 1u);
    let low = min(u32(at), nodes - 2u);
    return mix(edge_value(first + low), edge_value(first + low + 1u), at - f32(low));
}

// Weight of the box's edge in the sea's height: 1 at the edge, 0 from a band's width on.
fn edge_part(at: vec2f) -> f32 {
    let off = length(at - clamp(at, vec2f(0.0), sea.size.xz));
    let t = clamp(off / sea.band, 0.0, 1.0);
    return 1.0 - t * t * (3.0 - 2.0 * t);
}

// Phase of a wave component at x and z, in −π..π, at the ray's instant.
fn line_angle(i: u32, line: vec4f, at: vec2f) -> f32 {
    var phase = line.z;
#ifdef SHUTTER
    phase -= sea_values[2u * i + 1u].x * own_delay;
#endif
    return angle_of((dot(line.xy, at) + phase) / 6.2831853);
}

// Height of the surface, without waves that a pixel of `footprint` metres cannot resolve.
fn sea_height(at: vec2f, footprint: f32) -> f32 {
    let part = edge_part(at);
    var waves = 0.0;
    if part < 1.0 {
        for (var i = 0u; i < sea.lines; i++) {
            let line = sea_values[2u * i];
            let fine = length(line.xy) * footprint;
            if fine > FINEST {
                break;
            }
            let angle = line_angle(i, line, at);
            waves += line.w * exp(-0.125 * fine * fine) * cos(angle);
        }
    }
    let open = (1.0 - part) * (sea.level + waves);
    if part > 0.0 {
        return open + part * edge_height(at);
    }
    return open;
}

// Mean square slope of the waves that such a pixel cannot resolve.
fn sea_variance(at: vec2f, footprint: f32) -> f32 {
    var sum = 0.0;
    for (var i = 0u; i < sea.lines; i++) {
        let line = sea_values[2u * i];
        let k = length(line.xy);
        let fine = k * footprint;
        let kept = exp(-0.125 * fine * fine);
        sum += 0.5 * line.w * line.w * k * k * (1.0 - kept * kept);
    }
    let open = 1.0 - edge_part(at);
    return open * open * sum;
}

// Upward unit normal.
fn sea_normal(at: vec2f, footprint: f32) -> vec3f {
    let e = max(footprint, 8.0 * sea.hair);
    let x = vec2f(e, 0.0);
    let z = vec2f(0.0, e);
    let slope = vec2f(
        sea_height(at + x, footprint) - sea_height(at - x, footprint),
        sea_height(at + z, footprint) - sea_height(at - z, footprint),
    ) / (2.0 * e);
    return normalize(vec3f(-slope.x, 1.0, -slope.y));
}

// Velocity of the water at the surface; the contribution of the box's edge counts as still.
fn sea_velocity(at: vec2f) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < sea.lines; i++) {
        let line = sea_values[2u * i];
        let speeds = sea_values[2u * i + 1u];
        let angle = line_angle(i, line, at);
        let along = line.xy / length(line.xy) * (speeds.y * cos(angle));
        sum += vec3f(along.x, speeds.x * line.w * sin(angle), along.y);
    }
    return (1.0 - edge_part(at)) * sum;
}

fn is_sea_water(p: vec3f, footprint: f32) -> bool {
    return p.y < sea.high && is_sea(p.xz) && p.y < sea_height(p.xz, footprint);
}

struct SeaCrossing {
    // Distances just before and just after the surface; FAR where there is none.
    before: f32,
    after: f32,
}

// First crossing of the sea's surface by a ray between two distances beyond the box; `inside`
// states whether the ray begins in the sea, and `travelled` is the distance from the eye to its
// origin, metres.
fn sea_crossing(
    origin: vec3f, direction: vec3f, from_t: f32, to_t: f32, inside: bool, travelled: f32,
) -> SeaCrossing {
    // There is only air above the highest wave and only water below the lowest trough.
    let inverse = safe_inverse(direction).y;
    let a = (sea.low - sea.hair - origin.y) * inverse;
    let b = (sea.high + sea.hair - origin.y) * inverse;
    let start = max(min(a, b), from_t);
    let end = min(max(a, b), to_t);
    let leaves = (direction.y > 0.0) != inside;
    // The step that crosses the surface.
    var crossed = vec2f(FAR);
    var last = start;
    var t = start;
    for (var i = 0; i < MOST_SEA_STEPS && last < end && crossed.x >= FAR; i++) {
        let p = origin + direction * t;
        let footprint = (travelled + t) / camera.focal;
        var gap = 1e3 * sea.hair;
        var wet = false;
        if is_sea(p.xz) {
            let over = p.y - sea_height(p.xz, footprint);
            gap = abs(over);
            wet = over < 0.0;
        }
        if wet != inside && !(leaves && gap < SKIN * sea.hair) {
            crossed = vec2f(last, t);
        }
        // Ends the loop after the last point.
        last = select(t, FAR, t >= end);
        let step = max(
            gap / (abs(direction.y) + STEEP), max(LEAST_STEP * (travelled + t), 100.0 * sea.hair));
        t = min(t + step, end);
    }
    // Bisection of that step.
    let is_met = crossed.x < FAR;
    for (var i = 0; i < SEA_HALVINGS && is_met; i++) {
        let middle = 0.5 * (crossed.x + crossed.y);
        let same = is_sea_water(origin + direction * middle, (travelled + middle) / camera.focal)
            == inside;
        crossed = select(vec2f(crossed.x, middle), vec2f(middle, crossed.y), same);
    }
    return SeaCrossing(crossed.x, crossed.y);
}
