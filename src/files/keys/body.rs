//! Keys of floating bodies.

use super::{
    super::declare::keys,
    scene::{COORDINATE, ScaleSpec, VECTOR, blake3, rotate, scale, translate},
};

/// Names of a body's degrees of freedom: along the axes of the scene, then about them.
pub(crate) const DEGREES: [&str; 6] = ["x", "y", "z", "turn_x", "turn_y", "turn_z"];

keys! { struct BodySpec {
    mesh: String = text(
        "a closed .obj, .ply or .stl, or a level set in a .vdb, within the domain, \
         relative to the scene file",
    )
    .by_hash()
    .about("the mesh"),
    blake3: Option<String> = blake3,
    translate: [f64; 3] = translate,
    rotate_degrees: [f64; 3] = rotate,
    scale: ScaleSpec = scale,
    density: Option<f64> = number(1e-3..=1e6)
        .unit("kg/m³")
        .absent()
        .without(&["mass"])
        .about("of the body on average, where its mass is not given"),
    mass: Option<f64> = number(1e-9..=1e12)
        .unit("kg")
        .absent()
        .about("of the body"),
    centre: Option<[f64; 3]> = vector(3, COORDINATE)
        .unit("metres")
        .computed(|| "that of the mesh".to_owned())
        .about("centre of mass at the start"),
    inertia: Option<[f64; 3]> = vector(3, 1e-12..=1e15)
        .unit("kg m²")
        .computed(|| "that of the mesh filled evenly".to_owned())
        .also(", none above the sum of the others")
        .about("moments of inertia about the scene's axes through the centre of mass"),
    velocity: [f64; 3] = vector(3, VECTOR)
        .unit("m/s")
        .default("[0.0, 0.0, 0.0]")
        .about("of the centre of mass at the start"),
    spin: [f64; 3] = vector(3, VECTOR)
        .unit("degrees/s")
        .default("[0.0, 0.0, 0.0]")
        .about("angular velocity at the start, about the scene's axes"),
    free: Option<Vec<String>> = choices(&DEGREES)
        .computed(|| "all".to_owned())
        .without(&["hinge"])
        .also(", each once, at least one")
        .about("axes of the scene along which it moves and about which it turns"),
    hinge: Option<HingeSpec> = inline()
        .absent()
        .about("An axis that stands still, about which it turns"),
    #[serde(default)]
    mooring: Vec<MooringSpec> = tables().about("Springs that hold it"),
    collides: bool = flag()
        .default("true")
        .about("whether it meets walls, solids and other bodies; else it passes through them"),
} }

keys! { struct HingeSpec {
    at: [f64; 3] = vector(3, COORDINATE)
        .unit("metres")
        .about("a point on the axis"),
    axis: [f64; 3] = vector(3, -1e6..=1e6)
        .also(", not all 0; their length does not count")
        .about("direction of the axis"),
} }

keys! { struct MooringSpec {
    anchor: [f64; 3] = vector(3, COORDINATE)
        .unit("metres")
        .about("where it is fixed"),
    at: [f64; 3] = vector(3, COORDINATE)
        .unit("metres")
        .about("where it holds the body, at the start"),
    length: f64 = number(0.0..=1e6)
        .unit("metres")
        .about("at which it begins to pull; it never pushes"),
    stiffness: f64 = number(1e-6..=1e12)
        .unit("N/m")
        .about("pull per metre of stretch"),
    damping: f64 = number(0.0..=1e12)
        .unit("N s/m")
        .default("0.0")
        .about("pull per m/s of stretching, while it is taut"),
} }
