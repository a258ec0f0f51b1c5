//! Prepares a scene for the picture of a frame.

use glam::DVec3;

use swell_domain::{
    absorber::AbsorberStates,
    body::BodyState,
    bounds::Bounds,
    mesh_file::{MeshError, MeshFormat, parts::MeshParts, read_bytes},
    particles::Particles,
    pose::Pose,
};
use swell_render::{Mover, PosePath, RenderScene, SetMotion, SolidParts};
use swell_scene::{
    PlacedMesh, Scene, Wall,
    look::{AovSpec, Look},
    moving_solid::MovingSolid,
    solid_path::{BodiesAround, SolidPath},
};

/// The scene at a frame, with the parts that the look needs.
///
/// # Errors
/// If the look names materials: a mesh file that has changed since the scene was read, or that has
/// invalid texture coordinates.
pub(crate) fn render_scene(
    scene: &Scene,
    look: &Look,
    frame: u32,
    state: &FrameState<'_>,
) -> Result<RenderScene, MeshError> {
    let FrameState { now: state, around } = state;
    let bodies = BodiesAround {
        now: &state.bodies,
        before: around[0].map(|it| &it.bodies[..]),
        after: around[1].map(|it| &it.bodies[..]),
    };
    let time = f64::from(frame) / scene.shot.frames_per_second;
    let moving = scene.drawn_movers();
    let moving = moving.map(|solid| solid.mesh(&state.bodies, time));
    let solids = scene.solids.iter().map(|solid| solid.mesh.clone());
    let parts = match look.materials() {
        Some(_) => solid_parts(scene, &state.bodies, time)?,
        None => Vec::new(),
    };
    Ok(RenderScene {
        origin: scene.origin,
        domain: scene.domain,
        solids: solids.chain(moving).collect(),
        wet: None,
        parts,
        particle_spacing: scene.particle_spacing(),
        frames_per_second: scene.shot.frames_per_second,
        gravity: scene.water.gravity,
        wave_makers: plates(scene, &scene.walls(&state.walls, time)),
        moving: moving_parts(scene, look, (bodies, &state.walls), time),
        waves: scene.effects.waves(scene.water.gravity),
    })
}

/// What the picture of a frame's opaque geometry is made from.
pub(crate) struct FrameState<'a> {
    /// State of the frame.
    pub(crate) now: &'a Particles,
    /// States of the frames just before and just after, where they are known.
    pub(crate) around: [Option<&'a Particles>; 2],
}

impl<'a> FrameState<'a> {
    /// State of a frame whose neighbours are not known.
    pub(crate) fn alone(now: &'a Particles) -> Self {
        Self {
            now,
            around: [None; 2],
        }
    }
}

/// Motions of solids and wave makers about the frame at `time`; none for a look that shows none.
fn moving_parts(
    scene: &Scene,
    look: &Look,
    (bodies, absorbers): (BodiesAround<'_>, &AbsorberStates),
    time: f64,
) -> Vec<SetMotion> {
    if look.spec().image.shutter == 0.0 && !look.wants(AovSpec::Forward) {
        return Vec::new();
    }
    let first = scene.solids.len();
    let solids = scene.drawn_movers().enumerate();
    let solids = solids.map(|(index, solid)| {
        let path = SolidPath::new(solid, bodies);
        SetMotion {
            mover: Mover::Solid(first + index),
            path: PosePath::new(move |seconds| path.pose(time + seconds)),
        }
    });
    let makers = scene.makers(absorbers).enumerate();
    let makers = makers.map(|(index, (maker, absorber))| {
        let (maker, absorber) = (maker.clone(), absorber.copied());
        let mut inward = DVec3::ZERO;
        inward[maker.wall.axis] = if maker.wall.is_max { -1.0 } else { 1.0 };
        let pose = move |seconds| Pose {
            centre: maker.displacement(absorber.as_ref(), time + seconds) * inward,
            ..Pose::START
        };
        SetMotion {
            mover: Mover::WaveMaker(index),
            path: PosePath::new(pose),
        }
    });
    solids.chain(makers).collect()
}

/// Parts of each solid, read again from its file because a scene keeps only the mesh.
fn solid_parts(
    scene: &Scene,
    bodies: &[BodyState],
    time: f64,
) -> Result<Vec<SolidParts>, MeshError> {
    let of = |placed: &PlacedMesh| (placed.file.clone(), placed.file_hash.clone());
    let still = (scene.solids.iter()).map(|it| (it, of(it), it.name(), Pose::START));
    let moving = scene.drawn_movers().map(|solid| {
        let file = match &solid.sequence {
            Some(sequence) => sequence.file_at(time).clone(),
            None => of(&solid.placed),
        };
        (&solid.placed, file, solid.name(), solid.pose(bodies, time))
    });
    let parts = still
        .chain(moving)
        .map(|(placed, (file, file_hash), name, pose)| {
            let bytes = read_bytes(&file)?;
            if blake3::hash(&bytes).to_hex().as_str() != file_hash {
                return Err(MeshError::Malformed {
                    file,
                    detail: "it has changed since the scene was read".to_owned(),
                });
            }
            let mut parts = MeshParts::from_bytes(&bytes, MeshFormat::of(&file)?, &file)?;
            let way = placed.placement.world_from_file();
            if way.matrix3.determinant() < 0.0 {
                parts.turn();
            }
            Ok(SolidParts { name, parts, pose })
        });
    parts.collect()
}

/// The scene's wave makers, and how far inward of the domain's side each one is, metres.
fn plates(scene: &Scene, walls: &Bounds) -> Vec<(Wall, f64)> {
    let size = scene.domain.size();
    let makers = scene.wave_makers.iter().map(|maker| maker.wall);
    makers
        .map(|wall| match wall.is_max {
            true => (wall, size[wall.axis] - walls.max[wall.axis]),
            false => (wall, walls.min[wall.axis]),
        })
        .collect()
}

/// Names of the scene's solids, in the order of [`render_scene`]: those of their mesh files,
/// without extension.
pub(super) fn solid_names(scene: &Scene) -> Vec<String> {
    let moving = scene.drawn_movers().map(MovingSolid::name);
    (scene.solids.iter().map(PlacedMesh::name).chain(moving)).collect()
}
