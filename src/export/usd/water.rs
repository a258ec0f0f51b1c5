//! The water of a shot as prims: points or a mesh.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{
    extent,
    look::Bindings,
    text::{self, Text, name, quoted},
};
use swell_domain::{particles::Particles, water_mesh::WaterMesh};

/// Representation of a shot's water.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WaterRepresentation {
    /// Points.
    Points {
        /// Diameter of each point, metres; if `None`, the attribute `radius` holds half of it.
        width: Option<f64>,
    },
    /// A mesh.
    Mesh,
}

/// A prim of a shot's water, as the root declares it.
#[derive(Clone, Debug)]
pub struct WaterPrim<'a> {
    /// Name of the prim: `water`, `whitewater`, or a stream's name.
    pub name: &'a str,
    /// Representation.
    pub kind: WaterRepresentation,
    /// Names of the attributes of the particles, or of the mesh's vertices.
    pub attributes: Vec<String>,
    /// Index of its material among those of the look.
    pub material: Option<usize>,
}

/// Content of such a prim in a frame.
#[derive(Clone, Copy, Debug)]
pub enum WaterFrame<'a> {
    /// Points, relative to the scene's origin.
    Points(&'a Particles),
    /// A mesh, and the position of its origin relative to the scene's, metres.
    Mesh(&'a WaterMesh, DVec3),
}

/// A prim of a shot's water in the layer of a frame.
#[derive(Clone, Copy, Debug)]
pub struct WaterLayer<'a> {
    /// Name of the prim.
    pub name: &'a str,
    /// Representation.
    pub kind: WaterRepresentation,
    /// Content.
    pub content: WaterFrame<'a>,
}

impl WaterPrim<'_> {
    /// Writes its attributes without values.
    pub(super) fn put_manifest(&self, text: &mut Text) {
        text.open(&format!("over {}", quoted(&name(self.name))));
        for it in sampled(self.kind, &self.attributes) {
            text.line(&format!("{} {}", it.kind, it.name));
        }
        text.close();
    }

    /// Writes the prim, whose values at frames are in the layers.
    pub(super) fn put_root(&self, text: &mut Text, bindings: &Bindings) {
        bindings.open(text, &prim(self.name, self.kind), self.material);
        for it in sampled(self.kind, &self.attributes) {
            text.line(&format!(
                "{} {}{}",
                it.kind,
                it.name,
                in_parentheses(it.metadata)
            ));
        }
        put_constants(text, self.kind);
        text.close();
    }
}

impl WaterLayer<'_> {
    /// Writes the prim with its values at the frame `at`.
    pub(super) fn put(&self, text: &mut Text, at: u32) {
        text.open(&prim(self.name, self.kind));
        match self.content {
            WaterFrame::Points(particles) => put_points(text, self.kind, at, particles),
            WaterFrame::Mesh(mesh, corner) => put_water_mesh(text, at, mesh, corner),
        }
        put_constants(text, self.kind);
        text.close();
    }
}

/// First line of a prim.
fn prim(prim: &str, kind: WaterRepresentation) -> String {
    format!("def {} {}", schema(kind), quoted(&name(prim)))
}

/// An attribute of the water with one value per frame.
struct Sampled {
    kind: &'static str,
    name: String,
    /// Metadata in parentheses after the value; empty for none.
    metadata: &'static str,
}

/// Attributes of the water in the frames' layers.
fn sampled(kind: WaterRepresentation, attributes: &[String]) -> Vec<Sampled> {
    let of = |kind, name: &str, metadata| Sampled {
        kind,
        name: name.to_owned(),
        metadata,
    };
    let mut all = vec![of("float3[]", "extent", "")];
    match kind {
        WaterRepresentation::Points { width } => {
            if width.is_none() {
                all.push(of("float[]", "widths", "interpolation = \"vertex\""));
            }
            all.push(of("int64[]", "ids", ""));
            all.push(of("point3f[]", "points", ""));
            all.push(of("vector3f[]", "velocities", ""));
        }
        WaterRepresentation::Mesh => {
            all.push(of("int[]", "faceVertexCounts", ""));
            all.push(of("int[]", "faceVertexIndices", ""));
            all.push(of("normal3f[]", "normals", "interpolation = \"vertex\""));
            all.push(of("point3f[]", "points", ""));
            all.push(of("vector3f[]", "velocities", ""));
        }
    }
    let own = attributes.iter().map(|it| format!("primvars:{}", name(it)));
    all.extend(own.map(|it| of("float[]", &it, "interpolation = \"vertex\"")));
    all
}

/// Writes the attributes of the water that are the same in all frames.
fn put_constants(text: &mut Text, kind: WaterRepresentation) {
    match kind {
        WaterRepresentation::Points { width: Some(width) } => {
            text.line(&format!("float[] widths = [{}] (", width as f32));
            text.line("    interpolation = \"constant\"");
            text.line(")");
        }
        WaterRepresentation::Points { width: None } => {}
        WaterRepresentation::Mesh => text.line("uniform token subdivisionScheme = \"none\""),
    }
}

fn schema(kind: WaterRepresentation) -> &'static str {
    match kind {
        WaterRepresentation::Points { .. } => "Points",
        WaterRepresentation::Mesh => "Mesh",
    }
}

fn in_parentheses(metadata: &str) -> String {
    match metadata {
        "" => String::new(),
        some => format!(" ({some})"),
    }
}

fn put_points(text: &mut Text, kind: WaterRepresentation, at: u32, particles: &Particles) {
    let own = match kind {
        WaterRepresentation::Points { width: None } => particles.attributes.get("radius"),
        _ => None,
    };
    let margin = match (kind, own) {
        (_, Some(radii)) => f64::from(radii.iter().copied().fold(0.0, f32::max)),
        (WaterRepresentation::Points { width }, None) => 0.5 * width.unwrap_or(0.0),
        (WaterRepresentation::Mesh, None) => 0.0,
    };
    let extent = extent(&particles.position, margin);
    text.samples("float3[] extent", &[(at, extent)]);
    if let Some(radii) = own {
        text.line("float[] widths (interpolation = \"vertex\")");
        text.sampled_array("float[] widths", at, radii, |radius| {
            (2.0 * radius).to_string()
        });
    }
    text.sampled_array("int64[] ids", at, &particles.id, u32::to_string);
    text.sampled_array("point3f[] points", at, &particles.position, text::floats);
    text.sampled_array(
        "vector3f[] velocities",
        at,
        &particles.velocity,
        text::floats,
    );
    put_primvars(text, at, &particles.attributes);
}

fn put_primvars(text: &mut Text, at: u32, attributes: &BTreeMap<String, Vec<f32>>) {
    for (attribute, values) in attributes {
        let label = format!("primvars:{}", name(attribute));
        text.line(&format!("float[] {label} (interpolation = \"vertex\")"));
        text.sampled_array(&format!("float[] {label}"), at, values, f32::to_string);
    }
}

fn put_water_mesh(text: &mut Text, at: u32, water: &WaterMesh, corner: DVec3) {
    let place = |p: &DVec3| (*p + corner).as_vec3().to_array();
    let points: Vec<[f32; 3]> = water.mesh.vertices.iter().map(place).collect();
    text.samples("float3[] extent", &[(at, extent(&points, 0.0))]);
    let triangles = &water.mesh.triangles;
    text.sampled_array(
        "int[] faceVertexCounts",
        at,
        &vec![3; triangles.len()],
        |x| x.to_string(),
    );
    text.sampled_array(
        "int[] faceVertexIndices",
        at,
        triangles.as_flattened(),
        u32::to_string,
    );
    text.line("normal3f[] normals (interpolation = \"vertex\")");
    text.sampled_array("normal3f[] normals", at, &water.normals, text::floats);
    text.sampled_array("point3f[] points", at, &points, text::floats);
    text.sampled_array("vector3f[] velocities", at, &water.velocities, text::floats);
    put_primvars(text, at, &water.attributes);
}
