//! Pseudo-random numbers from ids (shared/hash.wgsl).

use glam::DVec3;

/// PCG hash (Jarzynski and Olano 2020).
pub(super) fn pcg(value: u32) -> u32 {
    let state = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// Returns a unit vector for a pair of particles at the same position: opposite for (a, b) and (b,
/// a). It points to a hashed point of a cube, with odd coordinates up to 1023.
pub(super) fn pair_direction(a: u32, b: u32) -> DVec3 {
    let seed = pcg(a.min(b) ^ pcg(a.max(b)));
    let part = |shift: u32| 2.0 * f64::from(seed >> shift & 1023) - 1023.0;
    let sign = if a < b { 1.0 } else { -1.0 };
    sign * DVec3::new(part(0), part(10), part(20)).normalize()
}
