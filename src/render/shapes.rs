//! Ellipsoids as which particles are splatted: their anisotropic kernels (Yu and Turk 2013), scaled
//! so that a lone particle is a sphere of its own volume.
//!
//! Spheres would give a silhouette with a roughness of 0.17 spacings. Kernels are flat at a flat
//! surface, so that those of the outermost particles merge. Where the surface is uneven, the
//! nearest kernels would protrude as far as the particles do; each ellipsoid therefore ends where
//! the field of all kernels does, at the surface that rays meet.

use std::f64::consts::PI;

use glam::{DMat3, DVec3, Vec3};

use super::{
    RenderScene,
    uniform::{Particle, Shape},
};
use swell_domain::level_set::{
    eigen,
    kernels::{ALONE, Ellipsoid, KernelField, Kernels},
};
use swell_domain::parallel;

/// Default splat radius over particle spacing; 0.5 √3 closes a lattice seen along its diagonal.
pub(super) const RADIUS: f64 = 0.87;

/// Least half axis, spacings: half the thickness of a single layer of particles in the kernels'
/// field.
const THINNEST: f64 = 0.35;

/// Ellipsoids of the first `seen` particles, in their order, fitted to all particles of the body;
/// `particles` are relative to the domain's least corner. Particles that were thrown clear are
/// spheres. `radius` is the look's splat radius, metres.
pub(super) fn shapes(
    particles: &[Particle],
    seen: usize,
    scene: &RenderScene,
    radius: f64,
) -> Vec<Shape> {
    let is_body = |particle: &&Particle| particle.tag & 1 == 1;
    let places: Vec<DVec3> = parallel::flat_map(0..particles.len(), |k| {
        let particle = &particles[k];
        is_body(&particle).then(|| Vec3::from(particle.position).as_dvec3())
    });
    let shaped = particles[..seen].iter().filter(is_body).count();
    let spacing = scene.particle_spacing;
    let kernels = Kernels::of_first(shaped, &places, scene.domain.size(), spacing);
    // Radius of a sphere of volume d³ over that of a lone particle's kernel, times the look's
    // radius over the default one.
    let factor = (3.0 / (4.0 * PI)).cbrt() / ALONE * radius / (RADIUS * spacing);
    let thinnest = THINNEST * radius / RADIUS;
    let all = Kernels::of_fitted(kernels, scene.domain.size(), spacing);
    let field = all.field();
    let fitted: Vec<Shape> = parallel::map_slice(&all.ellipsoids[..shaped], |kernel| {
        shape(kernel, &field, factor, thinnest)
    });
    let ball = (factor * ALONE * spacing) as f32;
    let alone = Shape {
        diagonal: [ball; 3],
        ..Shape::default()
    };
    let mut fitted = fitted.into_iter();
    let of = |particle: &Particle| match particle.tag & 1 {
        1 => fitted.next().unwrap_or(alone),
        _ => alone,
    };
    particles[..seen].iter().map(of).collect()
}

/// Ratio of shortest to longest half axis above which a kernel is inside the water. At the surface
/// of a half-space lattice it is 0.63.
const ROUND: f64 = 0.9;

/// Squares the flattening of a kernel. The outermost particles of a half-space lattice, with
/// kernels 0.63 as high as wide, then give a surface 0.47 spacings above them with a roughness of
/// 0.02; the water's own surface is half a spacing above. Unmodified kernels would give 0.74.
fn shape(kernel: &Ellipsoid, field: &KernelField<'_>, factor: f64, thinnest: f64) -> Shape {
    let (inverse, turn) = eigen::symmetric(kernel.inverse);
    let longest = 1.0 / inverse.min_element();
    let mut axes = inverse
        .to_array()
        .map(|g| (factor / (g * g * longest)).max(thinnest));
    let short = inverse.max_position();
    if inverse.min_element() < ROUND * inverse[short] {
        let reach = reach(kernel.centre, turn.col(short), axes[short], field);
        axes[short] = reach.max(thinnest);
    }
    let stretch = turn * DMat3::from_diagonal(DVec3::from_array(axes)) * turn.transpose();
    let [x, y, z] = [stretch.x_axis, stretch.y_axis, stretch.z_axis];
    Shape {
        diagonal: [x.x, y.y, z.z].map(|v| v as f32),
        off: [y.z, x.z, x.y].map(|v| v as f32),
        ..Shape::default()
    }
}

/// Distance from `centre` along `axis` to the end of the field's water, on the side where it ends
/// sooner and at most `most`, metres: by linear interpolation between the values at both ends and
/// one Newton step.
fn reach(centre: DVec3, axis: DVec3, most: f64, field: &KernelField<'_>) -> f64 {
    let (inner, gradient) = field.value_and_gradient(centre);
    let outward = if gradient.dot(axis) > 0.0 {
        -axis
    } else {
        axis
    };
    let outer = field.value(centre + most * outward);
    if inner <= 0.0 || outer >= 0.0 {
        return most;
    }
    let guess = most * inner / (inner - outer);
    let (value, gradient) = field.value_and_gradient(centre + guess * outward);
    let slope = gradient.dot(outward);
    let step = if slope < 0.0 { -value / slope } else { 0.0 };
    (guess + step).clamp(0.0, most)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use super::*;
    use swell_domain::bounds::Bounds;

    const D: f64 = 0.1;

    fn of(places: &[DVec3]) -> Vec<Shape> {
        let particles: Vec<Particle> = places
            .iter()
            .map(|place| Particle {
                position: place.as_vec3().to_array(),
                tag: 1,
                ..Particle::default()
            })
            .collect();
        let scene = RenderScene {
            origin: DVec3::ZERO,
            domain: Bounds {
                min: DVec3::ZERO,
                max: DVec3::splat(4.0),
            },
            solids: Vec::new(),
            wet: None,
            parts: Vec::new(),
            particle_spacing: D,
            frames_per_second: 24.0,
            gravity: DVec3::ZERO,
            wave_makers: Vec::new(),
            moving: Vec::new(),
            waves: None,
        };
        shapes(&particles, particles.len(), &scene, RADIUS * D)
    }

    /// A lone particle is a sphere of its volume, one at a calm surface is flat in it, and one
    /// inside the water is round.
    #[test]
    fn shapes_follow_the_neighbours() {
        let lone = of(&[DVec3::splat(2.0)])[0];
        let radius = (3.0 / (4.0 * PI)).cbrt() * D;
        for half in lone.diagonal {
            assert!((f64::from(half) / radius - 1.0).abs() < 1e-6, "{lone:?}");
        }
        let at = |k: usize| DVec3::new((k % 20) as f64, (k / 20 % 10) as f64, (k / 200) as f64);
        let pool: Vec<DVec3> = (0..4000).map(|k| 1.0 + D * at(k)).collect();
        let shapes = of(&pool);
        let place = |y: usize| &shapes[10 + 20 * y + 200 * 10];
        let [top, middle] = [place(9), place(5)].map(|it| it.diagonal.map(|x| f64::from(x) / D));
        // 0.633² of 1.241 across the surface and 1.241 along it, calculated by hand from the
        // weights of a half-space lattice.
        assert!(
            (top[1] - 0.497).abs() < 0.01 && (top[0] - 1.24).abs() < 0.03,
            "{top:?}"
        );
        assert!(
            middle.iter().all(|half| (half - 1.24).abs() < 0.01),
            "{middle:?}"
        );
    }

    /// For the flat ellipsoids of an uneven pool, the lesser of the field's values at the two ends
    /// of the shortest axis, stretched by `factor`.
    fn ends(factor: f64) -> Vec<f64> {
        let mut seed = 7u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / 16_777_216.0 - 0.5
        };
        let mut place = |k: usize| {
            let at = DVec3::new((k % 16) as f64, (k / 16 % 8) as f64, (k / 128) as f64);
            1.0 + D * (at + 0.6 * DVec3::new(random(), random(), random()))
        };
        let pool: Vec<DVec3> = (0..2048).map(&mut place).collect();
        let kernels = Kernels::fit(&pool, DVec3::splat(4.0), D);
        let field = kernels.field();
        let end = |(place, shape): (&DVec3, Shape)| {
            let ([xx, yy, zz], [yz, xz, xy]) = (shape.diagonal, shape.off);
            let columns = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
            let [x, y, z] = columns.map(|column| DVec3::from(column.map(f64::from)));
            let (axes, turn) = eigen::symmetric(DMat3::from_cols(x, y, z));
            let short = axes.min_position();
            let way = factor * axes[short] * turn.col(short);
            let is_flat = axes[short] < 0.6 * axes.max_element();
            // The clamped least axis is not shortened further.
            let is_free = axes[short] > 1.001 * THINNEST * D;
            (is_flat && is_free).then(|| field.value(place + way).min(field.value(place - way)))
        };
        let found = pool.iter().zip(of(&pool)).filter_map(end);
        found.collect()
    }

    /// Splats do not protrude where particles do: two steps of iteration leave an error of 0.02 in
    /// the field, a hundredth of a spacing.
    #[test]
    fn no_splat_stands_out_of_the_field() {
        let out = |factor: f64| {
            let values = ends(factor);
            assert!(values.len() > 200, "{}", values.len());
            let out = values.iter().filter(|&&value| value < -0.02).count();
            out as f64 / values.len() as f64
        };
        assert!(out(1.0) < 0.01, "{}", out(1.0));
        // Control: axes longer by a tenth.
        assert!(out(1.1) > 0.2, "{}", out(1.1));
    }
}
