//! USD as text (usda), for shots: a root layer with all that stands or moves by rule, and a layer a frame that it plays as a value clip.
//!
//! Units are metres, up is y, a time code is a frame. What is in these layers is what OpenUSD's own validators ask for; names and
//! semantics are those of UsdGeom's schemas and of the value clips' documentation.

mod text;

use glam::{DQuat, DVec3, Vec3};

use super::Source;
use swell_domain::{
    bounds::Bounds, eye::Eye, mesh::TriangleMesh, particles::Particles, pose::Pose,
    water_mesh::WaterMesh,
};

use text::{Text, asset, name, quoted};

/// What all layers of a shot have in common.
#[derive(Clone, Copy, Debug)]
pub struct Shot<'a> {
    /// Name of the shot, and of what the water is called below it.
    pub source: Source<'a>,
    /// Of the prim that holds the water: `water`, or a stream's name.
    pub water: &'a str,
    /// Frames a second.
    pub frames_per_second: f64,
    /// First and last frame.
    pub frames: [u32; 2],
    /// World position of the scene's zero, metres.
    pub origin: DVec3,
}

/// How a shot's water is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// As points.
    Points {
        /// Diameter of each, metres; where `None` the attribute `radius` has half of it.
        width: Option<f64>,
    },
    /// As a mesh.
    Mesh,
}

/// A solid of the scene.
#[derive(Clone, Debug)]
pub struct Solid {
    /// Made a valid and single name where it is none.
    pub name: String,
    /// Metres, about the scene's zero.
    pub mesh: TriangleMesh,
    /// Where it stands at each frame; empty for one that never moves.
    pub way: Vec<(u32, Pose)>,
}

/// A wall of the domain that makes waves.
#[derive(Clone, Debug)]
pub struct WaveMaker {
    /// Such as `wall_minus_x`.
    pub name: String,
    /// Its four corners where it stands at the start, counter-clockwise seen from the water; metres about the scene's zero.
    pub corners: [DVec3; 4],
}

/// The camera at a frame.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Frame number.
    pub frame: u32,
    /// About the scene's zero.
    pub eye: Eye,
    /// Width of the picture on the film, mm.
    pub film_width_mm: f64,
    /// The lens's f-number and the distance that is sharp, metres; `None` of a pinhole.
    pub lens: Option<[f64; 2]>,
}

/// What the root layer holds.
#[derive(Clone, Debug)]
pub struct Root<'a> {
    /// The shot.
    pub shot: Shot<'a>,
    /// How the water is told.
    pub kind: Kind,
    /// Attributes of the particles, by name; of points alone.
    pub attributes: Vec<String>,
    /// The layers of the frames, files beside the root; names without line ends.
    pub layers: Vec<(u32, String)>,
    /// The layer that says which attributes the frames' layers have.
    pub manifest: String,
    /// Solids, those that move among them.
    pub solids: Vec<Solid>,
    /// Walls that move; where they have come to stands in the layers of the frames.
    pub wave_makers: Vec<WaveMaker>,
    /// Of a look; empty without one.
    pub camera: Vec<View>,
}

/// An attribute of the water that has a value a frame.
struct Sampled {
    kind: &'static str,
    name: String,
    /// In parentheses behind the value; empty for none.
    metadata: &'static str,
}

/// The attributes that layers of frames have of the water.
fn sampled(kind: Kind, attributes: &[String]) -> Vec<Sampled> {
    let of = |kind, name: &str, metadata| Sampled {
        kind,
        name: name.to_owned(),
        metadata,
    };
    let mut all = vec![of("float3[]", "extent", "")];
    match kind {
        Kind::Points { width } => {
            if width.is_none() {
                all.push(of("float[]", "widths", "interpolation = \"vertex\""));
            }
            all.push(of("int64[]", "ids", ""));
            all.push(of("point3f[]", "points", ""));
            all.push(of("vector3f[]", "velocities", ""));
            let own = attributes.iter().map(|it| format!("primvars:{}", name(it)));
            all.extend(own.map(|it| of("float[]", &it, "interpolation = \"vertex\"")));
        }
        Kind::Mesh => {
            all.push(of("int[]", "faceVertexCounts", ""));
            all.push(of("int[]", "faceVertexIndices", ""));
            all.push(of("normal3f[]", "normals", "interpolation = \"vertex\""));
            all.push(of("point3f[]", "points", ""));
            all.push(of("vector3f[]", "velocities", ""));
        }
    }
    all
}

/// What of the water is the same in all frames.
fn put_constants(text: &mut Text, kind: Kind) {
    match kind {
        Kind::Points { width: Some(width) } => {
            text.line(&format!("float[] widths = [{}] (", width as f32));
            text.line("    interpolation = \"constant\"");
            text.line(")");
        }
        Kind::Points { width: None } => {}
        Kind::Mesh => text.line("uniform token subdivisionScheme = \"none\""),
    }
}

fn schema(kind: Kind) -> &'static str {
    match kind {
        Kind::Points { .. } => "Points",
        Kind::Mesh => "Mesh",
    }
}

/// The first lines of a layer, up to its one prim's body.
fn begin(text: &mut Text, shot: &Shot<'_>, what: &str, frames: [u32; 2]) {
    text.line("#usda 1.0");
    text.line("(");
    text.line(&format!(
        "    defaultPrim = {}",
        quoted(&name(shot.source.shot))
    ));
    let said = format!("{}, {what} of {}", shot.source.software, shot.source.shot);
    text.line(&format!("    doc = {}", quoted(&said)));
    text.line(&format!("    endTimeCode = {}", frames[1]));
    text.line(&format!("    framesPerSecond = {}", shot.frames_per_second));
    text.line("    metersPerUnit = 1");
    text.line(&format!("    startTimeCode = {}", frames[0]));
    text.line(&format!(
        "    timeCodesPerSecond = {}",
        shot.frames_per_second
    ));
    text.line("    upAxis = \"Y\"");
    text.line(")");
    text.line("");
}

/// Where a shot's prim stands.
fn put_origin(text: &mut Text, shot: &Shot<'_>) {
    if shot.origin != DVec3::ZERO {
        let at = text::triple(shot.origin);
        text.line(&format!("double3 xformOp:translate = {at}"));
        text.line("uniform token[] xformOpOrder = [\"xformOp:translate\"]");
    }
}

/// The manifest of the clips: the attributes that layers of frames have, without values.
pub fn manifest(root: &Root<'_>) -> Vec<u8> {
    let mut text = Text::default();
    begin(
        &mut text,
        &root.shot,
        "what the frames hold",
        root.shot.frames,
    );
    text.open(&format!("over {}", quoted(&name(root.shot.source.shot))));
    text.open(&format!("over {}", quoted(&name(root.shot.water))));
    for it in sampled(root.kind, &root.attributes) {
        text.line(&format!("{} {}", it.kind, it.name));
    }
    text.close();
    if !root.wave_makers.is_empty() {
        text.open("over \"wave_makers\"");
        for maker in &root.wave_makers {
            text.open(&format!("over {}", quoted(&maker.name)));
            text.line("double3 xformOp:translate");
            text.close();
        }
        text.close();
    }
    text.close();
    text.into_bytes()
}

/// The root layer.
pub fn root(root: &Root<'_>) -> Vec<u8> {
    let shot = &root.shot;
    let mut text = Text::default();
    begin(&mut text, shot, "the shot", shot.frames);
    let name_of_shot = name(shot.source.shot);
    text.line(&format!("def Xform {} (", quoted(&name_of_shot)));
    let listed = |each: &dyn Fn(&(u32, String)) -> String| {
        root.layers.iter().map(each).collect::<Vec<_>>().join(", ")
    };
    text.line("    clips = {");
    text.line("        dictionary default = {");
    let active: Vec<_> = (0..root.layers.len()).zip(&root.layers).collect();
    let active = active
        .iter()
        .map(|(k, (frame, _))| format!("({frame}, {k})"));
    let active = active.collect::<Vec<_>>().join(", ");
    text.line(&format!("            double2[] active = [{active}]"));
    let layers = listed(&|(_, file)| asset(file));
    text.line(&format!("            asset[] assetPaths = [{layers}]"));
    text.line(&format!(
        "            asset manifestAssetPath = {}",
        asset(&root.manifest)
    ));
    text.line(&format!(
        "            string primPath = \"/{name_of_shot}\""
    ));
    let times = listed(&|(frame, _)| format!("({frame}, {frame})"));
    text.line(&format!("            double2[] times = [{times}]"));
    text.line("        }");
    text.line("    }");
    text.line(")");
    text.open("");
    put_origin(&mut text, shot);
    text.open(&format!(
        "def {} {}",
        schema(root.kind),
        quoted(&name(shot.water))
    ));
    for it in sampled(root.kind, &root.attributes) {
        text.line(&format!(
            "{} {}{}",
            it.kind,
            it.name,
            in_parentheses(it.metadata)
        ));
    }
    put_constants(&mut text, root.kind);
    text.close();
    put_solids(&mut text, &root.solids);
    put_wave_makers(&mut text, &root.wave_makers);
    put_camera(&mut text, &root.camera);
    text.close();
    text.into_bytes()
}

fn in_parentheses(metadata: &str) -> String {
    match metadata {
        "" => String::new(),
        some => format!(" ({some})"),
    }
}

fn put_solids(text: &mut Text, solids: &[Solid]) {
    if solids.is_empty() {
        return;
    }
    text.open("def Xform \"solids\"");
    let mut taken = Vec::new();
    for solid in solids {
        let wanted = name(&solid.name);
        let count = taken.iter().filter(|other| **other == wanted).count();
        taken.push(wanted.clone());
        let single = match count {
            0 => wanted,
            more => format!("{wanted}_{}", more + 1),
        };
        text.open(&format!("def Mesh {}", quoted(&single)));
        put_mesh(text, &solid.mesh.vertices, &solid.mesh.triangles);
        put_way(text, &solid.way);
        text.close();
    }
    text.close();
}

/// How a solid moves. One that turns does so about its point of rest, so that it stays on its arc between frames.
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
        "uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\", \"xformOp:translate:rest\"]",
    );
}

fn put_wave_makers(text: &mut Text, makers: &[WaveMaker]) {
    if makers.is_empty() {
        return;
    }
    text.open("def Xform \"wave_makers\"");
    for maker in makers {
        text.open(&format!("def Mesh {}", quoted(&maker.name)));
        text.line("uniform bool doubleSided = 1");
        put_mesh(text, &maker.corners, &[[0, 1, 2], [0, 2, 3]]);
        text.line("double3 xformOp:translate");
        text.line("uniform token[] xformOpOrder = [\"xformOp:translate\"]");
        text.close();
    }
    text.close();
}

/// A mesh that keeps its shape.
fn put_mesh(text: &mut Text, vertices: &[DVec3], triangles: &[[u32; 3]]) {
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
    text.array("point3f[] points = ", &points, text::floats);
    text.line("uniform token subdivisionScheme = \"none\"");
}

fn put_camera(text: &mut Text, views: &[View]) {
    let Some(first) = views.first() else {
        return;
    };
    let [width, height] = first.eye.size.map(f64::from);
    // Of a camera USD has lengths of the film in tenths of the scene's unit, here of a metre; millimetres are hundredths of these.
    let film = first.film_width_mm / 100.0;
    text.open("def Camera \"camera\"");
    text.line("float2 clippingRange = (0.01, 100000)");
    let samples = |value: &dyn Fn(&View) -> String| {
        views
            .iter()
            .map(|view| (view.frame, value(view)))
            .collect::<Vec<_>>()
    };
    if first.lens.is_some() {
        let part =
            |k: usize| samples(&|view| (view.lens.map_or(0.0, |lens| lens[k]) as f32).to_string());
        text.samples("float focusDistance", &part(1));
        text.samples("float fStop", &part(0));
    }
    let focal = samples(&|view| ((view.eye.focal / width * film) as f32).to_string());
    text.samples("float focalLength", &focal);
    if views.iter().any(|view| view.eye.axis != [0.0; 2]) {
        for (axis, name, sign) in [(0, "horizontal", -1.0), (1, "vertical", 1.0)] {
            // Of the film's middle off the axis, to the right and up.
            let offset = |view: &View| sign * view.eye.axis[axis] / width * film;
            let offsets = samples(&|view| (offset(view) as f32).to_string());
            text.samples(&format!("float {name}ApertureOffset"), &offsets);
        }
    }
    text.line(&format!("float horizontalAperture = {}", film as f32));
    text.line(&format!(
        "float verticalAperture = {}",
        (film * height / width) as f32
    ));
    let matrix = samples(&|view| {
        let Eye {
            right, up, forward, ..
        } = view.eye;
        let row = |v: DVec3, w: u8| format!("({:?}, {:?}, {:?}, {w})", v.x, v.y, v.z);
        let rows = [
            row(right, 0),
            row(up, 0),
            row(-forward, 0),
            row(view.eye.position, 1),
        ];
        format!("( {} )", rows.join(", "))
    });
    text.samples("matrix4d xformOp:transform", &matrix);
    text.line("uniform token[] xformOpOrder = [\"xformOp:transform\"]");
    text.close();
}

/// The box of these points with a margin, metres; at zero without points.
fn extent(points: &[[f32; 3]], margin: f64) -> String {
    let bounds = Bounds::of_points(points.iter().map(|&p| Vec3::from(p).as_dvec3()));
    let [min, max] = bounds.map_or([DVec3::ZERO; 2], |b| [b.min - margin, b.max + margin]);
    let corner = |p: DVec3| text::floats(&p.as_vec3().to_array());
    format!("[{}, {}]", corner(min), corner(max))
}

/// A frame's water.
#[derive(Clone, Copy, Debug)]
pub enum Water<'a> {
    /// As points, about the scene's zero.
    Points(&'a Particles),
    /// As a mesh, whose zero lies so many metres from the scene's.
    Mesh(&'a WaterMesh, DVec3),
}

/// The layer of a frame: the water, and how far each wave maker has come, metres. It opens by itself as well.
pub fn frame(
    shot: &Shot<'_>,
    kind: Kind,
    water: &Water<'_>,
    makers: &[(String, DVec3)],
) -> Vec<u8> {
    let at = shot.source.frame;
    let mut text = Text::default();
    begin(&mut text, shot, &format!("frame {at}"), [at, at]);
    text.open(&format!("def Xform {}", quoted(&name(shot.source.shot))));
    put_origin(&mut text, shot);
    text.open(&format!(
        "def {} {}",
        schema(kind),
        quoted(&name(shot.water))
    ));
    match water {
        Water::Points(particles) => put_points(&mut text, kind, at, particles),
        Water::Mesh(mesh, corner) => put_water_mesh(&mut text, at, mesh, *corner),
    }
    put_constants(&mut text, kind);
    text.close();
    if !makers.is_empty() {
        text.open("def Xform \"wave_makers\"");
        for (maker, way) in makers {
            text.open(&format!("def Xform {}", quoted(maker)));
            text.samples("double3 xformOp:translate", &[(at, text::triple(*way))]);
            text.line("uniform token[] xformOpOrder = [\"xformOp:translate\"]");
            text.close();
        }
        text.close();
    }
    text.close();
    text.into_bytes()
}

fn put_points(text: &mut Text, kind: Kind, at: u32, particles: &Particles) {
    let own = match kind {
        Kind::Points { width: None } => particles.attributes.get("radius"),
        _ => None,
    };
    let margin = match (kind, own) {
        (_, Some(radii)) => f64::from(radii.iter().copied().fold(0.0, f32::max)),
        (Kind::Points { width }, None) => 0.5 * width.unwrap_or(0.0),
        (Kind::Mesh, None) => 0.0,
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
    for (attribute, values) in &particles.attributes {
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
}

#[cfg(test)]
#[path = "usd/tests.rs"]
mod tests;
