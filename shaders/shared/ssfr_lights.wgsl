// Components of a sample's light, one per output channel. All light added to the picture is also
// added to one component, so that the components sum to it. Without LIGHTS there are none.

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

// Attenuates everything added so far by the transmittance of what is in front.
fn dim_parts(kept: f32) {
#ifdef LIGHTS
    for (var part = 0u; part < LIGHT_PARTS; part++) {
        light_parts[part] *= kept;
    }
#endif
}
