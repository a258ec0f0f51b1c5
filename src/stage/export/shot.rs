//! The parts of a scene and a look that a USD shot has besides the water.

use std::{
    f64::consts::PI,
    path::{Path, PathBuf},
};

use glam::DVec3;

use super::{ExportError, ExportJob, Target, UsdWater, Wanted, beside, look::ShotLook};
use swell_cache::CacheError;
use swell_domain::{
    body::BodyState,
    level_set::foam::{FOAM, FOAM_AGE},
    mesh::TriangleMesh,
    particles::Particles,
};
use swell_export::usd::{
    self, CameraFrame, Paint, Root, Solid, WaterPrim, WaterRepresentation, WaveMaker,
};
use swell_scene::{PlacedMesh, Scene, Wall, moving_solid::MovingSolid};

/// Name part of the shot's manifest layer, in the place of a frame number.
const MANIFEST: &str = "manifest";

/// Name of the prim of whitewater beside the water.
pub(super) const WHITEWATER: &str = "whitewater";

/// Diameter of a sphere with a particle's volume, metres.
pub(super) fn width(spacing: f64) -> f64 {
    (6.0 / PI).cbrt() * spacing
}

/// Name of a wave maker, such as `wall_minus_x`.
fn name(wall: Wall) -> String {
    let side = if wall.is_max { "plus" } else { "minus" };
    format!("wall_{side}_{}", ["x", "y", "z"][wall.axis])
}

/// Displacement of each wave maker from the domain's side at a frame, metres, given the frame's
/// state.
pub(super) fn displacements(scene: &Scene, state: &Particles, frame: u32) -> Vec<(String, DVec3)> {
    let walls = scene.walls(&state.walls, scene.shot.time(frame));
    let size = scene.domain.size();
    let makers = scene.wave_makers.iter().map(|maker| maker.wall);
    makers
        .map(|wall| {
            let along = match wall.is_max {
                true => walls.max[wall.axis] - size[wall.axis],
                false => walls.min[wall.axis],
            };
            (name(wall), along * DVec3::AXES[wall.axis])
        })
        .collect()
}

/// A wave maker at the domain's side.
fn maker(scene: &Scene, wall: Wall) -> WaveMaker {
    let (min, max) = (scene.domain.min, scene.domain.max);
    let [first, second] = [(wall.axis + 1) % 3, (wall.axis + 2) % 3];
    let corner = |along: bool, across: bool| {
        let mut place = min;
        place[wall.axis] = if wall.is_max { max } else { min }[wall.axis];
        place[first] = if along { max } else { min }[first];
        place[second] = if across { max } else { min }[second];
        place
    };
    let mut corners = [
        corner(false, false),
        corner(true, false),
        corner(true, true),
        corner(false, true),
    ];
    // Seen along the axis, the first two sides turn counter-clockwise; seen from the water at the
    // far wall, clockwise.
    if wall.is_max {
        corners.reverse();
    }
    WaveMaker {
        name: name(wall),
        corners,
    }
}

impl ExportJob<'_> {
    /// The files of each shot that belong to no frame, with their content: the pictures that its
    /// look needs, its manifest and its root.
    pub(super) fn shots(&self) -> Result<Vec<(Wanted, Vec<u8>)>, ExportError> {
        let mut found = Vec::new();
        for target in &self.request.targets {
            let Target::Usd(file, water) = target else {
                continue;
            };
            let mut look = self.look(file)?;
            let pictures = look.as_mut().map(|look| std::mem::take(&mut look.files));
            let root = self.root(file, *water, look)?;
            let settings = format!(
                "usd of a shot, {}, frame numbers {:+}",
                self.water_settings(*water),
                self.numbering.offset
            );
            let parts = [
                (beside(file, MANIFEST), usd::manifest(&root)),
                (file.clone(), usd::root(&root)),
            ];
            let pictures = pictures.into_iter().flatten();
            let pictures = pictures.map(|(part, ending, bytes)| {
                (file.with_extension(format!("{part}.{ending}")), bytes)
            });
            for (file, bytes) in pictures.chain(parts) {
                let wanted = Wanted {
                    file,
                    owner: self.owner(target, settings.clone())?,
                    source: blake3::hash(&bytes).to_hex().to_string(),
                    follows: true,
                };
                found.push((wanted, bytes));
            }
        }
        Ok(found)
    }

    fn root(
        &self,
        file: &Path,
        water: UsdWater,
        look: Option<ShotLook>,
    ) -> Result<Root<'_>, CacheError> {
        let named = |path: PathBuf| {
            path.file_name()
                .map_or_else(String::new, |name| name.to_string_lossy().into_owned())
        };
        let layer = |&frame: &u32| {
            let number = self.numbering.of(frame);
            (number, named(self.layer(file, frame)))
        };
        let scene = &self.scene;
        let (prims, paints) = match look {
            Some(look) => (Some(look.prims), Some(look.paints)),
            None => (None, None),
        };
        let attributes = match water {
            UsdWater::Points => self.source().manifest().attributes.clone(),
            UsdWater::Mesh if self.foam.is_some() => [FOAM, FOAM_AGE].map(str::to_owned).to_vec(),
            UsdWater::Mesh => Vec::new(),
        };
        let mut waters = vec![WaterPrim {
            name: self.prim(),
            kind: self.kind(water),
            attributes,
            material: prims.as_ref().and_then(|look| match self.stream {
                Some(_) => look.whitewater,
                None => Some(look.water),
            }),
        }];
        waters.extend(self.whitewater.iter().map(|stream| WaterPrim {
            name: WHITEWATER,
            kind: WaterRepresentation::Points { width: None },
            attributes: stream.manifest().attributes.clone(),
            material: prims.as_ref().and_then(|look| look.whitewater),
        }));
        let is_stream = self.stream.is_some();
        let makers = scene.wave_makers.iter().map(|it| maker(scene, it.wall));
        Ok(Root {
            shot: self.shot(self.frames.first().copied().unwrap_or(0)),
            waters,
            layers: self.frames.iter().map(layer).collect(),
            manifest: named(beside(file, MANIFEST)),
            solids: if is_stream {
                Vec::new()
            } else {
                self.solids(paints)?
            },
            wave_makers: if is_stream {
                Vec::new()
            } else {
                makers.collect()
            },
            camera: self.views(),
            look: prims,
        })
    }

    /// States of the bodies after a frame.
    fn bodies_at(&self, frame: u32) -> Result<Vec<BodyState>, CacheError> {
        Ok(self.cache.entry(frame)?.bodies.clone())
    }

    fn solids(&self, paints: Option<Vec<Paint>>) -> Result<Vec<Solid>, CacheError> {
        let scene = &self.scene;
        let still = scene.solids.iter().enumerate();
        let still = still.map(|(index, placed)| Solid {
            name: placed.name(),
            mesh: self.refined(index, placed.mesh.clone()),
            way: Vec::new(),
            shapes: Vec::new(),
            is_wet: self.wet.is_some(),
            paint: None,
        });
        let first = scene.solids.len();
        let bodies = self.frames.iter().map(|&frame| self.bodies_at(frame));
        let bodies = bodies.collect::<Result<Vec<_>, _>>()?;
        let moving = (first..).zip(scene.drawn_movers());
        let moving = moving.map(|(index, solid)| Solid {
            name: solid.name(),
            is_wet: self.wet.is_some(),
            paint: None,
            mesh: self.refined(index, solid.placed.mesh.clone()),
            shapes: (solid.sequence.iter())
                .flat_map(|sequence| {
                    self.frames.iter().map(|&frame| {
                        let mesh = sequence.shape.mesh(scene.shot.time(frame));
                        (self.numbering.of(frame), self.refined(index, mesh))
                    })
                })
                .collect(),
            // The shape has the motion of a solid that changes it.
            way: (self.frames.iter().zip(&bodies))
                .filter(|_| solid.sequence.is_none())
                .map(|(&frame, bodies)| {
                    let pose = solid.pose(bodies, scene.shot.time(frame));
                    (self.numbering.of(frame), pose)
                })
                .collect(),
        });
        let mut solids: Vec<Solid> = still.chain(moving).collect();
        for (solid, paint) in solids.iter_mut().zip(paints.into_iter().flatten()) {
            solid.paint = Some(paint);
        }
        Ok(solids)
    }

    /// A solid's mesh in any pose, refined where the shot has its wetness.
    pub(super) fn refined(&self, index: usize, mesh: TriangleMesh) -> TriangleMesh {
        match &self.wet {
            Some((stream, _)) => {
                let surface = &stream.surfaces()[index];
                TriangleMesh {
                    vertices: surface.vertices(&mesh.vertices),
                    triangles: surface.triangles.clone(),
                }
            }
            None => mesh,
        }
    }

    /// Parts of a frame's wetness by the names of the solids.
    pub(super) fn by_solid<'w>(&self, wetness: &'w [f32]) -> Vec<(String, &'w [f32])> {
        let Some((stream, _)) = &self.wet else {
            return Vec::new();
        };
        let scene = &self.scene;
        let still = scene.solids.iter().map(PlacedMesh::name);
        let moving = scene.drawn_movers().map(MovingSolid::name);
        let names: Vec<String> = still.chain(moving).collect();
        let mut rest = wetness;
        let surfaces = stream.surfaces().iter();
        (usd::solid_names(names.iter().map(|name| &**name)).into_iter())
            .zip(surfaces)
            .map(|(name, surface)| {
                let (own, others) = rest.split_at(surface.len());
                rest = others;
                (name, own)
            })
            .collect()
    }

    /// The look's camera at each frame; empty without a look.
    fn views(&self) -> Vec<CameraFrame> {
        let Some(look) = &self.request.look else {
            return Vec::new();
        };
        let per_second = self.scene.shot.frames_per_second;
        let view = |&frame: &u32| CameraFrame {
            frame: self.numbering.of(frame),
            eye: swell_render::eye(look, self.scene.origin, frame.into(), per_second),
            film_width_mm: look.film_mm()[0],
            lens: swell_render::lens(look, frame.into(), per_second),
        };
        self.frames.iter().map(view).collect()
    }
}
