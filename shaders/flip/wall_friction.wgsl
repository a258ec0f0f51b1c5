// No-slip walls below the grid's resolution: slows water within a cell of such a wall along it, by
// the shear stress ρ (κ u)² of Prandtl's mixing length κ y with the mean gradient u / y between the
// wall, where water is at rest, and a face at distance y. The speed u is that of the particles. The
// update divides the velocity, so that a substep of any length ends between the initial velocity
// and rest. Walls only move along their normals: tangentially they are at rest.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_neighborhood.wgsl"
#import "shared/unit.wgsl"

// Bit mask of no-slip walls: the minimum faces along x, y, z, then the maximum faces.
override NO_SLIP: u32;

@group(0) @binding(2) var<storage, read> face_open: array<f32>;
// Velocity transferred from the particles.
@group(0) @binding(3) var<storage, read> face_change: array<f32>;
@group(0) @binding(4) var<storage, read> face_layer: array<u32>;
@group(0) @binding(5) var<storage, read_write> face_velocity: array<f32>;

const VON_KARMAN = 0.41;

// Part of the layer of one cell beside each no-slip wall that a row of faces represents, from the
// row's position in cells along each axis: all of it if less than half of its cell is cut off,
// shared between two rows that are equally near.
fn parts(place: vec3f) -> vec3f {
    let low = clamp(1.5 - (place - params.cut_min), vec3f(0.0), vec3f(1.0));
    let high = clamp(1.5 - (params.cut_max - place), vec3f(0.0), vec3f(1.0));
    let is_low = (vec3u(NO_SLIP) & vec3u(1u, 2u, 4u)) != vec3u(0u);
    let is_high = (vec3u(NO_SLIP) & vec3u(8u, 16u, 32u)) != vec3u(0u);
    return select(vec3f(0.0), low, is_low) + select(vec3f(0.0), high, is_high);
}

fn is_known(element: u32, component: u32) -> bool {
    return (face_layer[element] & (0x80u << (8u * component))) != 0u;
}

// The particles' velocity along `other` at the lower face along `own`: the mean of those of the
// four faces around it to which particles gave a velocity.
fn velocity_across(own: u32, other: u32) -> f32 {
    var sum = 0.0;
    var count = 0.0;
    for (var k = 0; k < 4; k++) {
        let element = element_at((k & 1) * unit(other) - (k >> 1u) * unit(own));
        let weight = select(0.0, 1.0, is_known(element, other));
        sum += weight * face_change[other * params.stride + element];
        count += weight;
    }
    return sum / max(count, 1.0);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.active_cells {
        return;
    }
    let element = thread + CELLS;
    let of_cell = parts(vec3f(own_cell(element)) + 0.5);
    for (var once = 0; once < select(0, 1, any(of_cell > vec3f(0.0))); once++) {
        open_neighborhood(element);
        for (var own = 0u; own < 3u; own++) {
            let face = own * params.stride + element;
            let is_water = face_open[face] > 0.0 && is_known(element, own);
            var rate = 0.0;
            for (var turn = 1u; turn < select(1u, 3u, is_water); turn++) {
                let across = (own + turn) % 3u;
                let along = vec2f(face_change[face], velocity_across(own, (own + 3u - turn) % 3u));
                rate += of_cell[across] * length(along);
            }
            rate *= VON_KARMAN * VON_KARMAN * params.inverse_cell_size;
            face_velocity[face] /= 1.0 + params.time_step * rate;
        }
    }
}
