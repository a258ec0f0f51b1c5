//! Solids of a shot: their meshes and motion, and how wet they are.

use glam::{DQuat, DVec3};

use super::{
    extent,
    look::{Bindings, Paint},
    text::{self, Text, quoted, unique},
};
use swell_domain::{mesh::TriangleMesh, pose::Pose};

/// Attribute of the vertices of a wet solid.
const WETNESS: &str = "float[] primvars:wetness";

/// A solid of the scene.
#[derive(Clone, Debug)]
pub struct Solid {
    /// Name, which is made valid and unique if necessary.
    pub name: String,
    /// Mesh in metres, relative to the scene's origin.
    pub mesh: TriangleMesh,
    /// Pose at each frame; empty for a static solid.
    pub way: Vec<(u32, Pose)>,
    /// Mesh at each frame, for a solid whose shape changes.
    pub shapes: Vec<(u32, TriangleMesh)>,
    /// Whether the frames' layers have the wetness of its vertices.
    pub is_wet: bool,
    /// Materials of its triangles; `None` in a shot without a look.
    pub paint: Option<Paint>,
}

/// Returns valid names for prims of solids with these names, each once.
pub fn solid_names<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    unique(names)
}

/// Writes into the manifest of the clips which solids have wetness.
pub(super) fn declare_wetness(text: &mut Text, solids: &[Solid]) {
    if solids.iter().all(|solid| !solid.is_wet) {
        return;
    }
    text.open("over \"solids\"");
    let names = solid_names(solids.iter().map(|solid| &*solid.name));
    for (_, name) in solids.iter().zip(names).filter(|(solid, _)| solid.is_wet) {
        text.open(&format!("over {}", quoted(&name)));
        text.line(WETNESS);
        text.close();
    }
    text.close();
}

/// Writes the wetness of solids, by their names, into the layer of a frame.
pub(super) fn put_wetness(text: &mut Text, frame: u32, wetness: &[(String, &[f32])]) {
    if wetness.is_empty() {
        return;
    }
    text.open("over \"solids\"");
    for (name, values) in wetness {
        text.open(&format!("over {}", quoted(name)));
        text.line(&format!("{WETNESS} (interpolation = \"vertex\")"));
        text.sampled_array(WETNESS, frame, values, f32::to_string);
        text.close();
    }
    text.close();
}

/// Writes the solids of a root layer.
pub(super) fn put_solids(text: &mut Text, solids: &[Solid], bindings: &Bindings) {
    if solids.is_empty() {
        return;
    }
    text.open("def Xform \"solids\"");
    let names = solid_names(solids.iter().map(|solid| &*solid.name));
    for (solid, single) in solids.iter().zip(names) {
        let prim = format!("def Mesh {}", quoted(&single));
        bindings.open_painted(text, &prim, solid.paint.as_ref());
        match solid.shapes.is_empty() {
            true => put_mesh(text, &solid.mesh.vertices, &solid.mesh.triangles),
            false => put_shapes(text, &solid.shapes),
        }
        put_way(text, &solid.way);
        if solid.is_wet {
            text.line(&format!("{WETNESS} (interpolation = \"vertex\")"));
        }
        text.close();
    }
    text.close();
}

/// Writes the motion of a solid. A solid that turns does so about its rest point, so that it stays
/// on its arc between frames.
fn put_way(text: &mut Text, way: &[(u32, Pose)]) {
    let Some((_, first)) = way.first() else {
        return;
    };
    let sampled = |of: &dyn Fn(&Pose) -> String| -> Vec<_> {
        way.iter().map(|(frame, pose)| (*frame, of(pose))).collect()
    };
    let turns = way.iter().any(|(_, pose)| pose.turn != DQuat::IDENTITY);
    if !turns {
        let samples = sampled(&|pose| text::triple(pose.place(DVec3::ZERO)));
        text.samples("double3 xformOp:translate", &samples);
        text.line("uniform token[] xformOpOrder = [\"xformOp:translate\"]");
        return;
    }
    let samples = sampled(&|pose| text::triple(pose.centre));
    text.samples("double3 xformOp:translate", &samples);
    let samples =
        sampled(&|Pose { turn, .. }| format!("({}, {}, {}, {})", turn.w, turn.x, turn.y, turn.z));
    text.samples("quatd xformOp:orient", &samples);
    let rest = text::triple(DVec3::ZERO - first.rest);
    text.line(&format!("double3 xformOp:translate:rest = {rest}"));
    text.line(
        "uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\", \
         \"xformOp:translate:rest\"]",
    );
}

/// Writes a mesh of constant shape.
pub(super) fn put_mesh(text: &mut Text, vertices: &[DVec3], triangles: &[[u32; 3]]) {
    let points: Vec<[f32; 3]> = vertices.iter().map(|p| p.as_vec3().to_array()).collect();
    text.line(&format!("float3[] extent = {}", extent(&points, 0.0)));
    text.array(
        "int[] faceVertexCounts = ",
        &vec![3; triangles.len()],
        |x| x.to_string(),
    );
    text.array(
        "int[] faceVertexIndices = ",
        triangles.as_flattened(),
        u32::to_string,
    );
    let normals = normals(vertices, triangles);
    text.primvar("normal3f[] normals", UNIFORM, &normals, text::floats);
    text.array("point3f[] points = ", &points, text::floats);
    text.line("uniform token subdivisionScheme = \"none\"");
}

/// Interpolation of what each face has one value of.
const UNIFORM: &str = "uniform";

/// Unit normals of triangles; zero where a triangle has none.
fn normals(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let normal = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|at| vertices[at as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        normal.as_vec3().to_array()
    };
    triangles.iter().map(normal).collect()
}

/// Writes a mesh that changes its shape; its triangles at each frame only where they change too.
fn put_shapes(text: &mut Text, shapes: &[(u32, TriangleMesh)]) {
    let triangles = &shapes[0].1.triangles;
    let is_kept = shapes.iter().all(|(_, mesh)| mesh.triangles == *triangles);
    let points = |mesh: &TriangleMesh| -> Vec<[f32; 3]> {
        (mesh.vertices.iter().map(|p| p.as_vec3().to_array())).collect()
    };
    let extents = shapes
        .iter()
        .map(|(frame, mesh)| (*frame, extent(&points(mesh), 0.0)));
    text.samples("float3[] extent", &extents.collect::<Vec<_>>());
    let of_triangles =
        |text: &mut Text, attribute: &str, of: &dyn Fn(&TriangleMesh) -> Vec<u32>| match is_kept {
            true => {
                let before = format!("{attribute} = ");
                text.array(&before, &of(&shapes[0].1), u32::to_string);
            }
            false => {
                let all = shapes.iter().map(|(frame, mesh)| (*frame, of(mesh)));
                text.array_samples(attribute, all, u32::to_string);
            }
        };
    of_triangles(text, "int[] faceVertexCounts", &|mesh| {
        vec![3; mesh.triangles.len()]
    });
    of_triangles(text, "int[] faceVertexIndices", &|mesh| {
        mesh.triangles.as_flattened().to_vec()
    });
    text.line(&format!(
        "normal3f[] normals (interpolation = {})",
        quoted(UNIFORM)
    ));
    let all =
        (shapes.iter()).map(|(frame, mesh)| (*frame, normals(&mesh.vertices, &mesh.triangles)));
    text.array_samples("normal3f[] normals", all, text::floats);
    let all = shapes.iter().map(|(frame, mesh)| (*frame, points(mesh)));
    text.array_samples("point3f[] points", all, text::floats);
    text.line("uniform token subdivisionScheme = \"none\"");
}
