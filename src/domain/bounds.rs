//! Axis-aligned boxes.

use glam::DVec3;

/// Farther than any domain reaches, metres, and a power of two: where walls stand that are not there.
pub const FAR: f64 = (1u64 << 40) as f64;

/// An axis-aligned box, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Least corner.
    pub min: DVec3,
    /// Greatest corner.
    pub max: DVec3,
}

impl Bounds {
    /// The smallest box around `points`; `None` where there are none.
    pub fn of_points(points: impl IntoIterator<Item = DVec3>) -> Option<Self> {
        points.into_iter().fold(None, |bounds, p| match bounds {
            None => Some(Self { min: p, max: p }),
            Some(b) => Some(Self {
                min: b.min.min(p),
                max: b.max.max(p),
            }),
        })
    }

    /// Edge lengths.
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// Cubic metres.
    pub fn volume(&self) -> f64 {
        let size = self.size();
        size.x * size.y * size.z
    }

    /// Whether `p` lies inside or on the surface.
    pub fn contains(&self, p: DVec3) -> bool {
        p.cmpge(self.min).all() && p.cmple(self.max).all()
    }

    /// Cells of edge `edge` that cover it along each axis; one at least.
    pub fn cells(&self, edge: f64) -> [u32; 3] {
        (self.size() / edge)
            .to_array()
            .map(|cells| (cells.ceil() as u32).max(1))
    }

    /// This box with each face moved outward by `margin` metres.
    pub fn grown(&self, margin: f64) -> Self {
        Self {
            min: self.min - DVec3::splat(margin),
            max: self.max + DVec3::splat(margin),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_enclosed_tightly() {
        let points = [DVec3::new(1.0, 5.0, -2.0), DVec3::new(3.0, 4.0, 0.0)];
        let bounds = Bounds::of_points(points).expect("two points have bounds");
        assert_eq!(bounds.min, DVec3::new(1.0, 4.0, -2.0));
        assert_eq!(bounds.max, DVec3::new(3.0, 5.0, 0.0));
        assert_eq!(bounds.volume(), 4.0);
        assert!(bounds.contains(points[0]));
        assert!(!bounds.contains(DVec3::new(3.1, 4.5, -1.0)));
        assert!(bounds.grown(0.2).contains(DVec3::new(3.1, 4.5, -1.0)));
        assert!(Bounds::of_points([]).is_none());
    }
}
