// Particles take the grid's velocity and its change: v = α u + (1 − α)(v + Δu) (Zhu and Bridson 2005), or u and its
// slope (APIC, Jiang et al. 2015). A cell's particles share its 18 faces, which are read once. What lies beyond the
// domain's faces along b and c is what lies before them, so that water slides along walls.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_neighborhood.wgsl"
#import "shared/flip_axis.wgsl"
#import "shared/flip_carried.wgsl"

@group(0) @binding(2) var<storage, read> cell_start: array<u32>;
@group(0) @binding(3) var<storage, read> sorted_position: array<vec4f>;
@group(0) @binding(4) var<storage, read> face_velocity: array<f32>;
// Four floats a particle.
@group(0) @binding(5) var<storage, read_write> velocity: array<f32>;
#ifdef APIC
@group(0) @binding(6) var<storage, read_write> affine: array<f32>;
#else
@group(0) @binding(6) var<storage, read> face_change: array<f32>;
@group(0) @binding(9) var<storage, read> sorted_velocity: array<f32>;
#endif
@group(0) @binding(10) var<storage, read_write> carried: array<f32>;
#ifdef CORRECTION
@group(0) @binding(11) var<storage, read> face_displacement: array<f32>;
#endif

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
    return vec3f(face_displacement[faces.x], face_displacement[faces.y], face_displacement[faces.z]);
}
#endif

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
    let component = axis.x;
    let first = cell_start[element];
    let end = cell_start[element + 1u];
    let cell = own_cell(element);
    let corner = vec3f(cell);
    let at = turned_cell(cell);
    let last = turned_cell(params.cells) - 1u;
    let to_a = turned_back(vec3i(1, 0, 0));
    let to_b = turned_back(vec3i(0, 1, 0));
    let to_c = turned_back(vec3i(0, 0, 1));
    let b_before = select(to_b, vec3i(0), at.y == 0u);
    let b_after = select(to_b, vec3i(0), at.y >= last.y);
    let c_before = select(to_c, vec3i(0), at.z == 0u);
    let c_after = select(to_c, vec3i(0), at.z >= last.z);
    var speeds: Values;
#ifndef APIC
    var change: Values;
#endif
#ifdef CORRECTION
    var shift: Values;
#endif
    // Entered only by cells with particles.
    for (var once = 0; once < select(0, 1, end > first); once++) {
        open_neighborhood(element);
        let plane = vec3u(component * params.stride);
        for (var side = 0; side < 2; side++) {
            let start = side * to_a;
            let before = plane + vec3u(element_at(start - b_before - c_before), element_at(start - c_before), element_at(start + b_after - c_before));
            let own = plane + vec3u(element_at(start - b_before), element_at(start), element_at(start + b_after));
            let after = plane + vec3u(element_at(start - b_before + c_after), element_at(start + c_after), element_at(start + b_after + c_after));
            speeds.lower = speeds.upper;
            speeds.upper = mat3x3f(velocities(before), velocities(own), velocities(after));
#ifndef APIC
            change.lower = change.upper;
            change.upper = mat3x3f(changes(before), changes(own), changes(after));
#endif
#ifdef CORRECTION
            shift.lower = shift.upper;
            shift.upper = mat3x3f(displacements(before), displacements(own), displacements(after));
#endif
        }
    }
    let scale = params.inverse_cell_size;
    let blend = params.pic_blend;
    for (var i = first; i < end; i++) {
        let f = turned(sorted_position[i].xyz * scale - corner);
        let a = vec2f(1.0 - f.x, f.x);
        let b = vec3f(max(0.5 - f.y, 0.0), 1.0 - abs(f.y - 0.5), max(f.y - 0.5, 0.0));
        let c = vec3f(max(0.5 - f.z, 0.0), 1.0 - abs(f.z - 0.5), max(f.z - 0.5, 0.0));
        let u = value_at(speeds, a, b, c);
        let k = 4u * i + component;
        carried[CARRIED * i + component] = u;
#ifdef APIC
        velocity[k] = u;
        // Slopes of the hats, 1 over a cell.
        let of_b = select(vec3f(0.0, -1.0, 1.0), vec3f(-1.0, 1.0, 0.0), f.y < 0.5);
        let of_c = select(vec3f(0.0, -1.0, 1.0), vec3f(-1.0, 1.0, 0.0), f.z < 0.5);
        let slope = scale * vec3f(
            value_at(speeds, vec2f(-1.0, 1.0), b, c),
            value_at(speeds, a, of_b, c),
            value_at(speeds, a, b, of_c),
        );
        let row = 9u * i + 3u * component;
        affine[row + component] = slope.x;
        affine[row + (component + 1u) % 3u] = slope.y;
        affine[row + (component + 2u) % 3u] = slope.z;
#else
        let advanced = sorted_velocity[k] + value_at(change, a, b, c);
        velocity[k] = advanced + blend * (u - advanced);
#endif
#ifdef CORRECTION
        carried[CARRIED * i + 3u + component] = value_at(shift, a, b, c);
#endif
    }
}
