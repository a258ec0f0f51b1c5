//! The parts of a frame that an export needs.

use std::cell::OnceCell;

use glam::DVec3;

use super::ExportJob;
use swell_cache::CacheError;
use swell_domain::{
    particles::Particles,
    water_mesh::{Body, WaterMesh},
};

/// A frame's content; each part is read or computed on first use.
pub(super) struct Content<'a> {
    job: &'a ExportJob<'a>,
    pub(super) frame: u32,
    particles: OnceCell<Particles>,
    mesh: OnceCell<WaterMesh>,
}

impl<'a> Content<'a> {
    pub(super) fn new(job: &'a ExportJob<'a>, frame: u32) -> Self {
        Self {
            job,
            frame,
            particles: OnceCell::new(),
            mesh: OnceCell::new(),
        }
    }

    pub(super) fn particles(&self) -> Result<&Particles, CacheError> {
        if self.particles.get().is_none() {
            let particles = self.job.source().read(self.frame)?;
            // Cannot fail: the cell is empty, and no other thread has access to it.
            let _ = self.particles.set(particles);
        }
        Ok(self.particles.get_or_init(Particles::default))
    }

    /// Volume inside the mesh relative to the particles' volume; `None` if no mesh was made.
    pub(super) fn volume(&self) -> Option<f64> {
        self.mesh.get().map(|mesh| mesh.volume)
    }

    pub(super) fn mesh(&self) -> Result<&WaterMesh, CacheError> {
        let particles = self.particles()?;
        let scene = &self.job.scene;
        Ok(self.mesh.get_or_init(|| {
            let place = |p: &[f32; 3]| DVec3::from(p.map(f64::from)) - scene.domain.min;
            let places: Vec<DVec3> = particles.position.iter().map(place).collect();
            WaterMesh::new(&Body {
                places: &places,
                velocities: &particles.velocity,
                size: scene.domain.size(),
                spacing: scene.particle_spacing(),
                voxels: self.job.request.voxels,
            })
        }))
    }
}
