// The map of bent sunlight as it is read. Needs the bindings `caustics`, `sun_paths` and those of rays_water and rays_set of whoever
// imports it.
#import "shared/caustics_layer.wgsl"

fn caustic_value(layer: u32, texel: vec2i) -> f32 {
    let at = vec2u(clamp(texel, vec2i(0), vec2i(caustics.size) - 1));
    return sun_paths[caustics.start + (layer * caustics.size.y + at.y) * caustics.size.x + at.x];
}

// Places along each side of a pixel's footprint at which the map is read, at most.
const MOST_TAPS: i32 = 4;

// Bilinear; `place` is in texels.
fn caustic_between(layer: u32, place: vec2f) -> f32 {
    let q = place - 0.5;
    let low = floor(q);
    let part = q - low;
    let c = vec2i(low);
    let near = mix(caustic_value(layer, c), caustic_value(layer, c + vec2i(1, 0)), part.x);
    let far = mix(caustic_value(layer, c + vec2i(0, 1)), caustic_value(layer, c + vec2i(1, 1)), part.x);
    return mix(near, far, part.y);
}

// Sunlight through water on a level face at `p`, over that through flat water; `n` is the normal of what stands there. The mean over a
// pixel of `footprint` metres: lines of light are finer than pixels.
fn caustic_at(p: vec3f, n: vec3f, footprint: f32) -> f32 {
    let layer = caustic_layer(p, n);
    // At the box's sides the map's light ends within a texel: it is read where no part of it is lost.
    var inner = p;
    if caustics.fade <= 0.0 {
        let inset = min(vec2f(1.5 * caustics.texel + 0.5 * footprint), 0.5 * rays.size.xz);
        let held = clamp(p.xz, inset, rays.size.xz - inset);
        inner = vec3f(held.x, p.y, held.y);
    }
    let place = caustic_place(inner);
    let size = footprint / caustics.texel;
    let taps = clamp(i32(ceil(size)), 1, MOST_TAPS);
    var sum = 0.0;
    for (var k = 0; k < taps * taps; k++) {
        let at = (vec2f(f32(k % taps), f32(k / taps)) + 0.5) / f32(taps) - 0.5;
        sum += caustic_between(layer, place + size * at);
    }
    return sum / f32(taps * taps);
}

// The part of a place's light that the map has.
fn caustic_part(p: vec3f) -> f32 {
    if caustics.fade <= 0.0 {
        return 1.0;
    }
    let q = caustic_place(p);
    let off = min(q, vec2f(caustics.size) - q) * caustics.texel;
    return smoothstep(0.5 * caustics.fade, caustics.fade, min(off.x, off.y));
}
