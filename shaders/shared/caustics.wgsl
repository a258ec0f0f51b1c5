// The map of sunlight that water bends and bundles on what lies below it (src/render/caustics.rs). Needs the binding `caustics` of
// whoever imports it.

struct Caustics {
    // Unit vectors to the sun: as it stands, and as it stands seen from within flat water.
    towards: vec3f,
    index: f32,
    sun: vec3f,
    // Edge of the map's texels, metres.
    texel: f32,
    // Of the map on the plane y = 0, least x and z, metres; and its texels.
    corner: vec2f,
    size: vec2u,
    // Where the first ray comes through the plane y = `top`, x and z, and how many there are along each.
    first: vec2f,
    rays: vec2u,
    // Between rays, metres, at most.
    spacing: f32,
    top: f32,
    // Standard deviation with which normals are smoothed, metres.
    width: f32,
    // Metres at the map's edge over which its light goes over into that of flat water; 0 where no water lies beyond.
    fade: f32,
    // Ripples, with RIPPLES: longest wavelength, root mean square slope.
    ripple: vec2f,
    // Part of the sun's light that flat water lets in.
    through: f32,
    // Place of the map's first value in `sun_paths`.
    start: u32,
    // Between rays along x and z, metres.
    step: vec2f,
    pad0: f32,
    pad1: f32,
}

// Where a place lies in the map, texels: along the light in flat water, so that there the map is even at any depth.
fn caustic_place(p: vec3f) -> vec2f {
    let foot = p.xz - caustics.sun.xz * (p.y / caustics.sun.y);
    return (foot - caustics.corner) / caustics.texel;
}
