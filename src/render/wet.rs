//! Solids under a film of water: their triangles, the wetness of the corners, the film's optics.

use std::{borrow::Cow, sync::Arc};

use glam::DVec3;

use super::{RenderError, RenderScene, plan::Plan};
use swell_domain::{mesh::TriangleMesh, wet::RefinedSurface};
use swell_scene::look::{Look, LookSpec};

/// How wet the solids of a scene are at a frame.
#[derive(Clone, Debug)]
pub struct WetSolids {
    /// Refined surfaces of [`RenderScene::solids`], in their order.
    pub surfaces: Arc<Vec<RefinedSurface>>,
    /// Wetness of each of their vertices, surface after surface, 0 to 1.
    pub wetness: Vec<f32>,
}

/// A solid's triangles as they are drawn.
pub(super) struct DrawnSolid<'a> {
    pub(super) vertices: Cow<'a, [DVec3]>,
    pub(super) triangles: &'a [[u32; 3]],
    /// For each triangle, the triangle of the mesh that it is a part of; `None` where it is that.
    parents: Option<&'a [u32]>,
    /// Wetness of each vertex.
    wetness: Option<&'a [f32]>,
}

impl<'a> DrawnSolid<'a> {
    /// The solid with this index: refined where the scene has its wetness, else its own mesh.
    pub(super) fn of(scene: &'a RenderScene, index: usize) -> Result<Self, RenderError> {
        let mesh: &TriangleMesh = &scene.solids[index];
        let Some(wet) = &scene.wet else {
            return Ok(Self {
                vertices: Cow::Borrowed(&mesh.vertices),
                triangles: &mesh.triangles,
                parents: None,
                wetness: None,
            });
        };
        let first: usize = (wet.surfaces.iter().take(index))
            .map(RefinedSurface::len)
            .sum();
        let surface = wet.surfaces.get(index);
        let found = surface.and_then(|it| Some((it, wet.wetness.get(first..first + it.len())?)));
        let Some((surface, wetness)) = found else {
            return Err(RenderError::Scene(format!(
                "solid {index} has no wetness: it is known of {} surfaces with {} vertices",
                wet.surfaces.len(),
                wet.wetness.len()
            )));
        };
        Ok(Self {
            vertices: Cow::Owned(surface.vertices(&mesh.vertices)),
            triangles: &surface.triangles,
            parents: Some(&surface.parents),
            wetness: Some(wetness),
        })
    }

    /// Index in the mesh of the triangle that triangle `index` is a part of.
    pub(super) fn parent(&self, index: usize) -> usize {
        self.parents.map_or(index, |it| it[index] as usize)
    }

    /// Wetness of a triangle's corners, packed above its material code as in ssfr_solid.wgsl.
    pub(super) fn packed_wetness(&self, corners: [u32; 3]) -> u32 {
        let Some(wetness) = self.wetness else {
            return 0;
        };
        let byte = |corner: u32| (255.0 * wetness[corner as usize].clamp(0.0, 1.0)).round() as u32;
        let [a, b, c] = corners.map(byte);
        a << 8 | b << 16 | c << 24
    }
}

/// Defines `INDEXED` in the passes that need a solid's triangle, and `WET` in those that shade,
/// where the look has materials or wet solids.
pub(super) fn plan_wet(
    plan: &mut Plan,
    look: &Look,
    indexed: &[&'static str],
    shading: &[&'static str],
) {
    let is_wet = look.spec().wet.is_some();
    if is_wet || look.materials().is_some() {
        for pass in indexed {
            plan.define(pass, "INDEXED");
        }
    }
    if is_wet {
        for pass in shading {
            plan.define(pass, "WET");
        }
    }
}

/// Part of the diffuse light from below that the surface of a film reflects back, by total and
/// partial internal reflection, and the mean square slope of that surface; zeros for a look without
/// wet solids.
pub(super) fn film(spec: &LookSpec) -> [f64; 2] {
    let index = spec.water.index;
    spec.wet.as_ref().map_or([0.0; 2], |wet| {
        // By Stokes' reciprocity, with radiance divided by n² (Lekner and Dorf 1988, equation 8).
        let trapped = 1.0 - (1.0 - diffuse_reflectance(index)) / (index * index);
        [trapped, wet.roughness * wet.roughness]
    })
}

/// Number of intervals of the cosine of incidence in [`diffuse_reflectance`].
const COSINES: u32 = 4096;

/// Reflectance of a surface of refractive index `index` for diffuse light from air: the Fresnel
/// reflectance, averaged over cos² of incidence by the midpoint rule.
fn diffuse_reflectance(index: f64) -> f64 {
    let of = |k: u32| {
        let c = (f64::from(k) + 0.5) / f64::from(COSINES);
        let t = (1.0 - (1.0 - c * c) / (index * index)).max(0.0).sqrt();
        let s = ((c - index * t) / (c + index * t)).powi(2);
        let p = ((index * c - t) / (index * c + t)).powi(2);
        c * (s + p)
    };
    (0..COSINES).map(of).sum::<f64>() / f64::from(COSINES)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the closed form of Duntley (1942), and known values for water.
    #[test]
    fn a_film_traps_what_theory_says() {
        for n in [1.2f64, 1.333, 1.5] {
            let (n2, n4) = (n * n, n.powi(4));
            let closed = 0.5
                + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0).powi(2))
                + n2 * (n2 - 1.0).powi(2) / (n2 + 1.0).powi(3) * ((n - 1.0) / (n + 1.0)).ln()
                - 2.0 * n.powi(3) * (n2 + 2.0 * n - 1.0) / ((n2 + 1.0) * (n4 - 1.0))
                + 8.0 * n4 * (n4 + 1.0) / ((n2 + 1.0) * (n4 - 1.0).powi(2)) * n.ln();
            // The midpoint rule's error is of the order of the square of an interval.
            let found = diffuse_reflectance(n);
            assert!((found - closed).abs() < 1e-6, "{n}: {found} {closed}");
        }
        assert!(diffuse_reflectance(1.0).abs() < 1e-12);
        // Water: 0.066 is reflected from above and 0.47 from below.
        assert!((diffuse_reflectance(4.0 / 3.0) - 0.066).abs() < 1e-3);
    }
}
