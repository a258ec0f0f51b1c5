//! A look's light and materials in terms that other renderers share.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::{
    RenderError, RenderScene,
    image::lat_long,
    materials::Painter,
    opaque::{has_normal, points_of},
    sky::{SUN_SOLID_ANGLE, Sky},
    uniform::Triangle,
};
use swell_scene::look::{Look, WaterSpec};

/// Sun and sky of a look. Light is linear Rec. 709 in the renderer's unit: white paint on level
/// ground under a clear sky with the sun 45 degrees high has radiance 1.
#[derive(Clone, Debug)]
pub struct Daylight {
    /// Unit vector towards the sun.
    pub to_sun: DVec3,
    /// Irradiance of the sun on a face perpendicular to it.
    pub sun_irradiance: Vec3,
    /// Angular diameter of the sun, degrees.
    pub sun_degrees: f64,
    /// The sky's radiance without the sun's disc, unless a panorama contains it: the bytes of an
    /// OpenEXR latitude-longitude picture, whose centre is towards +x, with +z to the right.
    pub sky: Vec<u8>,
}

/// Sun and sky of a look.
///
/// # Errors
/// [`RenderError::Panorama`], [`RenderError::Scene`] as for a picture.
pub fn daylight(look: &Look) -> Result<Daylight, RenderError> {
    let sky = Sky::new(look, u32::MAX)?;
    Ok(Daylight {
        to_sun: look.sun_direction(),
        sun_irradiance: sky.sun_irradiance,
        sun_degrees: 2.0 * (1.0 - SUN_SOLID_ANGLE / (2.0 * PI)).acos().to_degrees(),
        sky: lat_long(sky.size, &sky.texels)?,
    })
}

/// Diffuse reflectance of deep water (Hapke 1981, equation 38), red, green, blue.
pub fn deep_reflectance(water: &WaterSpec) -> [f64; 3] {
    let (absorption, scattering) = (water.absorption_per_metre, water.scattering_per_metre);
    std::array::from_fn(|k| {
        let extinction = absorption[k] + scattering[k];
        if extinction <= 0.0 {
            return 0.0;
        }
        let g = (absorption[k] / extinction).sqrt();
        (1.0 - g) / (1.0 + g)
    })
}

/// Materials of a solid's triangles.
#[derive(Clone, Debug)]
pub struct SolidPaint {
    /// For each triangle, the index of its material in the look's list; `None` for the plain
    /// colour of solids.
    pub materials: Vec<Option<usize>>,
    /// For each triangle, how its texture maps to it.
    mappings: Vec<Option<Triangle>>,
    /// Least corner of the domain, relative to which textures are mapped.
    corner: DVec3,
}

impl SolidPaint {
    /// Texture coordinates of a point of a triangle, metres in the scene's coordinates: u to the
    /// right, v upward, both repeating; `None` without a texture.
    pub fn place(&self, triangle: usize, point: DVec3) -> Option<[f64; 2]> {
        let mapping = self.mappings[triangle].as_ref()?;
        let wide = |v: [f32; 3]| Vec3::from(v).as_dvec3();
        let offset = point - self.corner - wide(mapping.c);
        let start = [mapping.material, mapping.paint].map(|bits| f64::from(f32::from_bits(bits)));
        let [u, row] = [
            start[0] + offset.dot(wide(mapping.a)),
            start[1] + offset.dot(wide(mapping.b)),
        ];
        Some([u, 1.0 - row])
    }
}

/// Materials of the scene's solids, in their order.
///
/// # Errors
/// [`RenderError::Material`] and [`RenderError::Scene`] as for a picture.
pub fn painted(look: &Look, scene: &RenderScene) -> Result<Vec<SolidPaint>, RenderError> {
    let corner = scene.domain.min;
    let mut painter = Painter::new(look, scene)?;
    let mut found = Vec::new();
    for (index, mesh) in scene.solids.iter().enumerate() {
        let count = mesh.triangles.len();
        let mut pairs = vec![[0; 2]; count];
        if let Some(painter) = &mut painter {
            let mut solid = painter.solid(index)?;
            for (k, pair) in pairs.iter_mut().enumerate() {
                let points = points_of(&mesh.vertices, mesh.triangles[k])?;
                // A degenerate triangle is invisible, and no texture maps to it.
                if has_normal(points, scene) {
                    *pair = solid.paint(k, points.map(|p| p - corner))?;
                }
            }
        }
        found.push(pairs);
    }
    let whole = painter.map(Painter::end).transpose()?;
    let (used, places) = whole.as_ref().map_or((&[][..], &[][..]), |it| it.lists());
    let list = |paint: u32| (paint > 0).then(|| used[paint as usize - 1]);
    let textured = |index: Option<usize>| {
        let list = &look.materials()?.list;
        list[index?].texture.as_ref()
    };
    let solid = |pairs: Vec<[u32; 2]>| SolidPaint {
        materials: pairs.iter().map(|&[paint, _]| list(paint)).collect(),
        mappings: pairs
            .iter()
            .map(|&[paint, place]| textured(list(paint)).map(|_| places[place as usize]))
            .collect(),
        corner,
    };
    Ok(found.into_iter().map(solid).collect())
}

#[cfg(test)]
mod tests;
