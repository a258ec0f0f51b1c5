// Accelerations by the scene's forces. Positions in metres from the domain's minimum corner.

// Mirrored by `DeviceForce` of solve/params.rs.
struct Force {
    // Least and greatest corner of the room, or of its mesh's bounding box.
    low: vec3f,
    // 1 / depth at which it is at its full strength; 0 for a sharp edge.
    fade_rate: f32,
    high: vec3f,
    // 0: the same everywhere, 1: around an axis, 2: towards a point, 3: motion of the domain.
    kind: u32,
    // The acceleration, m/s², or a point of the axis, or the point, or the pivot.
    at: vec3f,
    // Acceleration at the core radius, m/s², times the fraction of the step in which it acts; of
    // the domain's motion the square of the angular velocity, 1/s².
    strength: f32,
    // Unit vector along the axis.
    axis: vec3f,
    // Core radius; of the domain's motion the angular acceleration, 1/s².
    core: f32,
    // First node of the mesh's distances; of the domain's motion the acceleration at the pivot.
    origin: vec3f,
    // Distance between nodes; 0 without a mesh.
    spacing: f32,
    dims: vec3u,
    // Index of the first node in `force_distance`.
    first: u32,
    falloff: u32,
    unused: u32,
    padding: vec2u,
}

override FORCE_COUNT: u32;

@group(0) @binding(26) var<storage, read> forces: array<Force>;
#ifdef FORCE_MESHES
// Distances to the meshes of rooms at the nodes of a grid each, x fastest.
@group(0) @binding(27) var<storage, read> force_distance: array<f32>;

fn force_node(k: u32, node: vec3u) -> f32 {
    let dims = forces[k].dims;
    return force_distance[forces[k].first + (node.z * dims.y + node.y) * dims.x + node.x];
}

// Trilinear distance to the mesh of a room, at a position in its bounding box.
fn force_distance_at(k: u32, x: vec3f) -> f32 {
    let scaled = (x - forces[k].origin) / forces[k].spacing;
    let node = vec3u(clamp(vec3i(floor(scaled)), vec3i(0), vec3i(forces[k].dims) - 2));
    let t = scaled - vec3f(node);
    let low = mix(
        mix(force_node(k, node), force_node(k, node + vec3u(1, 0, 0)), t.x),
        mix(force_node(k, node + vec3u(0, 1, 0)), force_node(k, node + vec3u(1, 1, 0)), t.x),
        t.y,
    );
    let high = mix(
        mix(force_node(k, node + vec3u(0, 0, 1)), force_node(k, node + vec3u(1, 0, 1)), t.x),
        mix(force_node(k, node + vec3u(0, 1, 1)), force_node(k, node + vec3u(1, 1, 1)), t.x),
        t.y,
    );
    return mix(low, high, t.z);
}
#endif

// Depth in the room of a force; 0 or less outside.
fn depth_in_room(k: u32, x: vec3f) -> f32 {
    let inward = min(x - forces[k].low, forces[k].high - x);
    let depth = min(inward.x, min(inward.y, inward.z));
#ifdef FORCE_MESHES
    var in_mesh = depth;
    let is_of_mesh = forces[k].spacing > 0.0 && depth >= 0.0;
    for (var once = 0; once < select(0, 1, is_of_mesh); once++) {
        in_mesh = -force_distance_at(k, x);
    }
    return in_mesh;
#else
    return depth;
#endif
}

// Acceleration at the distance r over r, 1/s².
fn over_distance(k: u32, r: f32) -> f32 {
    let outer = max(r, forces[k].core);
    let ratio = forces[k].core / outer;
    let fallen = select(select(1.0, ratio, forces[k].falloff == 1u), ratio * ratio,
        forces[k].falloff == 2u);
    return forces[k].strength * fallen / outer;
}

// Acceleration by the motion of the domain, but for Coriolis's, from the way to the pivot.
fn inertia(k: u32, way: vec3f) -> vec3f {
    let outward = forces[k].axis * dot(forces[k].axis, way) - way;
    return forces[k].origin + forces[k].strength * outward
        + forces[k].core * cross(forces[k].axis, way);
}

fn force_of(k: u32, x: vec3f) -> vec3f {
    let depth = depth_in_room(k, x);
    let faded = select(1.0, min(depth * forces[k].fade_rate, 1.0), forces[k].fade_rate > 0.0);
    let part = select(0.0, faded, depth > 0.0);
    let way = forces[k].at - x;
    let around = cross(way, forces[k].axis);
    let by_distance = select(
        over_distance(k, length(way)) * way,
        over_distance(k, length(around)) * around,
        forces[k].kind == 1u,
    );
    if forces[k].kind == 3u {
        return inertia(k, way);
    }
    return part * select(by_distance, forces[k].strength * forces[k].at, forces[k].kind == 0u);
}

// Mean acceleration at x over the step, m/s².
fn force_at(x: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    for (var k = 0u; k < FORCE_COUNT; k++) {
        sum += force_of(k, x);
    }
    return sum;
}
