// For passes that write entries of `predicted`.
#import "shared/predicted_at.wgsl"

@group(0) @binding(1) var<storage, read_write> predicted: array<vec4f>;
#ifdef PAGED
@group(0) @binding(9) var<storage, read_write> predicted_high: array<vec4f>;
#endif

fn set_predicted(i: u32, place: vec4f) {
#ifdef PAGED
    if i < PAGE {
        predicted[i] = place;
    } else {
        predicted_high[i - PAGE] = place;
    }
#else
    predicted[i] = place;
#endif
}
