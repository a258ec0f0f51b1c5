//! A scene as TOML again, every default written out.

use std::{
    fmt::{self, Write as _},
    path::{Path, PathBuf},
};

use glam::DVec3;

use super::{Iteration, Pbf, PlacedMesh, Scene, Stop, flip::Flip, probe};
use crate::domain::{bounds::Bounds, motion::Motion};

/// Where a cache keeps its own copy of a mesh file: `assets/NAME-HASH.EXT`, so that two files of
/// one name stay apart.
pub fn asset_path(file: &Path, file_hash: &str) -> String {
    let part = |s: Option<&std::ffi::OsStr>| -> String {
        s.map(|s| s.to_string_lossy().into_owned())
            .unwrap_or_default()
            .chars()
            .map(|c| {
                if c.is_ascii_alphanumeric() || c == '_' {
                    c
                } else {
                    '-'
                }
            })
            .collect()
    };
    let short = file_hash.get(..16).unwrap_or(file_hash);
    format!(
        "assets/{}-{short}.{}",
        part(file.file_stem()),
        part(file.extension()).to_ascii_lowercase()
    )
}

impl Scene {
    /// The mesh files that the scene was built from, with their BLAKE3, each once.
    pub fn mesh_files(&self) -> Vec<(PathBuf, String)> {
        let mut files = Vec::new();
        let moving = self.moving_solids.iter().map(|solid| &solid.placed);
        for placed in self.solids.iter().chain(moving).chain(&self.water.meshes) {
            let file = (placed.file.clone(), placed.file_hash.clone());
            if !files.contains(&file) {
                files.push(file);
            }
        }
        files
    }

    /// The scene as TOML with every default written out and motion tables in place; loading it
    /// again gives an equal scene. `mesh_path` says where a file (given with its hash) will be
    /// found, relative to where the text is kept: [`asset_path`] for a cache.
    pub fn to_toml(&self, mesh_path: &dyn Fn(&Path, &str) -> String) -> String {
        let mut out = String::new();
        // Writing to a String cannot fail.
        let written = self.write(&mut out, mesh_path);
        debug_assert!(written.is_ok());
        out
    }

    fn write(&self, out: &mut String, mesh_path: &dyn Fn(&Path, &str) -> String) -> fmt::Result {
        writeln!(out, "[shot]")?;
        writeln!(out, "name = {}", text(&self.shot.name))?;
        writeln!(out, "frames = {}", self.shot.frames)?;
        writeln!(out, "frames_per_second = {:?}", self.shot.frames_per_second)?;
        writeln!(out, "\n[domain]")?;
        write_box(out, &self.domain.moved(self.origin))?;
        writeln!(out, "\n[water]")?;
        writeln!(out, "rest_density = {:?}", self.water.rest_density)?;
        writeln!(out, "gravity = {}", vector(self.water.gravity))?;
        for block in &self.water.blocks {
            writeln!(out, "\n[[water.block]]")?;
            write_box(out, &block.moved(self.origin))?;
        }
        for mesh in &self.water.meshes {
            writeln!(out, "\n[[water.mesh]]")?;
            write_mesh(out, "file", mesh, mesh_path)?;
        }
        for swarm in &self.water.particles {
            writeln!(out, "\n[[water.particles]]")?;
            let at: Vec<_> = swarm.at.iter().map(DVec3::to_array).collect();
            writeln!(out, "at = {at:?}")?;
            writeln!(out, "velocity = {}", vector(swarm.velocity))?;
        }
        for solid in &self.solids {
            writeln!(out, "\n[[solid]]")?;
            write_mesh(out, "mesh", solid, mesh_path)?;
        }
        for solid in &self.moving_solids {
            writeln!(out, "\n[[solid]]")?;
            write_mesh(out, "mesh", &solid.placed, mesh_path)?;
            writeln!(out, "direction = {}", vector(solid.direction))?;
            writeln!(out, "motion = {}", motion(&solid.motion))?;
        }
        for maker in &self.wave_makers {
            writeln!(out, "\n[[wave_maker]]")?;
            writeln!(out, "wall = {}", text(maker.wall.name()))?;
            writeln!(out, "motion = {}", motion(&maker.motion))?;
        }
        self.write_solver(out)?;
        if let Some(grids) = &self.grids {
            grids.write(out)?;
        }
        for probe in &self.probes {
            probe::write(out, probe, self.origin)?;
        }
        self.budget.write(out)?;
        writeln!(out, "\n[effects]")?;
        // An effect is a table of numbers, which toml can always write.
        let effects = toml::Table::try_from(&self.effects).unwrap_or_default();
        for (name, settings) in effects {
            writeln!(out, "{name} = {settings}")?;
        }
        Ok(())
    }

    fn write_solver(&self, out: &mut String) -> fmt::Result {
        writeln!(out, "\n[solver]")?;
        writeln!(out, "method = {}", text(self.solver.method.name()))?;
        if let Some(pbf) = &self.solver.pbf {
            write_pbf(out, pbf)?;
        }
        if let Some(flip) = &self.solver.flip {
            write_flip(out, flip)?;
        }
        Ok(())
    }
}

fn text(s: &str) -> String {
    toml::Value::from(s).to_string()
}

/// `{:?}` is the shortest decimal that reads back as the same number, and valid TOML.
fn vector(v: DVec3) -> String {
    format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z)
}

fn write_box(out: &mut String, bounds: &Bounds) -> fmt::Result {
    writeln!(out, "min = {}", vector(bounds.min))?;
    writeln!(out, "max = {}", vector(bounds.max))
}

fn write_mesh(
    out: &mut String,
    key: &str,
    mesh: &PlacedMesh,
    mesh_path: &dyn Fn(&Path, &str) -> String,
) -> fmt::Result {
    let path = mesh_path(&mesh.file, &mesh.file_hash);
    writeln!(out, "{key} = {}", text(&path))?;
    writeln!(out, "blake3 = {}", text(&mesh.file_hash))?;
    let placement = &mesh.placement;
    writeln!(out, "translate = {}", vector(placement.translate))?;
    writeln!(out, "rotate_degrees = {}", vector(placement.rotate_degrees))?;
    writeln!(out, "scale = {}", vector(placement.scale))
}

fn write_pbf(out: &mut String, pbf: &Pbf) -> fmt::Result {
    writeln!(out, "\n[solver.pbf]")?;
    writeln!(out, "particle_spacing = {:?}", pbf.particle_spacing)?;
    writeln!(out, "support_ratio = {:?}", pbf.support_ratio)?;
    writeln!(out, "iteration = {}", text(pbf.iteration.name()))?;
    if pbf.iteration == Iteration::Chebyshev {
        writeln!(out, "spectral_radius = {:?}", pbf.spectral_radius)?;
    }
    match pbf.stop {
        Stop::Iterations(n) => writeln!(out, "iterations = {n}")?,
        Stop::DensityError {
            density_error,
            max_iterations,
        } => {
            writeln!(out, "density_error = {density_error:?}")?;
            writeln!(out, "max_iterations = {max_iterations}")?;
        }
    }
    writeln!(out, "cfl = {:?}", pbf.cfl)?;
    writeln!(out, "relaxation = {:?}", pbf.relaxation)?;
    writeln!(out, "artificial_pressure = {:?}", pbf.artificial_pressure)?;
    writeln!(out, "max_substeps = {}", pbf.max_substeps)
}

fn write_flip(out: &mut String, flip: &Flip) -> fmt::Result {
    writeln!(out, "\n[solver.flip]")?;
    writeln!(out, "cell_size = {:?}", flip.cell_size)?;
    writeln!(out, "particles_per_cell = {}", flip.particles_per_cell)?;
    writeln!(out, "transfer = {}", text(flip.transfer.name()))?;
    writeln!(out, "pic_blend = {:?}", flip.pic_blend)?;
    writeln!(out, "cfl = {:?}", flip.cfl)?;
    writeln!(out, "max_substeps = {}", flip.max_substeps)?;
    writeln!(out, "surface = {}", text(flip.surface.name()))?;
    writeln!(out, "density_correction = {}", flip.density_correction)?;
    let pressure = &flip.pressure;
    writeln!(out, "\n[solver.flip.pressure]")?;
    let preconditioner = text(pressure.preconditioner.name());
    writeln!(out, "preconditioner = {preconditioner}")?;
    writeln!(out, "precision = {}", text(pressure.precision.name()))?;
    writeln!(out, "tolerance = {:?}", pressure.tolerance)?;
    writeln!(out, "max_iterations = {}", pressure.max_iterations)
}

fn motion(motion: &Motion) -> String {
    match motion {
        Motion::ConstantVelocity { velocity, until } => {
            let until = until.map_or(String::new(), |t| format!(", until = {t:?}"));
            format!("{{ kind = \"constant_velocity\", velocity = {velocity:?}{until} }}")
        }
        Motion::Sine {
            stroke,
            period,
            ramp,
        } => format!(
            "{{ kind = \"sine\", stroke = {stroke:?}, period = {period:?}, ramp = {ramp:?} }}"
        ),
        // Its gravity is the water's.
        Motion::Solitary { height, depth, .. } => {
            format!("{{ kind = \"solitary\", height = {height:?}, depth = {depth:?} }}")
        }
        Motion::Table { points } => {
            format!("{{ kind = \"table\", points = {points:?} }}")
        }
    }
}
