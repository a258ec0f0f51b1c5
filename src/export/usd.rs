//! Writes shots as USD text (usda): a root layer with everything static or animated by rule, and
//! one layer per frame, played as value clips.
//!
//! Units are metres, up is y, and a time code is a frame. The layers contain what OpenUSD's own
//! validators ask for; names and semantics follow the schemas of UsdGeom and the documentation of
//! value clips.

mod look;
mod solids;
mod text;
mod water;

use glam::{DVec3, Vec3};

use super::FileOrigin;
use swell_domain::{bounds::Bounds, eye::Eye};

use look::{Bindings, put_lights};
use solids::{declare_wetness, put_mesh, put_solids, put_wetness};
use text::{Text, asset, name, quoted};

pub use look::{Gloss, LookPrims, Material, Paint, Sun};
pub use solids::{Solid, solid_names};
pub use water::{WaterFrame, WaterLayer, WaterPrim, WaterRepresentation};

/// Properties that all layers of a shot share.
#[derive(Clone, Copy, Debug)]
pub struct Shot<'a> {
    /// Program, shot name and frame; the shot's name is also that of the root prim.
    pub source: FileOrigin<'a>,
    /// Frames per second.
    pub frames_per_second: f64,
    /// First and last frame.
    pub frames: [u32; 2],
    /// World position of the scene's origin, metres.
    pub origin: DVec3,
}

/// A wall of the domain that makes waves.
#[derive(Clone, Debug)]
pub struct WaveMaker {
    /// Name, such as `wall_minus_x`.
    pub name: String,
    /// Four corners at the start, counter-clockwise seen from the water; metres, relative to the
    /// scene's origin.
    pub corners: [DVec3; 4],
}

/// The camera at a frame.
#[derive(Clone, Copy, Debug)]
pub struct CameraFrame {
    /// Frame number.
    pub frame: u32,
    /// Camera, relative to the scene's origin.
    pub eye: Eye,
    /// Width of the image on the film, mm.
    pub film_width_mm: f64,
    /// The lens's f-number and focus distance, metres; `None` for a pinhole.
    pub lens: Option<[f64; 2]>,
}

/// Content of the root layer.
#[derive(Clone, Debug)]
pub struct Root<'a> {
    /// Properties of the shot.
    pub shot: Shot<'a>,
    /// The water, and whitewater beside it.
    pub waters: Vec<WaterPrim<'a>>,
    /// File name of each frame's layer, beside the root; names must not contain line ends.
    pub layers: Vec<(u32, String)>,
    /// File name of the layer that declares which attributes the frames' layers have.
    pub manifest: String,
    /// Solids, static and moving.
    pub solids: Vec<Solid>,
    /// Walls that move; their displacements are in the frames' layers.
    pub wave_makers: Vec<WaveMaker>,
    /// Camera of a look, per frame; empty without one.
    pub camera: Vec<CameraFrame>,
    /// Materials and light of that look; `None` without one.
    pub look: Option<LookPrims>,
}

/// Writes the first lines of a layer, up to the body of its only prim.
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

/// Writes the position of a shot's prim.
fn put_origin(text: &mut Text, shot: &Shot<'_>) {
    if shot.origin != DVec3::ZERO {
        let at = text::triple(shot.origin);
        text.line(&format!("double3 xformOp:translate = {at}"));
        text.line("uniform token[] xformOpOrder = [\"xformOp:translate\"]");
    }
}

/// Writes the manifest of the clips: the attributes of the frames' layers, without values.
pub fn manifest(root: &Root<'_>) -> Vec<u8> {
    let mut text = Text::default();
    begin(
        &mut text,
        &root.shot,
        "what the frames hold",
        root.shot.frames,
    );
    text.open(&format!("over {}", quoted(&name(root.shot.source.shot))));
    root.waters.iter().for_each(|it| it.put_manifest(&mut text));
    if !root.wave_makers.is_empty() {
        text.open("over \"wave_makers\"");
        for maker in &root.wave_makers {
            text.open(&format!("over {}", quoted(&maker.name)));
            text.line("double3 xformOp:translate");
            text.close();
        }
        text.close();
    }
    declare_wetness(&mut text, &root.solids);
    text.close();
    text.into_bytes()
}

/// Writes the root layer.
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
    let bindings = Bindings::of(root.look.as_ref(), &name_of_shot);
    for water in &root.waters {
        water.put_root(&mut text, &bindings);
    }
    put_solids(&mut text, &root.solids, &bindings);
    put_wave_makers(&mut text, root, &bindings);
    put_camera(&mut text, &root.camera);
    if let Some(look) = &root.look {
        bindings.put(&mut text, look);
        put_lights(&mut text, look);
    }
    text.close();
    text.into_bytes()
}

/// Writes the wave makers: with the look's material, invisible where the look does not draw them.
fn put_wave_makers(text: &mut Text, root: &Root<'_>, bindings: &Bindings) {
    if root.wave_makers.is_empty() {
        return;
    }
    let material = root.look.as_ref().map(|look| look.wave_makers);
    text.open("def Xform \"wave_makers\"");
    if material == Some(None) {
        text.line("token visibility = \"invisible\"");
    }
    for maker in &root.wave_makers {
        let prim = format!("def Mesh {}", quoted(&maker.name));
        bindings.open(text, &prim, material.flatten());
        text.line("uniform bool doubleSided = 1");
        put_mesh(text, &maker.corners, &[[0, 1, 2], [0, 2, 3]]);
        text.line("double3 xformOp:translate");
        text.line("uniform token[] xformOpOrder = [\"xformOp:translate\"]");
        text.close();
    }
    text.close();
}

fn put_camera(text: &mut Text, views: &[CameraFrame]) {
    let Some(first) = views.first() else {
        return;
    };
    let [width, height] = first.eye.size.map(f64::from);
    // USD measures the film in tenths of the scene's unit, here of a metre; a millimetre is a
    // hundredth of that.
    let film = first.film_width_mm / 100.0;
    text.open("def Camera \"camera\"");
    text.line("float2 clippingRange = (0.01, 100000)");
    let samples = |value: &dyn Fn(&CameraFrame) -> String| {
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
            // Offset of the film's centre from the axis, to the right and up.
            let offset = |view: &CameraFrame| sign * view.eye.axis[axis] / width * film;
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

/// Bounding box of the points with a margin, metres; at zero without points.
fn extent(points: &[[f32; 3]], margin: f64) -> String {
    let bounds = Bounds::of_points(points.iter().map(|&p| Vec3::from(p).as_dvec3()));
    let [min, max] = bounds.map_or([DVec3::ZERO; 2], |b| [b.min - margin, b.max + margin]);
    let corner = |p: DVec3| text::floats(&p.as_vec3().to_array());
    format!("[{}, {}]", corner(min), corner(max))
}

/// Writes the layer of a frame: the water, whitewater beside it, the displacement of each wave
/// maker, metres, and the wetness of each solid's vertices, by the names of [`solid_names`]. The
/// layer can also be opened without the root.
pub fn frame(
    shot: &Shot<'_>,
    waters: &[WaterLayer<'_>],
    makers: &[(String, DVec3)],
    wetness: &[(String, &[f32])],
) -> Vec<u8> {
    let at = shot.source.frame;
    let mut text = Text::default();
    begin(&mut text, shot, &format!("frame {at}"), [at, at]);
    text.open(&format!("def Xform {}", quoted(&name(shot.source.shot))));
    put_origin(&mut text, shot);
    waters.iter().for_each(|it| it.put(&mut text, at));
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
    put_wetness(&mut text, at, wetness);
    text.close();
    text.into_bytes()
}

#[cfg(test)]
#[path = "usd/tests.rs"]
mod tests;
