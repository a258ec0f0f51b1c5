//! Refraction through thin sheets of water, of which splats know no far side.

use glam::DVec2;
use swell::domain::particles::Particles;
use swell::gpu::adapter::Context;
use swell::render::Image;

use super::support::{Eye, RAMP_ERROR, Setup, context, draw, ramp_sky, scene, sky_place, spoiled};
use super::water::INDEX;

/// Balls at one position, each of which represents a thousandth of its volume: a lens of 0.08 of a
/// ball's thickness, 30 m away.
const BALLS: u32 = 80;
const PART: f64 = 1e-3;
const AWAY: f64 = 30.0;

fn eye() -> Eye {
    Eye {
        size: 128,
        ..Eye::new([5.0, 2.0, 1.0], [5.0, 6.0, 8.0], 1920.0)
    }
}

fn picture(context: &Context) -> Image {
    let eye = eye();
    let setup = Setup {
        surface: "smoothing_width_m = 0.0\nradius_m = 1.0\nsplat = \"sphere\"\n".to_owned(),
        water: "absorption_per_metre = [0.0, 0.0, 0.0]\n".to_owned(),
        output: "lights = [\"refraction\"]\n".to_owned(),
        ..Setup::new(eye)
    };
    let middle = (eye.position + AWAY * eye.forward()).as_vec3().to_array();
    let water = Particles {
        position: vec![middle; BALLS as usize],
        velocity: vec![[0.0; 3]; BALLS as usize],
        id: (0..BALLS).collect(),
        ..Particles::default()
    };
    draw(context, &setup, &ramp_sky, &scene(1.0, PART), &water, 1)
}

/// Angle by which a prism of angle `angle` deflects light that passes it symmetrically, by Snell's
/// law at both faces; both in radians.
fn turned(angle: f64) -> f64 {
    2.0 * (INDEX * (0.5 * angle).sin()).asin() - angle
}

/// For each pixel away from the middle of the lens: the distance of the sky that it shows from
/// where Snell's law puts it, and the deflection of light there, both in pixels.
fn errors(image: &Image) -> Vec<[f64; 2]> {
    let eye = eye();
    let (_, seen) = &image.lights[0];
    let mut errors = Vec::new();
    for (i, light) in seen.iter().enumerate() {
        let along = eye.direction(i);
        let place = eye.place(along);
        let far = place.length();
        let distance = (AWAY * eye.forward()).cross(along).length();
        // Towards the rim a sheet of balls is not a thin prism; in the middle it does not deflect.
        if !(0.15..0.65).contains(&distance) {
            continue;
        }
        let slope = f64::from(BALLS) * PART * 2.0 * distance / (1.0 - distance * distance).sqrt();
        let turn = turned(slope.atan());
        // Towards the thick middle.
        let angle = (far / eye.focal).atan() - turn;
        let expected = place / far * eye.focal * angle.tan();
        let [u, v] = [0, 1].map(|c| f64::from(light[c] / light[2]));
        // Position in the picture where the sky has that colour: Newton's method from the expected
        // position.
        let mut found = expected;
        for _ in 0..4 {
            let at = |p: DVec2| {
                let [right, up, forward] = eye.axes();
                sky_place(forward * eye.focal + right * p.x + up * p.y)
            };
            let off = DVec2::new(u, v) - at(found);
            let across = at(found + DVec2::X) - at(found);
            let rise = at(found + DVec2::Y) - at(found);
            let area = across.perp_dot(rise);
            found += DVec2::new(off.perp_dot(rise), across.perp_dot(off)) / area;
        }
        errors.push([(found - expected).length(), turn * eye.focal]);
    }
    errors
}

/// Relative to the deflection: 1/30 because metres are measured at the near side of the balls, 1/29
/// because the prism is not thin, and the mean over two spacings of a slope that varies.
const OFF: f64 = 0.1;

#[test]
fn a_sheet_turns_light_as_a_prism() {
    // A turn of the sky is so many pixels, and a lookup is per whole pixel.
    let ramp = eye().focal * std::f64::consts::TAU * RAMP_ERROR + 1.0;
    let share = |context: &Context| {
        let errors = errors(&picture(context));
        assert!(errors.len() > 3000, "{}", errors.len());
        let most = errors.iter().fold(0.0f64, |most, it| most.max(it[1]));
        assert!(most > 60.0, "{most}");
        let wrong = errors.iter().filter(|[off, turn]| *off > OFF * turn + ramp);
        wrong.count() as f64 / errors.len() as f64
    };
    assert_eq!(share(&context()), 0.0);
    // Controls: straight on, the opposite direction, 25 % more.
    for to in ["0.5 + 0.0 * slope", "0.5 - slope", "0.5 + 1.25 * slope"] {
        let wrong = share(&spoiled("ssfr/shade", "0.5 + slope", to));
        assert!(wrong > 0.5, "{to}: {wrong}");
    }
}
