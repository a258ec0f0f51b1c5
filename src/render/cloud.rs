//! Drops and bubbles of a frame as participating media for rays, and their grid at an instant in
//! the device's layout.

mod density;
mod shade;

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::{
    RenderScene,
    foam::FoamColumns,
    paths::Path,
    uniform::{self, Particle},
};
use swell_domain::{
    particles::Particles,
    whitewater::{RADIUS, WhitewaterKind},
};
use swell_scene::look::Look;

use density::Cloud;
pub(super) use density::Drop;
use shade::Shade;

/// Radius, in splat radii, of a ball with the mean square distance of what is splatted for a
/// particle: 1.6 for its mist and for the centres of its drops, which have a radius of up to a
/// third themselves.
const THROWN: f64 = 1.63;
/// Depth behind the water's surface at which a ray still meets what floats on it, particle
/// spacings: the width over which the grid smears it.
pub(super) const SKIN: f64 = 1.0;
/// Largest number of positions on a drop's path within a sample.
const MOST_BEADS: usize = 16;

/// Drops of the particles that the look whitens, with their paths; without `paths` they move in
/// straight lines. `radius` is that of a splat, metres.
pub(super) fn drops_of(
    look: &Look,
    scene: &RenderScene,
    radius: f64,
    (particles, paths): (&[Particle], &[Path]),
) -> Vec<(Drop, Path)> {
    let Some(spray) = &look.spec().water.spray else {
        return Vec::new();
    };
    let volume = scene.particle_spacing.powi(3);
    let white = (particles.iter().enumerate()).filter(|(_, particle)| particle.air & 0xffff > 0);
    white
        .map(|(index, particle)| {
            let air = f64::from(particle.air & 0xffff) / 65535.0;
            let drop = Drop {
                place: Vec3::from(particle.position).as_dvec3(),
                radius: THROWN * radius,
                area: spray.density_per_metre * air * volume,
                is_bubble: false,
            };
            let straight = || Path::straight(particle.velocity.into());
            (drop, paths.get(index).copied().unwrap_or_else(straight))
        })
        .collect()
}

/// Spray and bubbles of whitewater with their paths; `kind` is that of a particle. Foam is a layer
/// on the surface instead.
pub(super) fn white_of(
    look: &Look,
    scene: &RenderScene,
    white: &Particles,
    kind: impl Fn(usize) -> WhitewaterKind,
) -> Vec<(Drop, Path)> {
    let Some(spec) = &look.spec().whitewater else {
        return Vec::new();
    };
    let origin = scene.domain.min;
    let radii = white.attributes.get(RADIUS).map_or(&[][..], Vec::as_slice);
    let places = white.position.iter().zip(&white.velocity).zip(radii);
    (places.enumerate())
        .filter(|(index, _)| kind(*index) != WhitewaterKind::Foam)
        .map(|(index, ((&place, &velocity), &radius))| {
            let radius = spec.size * f64::from(radius);
            let drop = Drop {
                place: Vec3::from(place).as_dvec3() - origin,
                radius,
                area: spec.density_per_metre * 4.0 / 3.0 * PI * radius.powi(3),
                is_bubble: kind(index) == WhitewaterKind::Bubble,
            };
            (drop, Path::straight(velocity.into()))
        })
        .collect()
}

/// Drops at instants with the same share of the light: each once for each voxel on its path
/// between the first and the last, with as much of its cross-section.
fn streaks(drops: &[(Drop, Path)], instants: &[f32], voxel: f64) -> Vec<Drop> {
    let (Some(&first), Some(&last)) = (instants.first(), instants.last()) else {
        return Vec::new();
    };
    let of = |(drop, path): &(Drop, Path)| {
        let way = path.displacement(last) - path.displacement(first);
        let beads = ((way.length() / voxel).ceil() as usize).clamp(1, MOST_BEADS);
        let (drop, path) = (*drop, *path);
        (0..beads).map(move |bead| {
            let instant = instants[(2 * bead + 1) * instants.len() / (2 * beads)];
            Drop {
                place: drop.place + path.displacement(instant),
                area: drop.area / beads as f64,
                ..drop
            }
        })
    };
    drops.iter().flat_map(of).collect()
}

/// Builds the mean grid of instants and returns its uniform and its words, followed by those of the
/// foam on the water, which is of their mean.
pub(super) fn grid(
    drops: &[(Drop, Path)],
    instants: &[f32],
    foam: &FoamColumns,
    scene: &RenderScene,
    (voxel, sun): (f64, DVec3),
) -> (uniform::Cloud, Vec<u32>) {
    let moved = streaks(drops, instants, voxel);
    let cloud = Cloud::new(&moved, scene.domain.size(), voxel);
    let shade = Shade::new(&cloud, sun);
    let before = cloud.table.len() + shade.depths.len() + cloud.values.len();
    let about = uniform::Cloud {
        corner: cloud.corner.as_vec3().to_array(),
        voxel: voxel as f32,
        bricks: cloud.bricks,
        skin: (SKIN * scene.particle_spacing) as f32,
        nodes: shade.nodes,
        pitch: shade.pitch as f32,
        foam_corner: foam.corner,
        foam_columns: foam.columns,
        foam_edge: foam.edge,
        foam_start: before as u32,
        foam_albedo: foam.albedo,
        foam_radius: foam.radius,
    };
    let mut words = cloud.table;
    words.extend(shade.depths.iter().map(|depth| depth.to_bits()));
    words.extend_from_slice(&cloud.values);
    words.extend(foam.words());
    (about, words)
}
