// Flux out of cells by changes of the bodies' velocities.
#import "shared/pressure_bodies.wgsl"

@group(0) @binding(8) var<storage, read> body_pairs: array<BodyPair>;
@group(0) @binding(10) var<storage, read> body_change: array<real>;

// Flux out of a cell by changes of the bodies' velocities, those from index `changes` on, of the
// bodies in pairs `first` up to `end`.
fn body_flux(first: u32, end: u32, inner: u32, changes: u32) -> real {
    var sum = real(0.0);
    for (var pair = first; pair < end; pair++) {
        let own = changes + 6u * body_pairs[pair].body;
        for (var k = 0u; k < 6u; k++) {
            sum += real(body_coupling[CELLS * (6u * pair + k) + inner]) * body_change[own + k];
        }
    }
    return sum;
}
