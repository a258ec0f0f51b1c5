//! Materials and light that the look gives a USD shot.

use std::path::Path;

use super::{ExportError, ExportJob};
use crate::render::{FrameState, render_scene};
use swell_domain::{mesh::TriangleMesh, particles::Particles};
use swell_export::usd::{self, Gloss, LookPrims, Material, Paint, Sun};
use swell_render::{RenderError, SolidPaint, daylight, deep_reflectance, painted};
use swell_scene::look::{Look, Material as LookMaterial, Picture};
use swell_study::rgb::Rgb;

/// Materials and light of a shot, and the files that they refer to.
pub(super) struct ShotLook {
    /// What the root says.
    pub(super) prims: LookPrims,
    /// Materials of each solid.
    pub(super) paints: Vec<Paint>,
    /// Part of the name between the root's and the extension, extension, and content.
    pub(super) files: Vec<(String, &'static str, Vec<u8>)>,
}

/// Materials of a shot under construction.
struct Palette<'a> {
    look: &'a Look,
    materials: Vec<Material>,
    /// For each of the look's materials that is in use, its index among `materials`.
    used: Vec<(usize, usize)>,
    /// Index of the plain colour of solids, once it is in use.
    plain: Option<usize>,
    /// File name of each of the look's pictures.
    pictures: Vec<String>,
}

impl ExportJob<'_> {
    /// Materials and light of the shot at `root`; `None` without a look.
    pub(super) fn look(&self, root: &Path) -> Result<Option<ShotLook>, ExportError> {
        let Some(look) = &self.request.look else {
            return Ok(None);
        };
        let spec = look.spec();
        let light = daylight(look).map_err(|error| told(error, look))?;
        let stem = root.file_stem().unwrap_or_default().to_string_lossy();
        let pictures = look.materials().map_or(&[][..], |it| &it.pictures);
        let stems: Vec<String> = pictures.iter().map(stem_of).collect();
        let parts = usd::solid_names(stems.iter().map(String::as_str));
        let mut palette = Palette {
            look,
            materials: Vec::new(),
            used: Vec::new(),
            plain: None,
            pictures: parts
                .iter()
                .map(|part| format!("{stem}.{part}.png"))
                .collect(),
        };
        let water = palette.add(
            "water",
            deep_reflectance(&spec.water),
            Some(Gloss {
                index: spec.water.index,
                slope: spec.surface.roughness,
            }),
        );
        let white = spec.whitewater.as_ref();
        let whitewater = white.map(|white| palette.add("whitewater", [white.foam_albedo; 3], None));
        let makers = spec.wave_makers.as_ref();
        let wave_makers = makers.map(|makers| palette.add("wave_makers", makers.colour, None));
        let paints = match self.stream {
            Some(_) => Vec::new(),
            None => self.paints(&mut palette)?,
        };
        let mut files = vec![(SKY.to_owned(), "exr", light.sky)];
        for (part, picture) in parts.into_iter().zip(pictures) {
            let name = format!("{stem}.{part}.png");
            let is_used = palette
                .materials
                .iter()
                .any(|it| it.texture.as_ref() == Some(&name));
            if is_used {
                files.push((part, "png", png_of(picture, &self.software)?));
            }
        }
        Ok(Some(ShotLook {
            prims: LookPrims {
                materials: palette.materials,
                water,
                whitewater,
                wave_makers,
                sun: Sun {
                    towards: light.to_sun,
                    irradiance: light.sun_irradiance.to_array(),
                    degrees: light.sun_degrees,
                },
                sky: format!("{stem}.{SKY}.exr"),
            },
            paints,
            files,
        }))
    }

    /// Materials of each solid, as in the first frame.
    fn paints(&self, palette: &mut Palette<'_>) -> Result<Vec<Paint>, ExportError> {
        let Some(&frame) = self.frames.first() else {
            return Ok(Vec::new());
        };
        let entry = self.cache.entry(frame)?;
        let state = Particles {
            bodies: entry.bodies.clone(),
            walls: entry.clock.walls,
            ..Particles::default()
        };
        let look = palette.look;
        let scene = render_scene(&self.scene, look, frame, &FrameState::alone(&state))?;
        let found = painted(look, &scene).map_err(|error| told(error, look))?;
        let solids = found.iter().zip(&scene.solids).enumerate();
        let paints = solids.map(|(index, (paint, mesh))| match self.keeps_triangles(index) {
            true => self.paint(index, paint, mesh, palette),
            false => {
                let plain = palette.plain();
                let count = self.refined(index, mesh.clone()).triangles.len();
                Paint {
                    of: vec![plain; count],
                    places: Vec::new(),
                }
            }
        });
        Ok(paints.collect())
    }

    /// Whether a solid has the same triangles in all frames.
    fn keeps_triangles(&self, index: usize) -> bool {
        let scene = &self.scene;
        let moving = index.checked_sub(scene.solids.len());
        let sequence = moving.and_then(|k| scene.drawn_movers().nth(k)?.sequence.as_ref());
        sequence.is_none_or(|sequence| {
            let triangles = |&frame: &u32| sequence.shape.mesh(scene.shot.time(frame)).triangles;
            let mut all = self.frames.iter().map(triangles);
            let first = all.next();
            all.all(|it| Some(it) == first)
        })
    }

    /// Materials of a solid with the mesh of a frame.
    fn paint(
        &self,
        index: usize,
        paint: &SolidPaint,
        mesh: &TriangleMesh,
        palette: &mut Palette<'_>,
    ) -> Paint {
        let refined = self.refined(index, mesh.clone());
        let parent = |k: usize| match &self.wet {
            Some((stream, _)) => stream.surfaces()[index].parents[k] as usize,
            None => k,
        };
        let count = refined.triangles.len();
        let of = (0..count).map(|k| match paint.materials[parent(k)] {
            Some(material) => palette.of(material),
            None => palette.plain(),
        });
        let of = of.collect();
        let corners = (0..count).flat_map(|k| {
            let corners = refined.triangles[k];
            corners.map(|at| paint.place(parent(k), refined.vertices[at as usize]))
        });
        let places: Vec<Option<[f64; 2]>> = corners.collect();
        Paint {
            of,
            places: match places.iter().any(Option::is_some) {
                true => places
                    .iter()
                    .map(|place| place.unwrap_or_default())
                    .collect(),
                false => Vec::new(),
            },
        }
    }
}

/// Part of the name of the sky's file.
const SKY: &str = "sky";

impl Palette<'_> {
    fn add(&mut self, name: &str, colour: [f64; 3], gloss: Option<Gloss>) -> usize {
        self.materials.push(Material {
            name: name.to_owned(),
            colour,
            texture: None,
            gloss,
        });
        self.materials.len() - 1
    }

    /// The plain colour of solids.
    fn plain(&mut self) -> usize {
        if let Some(index) = self.plain {
            return index;
        }
        let index = self.add("solids", self.look.spec().solids.colour, None);
        self.plain = Some(index);
        index
    }

    /// One of the look's materials.
    fn of(&mut self, material: usize) -> usize {
        if let Some(&(_, index)) = self.used.iter().find(|(own, _)| *own == material) {
            return index;
        }
        let list = self.look.materials().map_or(&[][..], |it| &it.list);
        let LookMaterial {
            name,
            colour,
            texture,
            ..
        } = &list[material];
        let index = self.add(name.as_deref().unwrap_or("solids"), *colour, None);
        self.materials[index].texture =
            texture.as_ref().map(|it| self.pictures[it.picture].clone());
        self.used.push((material, index));
        index
    }
}

/// Part of a texture's name; in lower case, because some file systems do not tell cases apart.
fn stem_of(picture: &Picture) -> String {
    let stem = picture.file.file_stem().unwrap_or_default();
    stem.to_string_lossy().to_lowercase()
}

fn png_of(picture: &Picture, software: &str) -> Result<Vec<u8>, ExportError> {
    let rgb = Rgb {
        size: picture.size.map(|side| side as usize),
        pixels: picture.texels.clone(),
    };
    rgb.to_png(software).map_err(|source| ExportError::Texture {
        file: picture.file.clone(),
        source,
    })
}

/// An error of the renderer; one caused by a panorama or a material points to its line in the look.
fn told(error: RenderError, look: &Look) -> ExportError {
    let fault = match &error {
        RenderError::Panorama(problem) => look.panorama_fault(problem),
        RenderError::Material { index, problem } => look.material_fault(*index, problem),
        _ => None,
    };
    fault.map_or_else(|| error.into(), ExportError::Look)
}
