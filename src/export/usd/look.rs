//! Materials and light of a look: UsdPreviewSurface and UsdLux.

use glam::DVec3;

use super::text::{Text, asset, quoted, unique};

/// Materials and light of a shot.
#[derive(Clone, Debug)]
pub struct LookPrims {
    /// Materials; those that nothing is bound to are written too.
    pub materials: Vec<Material>,
    /// Index of the material of the water.
    pub water: usize,
    /// Index of the material of whitewater, where the look draws it.
    pub whitewater: Option<usize>,
    /// Index of the material of wave makers, where the look draws them.
    pub wave_makers: Option<usize>,
    /// The sun.
    pub sun: Sun,
    /// File name of the sky beside the root: a latitude-longitude picture whose centre is towards
    /// +x, with +z to the right.
    pub sky: String,
}

/// A material of a shot.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name, which is made valid and unique if necessary.
    pub name: String,
    /// Diffuse reflectance, linear Rec. 709; multiplies the texture.
    pub colour: [f64; 3],
    /// File name of the texture beside the root, in sRGB.
    pub texture: Option<String>,
    /// What it reflects like a mirror.
    pub gloss: Option<Gloss>,
}

/// Mirror reflection of a dielectric.
#[derive(Clone, Copy, Debug)]
pub struct Gloss {
    /// Refractive index.
    pub index: f64,
    /// Root mean square slope of the surface's microfacets along each axis.
    pub slope: f64,
}

/// The sun.
#[derive(Clone, Copy, Debug)]
pub struct Sun {
    /// Unit vector towards it.
    pub towards: DVec3,
    /// Irradiance on a face perpendicular to it, linear Rec. 709.
    pub irradiance: [f32; 3],
    /// Angular diameter, degrees.
    pub degrees: f64,
}

/// Materials of a solid's triangles.
#[derive(Clone, Debug, Default)]
pub struct Paint {
    /// Index of each triangle's material.
    pub of: Vec<usize>,
    /// Texture coordinates of each triangle's corners; empty if no triangle has a texture.
    pub places: Vec<[f64; 2]>,
}

/// A shot's materials by their paths.
#[derive(Clone, Debug, Default)]
pub(super) struct Bindings {
    paths: Vec<String>,
    names: Vec<String>,
}

/// Metadata of a prim that a material is bound to.
pub(super) const BINDS: &str = "prepend apiSchemas = [\"MaterialBindingAPI\"]";

impl Bindings {
    /// Materials of the shot whose root prim is `shot`.
    pub(super) fn of(look: Option<&LookPrims>, shot: &str) -> Self {
        let materials = look.map_or(&[][..], |look| &look.materials);
        let names = unique(materials.iter().map(|it| &*it.name));
        let paths = names.iter().map(|it| format!("/{shot}/materials/{it}"));
        Self {
            paths: paths.collect(),
            names: names.clone(),
        }
    }

    /// Opens a prim, which material `index` is bound to.
    pub(super) fn open(&self, text: &mut Text, prim: &str, index: Option<usize>) {
        let Some(index) = index else {
            text.open(prim);
            return;
        };
        text.open_with(prim, BINDS);
        self.bind(text, index);
    }

    fn bind(&self, text: &mut Text, index: usize) {
        text.line(&format!("rel material:binding = <{}>", self.paths[index]));
    }

    /// Opens the prim of a mesh with these materials and writes them: bound to the mesh, or to
    /// subsets of its faces where there are several.
    pub(super) fn open_painted(&self, text: &mut Text, prim: &str, paint: Option<&Paint>) {
        let Some(paint) = paint else {
            text.open(prim);
            return;
        };
        let mut used = paint.of.clone();
        used.sort_unstable();
        used.dedup();
        match used[..] {
            [single] => self.open(text, prim, Some(single)),
            _ => text.open(prim),
        }
        if used.len() > 1 {
            text.line("uniform token subsetFamily:materialBind:familyType = \"partition\"");
            for &index in &used {
                let faces = (0..paint.of.len()).filter(|&k| paint.of[k] == index);
                let faces: Vec<usize> = faces.collect();
                let subset = format!("def GeomSubset {}", quoted(&self.names[index]));
                self.open(text, &subset, Some(index));
                text.line("uniform token elementType = \"face\"");
                text.line("uniform token familyName = \"materialBind\"");
                text.array("int[] indices = ", &faces, usize::to_string);
                text.close();
            }
        }
        if !paint.places.is_empty() {
            let each = |[u, v]: &[f64; 2]| format!("({}, {})", *u as f32, *v as f32);
            text.primvar(
                "texCoord2f[] primvars:st",
                "faceVarying",
                &paint.places,
                each,
            );
        }
    }

    /// Writes the materials of a root layer.
    pub(super) fn put(&self, text: &mut Text, look: &LookPrims) {
        text.open("def Scope \"materials\"");
        for ((material, name), path) in look.materials.iter().zip(&self.names).zip(&self.paths) {
            text.open(&format!("def Material {}", quoted(name)));
            text.line(&format!(
                "token outputs:surface.connect = <{path}/surface.outputs:surface>"
            ));
            put_surface(text, material, path);
            if let Some(texture) = &material.texture {
                put_texture(text, texture, material.colour, path);
            }
            text.close();
        }
        text.close();
    }
}

fn put_surface(text: &mut Text, material: &Material, path: &str) {
    text.open("def Shader \"surface\"");
    text.line("uniform token info:id = \"UsdPreviewSurface\"");
    match &material.texture {
        Some(_) => text.line(&format!(
            "color3f inputs:diffuseColor.connect = <{path}/texture.outputs:rgb>"
        )),
        None => text.line(&format!(
            "color3f inputs:diffuseColor = {}",
            colour(material.colour)
        )),
    }
    match material.gloss {
        Some(Gloss { index, slope }) => {
            text.line(&format!("float inputs:ior = {}", index as f32));
            // The GGX distribution has α² = 2 σ², and the schema squares its roughness to α.
            let roughness = (2f64.sqrt() * slope).sqrt().min(1.0);
            text.line(&format!("float inputs:roughness = {}", roughness as f32));
        }
        // No mirror reflection, whichever workflow a renderer follows.
        None => {
            text.line("float inputs:ior = 1");
            text.line("float inputs:roughness = 1");
            text.line("color3f inputs:specularColor = (0, 0, 0)");
            text.line("int inputs:useSpecularWorkflow = 1");
        }
    }
    text.line("token outputs:surface");
    text.close();
}

fn put_texture(text: &mut Text, file: &str, factor: [f64; 3], path: &str) {
    text.open("def Shader \"texture\"");
    text.line("uniform token info:id = \"UsdUVTexture\"");
    text.line(&format!("asset inputs:file = {}", asset(file)));
    let [r, g, b] = factor.map(|c| c as f32);
    text.line(&format!("float4 inputs:scale = ({r}, {g}, {b}, 1)"));
    text.line("token inputs:sourceColorSpace = \"sRGB\"");
    text.line(&format!(
        "float2 inputs:st.connect = <{path}/st.outputs:result>"
    ));
    text.line("token inputs:wrapS = \"repeat\"");
    text.line("token inputs:wrapT = \"repeat\"");
    text.line("float3 outputs:rgb");
    text.close();
    text.open("def Shader \"st\"");
    text.line("uniform token info:id = \"UsdPrimvarReader_float2\"");
    text.line("string inputs:varname = \"st\"");
    text.line("float2 outputs:result");
    text.close();
}

/// Writes sun and sky. Distant lights shine along their -z; with `normalize` their intensity is the
/// irradiance, whatever their diameter. The centre of a dome's picture is towards its +z.
pub(super) fn put_lights(text: &mut Text, look: &LookPrims) {
    let Sun {
        towards,
        irradiance,
        degrees,
    } = look.sun;
    text.open("def Scope \"lights\"");
    text.open("def DistantLight \"sun\"");
    let most = irradiance.iter().copied().fold(0.0, f32::max);
    let share = irradiance.map(|part| if most > 0.0 { part / most } else { 1.0 });
    text.line(&format!("float inputs:angle = {}", degrees as f32));
    text.line(&format!(
        "color3f inputs:color = {}",
        colour(share.map(f64::from))
    ));
    text.line(&format!("float inputs:intensity = {most}"));
    text.line("bool inputs:normalize = 1");
    let right = DVec3::Y.cross(towards).try_normalize().unwrap_or(DVec3::X);
    let row = |v: DVec3, w: u8| format!("({:?}, {:?}, {:?}, {w})", v.x, v.y, v.z);
    let rows = [
        row(right, 0),
        row(towards.cross(right), 0),
        row(towards, 0),
        row(DVec3::ZERO, 1),
    ];
    text.line(&format!(
        "matrix4d xformOp:transform = ( {} )",
        rows.join(", ")
    ));
    text.line("uniform token[] xformOpOrder = [\"xformOp:transform\"]");
    text.close();
    text.open("def DomeLight \"sky\"");
    text.line("float inputs:intensity = 1");
    text.line(&format!("asset inputs:texture:file = {}", asset(&look.sky)));
    text.line("token inputs:texture:format = \"latlong\"");
    text.line("float xformOp:rotateY = 90");
    text.line("uniform token[] xformOpOrder = [\"xformOp:rotateY\"]");
    text.close();
    text.close();
}

fn colour(c: [f64; 3]) -> String {
    let [r, g, b] = c.map(|c| c as f32);
    format!("({r}, {g}, {b})")
}
