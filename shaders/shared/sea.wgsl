// The sea beyond the box (src/render/sea.rs): where its surface stands, and where a ray meets it. Needs the bindings `sea` and
// `sea_values` of whoever imports it.
#import "shared/camera.wgsl"
#import "shared/box.wgsl"

struct Sea {
    // Of the box that holds the simulated water, metres.
    size: vec3f,
    // Still water above the floor, metres.
    level: f32,
    // Least and greatest height of the surface.
    low: f32,
    high: f32,
    // Over which the box's edge goes over into the sea, metres.
    band: f32,
    // Lengths below this are the same place.
    hair: f32,
    // Along the box's edges, x and z.
    nodes: vec2u,
    // Waves; those with the greatest lengths come first.
    lines: u32,
    // Sides beyond which it lies: bit 2 × axis, plus 1 for the greater end.
    sides: u32,
}

// Waves that there is room for, and quads of each: k, phase and amplitude; ω and amplitude of the horizontal velocity.
const MOST_LINES: u32 = 64u;
// A wave whose length is less than 2π over this many of a pixel's footprints is slope alone.
const FINEST: f32 = 6.0;
// Steps after which a ray along the sea has met nothing.
const MOST_SEA_STEPS: i32 = 320;
const SEA_HALVINGS: i32 = 12;
// A ray that comes from the surface may begin so many hairs on its other side, where heights within the box and beyond differ: half a
// voxel.
const SKIN: f32 = 500.0;
// Steeper than the waves are, so that no step jumps over one.
const STEEP: f32 = 0.6;
// Least step of a ray over the distance that it came: a pixel of a picture of a thousand is a tenth of it.
const LEAST_STEP: f32 = 0.008;

// Distance after which it is not looked for: ten million particle spacings.
fn sea_end() -> f32 {
    return 2e10 * sea.hair;
}

// Whether the sea lies at x and z.
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

// Height of the simulated water at the place on its edge that is nearest to one beyond it.
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

// The part that the box's edge has in the sea's height: 1 at the edge, 0 from a band away on.
fn edge_part(at: vec2f) -> f32 {
    let off = length(at - clamp(at, vec2f(0.0), sea.size.xz));
    let t = clamp(off / sea.band, 0.0, 1.0);
    return 1.0 - t * t * (3.0 - 2.0 * t);
}

// Height of the surface; waves that a pixel of `footprint` metres cannot hold are left out.
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
            waves += line.w * exp(-0.125 * fine * fine) * cos(dot(line.xy, at) + line.z);
        }
    }
    let open = (1.0 - part) * (sea.level + waves);
    if part > 0.0 {
        return open + part * edge_height(at);
    }
    return open;
}

// Mean square slope of the waves that such a pixel cannot hold.
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

// How fast the water at the surface goes; what the box's edge has in it stands still.
fn sea_velocity(at: vec2f) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < sea.lines; i++) {
        let line = sea_values[2u * i];
        let speeds = sea_values[2u * i + 1u];
        let angle = dot(line.xy, at) + line.z;
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

// Where a ray that is `inside` of the sea, or not, first is otherwise between two distances beyond the box. The eye is `travelled`
// metres before its origin.
fn sea_crossing(
    origin: vec3f, direction: vec3f, from_t: f32, to_t: f32, inside: bool, travelled: f32,
) -> SeaCrossing {
    // Above the highest wave there is air, and below the lowest trough water.
    let inverse = safe_inverse(direction).y;
    let a = (sea.low - sea.hair - origin.y) * inverse;
    let b = (sea.high + sea.hair - origin.y) * inverse;
    let start = max(min(a, b), from_t);
    let end = min(max(a, b), to_t);
    let leaves = (direction.y > 0.0) != inside;
    // Of the step in which it is otherwise.
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
        // After the last place there is none.
        last = select(t, FAR, t >= end);
        let step = max(gap / (abs(direction.y) + STEEP), max(LEAST_STEP * (travelled + t), 100.0 * sea.hair));
        t = min(t + step, end);
    }
    // Halved until the surface is known.
    let is_met = crossed.x < FAR;
    for (var i = 0; i < SEA_HALVINGS && is_met; i++) {
        let middle = 0.5 * (crossed.x + crossed.y);
        let same = is_sea_water(origin + direction * middle, (travelled + middle) / camera.focal) == inside;
        crossed = select(vec2f(crossed.x, middle), vec2f(middle, crossed.y), same);
    }
    return SeaCrossing(crossed.x, crossed.y);
}
