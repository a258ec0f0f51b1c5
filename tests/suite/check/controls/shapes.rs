//! A solid whose shape changes, and faults in what only that runs.

use glam::DVec3;
use swell::{
    domain::{
        boundary::Shape,
        mesh::TriangleMesh,
        motion::Motion,
        shape::{ShapeField, ShapeSequence},
    },
    scene::{Scene, mesh_sequence::MeshSequence},
    stage::prepare::Start,
};

use super::{Control, control, variants::touch};
use crate::support::{D, box_mesh, mover};

/// A box that swells and leans.
fn meshes() -> Vec<TriangleMesh> {
    let bounds = swell::domain::bounds::Bounds {
        min: DVec3::new(0.33, 0.37, 0.21),
        max: DVec3::new(0.81, 0.78, 0.63),
    };
    let middle = 0.5 * (bounds.min + bounds.max);
    let first = box_mesh(bounds);
    let mut second = first.clone();
    for x in &mut second.vertices {
        *x = middle + 1.2 * (*x - middle);
        x.x += 0.3 * (x.y - middle.y);
    }
    vec![first, second]
}

/// The box in the water, with particles around it, some of which it meets.
pub fn shape(scene: &mut Scene, start: &mut Start) {
    let meshes = meshes();
    let mut solid = mover(meshes[0].bounds().unwrap(), DVec3::X, Motion::Still);
    let room = meshes[0].bounds().unwrap().grown(0.01);
    let shape = ShapeSequence::new(meshes, 0.0, 20.0);
    let field = ShapeField::new(&shape, 4.0 * D, D, None).unwrap();
    solid.slide = None;
    solid.sequence = Some(MeshSequence {
        shape,
        files: Vec::new(),
        first: 0,
        start: None,
        faults: Vec::new(),
    });
    scene.moving_solids.push(solid);
    start.boundary.moving.push(field.at(0.0));
    let samples = None;
    start.boundary.shapes = vec![Some(Shape { field, samples })];
    let all = &start.particles.position;
    let keep: Vec<bool> = (all.iter())
        .map(|x| !room.contains(DVec3::from_array(x.map(f64::from))))
        .collect();
    start.particles.retain(&keep);
    touch(&mut start.particles, &room.grown(-0.01));
    start.particles.id = (0..start.particles.len() as u32).collect();
}

pub const SHAPES: &[Control] = &[
    control(
        "flip/cut_cells",
        "return rigid + shape_velocity_at(x);",
        "return rigid + 1.1 * shape_velocity_at(x);",
        "flip/cut_cells",
        &["flux of solids", "velocity of closed faces"],
    ),
    control(
        "flip/cut_cells",
        "let start = solid_distance[place];",
        "let start = solid_distance[place + 1u];",
        "flip/cut_cells",
        &["open fraction", "open volume"],
    ),
    control(
        "flip/cut_cells",
        "let first = solid_grid.first + 2u * nodes;",
        "let first = solid_grid.first + 2u * nodes + 1u;",
        "flip/cut_cells",
        &["flux of solids", "velocity of closed faces"],
    ),
    control(
        "flip/advect",
        "start + solid_share * (",
        "start + 0.9 * solid_share * (",
        "flip/advect",
        &["position"],
    ),
    control(
        "flip/advect",
        "return rigid + shape_velocity_at(x);",
        "return rigid - shape_velocity_at(x);",
        "flip/advect",
        &["velocity"],
    ),
];
