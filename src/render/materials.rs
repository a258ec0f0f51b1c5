//! Materials of the scene's solids: which part has which material, and how its texture maps to each
//! triangle.

use std::collections::HashMap;

use glam::DVec3;
use half::f16;
use wgpu::TextureFormat;

use super::{
    RenderError, RenderScene, SolidParts,
    buffers::MATERIALS,
    plan::{Limits, Plan},
    uniform::{Material, Triangle},
};
use swell_domain::{mesh_file::parts::Places, parallel, pose::Pose};
use swell_gpu::texture::TextureSpec;
use swell_scene::look::{Look, Material as LookMaterial, Materials, Picture, Texture};

/// Largest number of materials on the solids of a picture, bounded by the usual size of a uniform
/// buffer.
const MOST_MATERIALS: usize = 256;

/// Texels per row of the texture that holds all pictures in sequence; a power of two, so that
/// shaders shift instead of dividing.
const ROW: usize = 1 << 12;

/// Materials and texture mappings of a scene's solids.
#[derive(Clone, Debug, Default)]
pub(super) struct Painted {
    /// Materials in use, in the order in which they were first met.
    pub(super) materials: Vec<Material>,
    /// Texture mappings, stored as words of a [`Triangle`] as materials.wgsl describes.
    pub(super) places: Vec<Triangle>,
    /// Index of each of `materials` among the look's materials.
    used: Vec<usize>,
}

impl Painted {
    /// For each material in use its index among the look's, and the texture mappings.
    pub(super) fn lists(&self) -> (&[usize], &[Triangle]) {
        (&self.used, &self.places)
    }
}

/// Assigns materials to the triangles of a scene.
pub(super) struct Painter<'a> {
    look: &'a Materials,
    scene: &'a RenderScene,
    /// For each of the look's materials, its number among those in use, counted from 1.
    numbers: Vec<Option<u32>>,
    /// For each of the look's materials, whether a part has its name.
    is_named: Vec<bool>,
    painted: Painted,
}

/// A material, the axis that a face's normal follows most closely, and whether the normal points in
/// its negative direction.
pub(super) type Side = (usize, usize, bool);

/// Assigns materials to the triangles of one solid.
pub(super) struct SolidPainter<'p, 'a> {
    painter: &'p mut Painter<'a>,
    solid: &'a SolidParts,
    /// Index of the look's material for each part of the mesh.
    of: Vec<Option<usize>>,
    /// Mappings along coordinate axes, by material and side.
    along: HashMap<Side, u32>,
}

impl<'a> Painter<'a> {
    /// Returns `None` where the look names no materials.
    pub(super) fn new(look: &'a Look, scene: &'a RenderScene) -> Result<Option<Self>, RenderError> {
        let Some(look) = look.materials() else {
            return Ok(None);
        };
        if scene.parts.len() != scene.solids.len() {
            return Err(RenderError::Scene(format!(
                "the look has materials, and the parts of {} of {} solids are known",
                scene.parts.len(),
                scene.solids.len()
            )));
        }
        Ok(Some(Self {
            look,
            scene,
            numbers: vec![None; look.list.len()],
            is_named: vec![false; look.list.len()],
            painted: Painted::default(),
        }))
    }

    /// Starts one of the scene's solids.
    pub(super) fn solid(&mut self, index: usize) -> Result<SolidPainter<'_, 'a>, RenderError> {
        let solid = &self.scene.parts[index];
        let triangles = self.scene.solids[index].triangles.len();
        if solid.parts.of.len() != triangles {
            return Err(RenderError::Scene(format!(
                "mesh {} has {triangles} triangles, and the parts of {} are known",
                solid.name,
                solid.parts.of.len()
            )));
        }
        let names = solid.parts.names.iter();
        let of = names.map(|names| self.find(names.iter().chain([&solid.name])));
        let of = of.collect();
        Ok(SolidPainter {
            painter: self,
            solid,
            of,
            along: HashMap::new(),
        })
    }

    /// Material of the first name that has one, else the default material of solids.
    fn find<'n>(&mut self, names: impl Iterator<Item = &'n String>) -> Option<usize> {
        let mut found = None;
        for name in names {
            let mut list = self.look.list.iter();
            let same = list.position(|it| it.name.as_ref() == Some(name));
            if let Some(index) = same {
                self.is_named[index] = true;
                found = found.or(same);
            }
        }
        found.or(self.look.solids)
    }

    fn number(&mut self, index: usize) -> Result<u32, RenderError> {
        if let Some(number) = self.numbers[index] {
            return Ok(number);
        }
        let used = &mut self.painted.used;
        if used.len() == MOST_MATERIALS {
            return Err(RenderError::Material {
                index,
                problem: format!("more than {MOST_MATERIALS} materials are on solids"),
            });
        }
        used.push(index);
        let number = used.len() as u32;
        let material = &self.look.list[index];
        self.painted.materials.push(Material {
            colour: material.colour.map(|c| c as f32),
            windows: f32::from(u8::from(material.windows)),
            ..Material::default()
        });
        self.numbers[index] = Some(number);
        Ok(number)
    }

    /// Material and mapping of a face of the look's walls; `None` where walls have a plain colour.
    /// `along` keeps the mappings of earlier faces.
    pub(super) fn paint_wall(
        &mut self,
        corners: [DVec3; 3],
        along: &mut HashMap<Side, u32>,
    ) -> Result<Option<[u32; 2]>, RenderError> {
        let Some(index) = self.look.basin else {
            return Ok(None);
        };
        let paint = self.number(index)?;
        let place = self.lay_along(index, corners, Pose::START, along);
        Ok(Some([paint, place]))
    }

    /// Mapping along coordinate axes of a material's texture on a face of an object at a pose.
    fn lay_along(
        &mut self,
        index: usize,
        [a, b, c]: [DVec3; 3],
        pose: Pose,
        along: &mut HashMap<Side, u32>,
    ) -> u32 {
        let pose = pose.moved(-self.scene.domain.min);
        // Normal in the object's initial pose.
        let normal = pose.turn.conjugate() * (b - a).cross(c - a);
        let size = normal.abs();
        let axis = match () {
            () if size.y >= size.x && size.y >= size.z => 1,
            () if size.x >= size.z => 0,
            () => 2,
        };
        let is_low = normal[axis] < 0.0;
        if let Some(&place) = along.get(&(index, axis, is_low)) {
            return place;
        }
        let texture = self.look.list[index].texture.as_ref();
        let texture = texture.expect("only a texture is laid on");
        let metres = texture.metres.expect("with the metres that it covers");
        let [width, height] = self.look.pictures[texture.picture].size.map(f64::from);
        let (right, up) = sides(axis, is_low);
        let gradients = [right / metres, -up / (metres * height / width)];
        // The mapping begins at the world's origin, so that it continues across meshes that touch;
        // moving objects carry it along.
        let corner = self.scene.origin + self.scene.domain.min;
        let starts = gradients.map(|it| it.dot(corner));
        let gradients = gradients.map(|it| pose.turn * it);
        let place = self.record(lie(gradients, starts, pose.place(DVec3::ZERO)));
        along.insert((index, axis, is_low), place);
        place
    }

    /// Number of texture mappings so far.
    pub(super) fn place_count(&self) -> usize {
        self.painted.places.len()
    }

    fn record(&mut self, lie: Triangle) -> u32 {
        let places = &mut self.painted.places;
        places.push(lie);
        places.len() as u32 - 1
    }

    /// Finishes and returns the result. It is an error if no part has the name of one of the look's
    /// own materials, or of any material of a library, unless the scene has no solids.
    pub(super) fn end(self) -> Result<Painted, RenderError> {
        if self.scene.solids.is_empty() {
            return Ok(self.painted);
        }
        let list = || self.look.list.iter().zip(&self.is_named).enumerate();
        let own = |it: &LookMaterial| it.is_own && it.name.is_some();
        let unnamed = list().find(|(_, (it, named))| own(it) && !**named);
        let mut library = list().filter(|(_, (it, _))| !it.is_own).peekable();
        let first = library.peek().map(|(index, _)| *index);
        let is_idle = library.all(|(_, (_, named))| !named);
        let names = || {
            let mut names: Vec<&str> = Vec::new();
            for solid in &self.scene.parts {
                let parts = solid.parts.names.iter().flatten();
                names.extend(parts.chain([&solid.name]).map(String::as_str));
            }
            names.sort_unstable();
            names.dedup();
            let more = if names.len() > 24 { ", …" } else { "" };
            names.truncate(24);
            format!("{}{more}", names.join(", "))
        };
        if let Some((index, (material, _))) = unnamed {
            return Err(RenderError::Material {
                index,
                problem: format!(
                    "no part of the scene's solids is called {:?}; there are: {}",
                    material.name.as_deref().unwrap_or_default(),
                    names()
                ),
            });
        }
        if let Some(index) = first.filter(|_| is_idle) {
            return Err(RenderError::Material {
                index,
                problem: format!(
                    "no part of the scene's solids has the name of one of its \
                     materials; there are: {}",
                    names()
                ),
            });
        }
        Ok(self.painted)
    }
}

impl SolidPainter<'_, '_> {
    /// Number of texture mappings so far, of all solids.
    pub(super) fn place_count(&self) -> usize {
        self.painter.place_count()
    }

    /// Material and mapping of triangle `k`, whose corners are in metres from the domain's least
    /// corner; zeros where it has the look's colour.
    pub(super) fn paint(&mut self, k: usize, corners: [DVec3; 3]) -> Result<[u32; 2], RenderError> {
        let Some(index) = self.of[self.solid.parts.of[k] as usize] else {
            return Ok([0; 2]);
        };
        let paint = self.painter.number(index)?;
        let Some(texture) = &self.painter.look.list[index].texture else {
            return Ok([paint, 0]);
        };
        let place = match texture.metres {
            Some(_) => {
                let pose = self.solid.pose;
                (self.painter).lay_along(index, corners, pose, &mut self.along)
            }
            None => {
                let places = self.solid.parts.places.get(k).copied().flatten();
                let places = places.ok_or_else(|| RenderError::Material {
                    index,
                    problem: format!(
                        "faces of mesh {} that it is for have no texture coordinates (vt); a \
                         texture of [[solids.material]] with metres needs none",
                        self.solid.name
                    ),
                })?;
                let lie = lie_by(places, texture, corners);
                self.painter.record(lie)
            }
        };
        Ok([paint, place])
    }
}

/// Directions of a picture's right and upper sides on a face whose normal follows an axis, seen
/// from in front; on level faces the upper side points along -z.
fn sides(axis: usize, is_low: bool) -> (DVec3, DVec3) {
    let sign = if is_low { -1.0 } else { 1.0 };
    match axis {
        0 => (DVec3::NEG_Z * sign, DVec3::Y),
        1 => (DVec3::X * sign, DVec3::NEG_Z),
        _ => (DVec3::X * sign, DVec3::Y),
    }
}

/// Texture mapping: the gradients of both coordinates, with rows counted from the top, and their
/// values at a point.
fn lie([a, b]: [DVec3; 2], starts: [f64; 2], at: DVec3) -> Triangle {
    let [u, v] = starts.map(|start| (start - start.floor()) as f32);
    Triangle {
        a: a.as_vec3().to_array(),
        material: u.to_bits(),
        b: b.as_vec3().to_array(),
        paint: v.to_bits(),
        c: at.as_vec3().to_array(),
        place: 0,
    }
}

/// Mapping from a mesh's texture coordinates. They are linear over the triangle, so their gradients
/// in its plane give them everywhere.
fn lie_by(places: Places, texture: &Texture, [a, b, c]: [DVec3; 3]) -> Triangle {
    let place = |k: usize| {
        let axis =
            |axis: usize| f64::from(places[k][axis]) * texture.scale[axis] + texture.offset[axis];
        // Rows are counted from the top.
        [axis(0), 1.0 - axis(1)]
    };
    let (first, second, third) = (place(0), place(1), place(2));
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(ac);
    let square = normal.length_squared();
    let gradient = |axis: usize| {
        let along_ab = second[axis] - first[axis];
        let along_ac = third[axis] - first[axis];
        (along_ab * ac.cross(normal) + along_ac * normal.cross(ab)) / square
    };
    lie([gradient(0), gradient(1)], first, a)
}

/// Plans materials and their textures in the shading passes; does nothing where the look names no
/// materials.
pub(super) fn plan_materials(
    plan: &mut Plan,
    look: &Look,
    painted: &Painted,
    passes: &[&'static str],
    limits: &Limits,
) -> Result<(), RenderError> {
    let Some(own) = look.materials() else {
        return Ok(());
    };
    for pass in passes {
        plan.define(pass, "MATERIALS");
    }
    let mut texels: Vec<[f16; 4]> = Vec::new();
    let mut firsts: HashMap<usize, (u32, u32)> = HashMap::new();
    let mut all = painted.materials.clone();
    for (material, &index) in all.iter_mut().zip(&painted.used) {
        let Some(texture) = &own.list[index].texture else {
            continue;
        };
        let picture = &own.pictures[texture.picture];
        let (first, levels) = *firsts.entry(texture.picture).or_insert_with(|| {
            let first = texels.len() as u32;
            let levels = levels_of(picture);
            texels.extend(levels.iter().flatten());
            (first, levels.len() as u32)
        });
        [material.size_x, material.size_y] = picture.size;
        (material.first, material.levels) = (first, levels);
    }
    let rows = texels.len().div_ceil(ROW).max(1);
    if rows as u32 > limits.texture || ROW as u32 > limits.texture {
        return Err(RenderError::Scene(format!(
            "the look's pictures take a texture of {ROW} × {rows} texels, and the \
             adapter takes {} a side",
            limits.texture
        )));
    }
    texels.resize(rows * ROW, [f16::ZERO; 4]);
    let bits: Vec<u16> = texels.iter().flatten().map(|x| x.to_bits()).collect();
    let spec = TextureSpec {
        name: "solid_texels".into(),
        size: [ROW as u32, rows as u32],
        format: TextureFormat::Rgba16Float,
    };
    plan.texture(spec, bytemuck::cast_slice(&bits).to_vec());
    all.resize(MOST_MATERIALS, Material::default());
    plan.values(&MATERIALS, &all);
    Ok(())
}

/// Mip levels of a picture in linear light, down to one texel; each level halves the size and holds
/// area means.
fn levels_of(picture: &Picture) -> Vec<Vec<[f16; 4]>> {
    let linear: Vec<f32> = (0..=255)
        .map(|code| linear(f64::from(code) / 255.0) as f32)
        .collect();
    let mut size = picture.size.map(|side| side as usize);
    let mut level: Vec<[f32; 3]> = parallel::map_slice(&picture.texels, |texel| {
        texel.map(|code| linear[usize::from(code)])
    });
    let half = |[r, g, b]: &[f32; 3]| [*r, *g, *b, 1.0].map(f16::from_f32);
    let mut levels = vec![level.iter().map(half).collect()];
    while size != [1, 1] {
        let smaller = size.map(|side| (side / 2).max(1));
        level = shrunk(&level, size, smaller);
        size = smaller;
        levels.push(level.iter().map(half).collect());
    }
    levels
}

/// Decodes sRGB (IEC 61966-2-1).
fn linear(code: f64) -> f64 {
    match code <= 0.04045 {
        true => code / 12.92,
        false => ((code + 0.055) / 1.055).powf(2.4),
    }
}

/// Downsamples by area means; odd sides share texels between means.
fn shrunk(texels: &[[f32; 3]], from: [usize; 2], to: [usize; 2]) -> Vec<[f32; 3]> {
    let parts = |axis: usize, k: usize| {
        let ratio = from[axis] as f64 / to[axis] as f64;
        let (low, high) = (k as f64 * ratio, (k + 1) as f64 * ratio);
        let last = (high.ceil() as usize).min(from[axis]);
        (low.floor() as usize..last).map(move |at| {
            let part = high.min(at as f64 + 1.0) - low.max(at as f64);
            (at, (part / ratio) as f32)
        })
    };
    let texel = |k: usize| {
        let mut sum = [0.0f32; 3];
        for (y, of_row) in parts(1, k / to[0]) {
            for (x, of_column) in parts(0, k % to[0]) {
                let texel = texels[y * from[0] + x];
                for (sum, channel) in sum.iter_mut().zip(texel) {
                    *sum += of_row * of_column * channel;
                }
            }
        }
        sum
    };
    parallel::map(0..to[0] * to[1], texel)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_is_decoded_as_the_standard_says() {
        for (code, value) in [
            (0.0, 0.0),
            (0.04045, 0.0031308),
            (0.5, 0.214_041),
            (1.0, 1.0),
        ] {
            assert!((linear(code) - value).abs() < 1e-6, "{code}");
        }
    }

    #[test]
    fn smaller_versions_keep_the_mean() {
        let size = [7, 5];
        let texels: Vec<[f32; 3]> = (0..35)
            .map(|k| [k as f32, (k * k % 11) as f32, 1.0])
            .collect();
        let mean = |texels: &[[f32; 3]], channel: usize| {
            texels.iter().map(|it| it[channel]).sum::<f32>() / texels.len() as f32
        };
        let smaller = shrunk(&texels, size, [3, 2]);
        assert_eq!(smaller.len(), 6);
        for channel in 0..3 {
            let (before, after) = (mean(&texels, channel), mean(&smaller, channel));
            assert!(
                (before - after).abs() < 1e-5 * before.max(1.0),
                "{before} {after}"
            );
        }
        // Control: without shared texels the last columns would be lost.
        let cut: Vec<[f32; 3]> = (0..35).filter(|k| k % 7 < 6).map(|k| texels[k]).collect();
        assert!((mean(&cut, 0) - mean(&texels, 0)).abs() > 0.1);
    }

    #[test]
    fn a_triangle_has_its_corners_coordinates() {
        let corners = [
            DVec3::new(3.0, 1.0, 2.0),
            DVec3::new(5.0, 1.5, 2.0),
            DVec3::new(3.5, 4.0, 7.0),
        ];
        let texture = Texture {
            picture: 0,
            metres: None,
            scale: [2.0, 3.0],
            offset: [0.25, 0.0],
        };
        let places = [[0.1, 0.2], [0.9, 0.3], [0.4, 0.8]];
        let lie = lie_by(places, &texture, corners);
        for (corner, place) in corners.iter().zip(places) {
            let from = corner.as_vec3() - glam::Vec3::from(lie.c);
            let at = |start: u32, gradient: [f32; 3]| {
                f32::from_bits(start) + glam::Vec3::from(gradient).dot(from)
            };
            let expected = [2.0 * place[0] + 0.25, 1.0 - 3.0 * place[1]];
            let found = [at(lie.material, lie.a), at(lie.paint, lie.b)];
            for (found, expected) in found.iter().zip(expected) {
                // Equal up to whole repetitions of the picture.
                let off = found - expected;
                assert!((off - off.round()).abs() < 1e-5, "{found} {expected}");
            }
        }
    }
}
