// Code shared by both halves of the incomplete Poisson preconditioner.
#import "shared/pressure_links.wgsl"

@group(0) @binding(5) var<storage, read> pressure_inverse_diagonal: array<real>;

fn inverse_diagonals(first: u32, s: u32, t: u32) -> vec4r {
    return vec4r(
        pressure_inverse_diagonal[first],
        pressure_inverse_diagonal[first + s],
        pressure_inverse_diagonal[first + t],
        pressure_inverse_diagonal[first + s + t],
    );
}
