// Sum of second minors in a cell whose paths may be straight in part.
#import "shared/flip_minors.wgsl"
#import "shared/flip_straight.wgsl"

// Part of the midpoint rule in bricks, from the velocities before forces, as bits of floats.
@group(0) @binding(12) var<storage, read> strain_bend: array<u32>;

fn bend_in(slot: u32) -> f32 {
    return bitcast<f32>(strain_bend[slot]);
}

fn sum_through_faces() -> f32 {
    let center = vec3f(own_local) + 0.5;
    var sum = 0.0;
    for (var k = 0u; k < 6u; k++) {
        let axis = k >> 1u;
        let is_upper = (k & 1u) == 1u;
        let at = select(vec3i(0), unit(axis), is_upper);
        let half = select(-0.5, 0.5, is_upper);
        let part = face_open[face_at(axis, at)] * straight_at(center + half * vec3f(unit(axis)));
        for (var once = 0; once < select(0, 1, part > 0.0); once++) {
            sum += select(-1.0, 1.0, is_upper) * part * through_lower(axis, at);
        }
    }
    return sum;
}

// Contraction in a substep, as a part of a cell's volume; after `open_neighborhood` and
// `find_bends`.
fn contraction_in(element: u32, cell: vec3f) -> f32 {
    let is_plain = is_whole(element, cell) && is_straight() && !is_bounded();
    var minors = 0.0;
    for (var once = 0; once < select(0, 1, is_plain); once++) {
        minors = sum_of_minors();
    }
    for (var once = 0; once < select(1, 0, is_plain); once++) {
        minors = sum_through_faces();
    }
    return part_of(minors);
}
