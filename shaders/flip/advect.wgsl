// Advects particles with the projected velocity at their positions, which is that of the middle of
// the substep, and by the density correction's displacement. Particles are kept out of solids and
// walls, and lose their velocity component into them. A particle that would move farther than the
// cap is slowed and counted.
// The velocity farther along the path is not that of the water when it gets there: the flow moves
// along with it. A midpoint rule in the field of the substep's start makes waves on a current grow.
// It serves where the water is violent (flip/bend_paths), and in domains that turn.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/counters.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_velocity.wgsl"
#import "shared/finite.wgsl"
#ifdef SOLIDS
#import "shared/flip_solid.wgsl"
#endif

#ifdef CONTRACTS
#import "shared/flip_straight.wgsl"

fn bend_in(slot: u32) -> f32 {
    return bitcast<f32>(brick_slot[path_bend_at(slot)]);
}
#endif
@group(0) @binding(3) var<storage, read> sorted_position: array<Vector>;
// Velocities, and with CORRECTION displacements behind them.
@group(0) @binding(5) var<storage, read> carried: array<Vector>;
// Three floats per particle, and behind those of all particles, 1 for each isolated droplet.
@group(0) @binding(13) var<storage, read> sorted_velocity: array<f32>;
@group(0) @binding(6) var<storage, read_write> position: array<Vector>;
@group(0) @binding(9) var<storage, read_write> velocity: array<Vector>;
// In storage order, and behind that in sorted order.
@group(0) @binding(10) var<storage, read_write> id: array<u32>;
// Counts slowed particles, and non-finite values, which clamping would hide.
@group(0) @binding(11) var<storage, read_write> counters: Counters;

#ifdef SOLIDS
// Each round at least halves the penetration depth of a particle between a wall and a solid at 45°.
const CORNER_ROUNDS = 4u;

// Removes the velocity component against a push.
fn stopped(v: vec3f, push: vec3f) -> vec3f {
    return v - push * (min(dot(v, push), 0.0) / max(dot(push, push), 1e-30));
}
#endif

// Removes the velocity component into the walls that x touches or is beyond.
fn at_walls(v: vec3f, x: vec3f) -> vec3f {
    let left = select(
        v, max(v, params.wall_velocity_min), x < params.wall_min + params.contact_distance);
    return select(
        left, min(left, params.wall_velocity_max), x > params.wall_max - params.contact_distance);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i >= params.particle_count {
        return;
    }
    let start = three(sorted_position[i]);
    let here = three(carried[i]);
    // A droplet continues ballistically: along its path the faces do not carry its velocity, and
    // those around may belong to other water.
    var bend = 1.0 - sorted_velocity[3u * params.particle_count + i];
#ifdef CONTRACTS
    let scaled = start * params.inverse_cell_size;
    let cell = vec3i(cell_of_place(scaled));
    find_slots(cell);
    find_bends();
    bend *= 1.0 - straight_at(scaled - vec3f(cell) + vec3f(own_local));
#endif
    var between = here;
    for (var once = 0; once < select(0, 1, bend > 0.0); once++) {
        between = mix(here, velocity_at(start + 0.5 * params.time_step * here, here), bend);
    }
    var way = params.time_step * between;
#ifdef CORRECTION
    way += three(carried[params.particle_count + i]);
#endif
    if !is_finite(start + way) {
        atomicAdd(&counters.not_finite, 1u);
    }
    let distance = length(way);
    if distance > params.max_displacement {
        way *= params.max_displacement / distance;
        atomicAdd(&counters.capped, 1u);
    }
    let low = params.wall_min + params.contact_distance;
    let high = params.wall_max - params.contact_distance;
    var v = vec3f(
        sorted_velocity[3u * i], sorted_velocity[3u * i + 1u], sorted_velocity[3u * i + 2u]);
#ifdef MOVING_SOLIDS
    // Steps of at most half a node spacing relative to the fastest solid, so that thin solids are
    // not skipped.
    let most = length(way) + posed_solids.fastest * params.time_step;
    let spacing = posed_solids.solids[0].grid.spacing;
    let steps = u32(ceil(2.0 * most / spacing)) + 1u;
    var is_near = false;
    let margin = most + params.contact_distance + 2.0 * spacing;
    for (var solid = 0u; solid < solid_count(); solid++) {
        let is_due = may_be_at_solid(solid, 0.0, start, margin);
        for (var once = 0; once < select(0, 1, is_due); once++) {
            look_at_solid(solid, 0.0);
            is_near |= solid_distance_bound(start) < margin;
        }
    }
    var x = select(start + way, start, is_near);
    for (var k = 0u; k < select(0u, steps, is_near); k++) {
        x += way / f32(steps);
        let share = f32(k + 1u) / f32(steps);
        for (var solid = 0u; solid < solid_count(); solid++) {
            let is_due = may_be_at_solid(solid, share, x, 0.0);
            for (var once = 0; once < select(0, 1, is_due); once++) {
                look_at_solid(solid, share);
                x = leave_solids(x);
                let pushing = solid_velocity_at(x);
                v = pushing + stopped(v - pushing, solid_push);
            }
        }
    }
    let free = x;
    // Between a solid and a wall, each of them would push the particle into the other.
    let rounds = select(0u, CORNER_ROUNDS, is_near && any(x != clamp(x, low, high)));
    for (var k = 0u; k < rounds; k++) {
        for (var solid = 0u; solid < solid_count(); solid++) {
            look_at_solid(solid, 1.0);
            x = leave_solids(clamp(x, low, high));
        }
    }
#else
    var x = start + way;
#ifdef SOLIDS
    // Steps of at most half a node spacing, so that thin solids are not skipped; no steps if no
    // solid is near.
    let reach = length(way) + params.contact_distance + 2.0 * solid_grid.spacing;
    let is_near = solid_distance_bound(start) < reach;
    let steps = u32(ceil(2.0 * length(way) / solid_grid.spacing)) + 1u;
    x = select(x, start, is_near);
    for (var k = 0u; k < select(0u, steps, is_near); k++) {
        x = leave_solids(x + way / f32(steps));
        v = stopped(v, solid_push);
    }
    let free = x;
    // Between a solid and a wall, each of them would push the particle into the other. The number
    // of rounds is decided once: after a push along the wall x lies exactly on it, after any other
    // push next to it.
    let rounds = select(0u, CORNER_ROUNDS, is_near && any(x != clamp(x, low, high)));
    for (var k = 0u; k < rounds; k++) {
        x = leave_solids(clamp(x, low, high));
    }
#else
    let free = x;
#endif
#endif
    v = at_walls(at_walls(v, free), x);
    x = clamp(x, low, high);
#ifdef PERIODIC
    x = wrapped_place(x, vec3f(params.cells) * params.cell_size);
#endif
    position[i] = packed(x);
    velocity[i] = packed(v);
    id[i] = id[params.particle_count + i];
}
