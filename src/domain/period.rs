//! Periodic boxes, whose opposite ends are joined.

use glam::DVec3;

use super::bounds::cells_over;

/// Lengths of a box along its periodic axes, metres; 0 along axes with walls. Positions are
/// relative to its least corner.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Period(pub DVec3);

impl Period {
    /// Returns the position in the box, up to its rounding, that `x` is an image of.
    #[inline]
    pub fn wrap(self, x: DVec3) -> DVec3 {
        if self.0 == DVec3::ZERO {
            return x;
        }
        x - self.whole((x / self.0).floor())
    }

    /// Returns the shortest of a difference and its periodic images.
    #[inline]
    pub fn shortest(self, difference: DVec3) -> DVec3 {
        if self.0 == DVec3::ZERO {
            return difference;
        }
        difference - self.whole((difference / self.0).round())
    }

    /// Returns whether a point that moved from `before` to `after` was wrapped to the other end, or
    /// is so close to an end that rounding decides on which side it is.
    #[inline]
    pub fn is_at_joint(self, before: DVec3, after: DVec3) -> bool {
        let is_carried = (after - before).abs().cmpgt(0.5 * self.0);
        let is_near = after.cmplt(1e-5 * self.0) | after.cmpgt((1.0 - 1e-5) * self.0);
        (self.0.cmpgt(DVec3::ZERO) & (is_carried | is_near)).any()
    }

    /// Returns `found`, or its image nearer to `expected` if only rounding put it at the other end
    /// of the box. `found` must lie in the box to be replaced.
    #[inline]
    pub fn image_by_rounding(self, found: DVec3, expected: DVec3) -> DVec3 {
        let slack = 1e-6 * self.0;
        let is_within = found.cmpge(-slack) & found.cmple(self.0 + slack);
        let near = expected + self.shortest(found - expected);
        DVec3::select(self.0.cmpgt(DVec3::ZERO) & is_within, near, found)
    }

    /// Returns the number of cells that cover a box of `size` metres along each axis, at least one:
    /// of edge `edge` along axes with walls; along periodic axes, as many as fit without being
    /// shorter than that.
    pub fn cells(self, size: DVec3, edge: f64) -> [u32; 3] {
        let (count, covering) = ((size / edge).to_array(), cells_over(size, edge).to_array());
        std::array::from_fn(|axis| match self.0[axis] > 0.0 {
            // Decimal fractions: 0.6 m are three cells of 0.2 m.
            true => ((count[axis] * (1.0 + 1e-9)).floor() as u32).max(1),
            false => covering[axis] as u32,
        })
    }

    /// Returns the edge lengths of `cells`, metres; `edge` along axes with walls.
    pub fn edges(self, cells: [u32; 3], edge: f64) -> DVec3 {
        let fitted = self.0 / DVec3::from_array(cells.map(f64::from));
        DVec3::select(self.0.cmpgt(DVec3::ZERO), fitted, DVec3::splat(edge))
    }

    /// Lengths of whole periods, metres; 0 along axes with walls.
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
        let there = DVec3::new(1.75, 3.0, 0.125) - DVec3::new(0.25, 1.0, 0.25);
        assert_eq!(period.shortest(there), DVec3::new(-0.5, 2.0, -0.125));
        // The other end is near; a position beyond it stays.
        let (low, high) = (DVec3::new(1e-9, 1.0, 0.1), DVec3::new(2.0, 1.0, 0.1));
        let off = |found| period.image_by_rounding(found, high).distance(high);
        assert!(off(low) < 1e-8 && off(high) == 0.0);
        assert!(off(high + 2.0 * DVec3::X) == 2.0 && off(low - 2.0 * DVec3::X) > 3.9);
        // Cells are no shorter than requested, and fill the period.
        let cells = period.cells(DVec3::new(2.0, 7.0, 0.5), 0.15);
        assert_eq!(cells, [13, 47, 3]);
        let edges = period.edges(cells, 0.15);
        assert_eq!(edges, DVec3::new(2.0 / 13.0, 0.15, 0.5 / 3.0));
        // Without a period, positions do not change.
        assert_eq!(Period::default().wrap(x), x);
        assert_eq!(Period::default().shortest(x), x);
    }
}
