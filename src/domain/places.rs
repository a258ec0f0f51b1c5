//! Twin of shared/place.wgsl: places told by words, and who is near by them. Lists of PBF's neighbours are made of these.

/// Steps of h along an axis, and how many of them come round.
const STEPS: f32 = 256.0;
const ROUND: u32 = 1024;
/// Steps within which a list made from words has everyone, and no one else.
const REACH: u32 = 258;

/// Cells along an axis up to which words tell places: what their products err by is stated for so many.
const MOST_CELLS: usize = 4000;

/// Whether words tell places in a grid of cells of h: where an axis comes round, their steps do not come round with it.
pub fn are_told(mut dims: impl Iterator<Item = usize>, is_periodic: bool) -> bool {
    !is_periodic && dims.all(|cells| cells <= MOST_CELLS)
}

/// How far beyond h, over h, whoever is listed can be: within 258 steps of h/256, and a step of each place along three axes with what
/// their products err by.
pub const SKIN: f64 = (REACH as f64 + 1.949) / STEPS as f64 - 1.0;

/// The word of a place, metres; `inverse` is 1/h as the device has it. Products are rounded as there, so that words are equal.
#[inline]
pub fn word(place: [f32; 3], inverse: f32) -> u32 {
    let step = |axis: usize| (place[axis] * inverse * STEPS).floor() as i32 as u32 % ROUND;
    step(0) | step(1) << 10 | step(2) << 20
}

/// Whether two are listed with each other by their words: along each axis the way that comes round sooner.
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

    /// Whoever is nearer than h is listed, whoever is farther than [`SKIN`] allows is not, wherever words come round.
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
            // Of coordinates at 60 m the last place is 4e-6 m.
            let (h, rounding) = (f64::from(h), 1e-5);
            assert!(listed(h - rounding), "{x:?} {way:?}");
            assert!(!listed(h * (1.0 + SKIN) + rounding), "{x:?} {way:?}");
            between += usize::from(listed(h * (1.0 + 0.5 * SKIN)));
        }
        // Neither all nor none of those between.
        assert!((400..3600).contains(&between), "{between}");
    }

    #[test]
    fn words_tell_places_of_so_many_cells() {
        assert!(are_told([4000, 1, 7].into_iter(), false));
        assert!(!are_told([4001, 1, 7].into_iter(), false));
        assert!(!are_told([4, 1, 7].into_iter(), true));
    }
}
