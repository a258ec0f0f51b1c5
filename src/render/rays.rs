//! Scene representation for ray casting: the water as a level set, opaque geometry as a bounding
//! volume hierarchy.

use glam::{DVec3, Vec3};

use super::{
    RenderScene,
    buffers::{DEPTHS, LEVEL_TABLE, LEVEL_VALUES, RAYS, SET_NODES, SET_TRIANGLES, SUN_PATHS},
    paths::Path,
    plan::Plan,
    set::Set,
    tree::{Hierarchy, Tree},
    uniform::{Rays, Triangle},
};
use swell_domain::level_set::{
    LevelSet, VALUES, bricks_over, kernels::Kernels, sunlight::nodes_over,
};
use swell_gpu::recording::{Bind, Command, Groups};
use swell_scene::look::Look;

/// Bits of the box sides at which the look's quay walls are: those along z.
const QUAYS: u32 = 0b11_0000;

/// Width, in spacings, of the gap between water and opaque geometry that counts as water: a
/// particle resting on a solid keeps half a spacing from it.
const GAP: f64 = 0.5;

/// Plans the level set, whose buffer grows with the frames; the lattice of sunlight in it, followed
/// by `behind` further values; and the hierarchy over opaque geometry. Returns the hierarchy, and
/// the uniform that has its scale.
pub(super) fn plan_rays(
    plan: &mut Plan,
    look: &Look,
    scene: &RenderScene,
    set: &Set<'_>,
    behind: usize,
) -> (Rays, Hierarchy) {
    let size = scene.domain.size();
    let voxel = voxel(look, scene);
    let bricks = bricks_over(size, voxel);
    let (nodes, pitch) = nodes_over(size, voxel);
    let hierarchy = Hierarchy::over(set.triangles);
    let is_moving = plan.moving.is_some();
    let Tree {
        low,
        step,
        nodes: boxes,
        mut sorted,
    } = hierarchy.packed(set.triangles);
    let rays = Rays {
        set_low: low,
        set_step: step,
        size: size.as_vec3().to_array(),
        voxel: voxel as f32,
        bricks,
        triangles: set.triangles.len() as u32,
        nodes,
        pitch: pitch as f32,
        gap: (GAP * scene.particle_spacing) as f32,
        ways: match is_moving {
            true => (set.triangles.len() + set.places.len()) as u32,
            false => 0,
        },
        walls: look.spec().basin.as_ref().map_or(0, |_| QUAYS),
        ..Rays::default()
    };
    let count = |n: [u32; 3]| n.iter().map(|&n| n as usize).product();
    plan.values(&RAYS, &[rays]);
    plan.buffer(&LEVEL_TABLE, count(bricks));
    plan.buffer(&LEVEL_VALUES, VALUES);
    plan.buffer(&SUN_PATHS, count(nodes) + behind);
    sorted.extend(set.places);
    if is_moving {
        sorted.resize(sorted.len() + set.triangles.len(), Triangle::default());
    }
    plan.values(&SET_NODES, &boxes);
    plan.values(&SET_TRIANGLES, &sorted);
    (rays, hierarchy)
}

/// Computes the depth of the first hit of a ray through each pixel of the padded frame: of water
/// into the first of [`DEPTHS`], of opaque geometry into the second, and of either into
/// `FIRST_DEPTH` of [`super::buffers`] where the look draws spray.
pub(super) fn first(plan: &Plan) -> Command {
    let binds = vec![
        Bind::whole("depth", &DEPTHS[0]),
        Bind::whole("solid_depth", &DEPTHS[1]),
    ];
    Command::in_groups("rays/first", Groups::Pixels(plan.extent.size), binds)
}

/// Edge length of a voxel, metres.
pub(super) fn voxel(look: &Look, scene: &RenderScene) -> f64 {
    scene.particle_spacing / look.spec().surface.voxels_per_spacing
}

/// Returns positions moved along their paths by `seconds`.
pub(super) fn moved(places: &[(Vec3, Path)], seconds: f32) -> Vec<DVec3> {
    let moved = places.iter();
    moved
        .map(|(position, path)| position.as_dvec3() + path.displacement(seconds))
        .collect()
}

/// Builds the level set of particles at positions relative to the box's least corner, with voxels
/// of `voxel` metres.
pub(super) fn level_set(scene: &RenderScene, voxel: f64, places: &[DVec3]) -> LevelSet {
    let size = scene.domain.size();
    let kernels = Kernels::fit(places, size, scene.particle_spacing);
    LevelSet::of_kernels(&kernels, size, voxel)
}

/// Unit vector towards the sun as seen from within flat water.
pub(super) fn sun_in_water(look: &Look) -> DVec3 {
    let sun = look.sun_direction();
    let bent = DVec3::new(sun.x, 0.0, sun.z) / look.spec().water.index;
    bent + DVec3::Y * (1.0 - bent.length_squared()).sqrt()
}
