//! Prepares a scene for a solver: particles, boundary, plan.

use std::sync::Arc;

use glam::DVec2;

use swell_cache::{CacheError, CacheReader};
use swell_domain::{
    boundary::{Boundary, Shape},
    bounds::Bounds,
    cut_cell::volume_offset,
    mesh::TriangleMesh,
    particles::Particles,
    sampling::{BoundarySample, Fill, boundary_samples, fill_below, fill_water},
    shape::{ShapeField, ShapeSamples, SurfaceSamples},
    signed_distance::{SignedDistance, SignedDistanceError},
    sources::Sources,
    thin::{Needed, thicken},
};
use swell_scene::{
    ByMethod, Method, Scene, mesh_sequence::MeshSequence, moving_solid::MovingSolid,
    start_waves::StartWaves,
};
use swell_solve::{
    boundary::FLOATS_OF_SHAPE,
    flip,
    plan::{Capacity, Counts, DeviceLimits, Plan},
};

/// Volume of water at a start, m³.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Volume that the particles represent.
    pub made: f64,
    /// Volume that the scene asks for, including what lies in solids and where blocks overlap;
    /// `None` if a bake begins from a frame.
    pub asked: Option<f64>,
}

/// What a solid whose shape changes takes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShapeCost {
    /// Name of the solid.
    pub name: String,
    /// Number of its mesh files; 0 for the floor that moves with waves.
    pub files: usize,
    /// Nodes of its grid. On the device each takes 20 bytes.
    pub nodes: usize,
    /// How often distances are sampled at all nodes in the shot.
    pub times: usize,
    /// Bytes in the host's memory: meshes, and distances and velocities at a few times.
    pub bytes: usize,
}

impl ShapeCost {
    /// Bytes in the device's memory.
    pub fn device_bytes(&self) -> usize {
        FLOATS_OF_SHAPE * size_of::<f32>() * self.nodes
    }
}

/// A scene's start.
#[derive(Clone, Debug)]
pub struct Start {
    /// State before the first frame.
    pub particles: Particles,
    /// Number of particles left out because a solid covers them or they lie behind a wall.
    pub removed: usize,
    /// Volume of water that the scene asks for, m³; `None` if it begins from a frame.
    pub asked: Option<f64>,
    /// Solids in the form that the solver needs.
    pub boundary: Boundary,
    /// Emitters and drains, which act at the end of each frame.
    pub sources: Sources,
}

impl Start {
    /// Samples the solids and fills the water.
    ///
    /// # Errors
    /// A mesh without an inside, or too large a distance grid.
    pub fn of(scene: &Scene) -> Result<Self, SignedDistanceError> {
        let spacing = scene.particle_spacing();
        let thin = Thin::of(scene);
        let boundary = boundary(scene, &thin)?;
        let room = scene.start_domain();
        let fill = match scene.start_waves() {
            Some(waves) => below(scene, &waves, &thin)?,
            None => {
                // Moving solids displace the water of the start as well.
                let all = thin.at_rest(scene).chain(thin.movers(scene));
                let at_start = match scene.moving_solids[..] {
                    [] => None,
                    _ => distance(scene, all, &thin)?,
                };
                fill_water(
                    &scene.start_blocks(),
                    scene.water.meshes.iter().map(|placed| &placed.mesh),
                    at_start.as_ref().or(boundary.distance.as_ref()),
                    &room,
                    spacing,
                )?
            }
        };
        let (mut particles, mut removed) = (fill.particles, fill.removed);
        particles.bodies = scene.bodies_at_start();
        scene.move_at_start(&particles.position, &mut particles.velocity);
        for swarm in &scene.water.particles {
            for at in &swarm.at {
                if room != scene.domain && !room.contains(*at) {
                    // Behind a wall that rests inside the domain.
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
        if let Some(band) = scene.band() {
            band.enter(&mut particles);
        }
        Ok(Self {
            particles,
            removed,
            asked: Some(scene.asked_volume()),
            boundary,
            sources: scene.sources()?,
        })
    }

    /// Samples the solids around `particles`, the state of a frame that has the scene's attributes.
    ///
    /// # Errors
    /// A mesh without an inside, or too large a distance grid.
    pub fn with(scene: &Scene, particles: Particles) -> Result<Self, SignedDistanceError> {
        Ok(Self {
            particles,
            removed: 0,
            asked: None,
            boundary: boundary(scene, &Thin::of(scene))?,
            sources: scene.sources()?,
        })
    }

    /// The start of the bake of `scene` in `cache`: the scene's own, or the frame that it began
    /// from.
    ///
    /// # Errors
    /// Those of [`Start::of`]; those of reading that frame.
    pub fn of_cache<E>(scene: &Scene, cache: &CacheReader) -> Result<Self, E>
    where
        E: From<SignedDistanceError> + From<CacheError>,
    {
        Ok(match cache.manifest().parent {
            None => Self::of(scene)?,
            Some(_) => Self::with(scene, cache.state(cache.first_frame())?)?,
        })
    }

    /// The volume of water.
    pub fn volume(&self, scene: &Scene) -> Volume {
        Volume {
            made: self.particles.amount() as f64 * scene.particle_volume(),
            asked: self.asked,
        }
    }

    /// Costs of the solids whose shape changes.
    pub fn shapes<'a>(&'a self, scene: &'a Scene) -> impl Iterator<Item = ShapeCost> + 'a {
        let solids = scene.moving_solids.iter().enumerate();
        solids.filter_map(|(index, solid)| {
            let shape = self.boundary.shape(index)?;
            let (times, bytes) = shape.field.cost(0.0, scene.shot.duration());
            let sequence = solid.sequence.as_ref();
            Some(ShapeCost {
                name: solid.name(),
                files: sequence.map_or(0, |it| it.files.len()),
                nodes: shape.field.nodes(),
                times,
                bytes: bytes + sequence.map_or(0, |it| it.shape.bytes()),
            })
        })
    }

    /// Lint of a start without water although the scene asks for some.
    pub(super) fn lint_dry(&self) -> Option<String> {
        // A branch may begin dry where emitters fill it.
        let is_fed = self.asked.is_none() && !self.sources.emitters.is_empty();
        if !self.particles.is_empty() || self.asked == Some(0.0) || is_fed {
            return None;
        }
        let lint = match (self.asked, self.removed) {
            (None, _) => "water: the frame that the bake begins from has no particles",
            (_, 0) => {
                "water: no block, mesh or wave is large enough for a particle; lower the particle \
                 spacing"
            }
            _ => "water: solids or walls cover all of the scene's water, and no particle is left",
        };
        Some(lint.to_owned())
    }

    /// Plans what the scene needs on a device with these limits.
    pub fn plan(&self, scene: &Scene, limits: DeviceLimits) -> Plan {
        self.plan_of(scene, &self.particles, limits)
    }

    /// The plan for display: for one particle if the scene starts dry, because passes over no
    /// particles would be left out.
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

    /// Plans the frame after one that ended with `particles`.
    pub fn plan_of(&self, scene: &Scene, particles: &Particles, limits: DeviceLimits) -> Plan {
        let grid = match scene.by_method() {
            ByMethod::Pbf(scene) => scene.of_projection(),
            ByMethod::Flip(scene) => Some(scene),
        };
        let bricks = grid.map_or_else(Capacity::default, |grid| flip::capacity(&grid, particles));
        let counts = Counts {
            particles: particles.len(),
            bricks,
            ..Counts::of_solids(&self.boundary)
        };
        Plan::new(scene, counts, limits)
    }
}

/// The water below waves, outside of the solids at the start.
fn below<'a>(
    scene: &'a Scene,
    waves: &'a StartWaves,
    thin: &'a Thin,
) -> Result<Fill, SignedDistanceError> {
    let solids = thin.at_rest(scene).chain(thin.movers(scene));
    let solid = distance(scene, solids.clone(), thin)?;
    let around = distance(scene, solids.chain([(&waves.air, false)]), thin)?;
    let floor = scene.domain.min;
    Ok(fill_below(
        |at| floor.y + waves.waves.surface(at - DVec2::new(floor.x, floor.z)),
        &waves.block,
        [solid.as_ref(), around.as_ref()],
        &scene.start_domain(),
        scene.particle_spacing(),
    ))
}

fn meshes(scene: &Scene) -> impl Iterator<Item = &TriangleMesh> + Clone {
    scene.solids.iter().map(|solid| &solid.mesh)
}

/// Which solids are too thin somewhere and are thickened there.
struct Thin {
    at_rest: Vec<bool>,
    moving: Vec<bool>,
    /// Their thickness at least.
    needed: Needed,
}

impl Thin {
    fn of(scene: &Scene) -> Self {
        let parts = scene.thin_solids();
        let (at_rest, moving) = parts.split_at(scene.solids.len());
        let mut moving = moving.iter();
        let is_thin = |solid: &MovingSolid| {
            let part = solid.is_drawn().then(|| moving.next()).flatten();
            part.is_some_and(Option::is_some) && solid.body.is_none()
        };
        Self {
            at_rest: at_rest.iter().map(Option::is_some).collect(),
            moving: scene.moving_solids.iter().map(is_thin).collect(),
            needed: scene.needed_thickness(),
        }
    }

    /// Solids at rest, and whether they are thickened.
    fn at_rest<'a>(
        &'a self,
        scene: &'a Scene,
    ) -> impl Iterator<Item = (&'a TriangleMesh, bool)> + Clone {
        meshes(scene).zip(self.at_rest.iter().copied())
    }

    /// Moving solids where they begin, and whether they are thickened.
    fn movers<'a>(
        &'a self,
        scene: &'a Scene,
    ) -> impl Iterator<Item = (&'a TriangleMesh, bool)> + Clone {
        let moving = scene.moving_solids.iter().map(|solid| &solid.placed.mesh);
        moving.zip(self.moving.iter().copied())
    }
}

/// Solids in the form that the solver needs.
fn boundary(scene: &Scene, thin: &Thin) -> Result<Boundary, SignedDistanceError> {
    let distance = distance(scene, thin.at_rest(scene), thin)?;
    let sampled = |mesh| samples(scene, mesh, distance.as_ref());
    let moving = scene
        .moving_solids
        .iter()
        .map(|solid| match solid.changes_shape() {
            true => Vec::new(),
            false => all_samples(scene, &solid.placed.mesh),
        });
    // FLIP uses only the signed distance of solids.
    let (samples, moving_samples) = match scene.solver.method() {
        Method::Pbf => (meshes(scene).flat_map(sampled).collect(), moving.collect()),
        Method::Flip => (Vec::new(), Vec::new()),
    };
    let shapes = shapes(scene, thin)?;
    let moving = moving_distances(scene, &shapes, thin)?;
    Ok(Boundary {
        samples,
        distance,
        offsets: offsets(scene, &moving),
        moving,
        moving_samples,
        shapes,
    })
}

/// Offsets that give bodies the volumes of their meshes.
fn offsets(scene: &Scene, moving: &[SignedDistance]) -> Vec<f64> {
    let solids = scene.moving_solids.iter().zip(moving);
    let of = |(solid, grid): (&MovingSolid, &SignedDistance)| match &solid.body {
        Some(_) => {
            let volume = solid.placed.mesh.signed_volume().abs();
            volume_offset(grid, volume, scene.solver.cell_size())
        }
        None => 0.0,
    };
    match scene.bodies().next() {
        Some(_) => solids.map(of).collect(),
        None => Vec::new(),
    }
}

/// The moving solids whose shape changes.
fn shapes(scene: &Scene, thin: &Thin) -> Result<Vec<Option<Shape>>, SignedDistanceError> {
    let spacing = scene.particle_spacing();
    let margin = scene.solid_margin();
    let is_sampled = scene.solver.method() == Method::Pbf;
    let shape = |(solid, is_thin): (&MovingSolid, &bool)| {
        let samples: Option<Arc<dyn SurfaceSamples>>;
        let field = match (&solid.sequence, &solid.floor) {
            (Some(MeshSequence { shape, .. }), _) => {
                samples = match is_sampled {
                    true => Some(Arc::new(ShapeSamples::new(shape, spacing))),
                    false => None,
                };
                ShapeField::new(shape, margin, spacing, is_thin.then_some(thin.needed))?
            }
            (None, Some(floor)) => {
                samples = match is_sampled {
                    true => Some(Arc::new(floor.samples())),
                    false => None,
                };
                ShapeField::of_floor(floor, margin, spacing)?
            }
            (None, None) => return Ok(None),
        };
        Ok(Some(Shape { field, samples }))
    };
    let solids = &scene.moving_solids;
    match solids.iter().any(MovingSolid::changes_shape) {
        true => solids.iter().zip(&thin.moving).map(shape).collect(),
        false => Ok(Vec::new()),
    }
}

/// Samples on the surfaces of a mesh and of its images along periodic axes. Of two that coincide,
/// keeps the one at the least end.
fn samples(
    scene: &Scene,
    mesh: &TriangleMesh,
    distance: Option<&SignedDistance>,
) -> Vec<BoundarySample> {
    let (images, spacing) = (
        scene.with_images(mesh, scene.solid_margin()),
        scene.particle_spacing(),
    );
    let mut samples: Vec<_> = (images.iter())
        .flat_map(|image| boundary_samples(image, &scene.domain, spacing))
        .collect();
    if !scene.is_periodic() {
        return samples;
    }
    // Where a mesh ends at the domain's end, its image continues it: that is not a surface.
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

/// Samples on the whole surface of a moving mesh: parts outside the domain may move in.
fn all_samples(scene: &Scene, mesh: &TriangleMesh) -> Vec<BoundarySample> {
    let spacing = scene.particle_spacing();
    let around = mesh.bounds().map(|bounds| bounds.grown(spacing));
    around.map_or(Vec::new(), |around| {
        boundary_samples(mesh, &around, spacing)
    })
}

/// Signed distance to the union of meshes, as far as water can reach them, thickened where a solid
/// that is marked so is thin.
fn distance<'a>(
    scene: &Scene,
    meshes: impl Iterator<Item = (&'a TriangleMesh, bool)>,
    thin: &Thin,
) -> Result<Option<SignedDistance>, SignedDistanceError> {
    let (images, is_thin): (Vec<_>, Vec<_>) = meshes
        .flat_map(|(mesh, is_thin)| {
            let images = scene.with_images(mesh, scene.solid_margin());
            images.into_iter().map(move |image| (image, is_thin))
        })
        .unzip();
    let Some((bounds, spacing)) = scene.solid_grid(&images) else {
        return Ok(None);
    };
    let meshes: Vec<&TriangleMesh> = images.iter().map(AsRef::as_ref).collect();
    let mut all = SignedDistance::from_meshes(meshes.iter().copied(), &bounds, spacing)?;
    if let Some(field) = &mut all {
        thicken(field, &meshes, &is_thin, &scene.walled(), thin.needed);
    }
    Ok(all)
}

/// The full signed distance of each moving solid: parts outside the domain may move in.
fn moving_distances(
    scene: &Scene,
    shapes: &[Option<Shape>],
    thin: &Thin,
) -> Result<Vec<SignedDistance>, SignedDistanceError> {
    let spacing = scene.particle_spacing();
    let solids = scene.moving_solids.iter().enumerate();
    let bounded = solids.filter_map(|(index, solid)| {
        let shape = shapes.get(index).and_then(Option::as_ref);
        let mesh = &solid.placed.mesh;
        Some((
            mesh,
            mesh.bounds()?,
            shape,
            solid.turns(),
            thin.moving[index],
        ))
    });
    bounded
        .map(|(mesh, bounds, shape, turns, is_thin)| {
            if let Some(shape) = shape {
                return Ok(shape.field.at(0.0));
            }
            let mut bounds = bounds.grown(scene.solid_margin());
            let reach = scene.domain.grown(scene.solid_margin());
            for axis in (0..3).filter(|&axis| scene.periodic[axis]) {
                (bounds.min[axis], bounds.max[axis]) = (reach.min[axis], reach.max[axis]);
            }
            let images = scene.with_images(mesh, scene.solid_margin());
            let images: Vec<_> = images.iter().map(AsRef::as_ref).collect();
            let distance = SignedDistance::from_meshes(images.iter().copied(), &bounds, spacing)?;
            let mut field = distance.expect("the mesh itself is among its images");
            // It may move anywhere, so that neither the domain nor other solids are beside it.
            let marks = vec![is_thin; images.len()];
            let needed = match turns {
                true => Needed::Everywhere(thin.needed.most()),
                false => thin.needed,
            };
            thicken(&mut field, &images, &marks, &Bounds::EVERYWHERE, needed);
            Ok(field)
        })
        .collect()
}
