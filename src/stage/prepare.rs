//! From a scene to what a solver starts from (particles, boundary, plan), and the solver.

use crate::{
    domain::{
        bounds::Bounds,
        mesh::TriangleMesh,
        particles::Particles,
        sampling::{boundary_samples, fill_water},
        signed_distance::{SignedDistance, SignedDistanceError},
        solver::Solver,
    },
    gpu::adapter::Context,
    scene::{
        Method, Scene,
        plan::{Capacity, Counts, DeviceLimits, Plan},
    },
    solve::{
        self, SolveError,
        boundary::Boundary,
        flip::{self, Flip},
        pbf::Pbf,
    },
};

/// Spacings that the signed distance reaches beyond the solids: more than the contact distance and the cells
/// that a substep crosses.
const MARGIN: f64 = 4.0;

/// A scene's start.
#[derive(Clone, Debug)]
pub struct Start {
    /// State before the first frame.
    pub particles: Particles,
    /// Lattice points left out because a solid is there.
    pub removed: usize,
    /// Solids as the solver meets them.
    pub boundary: Boundary,
}

impl Start {
    /// Samples solids and fills water.
    ///
    /// # Errors
    /// A mesh without an inside, or too large a distance grid.
    pub fn of(scene: &Scene) -> Result<Self, SignedDistanceError> {
        let spacing = scene.particle_spacing();
        let meshes = || scene.solids.iter().map(|solid| &solid.mesh);
        let distance = distance(scene, &meshes().collect::<Vec<_>>())?;
        let moving = moving_distances(scene)?;
        // Where solids move, they keep out the water of the start as well.
        let movers = scene.moving_solids.iter().map(|solid| &solid.placed.mesh);
        let at_start = match scene.moving_solids[..] {
            [] => None,
            _ => self::distance(scene, &meshes().chain(movers).collect::<Vec<_>>())?,
        };
        // FLIP meets solids by their distance alone.
        let samples = match scene.solver.method {
            Method::Pbf => meshes()
                .flat_map(|mesh| boundary_samples(mesh, &scene.domain, spacing))
                .collect(),
            Method::Flip => Vec::new(),
        };
        let water = scene.water.meshes.iter().map(|placed| &placed.mesh);
        let fill = fill_water(
            &scene.water.blocks,
            water,
            at_start.as_ref().or(distance.as_ref()),
            &scene.domain,
            spacing,
        )?;
        let mut particles = fill.particles;
        for name in attributes(scene) {
            let zeros = vec![0.0; particles.len()];
            particles.attributes.insert(name.to_owned(), zeros);
        }
        Ok(Self {
            particles,
            removed: fill.removed,
            boundary: Boundary {
                samples,
                distance,
                moving,
            },
        })
    }

    /// What the scene needs on a device with these limits.
    pub fn plan(&self, scene: &Scene, limits: DeviceLimits) -> Plan {
        let bricks = match scene.solver.method {
            Method::Pbf => Capacity::default(),
            Method::Flip => flip::capacity(scene, &self.particles),
        };
        let counts = Counts {
            particles: self.particles.len(),
            bricks,
            ..self.boundary.counts()
        };
        solve::plan(scene, counts, limits)
    }
}

/// What each particle carries beside position, velocity and id.
fn attributes(scene: &Scene) -> Vec<&'static str> {
    match scene.solver.method {
        Method::Pbf => Vec::new(),
        Method::Flip => flip::attributes(scene.solver.flip()).to_vec(),
    }
}

/// The scene's solver on a device, with what `plan` names.
///
/// # Errors
/// Those of the solver: a buffer over the adapter's limits, with the figures; the device at fault.
pub fn build(
    context: &Context,
    scene: &Scene,
    plan: Plan,
    start: &Start,
    is_timed: bool,
) -> Result<Box<dyn Solver<Error = SolveError>>, SolveError> {
    let boundary = &start.boundary;
    Ok(match scene.solver.method {
        Method::Pbf => Box::new(Pbf::new(context, scene, plan, boundary, is_timed)?),
        Method::Flip => Box::new(Flip::new(context, scene, plan, boundary, is_timed)?),
    })
}

/// Of the union of meshes, as far as water can come to them.
fn distance(
    scene: &Scene,
    meshes: &[&TriangleMesh],
) -> Result<Option<SignedDistance>, SignedDistanceError> {
    match solid_bounds(scene, meshes) {
        Some(bounds) => {
            SignedDistance::from_meshes(meshes.iter().copied(), &bounds, scene.particle_spacing())
        }
        None => Ok(None),
    }
}

/// One a moving solid, all of it: what is outside of the domain now may come in.
fn moving_distances(scene: &Scene) -> Result<Vec<SignedDistance>, SignedDistanceError> {
    let spacing = scene.particle_spacing();
    let solids = scene.moving_solids.iter();
    let bounded =
        solids.filter_map(|solid| Some((&solid.placed.mesh, solid.placed.mesh.bounds()?)));
    bounded
        .map(|(mesh, bounds)| {
            SignedDistance::from_mesh(mesh, &bounds.grown(MARGIN * spacing), spacing)
        })
        .collect()
}

/// Where meshes are, with room about them, as far as water can come.
fn solid_bounds(scene: &Scene, meshes: &[&TriangleMesh]) -> Option<Bounds> {
    let margin = MARGIN * scene.particle_spacing();
    let reach = scene.domain.grown(margin);
    let mut all: Option<Bounds> = None;
    for bounds in meshes.iter().filter_map(|mesh| mesh.bounds()) {
        all = Some(match all {
            None => bounds,
            Some(other) => Bounds {
                min: other.min.min(bounds.min),
                max: other.max.max(bounds.max),
            },
        });
    }
    let grown = all?.grown(margin);
    let clipped = Bounds {
        min: grown.min.max(reach.min),
        max: grown.max.min(reach.max),
    };
    clipped.min.cmplt(clipped.max).all().then_some(clipped)
}
