//! Sky and sun, and the light they cast on the scene.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use half::f16;
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};

use super::RenderError;
use swell_domain::parallel;
use swell_scene::look::{Look, SkySpec};

/// A latitude-longitude image of the sky, with integrals over it.
pub(super) struct Sky {
    pub(super) size: [u32; 2],
    /// Rows from the zenith down; alpha is 1.
    pub(super) texels: Vec<[f16; 4]>,
    /// Spherical-harmonics coefficients of the irradiance, in the order of `ssfr_light.wgsl`.
    pub(super) irradiance: [[f32; 4]; 9],
    /// Irradiance of the sun on a face perpendicular to it.
    pub(super) sun_irradiance: Vec3,
    /// Radiance over irradiance of the sun's disc, 1/sr; 0 where the image contains the disc.
    pub(super) disc: f32,
}

/// Sun elevation and turbidity that define the unit of light: white paint on level ground under
/// this sun and sky has radiance 1. Exposures are relative to that.
const REFERENCE_ELEVATION: f64 = PI / 4.0;
const REFERENCE_TURBIDITY: f64 = 3.0;
/// Fraction of the reference light that comes from the sky rather than the sun; clear-sky
/// measurements are between 0.15 and 0.2.
const REFERENCE_DIFFUSE: f64 = 0.18;
/// Solid angle of the sun, sr.
pub(super) const SUN_SOLID_ANGLE: f64 = 6.794e-5;

/// Solar illuminance constant: illuminance of sunlight outside the atmosphere, lux.
const SOLAR_ILLUMINANCE: f64 = 133e3;

/// Luminance, cd/m², of radiance 1 in all three channels, which white has under the reference sun
/// and sky: the solar illuminance, times the transmittance of the air, on a level face, plus the
/// sky's share; over π, because white paint is a Lambertian reflector.
pub(super) fn white_luminance() -> f64 {
    let through = luminance(transmittance(REFERENCE_ELEVATION, REFERENCE_TURBIDITY));
    let sun = SOLAR_ILLUMINANCE * through * REFERENCE_ELEVATION.sin();
    sun / (1.0 - REFERENCE_DIFFUSE) / PI
}

fn luminance(c: DVec3) -> f64 {
    c.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// Optical depths of the air from the ground to the zenith at a wavelength in micrometres, without
/// ozone: of molecules and of aerosols (Preetham, Shirley and Smits 1999, appendix A.1).
fn depths(micrometres: f64, turbidity: f64) -> [f64; 2] {
    let beta = 0.04608 * turbidity - 0.04586;
    let rayleigh = 0.008735 * micrometres.powf(-4.08);
    [rayleigh, beta * micrometres.powf(-1.3)]
}

/// Transmittance of the air for sunlight at 650, 550 and 450 nm, by Rayleigh scattering, aerosols
/// and ozone (Preetham, Shirley and Smits 1999, appendix A.1).
fn transmittance(elevation: f64, turbidity: f64) -> DVec3 {
    let zenith = PI / 2.0 - elevation;
    let mass = 1.0 / (zenith.cos() + 0.15 * (93.885 - zenith.to_degrees()).powf(-1.253));
    let at = |micrometres: f64, ozone: f64| {
        let [rayleigh, aerosol] = depths(micrometres, turbidity);
        (-(rayleigh + aerosol + 0.35 * ozone) * mass).exp()
    };
    DVec3::new(at(0.65, 0.062), at(0.55, 0.085), at(0.45, 0.003))
}

/// Rates at which the densities of molecules and aerosols decay with height, 1/m (Preetham, Shirley
/// and Smits 1999, section 4).
const DECAY: [f64; 2] = [0.1136e-3, 0.8333e-3];

/// Extinction of the air at the ground at 550 nm, 1/m: from the same optical depths as those of the
/// sunlight, in layers that decay with height by [`DECAY`].
pub(super) fn extinction(turbidity: f64) -> f64 {
    let layers = depths(0.55, turbidity).into_iter().zip(DECAY);
    layers.map(|(depth, decay)| depth * decay).sum()
}

fn state(elevation: f64, turbidity: f64, albedo: [f64; 3]) -> Result<SkyState, RenderError> {
    SkyState::new(&SkyParams {
        elevation: (elevation as f32).min(std::f32::consts::FRAC_PI_2),
        turbidity: turbidity as f32,
        albedo: albedo.map(|c| c as f32),
    })
    .map_err(|error| RenderError::Scene(error.to_string()))
}

fn radiance(state: &SkyState, direction: DVec3, sun: DVec3) -> DVec3 {
    let theta = direction.y.clamp(0.0, 1.0).acos() as f32;
    let gamma = direction.dot(sun).clamp(-1.0, 1.0).acos() as f32;
    DVec3::new(
        state.radiance(theta, gamma, Channel::R).max(0.0).into(),
        state.radiance(theta, gamma, Channel::G).max(0.0).into(),
        state.radiance(theta, gamma, Channel::B).max(0.0).into(),
    )
}

/// Direction of a texel's centre and its solid angle; matches `sky_radiance` in the shader.
fn texel(size: [u32; 2], x: u32, y: u32) -> (DVec3, f64) {
    let azimuth = ((f64::from(x) + 0.5) / f64::from(size[0]) - 0.5) * 2.0 * PI;
    let polar = (f64::from(y) + 0.5) / f64::from(size[1]) * PI;
    let (sin, cos) = polar.sin_cos();
    let direction = DVec3::new(sin * azimuth.cos(), cos, sin * azimuth.sin());
    let area = 2.0 * PI / f64::from(size[0]) * PI / f64::from(size[1]) * sin;
    (direction, area)
}

fn image(size: [u32; 2], colour: impl Fn(DVec3) -> DVec3 + Sync) -> Vec<DVec3> {
    let [width, height] = size.map(|side| side as usize);
    parallel::map(0..width * height, |k| {
        let (x, y) = ((k % width) as u32, (k / width) as u32);
        colour(texel(size, x, y).0)
    })
}

/// Irradiance on a level face from the upper hemisphere.
fn from_above(size: [u32; 2], texels: &[DVec3]) -> DVec3 {
    texels
        .iter()
        .zip(0u32..)
        .map(|(&colour, i)| {
            let (direction, area) = texel(size, i % size[0], i / size[0]);
            colour * direction.y.max(0.0) * area
        })
        .sum()
}

/// Spherical harmonics up to order 2, convolved with the cosine (Ramamoorthi and Hanrahan 2001).
fn harmonics(size: [u32; 2], texels: &[DVec3]) -> [[f32; 4]; 9] {
    let mut sums = [DVec3::ZERO; 9];
    for (&colour, i) in texels.iter().zip(0u32..) {
        let (d, area) = texel(size, i % size[0], i / size[0]);
        let basis = basis(d);
        for (sum, (value, _)) in sums.iter_mut().zip(basis) {
            *sum += colour * (value * area);
        }
    }
    let lobes = [
        PI,
        2.0 * PI / 3.0,
        2.0 * PI / 3.0,
        2.0 * PI / 3.0,
        PI / 4.0,
        PI / 4.0,
        PI / 4.0,
        PI / 4.0,
        PI / 4.0,
    ];
    let norms = basis(DVec3::Y).map(|(_, norm)| norm);
    std::array::from_fn(|i| {
        (sums[i] * (lobes[i] * norms[i]))
            .as_vec3()
            .extend(0.0)
            .to_array()
    })
}

/// Values of the nine basis functions, and the constant factor of each.
fn basis(d: DVec3) -> [(f64, f64); 9] {
    const C: [f64; 5] = [0.282_095, 0.488_603, 1.092_548, 0.315_392, 0.546_274];
    [
        (C[0], C[0]),
        (C[1] * d.y, C[1]),
        (C[1] * d.z, C[1]),
        (C[1] * d.x, C[1]),
        (C[2] * d.x * d.y, C[2]),
        (C[2] * d.y * d.z, C[2]),
        (C[3] * (3.0 * d.z * d.z - 1.0), C[3]),
        (C[2] * d.x * d.z, C[2]),
        (C[4] * (d.x * d.x - d.y * d.y), C[4]),
    ]
}

impl Sky {
    /// Bakes the look's sky; `limit` is the largest texture width.
    pub(super) fn new(look: &Look, limit: u32) -> Result<Self, RenderError> {
        let spec = look.spec();
        let sun = look.sun_direction();
        let elevation = spec.sun.elevation_degrees.to_radians();
        let reference = state(REFERENCE_ELEVATION, REFERENCE_TURBIDITY, [0.15; 3])?;
        let reference_sun = DVec3::new(REFERENCE_ELEVATION.cos(), REFERENCE_ELEVATION.sin(), 0.0);
        let coarse = [128, 64];
        let diffuse = luminance(from_above(
            coarse,
            &image(coarse, |d| radiance(&reference, d, reference_sun)),
        ));
        let unit = REFERENCE_DIFFUSE * PI / diffuse;
        let outside_air = (1.0 - REFERENCE_DIFFUSE) * PI
            / REFERENCE_ELEVATION.sin()
            / luminance(transmittance(REFERENCE_ELEVATION, REFERENCE_TURBIDITY));

        let turbidity = match &spec.sky {
            SkySpec::HosekWilkie { turbidity, .. } => *turbidity,
            SkySpec::Panorama { .. } => REFERENCE_TURBIDITY,
        };
        let sun_irradiance =
            transmittance(elevation, turbidity) * (outside_air * spec.sun.intensity);
        let (size, texels, disc) = match &spec.sky {
            SkySpec::HosekWilkie {
                turbidity, albedo, ..
            } => {
                let size = [512, 256];
                let state = state(elevation, *turbidity, *albedo)?;
                let mut texels = image(size, |d| {
                    radiance(&state, DVec3::new(d.x, d.y.max(0.0), d.z), sun) * unit
                });
                // Below the horizon is the ground, lit by the sky and the sun.
                let light = from_above(size, &texels) + sun_irradiance * sun.y;
                let ground = light * DVec3::from(spec.ground.colour) / PI;
                let below = texels.len() / 2;
                texels[below..].fill(ground);
                // The row just below the horizon repeats the sky's, because distant ground fades
                // into the air; without it, interpolation would mix ground into the horizon.
                let row = size[0] as usize;
                texels.copy_within(below - row..below, below);
                (size, texels, 1.0 / SUN_SOLID_ANGLE)
            }
            SkySpec::Panorama {
                rotate_degrees,
                intensity,
                ..
            } => {
                let bytes = look.panorama().unwrap_or_default();
                let (size, texels) = panorama(bytes, limit, *rotate_degrees, *intensity)?;
                (size, texels, 0.0)
            }
        };
        Ok(Self {
            size,
            irradiance: harmonics(size, &texels),
            sun_irradiance: sun_irradiance.as_vec3(),
            texels: texels
                .iter()
                .map(|c| {
                    let c = c.clamp(DVec3::ZERO, DVec3::splat(65000.0));
                    [c.x, c.y, c.z, 1.0].map(f16::from_f64)
                })
                .collect(),
            disc: disc as f32,
        })
    }
}

fn panorama(
    bytes: &[u8],
    limit: u32,
    rotate_degrees: f64,
    intensity: f64,
) -> Result<([u32; 2], Vec<DVec3>), RenderError> {
    use exr::prelude::{ReadChannels, ReadLayers, read};

    let fault = |message: String| RenderError::Panorama(message);
    let loaded = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size: exr::math::Vec2<usize>, _: &_| (size.0, vec![DVec3::ZERO; size.0 * size.1]),
            |(width, texels): &mut (usize, Vec<DVec3>),
             at: exr::math::Vec2<usize>,
             (r, g, b): (f32, f32, f32)| {
                texels[at.1 * *width + at.0] = DVec3::new(r.into(), g.into(), b.into());
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(std::io::Cursor::new(bytes))
        .map_err(|error| fault(error.to_string()))?;
    let layer = loaded.layer_data;
    let (mut width, mut texels) = layer.channel_data.pixels;
    let mut height = layer.size.1;
    if height < 2 || width != 2 * height {
        return Err(fault(format!(
            "is {width} × {height} pixels; a latitude-longitude picture is twice as wide as \
             high, and at least 4 × 2"
        )));
    }
    if texels.iter().any(|c| !c.is_finite()) {
        return Err(fault("holds a value that is not finite".to_owned()));
    }
    while width.max(height) > limit as usize {
        let (w, h) = (width / 2, height / 2);
        texels = parallel::map(0..w * h, |i| {
            let at = 2 * (i / w) * width + 2 * (i % w);
            (texels[at] + texels[at + 1] + texels[at + width] + texels[at + width + 1]) * 0.25
        });
        (width, height) = (w, h);
    }
    let shift = (rotate_degrees / 360.0 * width as f64).round() as i64;
    let turned = (0..width * height)
        .map(|i| {
            let x = (i % width) as i64 - shift;
            texels[i / width * width + x.rem_euclid(width as i64) as usize] * intensity
        })
        .collect();
    Ok(([width as u32, height as u32], turned))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use std::path::Path;

    use super::*;
    use swell_files::parse_look;

    fn look(extra: &str) -> Look {
        let text = format!(
            "[camera]\nfocal_length_mm = 35.0\nposition = [0, 1, 0]\ntarget = [1, 1, 0]\n{extra}"
        );
        parse_look(&text, Path::new("look.toml")).unwrap()
    }

    #[test]
    fn a_uniform_sky_gives_pi_times_its_radiance_in_every_direction() {
        let size = [64, 32];
        let coefficients = harmonics(size, &vec![DVec3::ONE; 64 * 32]);
        // The quadrature error at 32 rows is (π/64)²/6 ≈ 4e-4 of π.
        assert!((f64::from(coefficients[0][0]) - PI).abs() < 3e-3);
        assert!(coefficients[1..].iter().all(|c| c[0].abs() < 3e-3));
    }

    #[test]
    fn a_low_sun_is_redder_and_dimmer() {
        let sky = |degrees: f64| {
            let text = format!(
                "[sun]\nelevation_degrees = {degrees:.1}\n[sky]\nmodel = \"hosek_wilkie\"\n"
            );
            Sky::new(&look(&text), 8192).unwrap()
        };
        let (high, low) = (sky(45.0), sky(4.0));
        assert!(low.sun_irradiance.x < high.sun_irradiance.x);
        let ratio = |c: Vec3| c.z / c.x;
        assert!(ratio(low.sun_irradiance) < 0.3 * ratio(high.sun_irradiance));
        // The unit of light: white on level ground under the reference sky has radiance 1.
        let up = |c: &[[f32; 4]; 9]| {
            DVec3::from_array([0, 1, 2].map(|i| f64::from(c[0][i] + c[1][i] - c[6][i] - c[8][i])))
        };
        let total = luminance(up(&high.irradiance))
            + luminance(high.sun_irradiance.as_dvec3()) * REFERENCE_ELEVATION.sin();
        assert!((total / PI - 1.0).abs() < 0.05, "{total}");
    }

    #[test]
    fn white_is_as_bright_as_daylight() {
        // Clear sky of the Illuminating Engineering Society (Handbook, 9th edition, chapter 8): on
        // a level face, 127.5 klx exp(−0.21 / sin h) from the sun and 0.8 + 15.5 √sin h klx from
        // the sky. It describes air clearer than turbidity 3.
        let sin = REFERENCE_ELEVATION.sin();
        let clear = 127.5e3 * (-0.21 / sin).exp() * sin + 800.0 + 15_500.0 * sin.sqrt();
        let part = white_luminance() * PI / clear;
        assert!((0.8..1.0).contains(&part), "{part}");
        // Control: illuminance on a face towards the sun.
        assert!(!(0.8..1.0).contains(&(part / sin)), "{}", part / sin);
    }

    #[test]
    fn a_panorama_is_read_turned_and_shrunk() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("sky.exr");
        exr::prelude::write_rgb_file(&file, 16, 8, |x, _| {
            (if x < 4 { 4.0f32 } else { 0.0 }, 1.0f32, 2.0f32)
        })
        .unwrap();
        let bytes = std::fs::read(&file).unwrap();
        let (size, texels) = panorama(&bytes, 8, 90.0, 2.0).unwrap();
        assert_eq!(size, [8, 4]);
        // Columns 0 and 1 of 8 are bright; a quarter turn moves them to 2 and 3.
        let reds: Vec<f64> = texels[..8].iter().map(|c| c.x).collect();
        assert_eq!(reds, [0.0, 0.0, 8.0, 8.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(panorama(b"not an EXR", 8, 0.0, 1.0).is_err());
    }

    #[test]
    fn air_is_as_clear_as_its_turbidity() {
        // Rayleigh extinction at sea level at 550 nm, 1/m, from Bucholtz 1995, table 2. The fits of
        // both models are accurate to some percent.
        let molecules = 1.149e-5;
        assert!(
            (extinction(1.0) / molecules - 1.0).abs() < 0.05,
            "{}",
            extinction(1.0)
        );
        // A contrast of 2 % remains after 3.912 extinction lengths (Koschmieder 1924). In the
        // international visibility code, a clear day has a visibility of 10 to 50 km, and light
        // haze one of 4 to 10 km (McCartney 1976).
        let seen_km = |turbidity| 3.912e-3 / extinction(turbidity);
        assert!((10.0..50.0).contains(&seen_km(3.0)), "{}", seen_km(3.0));
        assert!((4.0..10.0).contains(&seen_km(10.0)), "{}", seen_km(10.0));
        // Control: without aerosols a hazy day is as clear as any.
        assert!(3.912e-3 / molecules > 300.0);
    }
}
