//! Axis-aligned boxes.

use glam::DVec3;

use super::flip::ON_FACE;

/// A distance beyond any domain, metres, and a power of two: the position of walls that a
/// domain lacks.
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
    /// The box that contains every point.
    pub const EVERYWHERE: Self = Self {
        min: DVec3::NEG_INFINITY,
        max: DVec3::INFINITY,
    };

    /// Returns the smallest box around `points`; `None` if there are none.
    pub fn of_points(points: impl IntoIterator<Item = DVec3>) -> Option<Self> {
        points.into_iter().fold(None, |bounds, p| match bounds {
            None => Some(Self { min: p, max: p }),
            Some(b) => Some(Self {
                min: b.min.min(p),
                max: b.max.max(p),
            }),
        })
    }

    /// Returns the edge lengths, metres.
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// Returns the volume, m³.
    pub fn volume(&self) -> f64 {
        let size = self.size();
        size.x * size.y * size.z
    }

    /// Returns whether `p` lies inside or on the surface.
    pub fn contains(&self, p: DVec3) -> bool {
        p.cmpge(self.min).all() && p.cmple(self.max).all()
    }

    /// What both boxes contain; a size is negative along axes on which they are apart.
    pub fn intersection(&self, other: &Self) -> Self {
        Self {
            min: self.min.max(other.min),
            max: self.max.min(other.max),
        }
    }

    /// Returns the number of cells of edge length `edge` that cover the box along each axis, as
    /// [`cells_over`] counts them.
    pub fn cells(&self, edge: f64) -> [u32; 3] {
        cells_over(self.size(), edge).to_array().map(|n| n as u32)
    }

    /// Returns this box moved by `way`, metres.
    pub fn moved(&self, way: DVec3) -> Self {
        Self {
            min: self.min + way,
            max: self.max + way,
        }
    }

    /// Returns this box with each face moved outward by `margin` metres.
    pub fn grown(&self, margin: f64) -> Self {
        Self {
            min: self.min - DVec3::splat(margin),
            max: self.max + DVec3::splat(margin),
        }
    }
}

/// Returns the number of cells of edge length `edge` that cover `size` along each axis, as whole
/// numbers; at least one. A last cell that the box would fill by less than [`ON_FACE`] is dropped:
/// 3 × 0.05 m are three cells of 0.05 m, although the quotient exceeds 3 in f64.
pub fn cells_over(size: DVec3, edge: f64) -> DVec3 {
    (size / edge - ON_FACE).ceil().max(DVec3::ONE)
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

    /// Products of decimals, which f64 rounds up or down, on axes that begin at 0 and on others.
    #[test]
    fn rounding_alone_makes_no_cell() {
        let cells = |min: f64, max: f64, edge: f64| {
            let bounds = Bounds {
                min: DVec3::splat(min),
                max: DVec3::splat(max),
            };
            bounds.cells(edge)[0]
        };
        let mut over = 0;
        for edge in [0.05, 0.1, 0.2, 0.3, 0.7, 1.0 / 3.0, 0.057_15 / 24.0] {
            for count in (1..2000).chain([65_535, 65_536]) {
                let length = f64::from(count) * edge;
                for min in [0.0, -0.3, 0.1, 17.3, -2000.1] {
                    over += u32::from((min + length - min) / edge > f64::from(count));
                    let found = cells(min, min + length, edge);
                    assert_eq!(found, count, "{count} of {edge} from {min}");
                }
                // Lengths rounded to f32, as other programs write them.
                let narrow = f64::from(length as f32);
                let found = cells(0.0, narrow, edge);
                assert!(count > 8000 || found == count, "{count} of {edge} in f32");
                // Negative control: a cell that is truly cut counts.
                assert_eq!(cells(0.0, length + 2.0 * ON_FACE * edge, edge), count + 1);
                assert_eq!(cells(0.0, length - 2.0 * ON_FACE * edge, edge), count);
            }
        }
        assert!(over > 1000, "{over} of them were one more before");
        assert_eq!(cells(0.0, 1e-6, 0.1), 1);
    }
}
