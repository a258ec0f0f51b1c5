// Fixed point of the map's sums: integer atomics add up to the same bits in any order. They hold 16384 times the light of flat water.
const LIGHT_SCALE: f32 = 262144.0;
