//! Boxes that join their own ends.

use glam::DVec3;

/// Lengths of a box along the axes along which it joins its own end, metres; 0 along those with walls. Positions are
/// relative to its least corner.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Period(pub DVec3);

impl Period {
    /// The place in the box, up to its rounding, of which `x` is an image.
    pub fn wrap(self, x: DVec3) -> DVec3 {
        x - self.whole((x / self.0).floor())
    }

    /// The shortest of a difference and its images.
    pub fn shortest(self, difference: DVec3) -> DVec3 {
        difference - self.whole((difference / self.0).round())
    }

    /// So many periods, metres; nothing along axes with walls.
    fn whole(self, periods: DVec3) -> DVec3 {
        DVec3::select(self.0.cmpgt(DVec3::ZERO), periods * self.0, DVec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_differ_by_whole_periods() {
        let period = Period(DVec3::new(2.0, 0.0, 0.5));
        let x = DVec3::new(-0.25, -7.0, 1.25);
        assert_eq!(period.wrap(x), DVec3::new(1.75, -7.0, 0.25));
        assert_eq!(period.wrap(period.wrap(x)), period.wrap(x));
        let there = DVec3::new(1.75, 3.0, 0.125) - DVec3::new(0.25, 1.0, 0.375);
        assert_eq!(period.shortest(there), DVec3::new(-0.5, 2.0, -0.25));
        // Without a period a place stays where it is.
        assert_eq!(Period::default().wrap(x), x);
        assert_eq!(Period::default().shortest(x), x);
    }
}
