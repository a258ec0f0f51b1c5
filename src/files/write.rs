//! Writes a scene as TOML with all defaults.

use std::path::Path;

use glam::DVec3;
use toml::Table;

use super::{
    axis::Axis,
    body, forces, frame, keep,
    keys::{
        AbsorptionSpec, BearerSpec, BodySpec, BoxSpec, DomainSpec, DrainSpec, EmitterSpec,
        FilesSpec, ForceSpec, GridsSpec, KeepSpec, MeshSpec, PbfSpec, ProbeSpec, ScaleSpec,
        SceneSpec, SequenceSpec, SolidSpec, SolverSpec, SwarmSpec, TrackSpec, WallMotionSpec,
        WaterSpec, WaveMakerSpec,
    },
    toml_text::{table, to_toml},
};

use swell_domain::{
    absorption::Absorption,
    bounds::Bounds,
    sources::{Drain, Emitter},
};
use swell_scene::{
    Iteration, Pbf, PlacedMesh, Scene, Solver, Stop, Swarm, WaveMaker,
    forces::PlacedForce,
    grids::Grids,
    mesh_sequence::MeshSequence,
    moving_solid::MovingSolid,
    probe::{Bearer, Probe, ProbeKind},
    sources::Region,
};

/// Returns the scene as TOML with all defaults and with motion tables in place; loading it
/// gives an equal scene. `mesh_path` maps a file and its hash to the path to write, relative to
/// where the text will be stored: [`asset_path`](swell_scene::asset_path) for a cache.
pub fn scene_to_toml(scene: &Scene, mesh_path: &dyn Fn(&Path, &str) -> String) -> String {
    to_toml(&Writer { scene, mesh_path }.scene())
}

/// Returns all keys of the scene with their values.
pub(super) fn written(scene: &Scene, mesh_path: &dyn Fn(&Path, &str) -> String) -> Table {
    table(&Writer { scene, mesh_path }.scene())
}

/// Turns the parts of a scene back into what a file says, in world coordinates.
struct Writer<'a> {
    scene: &'a Scene,
    mesh_path: &'a dyn Fn(&Path, &str) -> String,
}

impl Writer<'_> {
    fn scene(&self) -> SceneSpec {
        let scene = self.scene;
        let still = scene.solids.iter().map(|solid| self.solid(solid));
        let moving = scene.drawn_movers().filter(|it| it.is_prescribed());
        SceneSpec {
            shot: scene.shot.clone(),
            domain: self.domain(),
            water: self.water(),
            solid: still
                .chain(moving.map(|it| self.moving_solid(it)))
                .collect(),
            body: scene
                .moving_solids
                .iter()
                .filter_map(|it| self.body(it))
                .collect(),
            wave_maker: scene.wave_makers.iter().map(Into::into).collect(),
            emitter: scene.emitters.iter().map(|it| self.emitter(it)).collect(),
            drain: scene.drains.iter().map(|it| self.drain(it)).collect(),
            force: scene.forces.iter().map(|it| self.force(it)).collect(),
            solver: solver(scene),
            grids: scene.grids.as_ref().map(Into::into),
            keep: scene.keep.map(|particles| KeepSpec {
                particles: particles.to_string(),
                compression: keep::name(scene.compression).to_owned(),
            }),
            probe: scene.probes.iter().map(|it| self.probe(it)).collect(),
            budget: (&scene.budget).into(),
            effects: scene.effects.clone(),
        }
    }

    fn domain(&self) -> DomainSpec {
        let scene = self.scene;
        let BoxSpec { min, max } = self.block(&scene.domain);
        DomainSpec {
            min,
            max,
            // `no_slip` says the same.
            walls: None,
            no_slip: (!scene.no_slip.is_empty()).then(|| scene.no_slip.clone()),
            periodic: scene.is_periodic().then(|| Axis::of(scene.periodic)),
            ..frame::written(scene)
        }
    }

    fn water(&self) -> WaterSpec {
        let water = &self.scene.water;
        WaterSpec {
            rest_density: water.rest_density,
            gravity: water.gravity.to_array(),
            current: (water.current != DVec3::ZERO).then(|| water.current.to_array()),
            block: water.blocks.iter().map(|it| self.block(it)).collect(),
            mesh: water.meshes.iter().map(|it| self.mesh(it)).collect(),
            wave: water.waves.clone(),
            particles: water.particles.iter().map(Into::into).collect(),
        }
    }

    fn block(&self, bounds: &Bounds) -> BoxSpec {
        let Bounds { min, max } = bounds.moved(self.scene.origin);
        BoxSpec {
            min: min.to_array(),
            max: max.to_array(),
        }
    }

    fn mesh(&self, placed: &PlacedMesh) -> MeshSpec {
        let placement = &placed.placement;
        MeshSpec {
            file: (self.mesh_path)(&placed.file, &placed.file_hash),
            blake3: Some(placed.file_hash.clone()),
            translate: placement.translate.to_array(),
            rotate_degrees: placement.rotate_degrees.to_array(),
            scale: ScaleSpec::PerAxis(placement.scale.to_array()),
        }
    }

    fn solid(&self, placed: &PlacedMesh) -> SolidSpec {
        let mesh = self.mesh(placed);
        SolidSpec {
            mesh: Some(mesh.file),
            blake3: mesh.blake3,
            sequence: None,
            translate: mesh.translate,
            rotate_degrees: mesh.rotate_degrees,
            scale: mesh.scale,
            direction: None,
            motion: None,
            pivot: None,
            axis: None,
            turn: None,
            track: None,
        }
    }

    fn moving_solid(&self, solid: &MovingSolid) -> SolidSpec {
        let (slide, turn, origin) = (&solid.slide, &solid.turn, self.scene.origin);
        let motion = |motion| WallMotionSpec::from(motion);
        if let Some(sequence) = &solid.sequence {
            return SolidSpec {
                mesh: None,
                blake3: None,
                sequence: Some(self.sequence(sequence)),
                ..self.solid(&solid.placed)
            };
        }
        SolidSpec {
            direction: slide.as_ref().map(|it| it.direction.to_array()),
            motion: slide.as_ref().map(|it| motion(&it.motion).into()),
            pivot: turn.as_ref().map(|it| (it.pivot + origin).to_array()),
            axis: turn.as_ref().map(|it| it.axis.to_array()),
            turn: turn.as_ref().map(|it| motion(&it.motion).into()),
            track: solid.track.as_ref().map(|it| TrackSpec {
                file: None,
                node: None,
                start: None,
                poses: Some(it.written(origin)),
            }),
            ..self.solid(&solid.placed)
        }
    }

    fn sequence(&self, sequence: &MeshSequence) -> SequenceSpec {
        let paths = sequence.files.iter();
        let paths = paths.map(|(file, hash)| (self.mesh_path)(file, hash));
        SequenceSpec {
            files: FilesSpec::List(paths.collect()),
            ..sequence.into()
        }
    }

    fn body(&self, solid: &MovingSolid) -> Option<BodySpec> {
        let mesh = self.mesh(&solid.placed);
        (solid.body.as_ref()).map(|it| body::written(it, mesh, self.scene.origin))
    }

    fn emitter(&self, emitter: &Emitter<Region>) -> EmitterSpec {
        let (block, mesh) = self.room(&emitter.shape);
        EmitterSpec {
            min: block.as_ref().map(|it| it.min),
            max: block.as_ref().map(|it| it.max),
            mesh,
            velocity: emitter.velocity.to_array(),
            level: emitter.level.map(|level| level + self.scene.origin.y),
            from: emitter.window.from,
            until: emitter.window.until,
        }
    }

    fn drain(&self, drain: &Drain<Region>) -> DrainSpec {
        let (block, mesh) = self.room(&drain.shape);
        DrainSpec {
            min: block.as_ref().map(|it| it.min),
            max: block.as_ref().map(|it| it.max),
            mesh,
            level: drain.level.map(|level| level + self.scene.origin.y),
            rate: drain.rate,
            from: drain.window.from,
            until: drain.window.until,
        }
    }

    fn force(&self, placed: &PlacedForce) -> ForceSpec {
        let room = placed.region.as_ref().map(|region| self.room(region));
        let (block, mesh) = room.unwrap_or_default();
        ForceSpec {
            min: block.as_ref().map(|it| it.min),
            max: block.as_ref().map(|it| it.max),
            mesh,
            ..forces::written(&placed.force, self.scene.origin)
        }
    }

    fn room(&self, region: &Region) -> (Option<BoxSpec>, Option<MeshSpec>) {
        match region {
            Region::Block(block) => (Some(self.block(block)), None),
            Region::Mesh(placed) => (None, Some(self.mesh(placed))),
        }
    }

    fn probe(&self, probe: &Probe) -> ProbeSpec {
        let kind = probe.kind;
        let at = kind.at(self.scene.origin);
        let (solid, about) = match kind {
            ProbeKind::Force { on, about } => (
                Some(self.bearer(on)),
                Some((about + self.scene.origin).to_array()),
            ),
            _ => (None, None),
        };
        ProbeSpec {
            name: Some(probe.name.clone()),
            kind: kind.name().to_owned(),
            at: (solid.is_none() && !at.is_empty()).then_some(at),
            axis: kind.towards(),
            quantile: kind.quantile(),
            solid,
            about,
            rate_hz: probe.rate,
            window: probe.window,
        }
    }

    /// Moving solids follow the static ones.
    fn bearer(&self, on: Bearer) -> BearerSpec {
        match on {
            Bearer::Solid(index) => BearerSpec::Number(index),
            Bearer::MovingSolid(index) => BearerSpec::Number(self.scene.solids.len() + index),
            Bearer::Wall(wall) => BearerSpec::Wall(wall),
        }
    }
}

fn solver(scene: &Scene) -> SolverSpec {
    let both = || {
        [Some(&scene.solver), scene.unchosen.as_ref()]
            .into_iter()
            .flatten()
    };
    SolverSpec {
        method: scene.solver.method(),
        pbf: both().find_map(Solver::pbf).map(Into::into),
        flip: both().find_map(Solver::flip).cloned(),
    }
}

impl From<&Swarm> for SwarmSpec {
    fn from(swarm: &Swarm) -> Self {
        Self {
            at: swarm.at.iter().map(|at| at.to_array()).collect(),
            velocity: swarm.velocity.to_array(),
        }
    }
}

impl From<&WaveMaker> for WaveMakerSpec {
    fn from(maker: &WaveMaker) -> Self {
        Self {
            wall: maker.wall,
            motion: (&maker.motion).into(),
            absorption: maker.absorption.as_ref().map(Into::into),
        }
    }
}

impl From<&Absorption> for AbsorptionSpec {
    fn from(absorption: &Absorption) -> Self {
        let asked = absorption.asked();
        Self {
            depth: asked.depth,
            period: asked.period,
            room: asked.room,
        }
    }
}

impl From<&Pbf> for PbfSpec {
    fn from(pbf: &Pbf) -> Self {
        let (iterations, density_error, max_iterations) = match pbf.stop {
            Stop::Iterations(iterations) => (Some(iterations), None, None),
            Stop::DensityError {
                density_error,
                max_iterations,
            } => (None, Some(density_error), Some(max_iterations)),
        };
        let is_chebyshev = pbf.iteration == Iteration::Chebyshev;
        Self {
            particle_spacing: pbf.particle_spacing,
            support_ratio: pbf.support_ratio,
            iteration: pbf.iteration,
            spectral_radius: is_chebyshev.then_some(pbf.spectral_radius),
            iterations,
            density_error,
            max_iterations,
            cfl: pbf.cfl,
            relaxation: Some(pbf.relaxation),
            artificial_pressure: pbf.artificial_pressure,
            grid_projection: pbf.grid_projection,
            max_substeps: pbf.max_substeps,
        }
    }
}

impl From<&Grids> for GridsSpec {
    fn from(grids: &Grids) -> Self {
        Self {
            surface: grids.surface,
            velocity: grids.velocity,
            voxel_size: Some(grids.voxel_size),
            precision: grids.precision,
        }
    }
}
