//! Reflections in water of solids behind spray.

use glam::DVec3;
use swell::domain::bounds::Bounds;
use swell::domain::whitewater::RADIUS as SIZE;
use swell::gpu::adapter::Context;
use swell::render::{FrameInputs, RenderScene, WaterParticles};

use super::geometry::box_mesh;
use super::support::{ball, context, draw_inputs, scene, spoiled, uniform_sky};
use super::water::{BLACK, INDEX, RADIUS, eye_at, meetings, setup_at};

const LEVEL: f64 = 2.0;
/// The near side of a black wall, m, and a cloud that touches it.
const WALL: f64 = 7.0;
const CLOUD: DVec3 = DVec3::new(WALL - 0.4, LEVEL + 0.8, 5.0);
const CLOUD_RADIUS: f64 = 0.4;

/// Mean reflection in black water of a cloud in front of a black wall under a white sky, where the
/// cloud is visible, and of the wall beside it.
fn mirrored(context: &Context) -> [f64; 2] {
    let mut setup = setup_at(70.0, LEVEL, BLACK.to_owned());
    setup.eye = eye_at(70.0, LEVEL, 256.0);
    setup.solids = [0.0; 3];
    setup.water += "[whitewater]\ndensity_per_metre = 40.0\n";
    let wall = Bounds {
        min: DVec3::new(WALL, 0.0, -5.0),
        max: DVec3::new(WALL + 1.0, 9.0, 15.0),
    };
    let scene = RenderScene {
        solids: vec![box_mesh(wall)],
        // The ray march after the reflection has steps of one spacing.
        particle_spacing: 0.1,
        ..scene(RADIUS, 1.0)
    };
    let mut white = ball(CLOUD, DVec3::ZERO);
    let radius = vec![CLOUD_RADIUS as f32];
    white.attributes.insert(SIZE.to_owned(), radius);
    let water = WaterParticles::new(ball(DVec3::new(5.0, LEVEL - RADIUS, 5.0), DVec3::ZERO));
    let inputs = FrameInputs::alone(&water, &white);
    let image = draw_inputs(context, &setup, &uniform_sky, &scene, &inputs, 1).unwrap();
    let [mut cloud, mut bare] = [const { Vec::new() }; 2];
    for (i, at) in meetings(&image, &setup.eye).iter().enumerate() {
        let is_water = (at.position.y - LEVEL).abs() < 0.1 && at.position.x < CLOUD.x - 0.5;
        if !is_water || at.along.y >= 0.0 {
            continue;
        }
        let way = at.reflected();
        let off = (CLOUD - at.position).cross(way).length();
        let on_wall = at.position + way * ((WALL - at.position.x) / way.x);
        let found = f64::from(image.beauty[i][1]) / at.reflectance(INDEX);
        // The inner half of the cloud: the picture shows it slightly offset from where the
        // reflected ray passes it.
        if off < 0.5 * CLOUD_RADIUS {
            cloud.push(found);
        } else if off > 2.0 * CLOUD_RADIUS && on_wall.y < 8.0 {
            bare.push(found);
        }
    }
    [cloud, bare].map(|values| {
        assert!(values.len() >= 4, "{}", values.len());
        values.iter().sum::<f64>() / values.len() as f64
    })
}

/// Spray without absorption returns up to 1 under a white sky and the wall 0: the reflection shows
/// whichever is in front.
#[test]
fn what_spray_hides_is_not_mirrored() {
    let [cloud, bare] = mirrored(&context());
    assert!(cloud > 0.5 && bare < 0.5, "{cloud} {bare}");
    // The reflection shows no spray brighter than the sky around it.
    assert!(cloud < 1.01, "{cloud}");
    let bright = spoiled(
        "ssfr/shade",
        "spray_radiance(-met.way",
        "2.0 * spray_radiance(-met.way",
    );
    let [cloud, _] = mirrored(&bright);
    assert!(cloud > 1.01, "the control: {cloud}");
    let spoiled = spoiled("ssfr/shade", "mist.depth > nearest", "mist.depth < nearest");
    let [cloud, _] = mirrored(&spoiled);
    assert!(cloud < 0.5, "the control: {cloud}");
}
