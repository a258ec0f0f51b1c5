// Layout of the caustics map: sunlight that water refracts onto what is below it
// (src/render/caustics.rs). The importing shader must bind `caustics`.

struct Caustics {
    // Unit vectors towards the sun in air, and in `sun` as seen from within flat water.
    towards: vec3f,
    index: f32,
    sun: vec3f,
    // Edge of the map's texels, metres.
    texel: f32,
    // Least x and z of the map on the plane y = 0, metres, and its size in texels.
    corner: vec2f,
    size: vec2u,
    // Point x, z at which the first ray crosses the plane y = `top`, and the number of rays along
    // each axis.
    first: vec2f,
    rays: vec2u,
    // Upper bound of the distance between rays, metres.
    spacing: f32,
    top: f32,
    // Standard deviation with which normals are smoothed, metres.
    width: f32,
    // Width at the map's edge over which its light blends into that of flat water, metres; 0 where
    // there is no water beyond.
    fade: f32,
    // Ripples, with RIPPLES: longest wavelength, m, and root mean square slope.
    ripple: vec2f,
    // Transmittance of flat water's surface for the sun's light.
    through: f32,
    // Index of the map's first value in `sun_paths`.
    start: u32,
    // Distance between rays along x and z, metres.
    step: vec2f,
    pad0: f32,
    pad1: f32,
}

// Position of a point in the map, texels: projected along the light in flat water, so that flat
// water gives an even map at any depth.
fn caustic_place(p: vec3f) -> vec2f {
    let foot = p.xz - caustics.sun.xz * (p.y / caustics.sun.y);
    return (foot - caustics.corner) / caustics.texel;
}
