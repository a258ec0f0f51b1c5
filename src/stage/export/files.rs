//! The files of a frame: what they are called, what they are made from, and their bytes.

use glam::DVec3;

use swell_cache::{CacheError, CacheReader, GridRecord, frame::Stamp, vdb};
use swell_domain::{
    fog::FogRaster,
    sparse_grid::Precision,
    vdb::VdbGrid,
    whitewater::{WhitewaterKind, of_kinds},
};
use swell_export::{FileOrigin, mesh, mesh::Placed, table, usd};

use super::{
    Content, ExportError, ExportJob, Target, UsdWater,
    folder::{Owner, Wanted},
    shot,
};

impl ExportJob<'_> {
    /// Describes how a shot represents its water, for the records of its layers and root.
    pub(super) fn water_settings(&self, water: UsdWater) -> String {
        let mut settings = match water {
            UsdWater::Points if self.stream.is_some() => format!("points{}", self.kinds_in_words()),
            UsdWater::Points => "points".to_owned(),
            UsdWater::Mesh => format!("mesh, {}", self.mesh_settings()),
        };
        if let Some(name) = &self.request.whitewater {
            settings += &format!(", whitewater {name}{}", self.kinds_in_words());
        }
        if let Some((_, name)) = &self.wet {
            settings += &format!(", wetness {name}");
        }
        settings
    }

    fn mesh_settings(&self) -> String {
        let foam = match &self.request.foam {
            Some(stream) => format!(", foam of {stream}"),
            None => String::new(),
        };
        format!("{} voxels a spacing{foam}", self.request.voxels)
    }

    /// The chosen kinds of whitewater, for the records of files; empty for all.
    fn kinds_in_words(&self) -> String {
        let names = |kinds: &Vec<WhitewaterKind>| {
            let names: Vec<_> = kinds.iter().map(|kind| kind.name()).collect();
            format!(" of {}", names.join(", "))
        };
        self.request.kinds.as_ref().map_or_else(String::new, names)
    }

    /// The streams that a file is made from beside the exported cache.
    fn beside(&self, target: &Target) -> impl Iterator<Item = &CacheReader> {
        let is_mesh = matches!(target, Target::Mesh(_) | Target::Usd(_, UsdWater::Mesh));
        let is_shot = matches!(target, Target::Usd(..));
        let foam = self.foam.iter().filter(move |_| is_mesh);
        foam.chain(self.whitewater.iter().filter(move |_| is_shot))
    }

    pub(super) fn owner(&self, target: &Target, settings: String) -> Result<Owner, CacheError> {
        let source = self.source();
        let mut cache = source.entry(source.first_frame())?.chain.clone();
        for stream in self.beside(target) {
            cache = format!("{cache} {}", stream.entry(stream.first_frame())?.chain);
        }
        Ok(Owner {
            software: self.software.clone(),
            shot: source.manifest().shot.clone(),
            cache,
            settings,
        })
    }

    pub(super) fn wanted(&self, target: &Target, frame: u32) -> Result<Wanted, CacheError> {
        let kinds = self.kinds_in_words();
        let number = self.numbering.of(frame);
        let (file, settings) = match target {
            Target::Mesh(files) => (
                files.file(number),
                format!("mesh as {}, {}", files.ending(), self.mesh_settings()),
            ),
            Target::Npy(files) => (files.file(number), format!("particles as npy{kinds}")),
            Target::Csv(files) => (files.file(number), format!("particles as csv{kinds}")),
            Target::Bgeo(files) => (files.file(number), format!("particles as bgeo{kinds}")),
            Target::Vdb(files) => (files.file(number), "grids as vdb".to_owned()),
            Target::Fog(files) => {
                let voxel = self.fog_voxel();
                (files.file(number), format!("fog of {voxel} m{kinds}"))
            }
            Target::Usd(file, water) => {
                let water = self.water_settings(*water);
                let layer = self.layer(file, frame);
                (layer, format!("a frame's layer of usd, {water}"))
            }
        };
        let mut source = self.source().frame_hash(frame)?.to_owned();
        for stream in self.beside(target) {
            source = format!("{source} {}", stream.frame_hash(frame)?);
        }
        if let (Some((wet, _)), Target::Usd(..)) = (&self.wet, target) {
            source += &format!(" wet {}", wet.frame_hash(frame)?);
        }
        Ok(Wanted {
            file,
            owner: self.owner(target, settings)?,
            source,
            follows: false,
        })
    }

    pub(super) fn bytes(
        &self,
        target: &Target,
        content: &Content<'_>,
    ) -> Result<Vec<u8>, ExportError> {
        let (scene, frame) = (&self.scene, content.frame);
        let source = FileOrigin {
            software: &self.software,
            shot: &self.source().manifest().shot,
            frame,
        };
        let origin = scene.origin;
        Ok(match target {
            Target::Npy(_) => table::npy(content.particles()?, origin),
            Target::Csv(_) => table::csv(content.particles()?, origin),
            Target::Bgeo(_) => table::bgeo(content.particles()?, origin),
            Target::Vdb(_) => self.grids(content)?,
            Target::Fog(_) => self.fog(content)?,
            Target::Mesh(files) => {
                let placed = Placed {
                    water: content.mesh()?,
                    corner: origin + scene.domain.min,
                    is_far: origin != DVec3::ZERO,
                };
                match files.ending().as_str() {
                    "ply" => mesh::ply(&placed, &source),
                    "obj" => mesh::obj(&placed, &source),
                    _ => self.layer_bytes(UsdWater::Mesh, content, &source, None)?,
                }
            }
            Target::Usd(_, water) => {
                let wetness = match &self.wet {
                    Some((wet, _)) => wet.read(frame)?,
                    None => Vec::new(),
                };
                let wetness = self.by_solid(&wetness);
                self.layer_bytes(*water, content, &source, Some(&wetness))?
            }
        })
    }

    /// Grids as the bake kept them, or with a scene's default settings.
    fn grids(&self, content: &Content<'_>) -> Result<Vec<u8>, ExportError> {
        let manifest = self.cache.manifest();
        let frame = content.frame;
        let default = || GridRecord {
            surface: true,
            velocity: true,
            voxel_size: 2.0 * self.scene.particle_spacing(),
            origin: self.scene.domain.min.to_array(),
            precision: Precision::Half,
        };
        let record = manifest.grids.clone().unwrap_or_else(default);
        let grids = record
            .grids(content.particles()?, manifest.particle_spacing)
            .moved(manifest.origin.into());
        let mut bytes = Vec::new();
        vdb::encode(&mut bytes, &self.stamp(frame)?, &grids, record.precision)
            .map_err(|source| ExportError::Vdb { frame, source })?;
        Ok(bytes)
    }

    fn stamp(&self, frame: u32) -> Result<Stamp<'_>, CacheError> {
        let manifest = self.source().manifest();
        Ok(Stamp {
            program: &manifest.program,
            program_version: &manifest.program_version,
            shot: &manifest.shot,
            frame,
            time: self.source().entry(frame)?.clock.time,
            origin: manifest.origin.into(),
        })
    }

    /// Edge length of a fog's voxel, metres.
    pub(super) fn fog_voxel(&self) -> f64 {
        let spacing = self.scene.particle_spacing();
        self.request.fog_voxel.unwrap_or(spacing)
    }

    /// Fog of the chosen kinds, of spray where none were chosen, as precise as the bake's grids.
    fn fog(&self, content: &Content<'_>) -> Result<Vec<u8>, ExportError> {
        let raster = FogRaster {
            origin: self.scene.domain.min,
            voxel_size: self.fog_voxel(),
            frame_seconds: 1.0 / self.scene.shot.frames_per_second,
        };
        let white = content.particles()?;
        let mut fog = match &self.request.kinds {
            Some(_) => raster.fog(white),
            None => raster.fog(&of_kinds(white.clone(), &[WhitewaterKind::Spray])),
        };
        let grids = &self.cache.manifest().grids;
        let precision = grids.as_ref().map_or(Precision::Half, |it| it.precision);
        fog.density.origin += self.scene.origin;
        fog.velocity.origin += self.scene.origin;
        let grids = [
            VdbGrid::Fog("density", &fog.density),
            VdbGrid::Vectors("vel", &fog.velocity),
        ];
        Ok(vdb::file(&self.stamp(content.frame)?, &grids, precision))
    }

    /// Layer of a frame; that of a shot has what is `beside` the water: whitewater and the wetness
    /// of solids.
    fn layer_bytes(
        &self,
        water: UsdWater,
        content: &Content<'_>,
        source: &FileOrigin<'_>,
        beside: Option<&[(String, &[f32])]>,
    ) -> Result<Vec<u8>, ExportError> {
        let shot = self.shot(source.frame);
        let makers = match self.stream {
            Some(_) => Vec::new(),
            None => shot::displacements(&self.scene, content.particles()?, source.frame),
        };
        let mut waters = vec![usd::WaterLayer {
            name: self.prim(),
            kind: self.kind(water),
            content: match water {
                UsdWater::Points => usd::WaterFrame::Points(content.particles()?),
                UsdWater::Mesh => usd::WaterFrame::Mesh(content.mesh()?, self.scene.domain.min),
            },
        }];
        if beside.is_some()
            && let Some(particles) = content.whitewater()?
        {
            waters.push(usd::WaterLayer {
                name: shot::WHITEWATER,
                kind: usd::WaterRepresentation::Points { width: None },
                content: usd::WaterFrame::Points(particles),
            });
        }
        Ok(usd::frame(&shot, &waters, &makers, beside.unwrap_or(&[])))
    }

    /// Name of the prim that holds the water, or the stream in place of it.
    pub(super) fn prim(&self) -> &str {
        self.request.stream.as_deref().unwrap_or("water")
    }

    pub(super) fn kind(&self, water: UsdWater) -> usd::WaterRepresentation {
        let is_own = self.stream.is_some();
        match water {
            UsdWater::Points if is_own => usd::WaterRepresentation::Points { width: None },
            UsdWater::Points => usd::WaterRepresentation::Points {
                width: Some(shot::width(self.scene.particle_spacing())),
            },
            UsdWater::Mesh => usd::WaterRepresentation::Mesh,
        }
    }

    /// A shot's time codes are the numbers in the names of its layers.
    pub(super) fn shot(&self, frame: u32) -> usd::Shot<'_> {
        let number = |frame: Option<&u32>| frame.map_or(0, |&frame| self.numbering.of(frame));
        usd::Shot {
            source: FileOrigin {
                software: &self.software,
                shot: &self.source().manifest().shot,
                frame: self.numbering.of(frame),
            },
            frames_per_second: self.scene.shot.frames_per_second,
            frames: [self.frames.first(), self.frames.last()].map(number),
            origin: self.scene.origin,
        }
    }
}
