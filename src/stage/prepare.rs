//! From a scene to what a solver starts from: particles, boundary, plan.

use std::borrow::Cow;

use swell_cache::{CacheError, CacheReader};
use swell_domain::{
    boundary::Boundary,
    bounds::Bounds,
    flip as flip_domain,
    mesh::TriangleMesh,
    particles::Particles,
    pbf,
    sampling::{BoundarySample, boundary_samples, fill_water},
    signed_distance::{SignedDistance, SignedDistanceError, fitting_spacing},
    sources::Sources,
};
use swell_scene::{Method, Scene};
use swell_solve::{
    flip,
    plan::{Capacity, Counts, DeviceLimits, Plan},
};

/// Spacings that the signed distance reaches beyond the solids: more than the contact distance and the cells
/// that a substep crosses.
const MARGIN: f64 = 4.0;

/// Nodes of the grid of solids that do not move: as many values as a binding of 128 MiB holds, which every adapter has. Where that
/// does for less than one a particle spacing, they stand farther apart, whatever the adapter.
pub const MOST_NODES: usize = 1 << 25;

/// A scene's start.
#[derive(Clone, Debug)]
pub struct Start {
    /// State before the first frame.
    pub particles: Particles,
    /// Lattice points left out because a solid is there.
    pub removed: usize,
    /// Solids as the solver meets them.
    pub boundary: Boundary,
    /// What enters and leaves at the frames' ends.
    pub sources: Sources,
}

impl Start {
    /// Samples solids and fills water.
    ///
    /// # Errors
    /// A mesh without an inside, or too large a distance grid.
    pub fn of(scene: &Scene) -> Result<Self, SignedDistanceError> {
        let spacing = scene.particle_spacing();
        let boundary = boundary(scene)?;
        // Where solids move, they keep out the water of the start as well.
        let movers = scene.moving_solids.iter().map(|solid| &solid.placed.mesh);
        let at_start = match scene.moving_solids[..] {
            [] => None,
            _ => distance(scene, meshes(scene).chain(movers))?,
        };
        let water = scene.water.meshes.iter().map(|placed| &placed.mesh);
        let room = scene.start_domain();
        let within = |block: &Bounds| Bounds {
            min: block.min.max(room.min),
            max: block.max.min(room.max),
        };
        let blocks: Vec<Bounds> = scene.water.blocks.iter().map(within).collect();
        let fill = fill_water(
            &blocks,
            water,
            at_start.as_ref().or(boundary.distance.as_ref()),
            &room,
            spacing,
        )?;
        let (mut particles, mut removed) = (fill.particles, fill.removed);
        for swarm in &scene.water.particles {
            for at in &swarm.at {
                if room != scene.domain && !room.contains(*at) {
                    // Behind a wall that rests inside of the domain.
                    removed += 1;
                    continue;
                }
                particles.id.push(particles.id.len() as u32);
                particles.position.push(at.as_vec3().to_array());
                particles.velocity.push(swarm.velocity.as_vec3().to_array());
            }
        }
        for name in scene.declared_attributes() {
            let zeros = vec![0.0; particles.len()];
            particles.attributes.insert((*name).to_owned(), zeros);
        }
        Ok(Self {
            particles,
            removed,
            boundary,
            sources: scene.sources()?,
        })
    }

    /// Samples solids about `particles`, the state of a frame, which has the scene's attributes.
    ///
    /// # Errors
    /// A mesh without an inside, or too large a distance grid.
    pub fn with(scene: &Scene, particles: Particles) -> Result<Self, SignedDistanceError> {
        Ok(Self {
            particles,
            removed: 0,
            boundary: boundary(scene)?,
            sources: scene.sources()?,
        })
    }

    /// The start of a bake of `scene` that stands in `cache`: the scene's own, or the frame that it began from.
    ///
    /// # Errors
    /// Those of [`Start::of`]; of that frame.
    pub fn of_cache<E>(scene: &Scene, cache: &CacheReader) -> Result<Self, E>
    where
        E: From<SignedDistanceError> + From<CacheError>,
    {
        Ok(match cache.manifest().parent {
            None => Self::of(scene)?,
            Some(_) => Self::with(scene, cache.read(cache.first_frame())?)?,
        })
    }

    /// What the scene needs on a device with these limits.
    pub fn plan(&self, scene: &Scene, limits: DeviceLimits) -> Plan {
        self.plan_of(scene, &self.particles, limits)
    }

    /// The same to be shown: of one particle where it starts dry, as passes over particles are none without.
    pub fn shown_plan(&self, scene: &Scene, limits: DeviceLimits) -> Plan {
        if !self.particles.is_empty() {
            return self.plan(scene, limits);
        }
        let mut one = self.particles.clone();
        one.id.push(0);
        one.position.push(scene.domain.min.as_vec3().to_array());
        one.velocity.push([0.0; 3]);
        self.plan_of(scene, &one, limits)
    }

    /// What it needs for the frame after one that ended with `particles`.
    pub fn plan_of(&self, scene: &Scene, particles: &Particles, limits: DeviceLimits) -> Plan {
        let bricks = match (scene.solver.method, scene.of_projection()) {
            (Method::Pbf, None) => Capacity::default(),
            (Method::Pbf, Some(grid)) => flip::capacity(&grid, particles),
            (Method::Flip, _) => flip::capacity(scene, particles),
        };
        let counts = Counts {
            particles: particles.len(),
            bricks,
            ..Counts::of_solids(&self.boundary)
        };
        Plan::new(scene, counts, limits)
    }
}

fn meshes(scene: &Scene) -> impl Iterator<Item = &TriangleMesh> {
    scene.solids.iter().map(|solid| &solid.mesh)
}

/// Solids as the solver meets them.
fn boundary(scene: &Scene) -> Result<Boundary, SignedDistanceError> {
    let distance = distance(scene, meshes(scene))?;
    let sampled = |mesh| samples(scene, mesh, distance.as_ref());
    let moving = scene.moving_solids.iter().map(|solid| &solid.placed.mesh);
    // FLIP meets solids by their distance alone.
    let (samples, moving_samples) = match scene.solver.method {
        Method::Pbf => (
            meshes(scene).flat_map(sampled).collect(),
            moving.map(|mesh| all_samples(scene, mesh)).collect(),
        ),
        Method::Flip => (Vec::new(), Vec::new()),
    };
    Ok(Boundary {
        samples,
        distance,
        moving: moving_distances(scene)?,
        moving_samples,
    })
}

/// Samples on a mesh's surface, and on its images' along periodic axes: of two that are one there, the one at the least
/// end.
fn samples(
    scene: &Scene,
    mesh: &TriangleMesh,
    distance: Option<&SignedDistance>,
) -> Vec<BoundarySample> {
    let (images, spacing) = (
        scene.with_images(mesh, margin(scene)),
        scene.particle_spacing(),
    );
    let mut samples: Vec<_> = (images.iter())
        .flat_map(|image| boundary_samples(image, &scene.domain, spacing))
        .collect();
    if !scene.is_periodic() {
        return samples;
    }
    // Where a mesh ends at the domain's end, its image goes on: no surface.
    let is_within = |sample: &BoundarySample| {
        let before = sample.position + 0.5 * spacing * sample.normal;
        distance.is_some_and(|distance| distance.sample(before) < 0.0)
    };
    let is_image = |sample: &BoundarySample| {
        (0..3).any(|axis| scene.periodic[axis] && sample.position[axis] >= scene.domain.max[axis])
    };
    samples.retain(|sample| !is_image(sample) && !is_within(sample));
    samples
}

/// Samples on all of a moving mesh's surface: what is outside of the domain now may come in.
fn all_samples(scene: &Scene, mesh: &TriangleMesh) -> Vec<BoundarySample> {
    let spacing = scene.particle_spacing();
    let around = mesh.bounds().map(|bounds| bounds.grown(spacing));
    around.map_or(Vec::new(), |around| {
        boundary_samples(mesh, &around, spacing)
    })
}

/// Metres that a signed distance reaches beyond the solids: where the domain joins its own end, as far as a particle may
/// come beyond it in a substep as well.
fn margin(scene: &Scene) -> f64 {
    let way = match scene.solver.method {
        Method::Pbf => pbf::CAP * scene.solver.pbf().cfl * scene.particle_spacing(),
        Method::Flip => {
            let flip = scene.solver.flip();
            flip_domain::CAP * flip.cfl * flip.cell_size
        }
    };
    let beyond = if scene.is_periodic() { way } else { 0.0 };
    MARGIN * scene.particle_spacing() + beyond
}

/// Of the union of meshes, as far as water can come to them.
fn distance<'a>(
    scene: &Scene,
    meshes: impl Iterator<Item = &'a TriangleMesh>,
) -> Result<Option<SignedDistance>, SignedDistanceError> {
    let meshes: Vec<_> = meshes
        .flat_map(|mesh| scene.with_images(mesh, margin(scene)))
        .collect();
    match solid_bounds(scene, &meshes) {
        Some(bounds) => {
            let meshes = meshes.iter().map(AsRef::as_ref);
            let spacing = fitting_spacing(&bounds, scene.particle_spacing(), MOST_NODES);
            SignedDistance::from_meshes(meshes, &bounds, spacing)
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
            let mut bounds = bounds.grown(margin(scene));
            if !scene.is_periodic() {
                return SignedDistance::from_mesh(mesh, &bounds, spacing);
            }
            let reach = scene.domain.grown(margin(scene));
            for axis in (0..3).filter(|&axis| scene.periodic[axis]) {
                (bounds.min[axis], bounds.max[axis]) = (reach.min[axis], reach.max[axis]);
            }
            let images = scene.with_images(mesh, margin(scene));
            let images = images.iter().map(AsRef::as_ref);
            let distance = SignedDistance::from_meshes(images, &bounds, spacing)?;
            Ok(distance.expect("the mesh itself is among its images"))
        })
        .collect()
}

/// Where meshes are, with room about them, as far as water can come.
fn solid_bounds(scene: &Scene, meshes: &[Cow<'_, TriangleMesh>]) -> Option<Bounds> {
    let margin = margin(scene);
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
