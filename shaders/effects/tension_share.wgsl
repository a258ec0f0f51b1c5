// Water fraction around cell centres for surface tension: the density, smoothed for the first time.
#import "shared/tension.wgsl"
#import "shared/tension_smooth.wgsl"

@group(0) @binding(3) var<storage, read> density: array<f32>;
@group(0) @binding(4) var<storage, read_write> tension_share: array<f32>;

fn share_of(element: u32) -> f32 {
    return clamp(density[element], 0.0, 1.0);
}

fn store(element: u32, share: f32) {
    tension_share[element] = share;
}
