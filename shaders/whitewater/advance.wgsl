// Moves each whitewater particle from the previous frame to this one, with the water of this one:
// spray flies and lands, foam is advected, bubbles rise (Ihmsen et al. 2012, section 3.2).
#import "shared/thread.wgsl"
#import "shared/predicted.wgsl"
#import "shared/vector.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/search.wgsl"
#import "shared/walls.wgsl"
#import "shared/confine.wgsl"
#import "shared/whitewater.wgsl"
#import "shared/air.wgsl"
#ifdef FORCES
#import "shared/forces.wgsl"
#endif

@group(0) @binding(12) var<storage, read> sorted_velocity: array<Vector>;
// Position and kind.
@group(0) @binding(13) var<storage, read_write> white_position: array<vec4f>;
// Velocity, and in w the speed at which the particle rises as a bubble, m/s; after the pass w holds
// the water fraction around it.
@group(0) @binding(14) var<storage, read_write> white_velocity: array<vec4f>;
// Number of whitewater particles, in x.
@group(0) @binding(15) var<uniform> white_count: vec4u;

const SPRAY = 0u;
const FOAM = 1u;
const BUBBLE = 2u;

// Constants of domain::whitewater.
override AIR_BELOW: f32;
override WATER_ABOVE: f32;
override FLIGHT_STEPS: u32;
override HALVINGS: u32;
// Values from the settings.
override RESPONSE: f32;

// No particle has this index, so the search excludes none.
const NO_ONE = 0xffffffffu;

struct Water {
    share: f32,
    velocity: vec3f,
}

var<private> looked_at: vec3f;
var<private> kernel_sum: f32;
var<private> solid_sum: f32;
var<private> velocity_sum: vec3f;

fn visit(i: u32, j: u32) {
    let other = predicted_at(j);
    let d = between(looked_at, other.xyz);
    let p = max(1.0 - dot(d, d) * inverse_h * inverse_h, 0.0);
    let w = p * p * p;
#ifdef SOLIDS
    if j >= fluid_count {
        solid_sum += other.w * w;
        return;
    }
#endif
    kernel_sum += w;
    velocity_sum += w * three(sorted_velocity[j]);
}

fn water_at(x: vec3f) -> Water {
    looked_at = x;
    kernel_sum = 0.0;
    solid_sum = 0.0;
    velocity_sum = vec3f(0.0);
    search_neighbors(x, NO_ONE);
    let share = share_of(kernel_sum, solid_sum, wall_term(x).density);
    return Water(share, velocity_sum / max(kernel_sum, 1e-20));
}

// Nearest allowed position: off walls, out of solids, in the domain.
fn allowed(x: vec3f) -> vec3f {
    let y = confine(x);
#ifdef PERIODIC
    return wrapped_place(y);
#else
    return y;
#endif
}

struct Flight {
    way: vec3f,
    velocity: vec3f,
}

// Drag is implicit, so that a drop of any size reaches its terminal velocity.
fn fly(place: vec3f, start: vec3f) -> Flight {
    let step = params.time_step / f32(FLIGHT_STEPS);
    var flight = Flight(vec3f(0.0), start);
    for (var k = 0u; k < FLIGHT_STEPS; k++) {
        let before = flight.velocity;
        let against = before - wind();
        var pulled = against + params.velocity_step / f32(FLIGHT_STEPS);
#ifdef FORCES
        pulled += step * force_at(place + flight.way);
#endif
        flight.velocity = wind() + pulled / (1.0 + step * air_drag(length(against)));
        flight.way += 0.5 * step * (before + flight.velocity);
    }
    return flight;
}

fn kind_of(share: f32) -> u32 {
    return select(select(FOAM, BUBBLE, share > WATER_ABOVE), SPRAY, share < AIR_BELOW);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i >= white_count.x {
        return;
    }
    begin_water();
    let start = white_position[i].xyz;
    let kind = u32(white_position[i].w);
    let before = white_velocity[i].xyz;
    let rise = white_velocity[i].w;
    let step = params.time_step;
    var way = step * before;
    var velocity = before;
    if kind == SPRAY {
        let flight = fly(start, before);
        way = flight.way;
        velocity = flight.velocity;
    }
    var place = allowed(start + way);
    var water = water_at(place);
    let is_in_water = water.share >= AIR_BELOW;
    if is_in_water != (kind != SPRAY) && kind != FOAM {
        // The path crosses the surface: bisects for it. A drop stays there, a bubble bursts there.
        var near = 0.0;
        var far = 1.0;
        for (var k = 0u; k < HALVINGS; k++) {
            let middle = 0.5 * (near + far);
            let there = allowed(start + middle * way);
            let found = water_at(there);
            let is_found = found.share >= AIR_BELOW;
            if is_found {
                place = there;
                water = found;
            }
            if is_found == is_in_water {
                far = middle;
            } else {
                near = middle;
            }
        }
        velocity = select(before, water.velocity, water.share >= AIR_BELOW);
    } else if kind == FOAM && !is_in_water {
        // Foam that is thrown off: from here on it flies.
        velocity = before + params.velocity_step;
#ifdef FORCES
        velocity += step * force_at(start);
#endif
    } else if kind != SPRAY {
        // Heun's method with the water's velocity; the velocity at the previous frame is the
        // particle's own.
        let up = -params.velocity_step / max(length(params.velocity_step), 1e-30);
        let aim = water.velocity + select(0.0, rise, kind == BUBBLE) * up;
        let kept = select(0.0, exp(-step / RESPONSE), kind == BUBBLE);
        velocity = aim + kept * (before - aim);
        place = allowed(start + 0.5 * step * (before + velocity));
    }
    white_position[i] = vec4f(place, f32(kind_of(water.share)));
    white_velocity[i] = vec4f(velocity, water.share);
}
