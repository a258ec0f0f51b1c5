// Smooths the water fraction for the second time.
#import "shared/tension.wgsl"
#import "shared/tension_smooth.wgsl"

@group(0) @binding(3) var<storage, read> tension_share: array<f32>;
@group(0) @binding(4) var<storage, read_write> tension_between: array<f32>;

fn share_of(element: u32) -> f32 {
    return tension_share[element];
}

fn store(element: u32, share: f32) {
    tension_between[element] = share;
}
