// Grid-to-particle transfer: v = α u + (1 − α)(v + Δu) (Zhu and Bridson 2005), or u and its
// gradient (APIC, Jiang et al. 2015). At the surface v is clamped to the range of the 18 faces
// around it, extended by a margin: the largest speed of these faces times its Courant number, at
// most that speed. The grid does not see how a particle differs from the flow, and at the surface
// no pressure of neighbours bounds such differences, which grow as the substep shrinks. Without the
// margin a jet presses on a wall with more than its momentum. The particles of a cell share its
// faces, which are read once. Weights are multiplied by the faces' open fractions and normalized,
// because the projection gives faces with a small open fraction several times their neighbours'
// velocities; those of faces that solids close, by how much they face the solid (flip/cut_cells).
// Beyond the domain along b and c, faces have the values of those inside, so that water slides
// along walls.
// In a film on a solid the grid knows the depth only to half a particle of a full cell. Surface
// slopes below that, and speeds below that of a fall by that height, cannot be told from rest, and
// nothing else stops them. There particles get Coulomb friction with the solid, with that slope as
// coefficient: water rests on gentler slopes, runs down steeper ones, and falls along walls.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_neighborhood.wgsl"
#ifdef SOLIDS
#import "shared/flip_solid.wgsl"
#endif
#ifdef PERIODIC
#import "shared/flip_periodic.wgsl"
#endif

@group(0) @binding(2) var<storage, read> cell_start: array<u32>;
@group(0) @binding(3) var<storage, read> sorted_position: array<Vector>;
// Velocities, and with CORRECTION displacements behind them.
@group(0) @binding(4) var<storage, read> face_velocity: array<f32>;
// Three floats per particle, as in `carried`. Behind those of all particles, 1 for each isolated
// droplet, far from all water with a pressure, else 0.
@group(0) @binding(5) var<storage, read_write> sorted_velocity: array<f32>;
#ifdef SOLIDS
@group(0) @binding(15) var<storage, read> face_weight: array<f32>;
#endif
#ifdef APIC
@group(0) @binding(6) var<storage, read_write> affine: array<f32>;
#else
@group(0) @binding(6) var<storage, read> face_change: array<f32>;
#endif
@group(0) @binding(12) var<storage, read> cell_kind: array<u32>;
// The displacements by which particles are pushed apart follow, if they are.
@group(0) @binding(10) var<storage, read_write> carried: array<f32>;

// Values at the 18 faces: columns along c, rows along b.
struct Values {
    lower: mat3x3f,
    upper: mat3x3f,
}

fn value_at(values: Values, a: vec2f, b: vec3f, c: vec3f) -> f32 {
    return a.x * dot(b, values.lower * c) + a.y * dot(b, values.upper * c);
}

fn velocities(faces: vec3u) -> vec3f {
    return vec3f(face_velocity[faces.x], face_velocity[faces.y], face_velocity[faces.z]);
}

#ifndef APIC
fn changes(faces: vec3u) -> vec3f {
    return vec3f(face_change[faces.x], face_change[faces.y], face_change[faces.z]);
}
#endif

#ifdef CORRECTION
fn displacements(faces: vec3u) -> vec3f {
    return velocities(faces + 3u * params.stride);
}
#endif

#ifdef SOLIDS
fn parts(faces: vec3u) -> vec3f {
    return vec3f(face_weight[faces.x], face_weight[faces.y], face_weight[faces.z]);
}

fn product(a: mat3x3f, b: mat3x3f) -> mat3x3f {
    return mat3x3f(a[0] * b[0], a[1] * b[1], a[2] * b[2]);
}

fn sum_of(a: mat3x3f) -> f32 {
    return dot(a[0] + a[1] + a[2], vec3f(1.0));
}

// Each value times its weight, plus the mean of all times the rest.
fn settled(values: Values, part: Values) -> Values {
    let all = weighed(values, part);
    let mean = (sum_of(all.lower) + sum_of(all.upper))
        / max(sum_of(part.lower) + sum_of(part.upper), 1e-6);
    let ones = mat3x3f(vec3f(1.0), vec3f(1.0), vec3f(1.0));
    return Values(all.lower + mean * (ones - part.lower), all.upper + mean * (ones - part.upper));
}

fn weighed(values: Values, part: Values) -> Values {
    return Values(product(values.lower, part.lower), product(values.upper, part.upper));
}

#endif
#ifndef APIC
// Exceeds any velocity, m/s.
const FAR = 1e30;

fn least(values: Values) -> f32 {
    let lower = min(min(values.lower[0], values.lower[1]), values.lower[2]);
    let upper = min(min(values.upper[0], values.upper[1]), values.upper[2]);
    let both = min(lower, upper);
    return min(both.x, min(both.y, both.z));
}

#endif
// Values at the faces of one component.
struct Component {
    speeds: Values,
#ifdef SOLIDS
    // Weight of each face where solids leave faces partly open; the values are multiplied by it.
    part: Values,
#endif
#ifndef APIC
    change: Values,
    // Smallest and largest velocity of the faces.
    range: vec2f,
#endif
#ifdef CORRECTION
    shift: Values,
#endif
}

const AIR = 0u;
const FLUID = 1u;

// Kinds of the 27 cells around a cell, as far as the domain reaches.
struct About {
    // None of them is water.
    is_dry: bool,
    // At least one is air.
    is_surface: bool,
}

fn look_about(to_before: vec3i, to_after: vec3i) -> About {
    var water = 0u;
    var air = 0u;
    for (var k = 0; k < 27; k++) {
        let offset = clamp(vec3i(k % 3, k / 3 % 3, k / 9) - 1, -to_before, to_after);
        let kind = cell_kind[element_at(offset)];
        water += u32(kind == FLUID);
        air += u32(kind == AIR);
    }
    return About(water == 0u, air > 0u);
}

// Steps along b and c to the cells before and after; 0 where the domain ends.
struct Steps {
    a: vec3i,
    b_before: vec3i,
    b_after: vec3i,
    c_before: vec3i,
    c_after: vec3i,
}

fn read_component(axis: u32, steps: Steps) -> Component {
    var read: Component;
#ifdef SOLIDS
    var part: Values;
#endif
    let plane = vec3u(axis * params.stride);
    for (var side = 0; side < 2; side++) {
        let start = side * steps.a;
        let before = plane + vec3u(
            element_at(start - steps.b_before - steps.c_before),
            element_at(start - steps.c_before),
            element_at(start + steps.b_after - steps.c_before),
        );
        let own = plane + vec3u(
            element_at(start - steps.b_before),
            element_at(start),
            element_at(start + steps.b_after),
        );
        let after = plane + vec3u(
            element_at(start - steps.b_before + steps.c_after),
            element_at(start + steps.c_after),
            element_at(start + steps.b_after + steps.c_after),
        );
#ifdef SOLIDS
        part.lower = part.upper;
        part.upper = mat3x3f(parts(before), parts(own), parts(after));
#endif
        read.speeds.lower = read.speeds.upper;
        read.speeds.upper = mat3x3f(velocities(before), velocities(own), velocities(after));
#ifndef APIC
        read.change.lower = read.change.upper;
        read.change.upper = mat3x3f(changes(before), changes(own), changes(after));
#endif
#ifdef CORRECTION
        read.shift.lower = read.shift.upper;
        read.shift.upper = mat3x3f(displacements(before), displacements(own), displacements(after));
#endif
    }
#ifndef APIC
#ifdef SOLIDS
    let speeds = settled(read.speeds, part);
#else
    let speeds = read.speeds;
#endif
    let range = vec2f(least(speeds), -least(Values(-1.0 * speeds.lower, -1.0 * speeds.upper)));
    read.range = range;
#endif
#ifdef SOLIDS
    read.speeds = weighed(read.speeds, part);
#ifndef APIC
    read.change = weighed(read.change, part);
#endif
#ifdef CORRECTION
    read.shift = weighed(read.shift, part);
#endif
    read.part = part;
#endif
    return read;
}

fn center_hats(f: f32) -> vec3f {
    return vec3f(max(0.5 - f, 0.0), 1.0 - abs(f - 0.5), max(f - 0.5, 0.0));
}

#ifdef APIC
// Derivative of the normalized interpolation with value `u`, times the sum of its weights, along
// the axis whose weights are slopes. The derivative itself is not bounded where faces are almost
// closed: with it, water at rest on a beach of 1:20 reaches 10⁴ m/s within 33 frames.
fn slope_of(faces: Component, u: f32, a: vec2f, b: vec3f, c: vec3f) -> f32 {
#ifdef SOLIDS
    return value_at(faces.speeds, a, b, c) - u * value_at(faces.part, a, b, c);
#else
    return value_at(faces.speeds, a, b, c);
#endif
}
#endif

#ifdef SOLIDS
// Slope that cannot be told from level, as a multiple of a particle's share of a full cell.
const LEAST_SLOPE = 0.5;

// Distance from a solid, in cells: friction is full below it, and none from twice that on. Half the
// spacing of eight particles per cell.
const TOUCHES = 0.25;

// Friction with the solid that is looked at.
struct Friction {
    normal: vec3f,
    // The solid's velocity, m/s.
    solid: vec3f,
    // Largest change of a velocity along the solid in this substep, m/s.
    most: f32,
}

fn friction_at(x: vec3f) -> Friction {
    let step = 0.5 * TOUCHES * params.cell_size;
    let slope = vec3f(
        solid_distance_at(x + vec3f(step, 0.0, 0.0)) - solid_distance_at(x - vec3f(step, 0.0, 0.0)),
        solid_distance_at(x + vec3f(0.0, step, 0.0)) - solid_distance_at(x - vec3f(0.0, step, 0.0)),
        solid_distance_at(x + vec3f(0.0, 0.0, step)) - solid_distance_at(x - vec3f(0.0, 0.0, step)),
    );
    let normal = slope / max(length(slope), 1e-20);
    let part = clamp(2.0 - solid_distance_at(x) * params.inverse_cell_size / TOUCHES, 0.0, 1.0);
    let pressing = max(-dot(params.velocity_step, normal), 0.0);
#ifdef MOVING_SOLIDS
    let solid = solid_velocity_at(x);
#else
    let solid = vec3f(0.0);
#endif
    return Friction(normal, solid, part * LEAST_SLOPE * params.particle_share * pressing);
}

// In a film friction fades between the speed of a fall by the least height and 1.41 times that. An
// isolated droplet has static friction only: at rest it stays, once it slides it goes on.
fn slowed(v: vec3f, friction: Friction, falls: bool) -> vec3f {
    let beside = v - friction.solid;
    let along = beside - friction.normal * dot(beside, friction.normal);
    let speed = length(along);
    let gravity = length(params.velocity_step) / params.kick;
    let square = 2.0 * gravity * LEAST_SLOPE * params.particle_share * params.cell_size;
    let over = select(speed * speed / max(square, 1e-20), speed / max(friction.most, 1e-20), falls);
    return v - along * min(clamp(2.0 - over, 0.0, 1.0) * friction.most / max(speed, 1e-20), 1.0);
}

// The grid's velocity, which moves the water, stays as it is, so that no water piles up: it creeps
// to where it finds room. An isolated droplet moves with its own velocity.
fn rub(i: u32, x: vec3f, falls: bool) {
    let k = 3u * i;
    let own = vec3f(sorted_velocity[k], sorted_velocity[k + 1u], sorted_velocity[k + 2u]);
    let v = slowed(own, friction_at(x), falls);
    for (var axis = 0u; axis < 3u; axis++) {
        sorted_velocity[k + axis] = v[axis];
        carried[k + axis] = select(carried[k + axis], v[axis], falls);
    }
}

fn is_near_solid(x: vec3f) -> bool {
    return solid_distance_near(x) < 2.0 * (TOUCHES * params.cell_size + solid_grid.spacing);
}

// Each solid as it stands at the start of the substep; only particles near one enter the loop.
fn rub_all(i: u32, x: vec3f, falls: bool) {
#ifdef MOVING_SOLIDS
    for (var solid = 0u; solid < solid_count(); solid++) {
        look_at_solid(solid, 0.0);
        for (var once = 0; once < select(0, 1, is_near_solid(x)); once++) {
            rub(i, x, falls);
        }
    }
#else
    for (var once = 0; once < select(0, 1, is_near_solid(x)); once++) {
        rub(i, x, falls);
    }
#endif
}

#endif
// `f` is the position in the cell, along a, b and c. An isolated droplet falls freely: around it
// nothing is projected, and closed faces, which have the wall's velocity, would stop it a cell away
// from the wall or hold it under a ceiling.
fn give(i: u32, axis: u32, f: vec3f, faces: Component, falls: bool, beyond: f32) {
    let a = vec2f(1.0 - f.x, f.x);
    let b = center_hats(f.y);
    let c = center_hats(f.z);
    let k = 3u * i + axis;
    let falling = sorted_velocity[k] + params.velocity_step[axis];
#ifdef SOLIDS
    let per_whole = 1.0 / max(value_at(faces.part, a, b, c), 1e-6);
#else
    let per_whole = 1.0;
#endif
    let u = select(per_whole * value_at(faces.speeds, a, b, c), falling, falls);
    carried[k] = u;
#ifdef APIC
    sorted_velocity[k] = u;
    // Derivatives of the hat functions, 1 per cell.
    let of_b = select(vec3f(0.0, -1.0, 1.0), vec3f(-1.0, 1.0, 0.0), f.y < 0.5);
    let of_c = select(vec3f(0.0, -1.0, 1.0), vec3f(-1.0, 1.0, 0.0), f.z < 0.5);
    let scale = params.inverse_cell_size;
    let row = 9u * i + 3u * axis;
    affine[row + axis] = scale * slope_of(faces, u, vec2f(-1.0, 1.0), b, c);
    affine[row + (axis + 1u) % 3u] = scale * slope_of(faces, u, a, of_b, c);
    affine[row + (axis + 2u) % 3u] = scale * slope_of(faces, u, a, b, of_c);
#else
    let advanced = sorted_velocity[k] + per_whole * value_at(faces.change, a, b, c);
    let kept = clamp(advanced + params.pic_blend * (u - advanced), faces.range.x - beyond,
        faces.range.y + beyond);
    sorted_velocity[k] = select(kept, falling, falls);
#endif
#ifdef CORRECTION
    carried[3u * params.particle_count + k] = per_whole * value_at(faces.shift, a, b, c);
#else
#ifdef PUSHED
    carried[3u * params.particle_count + k] = 0.0;
#endif
#endif
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.wet_cells {
        return;
    }
    let element = thread + CELLS;
    let first = cell_start[element];
    let end = cell_start[element + 1u];
    var of_x: Component;
    var of_y: Component;
    var of_z: Component;
    var corner = vec3f(0.0);
    var about: About;
    // Only cells with particles enter the loop.
    for (var once = 0; once < select(0, 1, end > first); once++) {
        open_neighborhood(element);
        let cell = own_cell(element);
        corner = vec3f(cell);
        var to_before = select(vec3i(1), vec3i(0), cell == vec3u(0u));
        var to_after = select(vec3i(1), vec3i(0), cell + 1u >= params.cells);
#ifdef PERIODIC
        to_before = select(to_before, vec3i(1), is_periodic());
        to_after = select(to_after, vec3i(1), is_periodic());
#endif
#ifdef APIC
#ifdef SOLIDS
        let is_looked_about = true;
#else
        let is_looked_about = cell_kind[element] != FLUID;
#endif
#else
        let is_looked_about = true;
#endif
        for (var once = 0; once < select(0, 1, is_looked_about); once++) {
            about = look_about(to_before, to_after);
        }
        let x = vec3i(1, 0, 0);
        let y = vec3i(0, 1, 0);
        let z = vec3i(0, 0, 1);
        of_x = read_component(
            0u, Steps(x, y * to_before, y * to_after, z * to_before, z * to_after));
        of_y = read_component(
            1u, Steps(y, z * to_before, z * to_after, x * to_before, x * to_after));
        of_z = read_component(
            2u, Steps(z, x * to_before, x * to_after, y * to_before, y * to_after));
    }
#ifdef APIC
    let beyond = 0.0;
#else
    let ranges = max(max(abs(of_x.range), abs(of_y.range)), abs(of_z.range));
    let fastest = max(ranges.x, ranges.y);
    let way = fastest * params.time_step * params.inverse_cell_size;
    let beyond = select(FAR, fastest * min(way, 1.0), about.is_surface);
#endif
    for (var i = first; i < end; i++) {
        let f = three(sorted_position[i]) * params.inverse_cell_size - corner;
        give(i, 0u, f, of_x, about.is_dry, beyond);
        give(i, 1u, f.yzx, of_y, about.is_dry, beyond);
        give(i, 2u, f.zxy, of_z, about.is_dry, beyond);
#ifdef SOLIDS
        for (var once = 0; once < select(0, 1, about.is_surface); once++) {
            rub_all(i, three(sorted_position[i]), about.is_dry);
        }
#endif
        sorted_velocity[3u * params.particle_count + i] = f32(about.is_dry);
    }
}
