// Parts of a sample's light, each for a channel of its own. Every light that is added to the picture is added to one of them too, so
// that they add up to it; without LIGHTS there are none.

const REFLECTION: u32 = 0u;
const REFRACTION: u32 = 1u;
const SCATTERING: u32 = 2u;
const SUN: u32 = 3u;
const SKYLIGHT: u32 = 4u;
const WHITE: u32 = 5u;
const SOLIDS: u32 = 6u;
const CAUSTICS: u32 = 7u;
const FOAM_LIGHT: u32 = 8u;
const LIGHT_PARTS: u32 = 9u;

#ifdef LIGHTS
var<private> light_parts: array<vec3f, LIGHT_PARTS>;
#endif

fn light_part(part: u32, light: vec3f) {
#ifdef LIGHTS
    light_parts[part] += light;
#endif
}

// What was added up to here is seen through something that lets so much of it through.
fn dim_parts(kept: f32) {
#ifdef LIGHTS
    for (var part = 0u; part < LIGHT_PARTS; part++) {
        light_parts[part] *= kept;
    }
#endif
}
