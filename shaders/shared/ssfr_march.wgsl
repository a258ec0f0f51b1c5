// Screen-space ray marching over the depth image of opaque geometry. The importing shader must bind
// `camera`, `shading` and `solid_depth`.

// Padded pixel of a point in eye space.
fn pixel_of(eye: vec3f) -> vec2i {
    return vec2i(floor(project(camera, eye))) + vec2i(camera.corner);
}

struct March {
    // World-space distance; FAR without a hit.
    distance: f32,
    at: u32,
    eye: vec3f,
}

// Marches a ray over the depth image of the solids. A hit is at most a few spacings or 1.5 steps
// behind that surface, where each step counts `deep` times; geometry nearer to the viewer than
// `nearest` is in front of the water and no hit. The refinement follows the loop, because adapters
// that execute both sides of a branch would refine at every step.
fn march(
    origin: vec3f, direction: vec3f, reach: f32, steps: i32, growth: f32, deep: f32, nearest: f32,
) -> March {
    var last = 0.0;
    // First step of a geometric series of `steps` steps that ends at `reach`.
    var step = reach / f32(steps);
    if growth > 1.0 {
        step = reach * (growth - 1.0) / (pow(growth, f32(steps)) - 1.0);
    }
    var next = FAR;
    for (var i = 0; i < steps; i++) {
        let t = last + step;
        let q = origin + direction * t;
        if q.z < camera.near {
            break;
        }
        let pixel = pixel_of(q);
        if any(pixel < vec2i(0)) || any(pixel >= vec2i(camera.size)) {
            break;
        }
        let z = solid_depth[u32(pixel.y) * camera.size.x + u32(pixel.x)];
        let slack = 1.5 * step;
        if z < q.z && z > nearest - (deep - 1.0) * slack
            && q.z - z < 3.5 * shading.spacing + deep * slack
        {
            next = t;
            break;
        }
        last = t;
        step *= growth;
    }
    return refine(origin, direction, last, next);
}

// Refines a hit between two distances by bisection; no hit where the second is FAR.
fn refine(origin: vec3f, direction: vec3f, from_t: f32, to_t: f32) -> March {
    if to_t >= FAR {
        return March(FAR, 0u, vec3f(0.0));
    }
    var low = from_t;
    var high = to_t;
    for (var i = 0; i < 5; i++) {
        let middle = 0.5 * (low + high);
        let q = origin + direction * middle;
        let pixel = clamp(pixel_of(q), vec2i(0), vec2i(camera.size) - 1);
        let z = solid_depth[u32(pixel.y) * camera.size.x + u32(pixel.x)];
        if z < q.z {
            high = middle;
        } else {
            low = middle;
        }
    }
    let q = origin + direction * high;
    let pixel = clamp(pixel_of(q), vec2i(0), vec2i(camera.size) - 1);
    return March(high, u32(pixel.y) * camera.size.x + u32(pixel.x), q);
}
