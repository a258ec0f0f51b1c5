// Fixed-point scale of the map's sums: integer atomics give the same bits in any order. A sum holds
// up to 16384 times the light of flat water.
const LIGHT_SCALE: f32 = 262144.0;
