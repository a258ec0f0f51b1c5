//! Opaque geometry: the scene's solids and wave makers and the look's quay walls, as triangles with
//! materials.

use std::collections::HashMap;

use glam::DVec3;

use super::{
    RenderError, RenderScene,
    cryptomatte::{MOST_SOLIDS, PALETTE, SOLIDS},
    materials::{Painted, Painter},
    moving::{Mover, is_blurred},
    uniform::Triangle,
    wet::DrawnSolid,
};
use swell_domain::mesh::TriangleMesh;
use swell_scene::look::{AovSpec, BasinSpec, Look};

/// Material codes of a triangle, as in ssfr_solid.wgsl: a solid in the look's colour, a wall at 1.1
/// times the ground's colour; from [`SOLIDS`] on individual solids, from [`PALETTE`] on the
/// palette's colours.
const SOLID: u32 = 0;
const WALL: u32 = 1;

/// Largest number of colours in the palette: a material code has eight bits per pixel.
pub(super) const MOST_COLOURS: usize = 256 - PALETTE as usize;

/// Gap between a wall and the domain, particle spacings; coincident faces would flicker.
const GAP: f64 = 0.006;

/// Triangles, and the colours of their materials.
#[derive(Clone, Debug, Default)]
pub(super) struct Opaque {
    /// Triangles with corners in metres from the domain's least corner.
    pub(super) triangles: Vec<Triangle>,
    /// For each material code from [`PALETTE`] on: linear reflectance, and 1 where the material may
    /// have rows of windows.
    pub(super) palette: Vec<[f32; 4]>,
    /// Materials and texture mappings of solids.
    pub(super) painted: Painted,
    /// For each triangle, 0 or the number of its motion among [`RenderScene::moving`], from 1;
    /// empty where nothing moves within the shutter.
    pub(super) movers: Vec<u32>,
    /// The same for each texture mapping.
    pub(super) place_movers: Vec<u32>,
    /// Material code of each motion, by which motion vectors know it.
    pub(super) codes: Vec<u32>,
}

impl Opaque {
    /// Collects the opaque geometry of a look and a scene.
    pub(super) fn new(look: &Look, scene: &RenderScene) -> Result<Self, RenderError> {
        let mut opaque = Self::default();
        let mut painter = Painter::new(look, scene)?;
        opaque.codes = vec![0; scene.moving.len()];
        opaque.add_solids(look, scene, painter.as_mut())?;
        let size = scene.domain.size();
        if let Some(basin) = &look.spec().basin {
            let material = match basin.colour {
                Some(colour) => opaque.material(colour, false)?,
                None => WALL,
            };
            let mut along = HashMap::new();
            for [low, high] in quays(basin, size, GAP * scene.particle_spacing) {
                for corners in box_triangles(low, high) {
                    let paint = match &mut painter {
                        Some(painter) => painter.paint_wall(corners, &mut along)?,
                        None => None,
                    };
                    opaque.push(corners, material, paint.unwrap_or_default());
                }
            }
        }
        if let Some(plates) = &look.spec().wave_makers {
            let plain = opaque.material(plates.colour, false)?;
            for (index, &(wall, inward)) in scene.wave_makers.iter().enumerate() {
                let motion = scene.motion_of(Mover::WaveMaker(index));
                let material = match motion {
                    // One of its own, for motion vectors.
                    Some(motion) if look.wants(AovSpec::Forward) => {
                        opaque.codes[motion] = opaque.own_material(plates.colour)?;
                        opaque.codes[motion]
                    }
                    _ => plain,
                };
                let first = opaque.triangles.len();
                let (mut low, mut high) = (DVec3::ZERO, size);
                high.y = plates.height_m;
                let face = match wall.is_max {
                    true => size[wall.axis] - inward,
                    false => inward,
                };
                let back = match wall.is_max {
                    true => face + plates.thickness_m,
                    false => face - plates.thickness_m,
                };
                (low[wall.axis], high[wall.axis]) = (face.min(back), face.max(back));
                opaque.add_box(low, high, material);
                opaque.moves_from(first, motion);
            }
        }
        if let Some(painter) = painter {
            opaque.painted = painter.end()?;
        }
        match is_blurred(look, scene) {
            true => opaque.movers.resize(opaque.triangles.len(), 0),
            false => opaque.movers.clear(),
        }
        let places = opaque.painted.places.len();
        opaque.place_movers.resize(places, 0);
        Ok(opaque)
    }

    /// Takes the texture mappings, which are stored after the triangles in their buffer, and shifts
    /// the triangles' references to them.
    pub(super) fn placed(&mut self) -> Vec<Triangle> {
        let places = std::mem::take(&mut self.painted.places);
        if !places.is_empty() {
            let count = self.triangles.len() as u32;
            for triangle in &mut self.triangles {
                triangle.place += count;
            }
        }
        places
    }

    /// Notes that the triangles from `first` on have a motion.
    fn moves_from(&mut self, first: usize, motion: Option<usize>) {
        if let Some(motion) = motion {
            self.movers.resize(first, 0);
            self.movers.resize(self.triangles.len(), number(motion));
        }
    }

    fn add_solids(
        &mut self,
        look: &Look,
        scene: &RenderScene,
        mut painter: Option<&mut Painter<'_>>,
    ) -> Result<(), RenderError> {
        let tells_apart = look.spec().output.cryptomatte;
        let tells_moving = tells_apart || look.wants(AovSpec::Forward);
        let mut seen_moving = 0;
        let moving = scene.moving.iter();
        let moving = moving.filter(|motion| matches!(motion.mover, Mover::Solid(_)));
        let moving = moving.count();
        if !tells_apart && tells_moving && moving > MOST_SOLIDS {
            return Err(RenderError::Scene(format!(
                "motion vectors (forward in output.aovs) distinguish at most {MOST_SOLIDS} solids \
                 that move, and the scene has {moving}"
            )));
        }
        if tells_apart && scene.solids.len() > MOST_SOLIDS {
            return Err(RenderError::Scene(format!(
                "output.cryptomatte distinguishes at most {MOST_SOLIDS} solids, and the scene has \
                 {}",
                scene.solids.len()
            )));
        }
        let origin = scene.domain.min;
        for (index, (code, mesh)) in (SOLIDS..).zip(&scene.solids).enumerate() {
            let motion = scene.motion_of(Mover::Solid(index));
            let material = match motion {
                _ if tells_apart => code,
                Some(_) if tells_moving => {
                    seen_moving += 1;
                    SOLIDS + seen_moving - 1
                }
                _ => SOLID,
            };
            if let Some(motion) = motion {
                self.codes[motion] = material;
            }
            let (first, first_place) = (
                self.triangles.len(),
                painter.as_ref().map_or(0, |painter| painter.place_count()),
            );
            let mut painter = match &mut painter {
                Some(painter) => Some(painter.solid(index)?),
                None => None,
            };
            let drawn = DrawnSolid::of(scene, index)?;
            // Parts of one triangle have one paint.
            let mut last: Option<(usize, [u32; 2])> = None;
            for (k, &corners) in drawn.triangles.iter().enumerate() {
                let points = points_of(&drawn.vertices, corners)?;
                if !has_normal(points, scene) {
                    continue;
                }
                let parent = drawn.parent(k);
                let paint = match (last, &mut painter) {
                    (Some((painted, paint)), _) if painted == parent => paint,
                    (_, Some(painter)) => {
                        let whole = points_of(&mesh.vertices, mesh.triangles[parent])?;
                        painter.paint(parent, whole.map(|p| p - origin))?
                    }
                    (_, None) => [0; 2],
                };
                last = Some((parent, paint));
                let wetness = drawn.packed_wetness(corners);
                self.push(points.map(|p| p - origin), material | wetness, paint);
            }
            self.moves_from(first, motion);
            if let (Some(motion), Some(painter)) = (motion, painter) {
                self.place_movers.resize(first_place, 0);
                self.place_movers
                    .resize(painter.place_count(), number(motion));
            }
        }
        Ok(())
    }

    /// Returns the code of a colour that nothing else has.
    fn own_material(&mut self, colour: [f64; 3]) -> Result<u32, RenderError> {
        let [r, g, b] = colour.map(|c| c as f32);
        self.add_material([r, g, b, 0.0])
    }

    /// Returns the code of a colour; adds it to the palette if needed.
    fn material(&mut self, colour: [f64; 3], has_windows: bool) -> Result<u32, RenderError> {
        let [r, g, b] = colour.map(|c| c as f32);
        let entry = [r, g, b, f32::from(u8::from(has_windows))];
        match self.palette.iter().position(|it| *it == entry) {
            Some(index) => Ok(PALETTE + index as u32),
            None => self.add_material(entry),
        }
    }

    fn add_material(&mut self, entry: [f32; 4]) -> Result<u32, RenderError> {
        if self.palette.len() == MOST_COLOURS {
            return Err(RenderError::Scene(format!(
                "more than {MOST_COLOURS} colours of solids, walls and wave makers"
            )));
        }
        self.palette.push(entry);
        Ok(PALETTE + self.palette.len() as u32 - 1)
    }

    fn push(&mut self, corners: [DVec3; 3], material: u32, [paint, place]: [u32; 2]) {
        let [a, b, c] = corners.map(|p| p.as_vec3().to_array());
        self.triangles.push(Triangle {
            a,
            material,
            b,
            paint,
            c,
            place,
        });
    }

    fn add_box(&mut self, low: DVec3, high: DVec3, material: u32) {
        for corners in box_triangles(low, high) {
            self.push(corners, material, [0; 2]);
        }
    }
}

pub(super) fn points_of(vertices: &[DVec3], corners: [u32; 3]) -> Result<[DVec3; 3], RenderError> {
    let mut points = [DVec3::ZERO; 3];
    for (point, index) in points.iter_mut().zip(corners) {
        *point = *vertices.get(index as usize).ok_or_else(|| {
            RenderError::Scene(format!(
                "a triangle refers to vertex {index}, which does not exist"
            ))
        })?;
    }
    Ok(points)
}

/// Whether a triangle has a normal; a degenerate one is invisible.
pub(super) fn has_normal([a, b, c]: [DVec3; 3], scene: &RenderScene) -> bool {
    let area = (b - a).cross(c - a);
    area.length() > 1e-10 * scene.particle_spacing.powi(2)
}

/// Number of a motion in [`Opaque::movers`].
fn number(motion: usize) -> u32 {
    motion as u32 + 1
}

/// Returns all opaque geometry of a look and a scene, except the ground, as one mesh in metres from
/// the domain's least corner.
///
/// # Errors
/// [`RenderError::Scene`] or [`RenderError::Material`] if a mesh refers to missing vertices, if
/// there are more colours than a pixel can encode, or if a material of the look cannot be used.
pub fn opaque(look: &Look, scene: &RenderScene) -> Result<TriangleMesh, RenderError> {
    let all = Opaque::new(look, scene)?.triangles;
    let corner = |p: [f32; 3]| DVec3::from(p.map(f64::from));
    Ok(TriangleMesh {
        triangles: (0..all.len() as u32)
            .map(|k| [3 * k, 3 * k + 1, 3 * k + 2])
            .collect(),
        vertices: all
            .iter()
            .flat_map(|it| [it.a, it.b, it.c].map(corner))
            .collect(),
    })
}

/// Least and greatest corner of each quay wall. Without a wall across it, the -x end lies far
/// beyond the domain, so that it is not in the picture.
fn quays(basin: &BasinSpec, size: DVec3, gap: f64) -> Vec<[DVec3; 2]> {
    let thick = basin.thickness_m;
    let stands = |axis: usize, is_max: bool| {
        let mut sides = basin.sides.iter();
        sides.any(|wall| wall.axis == axis && wall.is_max == is_max)
    };
    let walls = basin.sides.iter().map(|wall| {
        let along = 2 - wall.axis;
        let (mut low, mut high) = (DVec3::ZERO, DVec3::new(0.0, basin.height_m, 0.0));
        let face = if wall.is_max { size[wall.axis] } else { 0.0 };
        let way = if wall.is_max { 1.0 } else { -1.0 };
        let (near, far) = (face + way * gap, face + way * thick);
        (low[wall.axis], high[wall.axis]) = (near.min(far), near.max(far));
        // Waves come from -x. Walls along x therefore extend well past that end; all others end at
        // a corner.
        low[along] = match (along, stands(along, false)) {
            (0, false) => -2.0 * size.x,
            _ => -thick,
        };
        high[along] = size[along] + thick;
        [low, high]
    });
    walls.collect()
}

/// Twelve triangles of a box, counter-clockwise seen from outside.
pub(super) fn box_triangles(low: DVec3, high: DVec3) -> Vec<[DVec3; 3]> {
    let corner = |i: usize| {
        DVec3::new(
            if i & 1 == 0 { low.x } else { high.x },
            if i & 2 == 0 { low.y } else { high.y },
            if i & 4 == 0 { low.z } else { high.z },
        )
    };
    [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ]
    .iter()
    .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
    .map(|face| face.map(corner))
    .collect()
}
