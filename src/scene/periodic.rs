//! Periodic axes of the domain.

use std::borrow::Cow;

use glam::{DAffine3, DVec3};

use super::Scene;
use swell_domain::{bounds::Bounds, mesh::TriangleMesh, period::Period};

impl Scene {
    /// Whether the domain is periodic along any axis.
    pub fn is_periodic(&self) -> bool {
        self.periodic.contains(&true)
    }

    /// Returns the domain's length along periodic axes, rounded to `f32` so that GPU and
    /// reference wrap alike.
    pub fn period(&self) -> Period {
        let is = |axis: usize| f64::from(u8::from(self.periodic[axis]));
        let size = self.domain.size() * DVec3::new(is(0), is(1), is(2));
        Period(size.as_vec3().as_dvec3())
    }

    /// Returns the mesh and, along periodic axes, those of its images that come within `margin`
    /// metres of the domain.
    pub fn with_images<'a>(
        &self,
        mesh: &'a TriangleMesh,
        margin: f64,
    ) -> Vec<Cow<'a, TriangleMesh>> {
        let (Period(period), near) = (self.period(), self.domain.grown(margin));
        let mut images = vec![Cow::Borrowed(mesh)];
        if !self.is_periodic() {
            return images;
        }
        for k in (0..27).filter(|&k| k != 13) {
            let step = DVec3::from_array([k % 3, k / 3 % 3, k / 9].map(|n| f64::from(n) - 1.0));
            // There are no images along an axis with walls.
            if (0..3).any(|axis| !self.periodic[axis] && step[axis] != 0.0) {
                continue;
            }
            let image = mesh.transformed(&DAffine3::from_translation(step * period));
            let comes_near = |b: Bounds| b.min.cmplt(near.max).all() && b.max.cmpgt(near.min).all();
            if image.bounds().is_some_and(comes_near) {
                images.push(Cow::Owned(image));
            }
        }
        images
    }
}
