// Projection of particles as spheres.

struct Particle {
    // World position, metres.
    position: vec3f,
    // From the lowest bit on: 16 bits of the fraction of its volume that whitens; 6 bits of
    // company, 0 for a particle on its own; 10 bits of its radius in the surface over the full
    // radius.
    air: u32,
    velocity: vec3f,
    // Twice the particle's id, plus 1 where it belongs to the body of water that rays meet, 0 where
    // it was thrown clear of it.
    tag: u32,
}

fn air_of(particle: Particle) -> f32 {
    return f32(particle.air & 0xffffu) / 65535.0;
}

fn company_of(particle: Particle) -> f32 {
    return f32((particle.air >> 16u) & 63u) / 63.0;
}

// Radius of the particle's sphere in the surface, metres.
fn body_radius(camera: Camera, particle: Particle) -> f32 {
    let part = particle.air >> 22u;
    return camera.radius * select(f32(part) / 1023.0, 1.0, part == 1023u);
}

// Row of the i-th pixel of a box `width` wide, exact below 2²³ pixels and 2²⁰ rows: a quotient errs
// by 2.5 ulp on some devices, so by a row at most. Software adapters divide integers one lane at a
// time.
fn row_of(i: u32, width: u32) -> u32 {
    let row = u32((f32(i) + 0.5) / f32(width));
    let low = row * width;
    return select(row, row - 1u, i < low) + select(0u, 1u, i >= low + width);
}

// Pixels that the sphere may touch: least and greatest, inclusive; x > z where there are none.
// Exact perspective bounds of a sphere (Mara and McGuire 2013, 2D polyhedral bounds, in one axis
// each).
fn sphere_bounds(camera: Camera, c: vec3f, radius: f32, scale: f32, size: vec2u) -> vec4i {
    if c.z < 1.5 * radius {
        return vec4i(0, 0, -1, -1);
    }
    let squared = c.z * c.z - radius * radius;
    let x = c.x * c.z + vec2f(-radius, radius) * sqrt(max(c.x * c.x + squared, 0.0));
    let y = -c.y * c.z + vec2f(-radius, radius) * sqrt(max(c.y * c.y + squared, 0.0));
    let low = (camera.centre + camera.focal * vec2f(x.x, y.x) / squared) * scale - 0.5;
    let high = (camera.centre + camera.focal * vec2f(x.y, y.y) / squared) * scale - 0.5;
    return pixels_between(camera, low, high, scale, size);
}

// Whole pixels between two positions relative to `corner`; the offset is added after rounding.
fn pixels_between(camera: Camera, low: vec2f, high: vec2f, scale: f32, size: vec2u) -> vec4i {
    let shift = camera.corner * scale;
    let edge = vec2f(size) - 1.0 - shift;
    if any(high < -shift) || any(low > edge) {
        return vec4i(0, 0, -1, -1);
    }
    let least = vec2i(ceil(max(low, -shift))) + vec2i(shift);
    return vec4i(least, vec2i(floor(min(high, edge))) + vec2i(shift));
}

struct Hit {
    // Eye-space depth of the near side.
    depth: f32,
    // Length of the chord, metres; negative where the ray misses.
    chord: f32,
}

// The ray has z = 1, so its parameter is the depth. The discriminant uses the cross product: the
// textbook b² − ac loses every digit at 20 m for a 10 cm sphere.
fn hit_sphere(ray: vec3f, c: vec3f, radius: f32) -> Hit {
    let a = dot(ray, ray);
    let off = cross(ray, c);
    let under = a * radius * radius - dot(off, off);
    if under <= 0.0 {
        return Hit(FAR, -1.0);
    }
    let root = sqrt(under);
    return Hit((dot(ray, c) - root) / a, 2.0 * root / sqrt(a));
}

// Fixed-point scale of thickness sums: integer atomics give the same bits in any order.
const THICKNESS_SCALE: f32 = 65536.0;
