#import "shared/predicted_at.wgsl"

@group(0) @binding(1) var<storage, read> predicted: array<vec4f>;
#ifdef PAGED
@group(0) @binding(9) var<storage, read> predicted_high: array<vec4f>;
#endif
