//! The parts of a frame that an export needs.

use std::cell::OnceCell;

use glam::DVec3;

use super::ExportJob;
use swell_cache::{CacheError, CacheReader};
use swell_domain::{
    level_set::foam::{FOAM, FOAM_AGE, Foam, FoamBox},
    particles::Particles,
    water_mesh::{Body, WaterMesh},
    whitewater::of_kinds,
};

/// A frame's content; each part is read or computed on first use.
pub(super) struct Content<'a> {
    job: &'a ExportJob<'a>,
    pub(super) frame: u32,
    particles: OnceCell<Particles>,
    mesh: OnceCell<WaterMesh>,
    whitewater: OnceCell<Particles>,
}

impl<'a> Content<'a> {
    pub(super) fn new(job: &'a ExportJob<'a>, frame: u32) -> Self {
        Self {
            job,
            frame,
            particles: OnceCell::new(),
            mesh: OnceCell::new(),
            whitewater: OnceCell::new(),
        }
    }

    /// The particles of the exported cache, of the chosen kinds if it is a stream.
    pub(super) fn particles(&self) -> Result<&Particles, CacheError> {
        self.read(
            &self.particles,
            self.job.source(),
            self.job.stream.is_some(),
        )
    }

    /// Whitewater of the chosen kinds beside the water; `None` where none was asked for.
    pub(super) fn whitewater(&self) -> Result<Option<&Particles>, CacheError> {
        let stream = self.job.whitewater.as_ref();
        stream
            .map(|it| self.read(&self.whitewater, it, true))
            .transpose()
    }

    fn read<'b>(
        &self,
        cell: &'b OnceCell<Particles>,
        cache: &CacheReader,
        is_stream: bool,
    ) -> Result<&'b Particles, CacheError> {
        if cell.get().is_none() {
            let mut particles = cache.read(self.frame)?;
            if let (true, Some(kinds)) = (is_stream, &self.job.request.kinds) {
                particles = of_kinds(particles, kinds);
            }
            // Cannot fail: the cell is empty, and no other thread has access to it.
            let _ = cell.set(particles);
        }
        Ok(cell.get_or_init(Particles::default))
    }

    /// Volume inside the mesh relative to the particles' volume; `None` if no mesh was made.
    pub(super) fn volume(&self) -> Option<f64> {
        self.mesh.get().map(|mesh| mesh.volume)
    }

    pub(super) fn mesh(&self) -> Result<&WaterMesh, CacheError> {
        if self.mesh.get().is_none() {
            // Cannot fail: the cell is empty, and no other thread has access to it.
            let _ = self.mesh.set(self.made_mesh()?);
        }
        Ok(self.mesh.get_or_init(WaterMesh::default))
    }

    fn made_mesh(&self) -> Result<WaterMesh, CacheError> {
        let particles = self.particles()?;
        let scene = &self.job.scene;
        let place = |p: &[f32; 3]| DVec3::from(p.map(f64::from)) - scene.domain.min;
        let places: Vec<DVec3> = particles.position.iter().map(place).collect();
        let mut mesh = WaterMesh::new(&Body {
            places: &places,
            velocities: &particles.velocity,
            size: scene.domain.size(),
            spacing: scene.particle_spacing(),
            voxels: self.job.request.voxels,
        });
        if let Some(stream) = &self.job.foam {
            let room = FoamBox {
                corner: scene.domain.min,
                walls: scene.walls(&particles.walls, scene.shot.time(self.frame)),
                period: scene.period(),
                spacing: scene.particle_spacing(),
            };
            let foam = Foam::new(&stream.read(self.frame)?, &room);
            let values = foam.at(&mesh.mesh.vertices, &mesh.normals);
            let names = [FOAM, FOAM_AGE].map(str::to_owned);
            mesh.attributes = names.into_iter().zip(values).collect();
        }
        Ok(mesh)
    }
}
