//! Positions packed into 32-bit words, and the distance test on them from which PBF builds its
//! neighbour lists. Mirrors shared/place.wgsl.

/// Steps per h along an axis, and the number of steps after which an axis wraps.
const STEPS: f32 = 256.0;
const ROUND: u32 = 1024;
/// Distance in steps below which two words count as near.
const REACH: u32 = 258;

/// Largest number of cells along an axis for which packing is used: the bound on the rounding of
/// its products holds up to it.
const MOST_CELLS: usize = 4000;

/// Returns whether packed positions work in a grid of cells of size h. They do not for periodic
/// axes, whose steps do not wrap with the period.
pub fn can_pack(mut dims: impl Iterator<Item = usize>, is_periodic: bool) -> bool {
    !is_periodic && dims.all(|cells| cells <= MOST_CELLS)
}

/// Largest distance of a listed neighbour, as the excess over h relative to h: 258 steps of h/256,
/// plus one step per position along three axes including the rounding of their products.
pub const SKIN: f64 = (REACH as f64 + 1.949) / STEPS as f64 - 1.0;

/// Packs a position, metres; `inverse` is 1/h as the GPU has it. Products are rounded as on the
/// GPU, so that the words are equal.
#[inline]
pub fn word(place: [f32; 3], inverse: f32) -> u32 {
    let step = |axis: usize| (place[axis] * inverse * STEPS).floor() as i32 as u32 % ROUND;
    step(0) | step(1) << 10 | step(2) << 20
}

/// Returns whether two words are near; along each axis the shorter way round counts.
#[inline]
pub fn are_near(a: u32, b: u32) -> bool {
    let way = |axis: u32| {
        let apart = (a >> (10 * axis)).wrapping_sub(b >> (10 * axis)) % ROUND;
        apart.min(ROUND - apart)
    };
    (0..3).map(|axis| way(axis).pow(2)).sum::<u32>() < REACH * REACH
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points nearer than h are listed, and points farther than [`SKIN`] allows are not, including
    /// where words wrap.
    #[test]
    fn words_list_who_is_near_and_no_one_far() {
        let h = 0.1f32;
        let words = |x: [f32; 3]| word(x, 1.0 / h);
        let mut between = 0;
        for k in 0..4000u32 {
            let unit = |salt: u32| {
                f64::from((k * 2_654_435_761).rotate_left(salt) ^ k) / f64::from(u32::MAX)
            };
            let x = [3, 11, 19].map(|salt| (60.0 * unit(salt)) as f32);
            let (up, round) = (2.0 * unit(7) - 1.0, std::f64::consts::TAU * unit(23));
            let flat = (1.0 - up * up).sqrt();
            let way = [flat * round.cos(), up, flat * round.sin()];
            let listed = |distance: f64| {
                let y = [0, 1, 2].map(|axis| x[axis] + (way[axis] * distance) as f32);
                are_near(words(x), words(y))
            };
            // At 60 m the last digit of an f32 coordinate is 4e-6 m.
            let (h, rounding) = (f64::from(h), 1e-5);
            assert!(listed(h - rounding), "{x:?} {way:?}");
            assert!(!listed(h * (1.0 + SKIN) + rounding), "{x:?} {way:?}");
            between += usize::from(listed(h * (1.0 + 0.5 * SKIN)));
        }
        // Some of those in between are listed, but not all.
        assert!((400..3600).contains(&between), "{between}");
    }

    #[test]
    fn words_tell_places_of_so_many_cells() {
        assert!(can_pack([4000, 1, 7].into_iter(), false));
        assert!(!can_pack([4001, 1, 7].into_iter(), false));
        assert!(!can_pack([4, 1, 7].into_iter(), true));
    }
}
