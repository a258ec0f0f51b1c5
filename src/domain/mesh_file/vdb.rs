//! Reads OpenVDB level sets with vdb-rs: the surface is where the level set is 0, in world
//! coordinates of the grid.

mod half;

use std::{
    any::Any,
    cell::Cell,
    io::Cursor,
    panic::{self, AssertUnwindSafe},
    sync::Once,
};

use glam::DVec3;
use vdb_rs::{Grid, Map, MetadataValue, VdbLevel, VdbReader};

use half::with_lengths;

use super::{Digits, Raw};
use crate::isosurface::sparse::{Band, around};

/// Level set that is read if a file has several: Houdini, Blender and swell use this name.
const USUAL: &str = "surface";

/// First bytes of a file; vdb-rs does not check them.
const MAGIC: [u8; 8] = *b" BDV\0\0\0\0";

/// Reads vertices in metres, and triangles.
pub(super) fn read(bytes: &[u8]) -> Result<Raw, String> {
    if !bytes.starts_with(&MAGIC) {
        return Err("not an OpenVDB file".into());
    }
    let bytes = with_lengths(bytes);
    let grid = caught(|| grid(&bytes))
        .map_err(|panic| format!("damaged, or of a kind that vdb-rs does not read: {panic}"))
        .flatten()?;
    let (scale, origin) = match &grid.transform {
        Map::UniformScaleMap { scale_values, .. } => (scale_values.to_array(), [0.0; 3]),
        Map::ScaleTranslateMap {
            translation,
            scale_values,
            ..
        } => (scale_values.to_array(), translation.to_array()),
    };
    let mut band = Band::new();
    for (at, value, level) in grid.iter() {
        // Tiles are entirely inside or outside: no surface passes through them.
        if matches!(level, VdbLevel::Voxel) {
            band.insert(at.to_array().map(|c| c as i32), value);
        }
    }
    if let Some(value) = band.values().find(|value| !value.is_finite()) {
        return Err(format!("a value of the level set is {value}"));
    }
    let mesh = around(&band);
    let (scale, origin) = (DVec3::from_array(scale), DVec3::from_array(origin));
    let places = mesh.vertices.iter().map(|&v| origin + scale * v);
    let triangles = mesh.triangles.iter().map(|t| t.map(u64::from));
    Ok(Raw::of_triangles(
        Digits::Double,
        places.collect(),
        triangles,
    ))
}

thread_local! {
    /// Whether this thread is inside [`caught`], whose panics are returned and not printed.
    static IS_ASKING: Cell<bool> = const { Cell::new(false) };
}

/// Returns the result of `read`, or the message of its panic, which is not printed: vdb-rs asserts
/// what it expects of a file.
fn caught<T>(read: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let told = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            if !IS_ASKING.get() {
                told(panic);
            }
        }));
    });
    IS_ASKING.set(true);
    let found = panic::catch_unwind(AssertUnwindSafe(read));
    IS_ASKING.set(false);
    found.map_err(|panic| words(panic.as_ref()))
}

fn words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
    let lines = text.unwrap_or("it says no more").lines();
    lines.map(str::trim).collect::<Vec<_>>().join(", ")
}

/// Description of a grid of an OpenVDB file.
#[derive(Clone, Debug)]
pub struct GridFile {
    /// Name, such as `surface`.
    pub name: String,
    /// OpenVDB's name of the grid type, such as `Tree_float_5_4_3`.
    pub kind: String,
    /// Grid class: `level set`, `staggered` or `fog volume`; empty if the grid has none.
    pub class: String,
    /// Number of active voxels according to the metadata; `None` if it does not tell.
    pub voxels: Option<u64>,
    /// Least and greatest active voxel according to the metadata.
    pub extent: Option<[[i32; 3]; 2]>,
    /// Edge lengths of a voxel, in the grid's own unit; `None` for grids that do not hold
    /// 32-bit floats.
    pub voxel_size: Option<[f64; 3]>,
}

/// Lists the grids of a file, by name. Grids of floats are read completely, so that a truncated one
/// is detected.
///
/// # Errors
/// A message that says what is wrong.
pub fn grids(bytes: &[u8]) -> Result<Vec<GridFile>, String> {
    if !bytes.starts_with(&MAGIC) {
        return Err("not an OpenVDB file".into());
    }
    let bytes = with_lengths(bytes);
    caught(|| all_grids(&bytes))
        .map_err(|panic| format!("damaged, or of a kind that vdb-rs does not read: {panic}"))?
}

fn all_grids(bytes: &[u8]) -> Result<Vec<GridFile>, String> {
    let fail = |error: vdb_rs::ParseError| error.to_string();
    let mut reader = VdbReader::new(Cursor::new(bytes)).map_err(fail)?;
    let mut descriptors: Vec<_> = reader.grid_descriptors.values().cloned().collect();
    descriptors.sort_unstable_by(|a, b| a.name.cmp(&b.name));
    let mut grids = Vec::new();
    for found in descriptors {
        let of = |key: &str| found.meta_data.0.get(key);
        let corner = |key| match of(key) {
            Some(MetadataValue::Vec3i(corner)) => Some(corner.to_array()),
            _ => None,
        };
        if found.end_pos > bytes.len() as u64 {
            return Err(format!(
                "truncated: grid {} ends beyond the file",
                found.name
            ));
        }
        let voxel_size = match found.grid_type.starts_with("Tree_float_5_4_3") {
            true => Some(scale_of(
                &reader.read_grid::<f32>(&found.name).map_err(fail)?,
            )),
            false => None,
        };
        grids.push(GridFile {
            class: match of("class") {
                Some(MetadataValue::String(class)) => class.clone(),
                _ => String::new(),
            },
            voxels: match of("file_voxel_count") {
                Some(MetadataValue::I64(count)) => u64::try_from(*count).ok(),
                _ => None,
            },
            extent: corner("file_bbox_min")
                .zip(corner("file_bbox_max"))
                .map(|(min, max)| [min, max]),
            voxel_size,
            kind: found.grid_type,
            name: found.name,
        });
    }
    Ok(grids)
}

fn scale_of(grid: &Grid<f32>) -> [f64; 3] {
    match &grid.transform {
        Map::UniformScaleMap { scale_values, .. } | Map::ScaleTranslateMap { scale_values, .. } => {
            scale_values.to_array()
        }
    }
}

/// Reads the level set of a file.
fn grid(bytes: &[u8]) -> Result<Grid<f32>, String> {
    let fail = |error: vdb_rs::ParseError| error.to_string();
    let mut reader = VdbReader::new(Cursor::new(bytes)).map_err(fail)?;
    let mut all: Vec<String> = reader.grid_descriptors.keys().cloned().collect();
    all.sort_unstable();
    let is_level_set = |name: &&String| {
        let grid = &reader.grid_descriptors[*name];
        let class = grid.meta_data.0.get("class");
        grid.grid_type.starts_with("Tree_float_5_4_3")
            && class == Some(&MetadataValue::String("level set".to_owned()))
    };
    let level_sets: Vec<String> = all.iter().filter(is_level_set).cloned().collect();
    let name = match &level_sets[..] {
        [] => return Err(format!("no level set among its grids ({})", all.join(", "))),
        [only] => only.clone(),
        several if several.iter().any(|name| name == USUAL) => USUAL.to_owned(),
        several => {
            return Err(format!(
                "several level sets ({}), and none is called {USUAL:?}",
                several.join(", ")
            ));
        }
    };
    reader.read_grid::<f32>(&name).map_err(fail)
}
