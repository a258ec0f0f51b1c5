// Lookup in the caustics map. The importing shader must bind `caustics`, `sun_paths` and the
// bindings of rays_water and rays_set.
#import "shared/caustics_layer.wgsl"

fn caustic_value(layer: u32, texel: vec2i) -> f32 {
    let at = vec2u(clamp(texel, vec2i(0), vec2i(caustics.size) - 1));
    return sun_paths[caustics.start + (layer * caustics.size.y + at.y) * caustics.size.x + at.x];
}

// Largest number of taps along each side of a pixel's footprint.
const MOST_BLUR_TAPS: i32 = 4;

// Bilinear lookup; `place` is in texels.
fn caustic_between(layer: u32, place: vec2f) -> f32 {
    let q = place - 0.5;
    let low = floor(q);
    let part = q - low;
    let c = vec2i(low);
    let near = mix(caustic_value(layer, c), caustic_value(layer, c + vec2i(1, 0)), part.x);
    let far = mix(
        caustic_value(layer, c + vec2i(0, 1)), caustic_value(layer, c + vec2i(1, 1)), part.x);
    return mix(near, far, part.y);
}

// Sunlight through water on a level face at `p`, relative to that through flat water, as the mean
// over a pixel of `footprint` metres, because caustics are finer than pixels; `n` is the surface
// normal.
fn caustic_at(p: vec3f, n: vec3f, footprint: f32) -> f32 {
    let layer = caustic_layer(p, n);
    // The map's light fades out within a texel at the box's sides; the lookup stays away from them.
    var inner = p;
    if caustics.fade <= 0.0 {
        let inset = min(vec2f(1.5 * caustics.texel + 0.5 * footprint), 0.5 * rays.size.xz);
        let held = clamp(p.xz, inset, rays.size.xz - inset);
        inner = vec3f(held.x, p.y, held.y);
    }
    let place = caustic_place(inner);
    let size = footprint / caustics.texel;
    let taps = clamp(i32(ceil(size)), 1, MOST_BLUR_TAPS);
    var sum = 0.0;
    for (var k = 0; k < taps * taps; k++) {
        let at = (vec2f(f32(k % taps), f32(k / taps)) + 0.5) / f32(taps) - 0.5;
        sum += caustic_between(layer, place + size * at);
    }
    return sum / f32(taps * taps);
}

// Fraction of a point's light that comes from the map.
fn caustic_part(p: vec3f) -> f32 {
    if caustics.fade <= 0.0 {
        return 1.0;
    }
    let q = caustic_place(p);
    let off = min(q, vec2f(caustics.size) - q) * caustics.texel;
    return smoothstep(0.5 * caustics.fade, caustics.fade, min(off.x, off.y));
}
