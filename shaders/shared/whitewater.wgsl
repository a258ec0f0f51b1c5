// Code shared by sums over water: the water fraction around a position. Copies of uniforms that
// inner loops read: llvmpipe does not hoist uniform loads out of a loop.
var<private> fluid_count: u32;
var<private> inverse_h: f32;

fn begin_water() {
    fluid_count = params.particle_count;
    inverse_h = params.inverse_support_radius;
}

// Water fraction of the volume that walls and solids leave open: 1 deep inside, also in a corner; 0
// in dry air beside a wall.
fn share_of(kernel: f32, solid: f32, wall: f32) -> f32 {
    let free = 1.0 - wall - params.density_scale * solid;
    return params.density_scale * kernel / max(free, 0.1);
}
