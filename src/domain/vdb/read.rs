//! Reads the grids of 32-bit floats of a file from anyone: every count and offset is checked
//! against the bytes that are there, and each byte is read a bounded number of times.

mod blosc;
mod tree;

use std::collections::BTreeMap;

use glam::DVec3;

use super::{FLOAT_TREE, IDENTIFIER, MAGIC, Metadata, compression, cursor::Cursor, version};
use crate::sparse_grid::Leaf;
use tree::Tree;

/// Level set that is read if a file has several: Houdini, Blender and swell use this name.
const USUAL: &str = "surface";

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
    /// 32-bit floats, or have the tree of another grid.
    pub voxel_size: Option<[f64; 3]>,
}

/// The voxels of a level set. Voxel (i, j, k) is centred at `translation + scale · (i, j, k)`.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelSet {
    /// Edge lengths of a voxel, in the grid's own unit.
    pub scale: DVec3,
    /// Centre of voxel (0, 0, 0).
    pub translation: DVec3,
    /// Leaves in the order of the file.
    pub leaves: Vec<Leaf<f32>>,
}

/// Lists the grids of a file, by name. Grids of floats are read completely, so that a truncated one
/// is detected.
///
/// # Errors
/// A message that says what is wrong.
pub fn grids(bytes: &[u8]) -> Result<Vec<GridFile>, String> {
    let mut grids = Vec::new();
    for found in headers(bytes)? {
        let corner = |key| match found.metadata.get(key) {
            Some(Metadata::Ints(corner)) => Some(*corner),
            _ => None,
        };
        grids.push(GridFile {
            class: found.class().to_owned(),
            voxels: match found.metadata.get("file_voxel_count") {
                Some(Metadata::Long(count)) => u64::try_from(*count).ok(),
                _ => None,
            },
            extent: corner("file_bbox_min")
                .zip(corner("file_bbox_max"))
                .map(|(min, max)| [min, max]),
            voxel_size: match found.kind.starts_with(FLOAT_TREE) && found.instance_of.is_empty() {
                true => Some(found.level_set(bytes)?.scale.to_array()),
                false => None,
            },
            kind: found.kind,
            name: found.name,
        });
    }
    grids.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(grids)
}

/// Reads the level set of a file, or the one called `surface` if it has several.
///
/// # Errors
/// A message that says what is wrong.
pub fn level_set(bytes: &[u8]) -> Result<LevelSet, String> {
    let mut all = headers(bytes)?;
    all.sort_by(|a, b| a.name.cmp(&b.name));
    let names = |grids: &[&Header]| {
        let names: Vec<_> = grids.iter().map(|grid| grid.name.as_str()).collect();
        names.join(", ")
    };
    let is_level_set =
        |grid: &&Header| grid.kind.starts_with(FLOAT_TREE) && grid.class() == "level set";
    let level_sets: Vec<_> = all.iter().filter(is_level_set).collect();
    match &level_sets[..] {
        [] => {
            let all: Vec<_> = all.iter().collect();
            Err(format!("no level set among its grids ({})", names(&all)))
        }
        [only] => only.level_set(bytes),
        several => match several.iter().find(|grid| grid.name == USUAL) {
            Some(usual) => usual.level_set(bytes),
            None => Err(format!(
                "several level sets ({}), and none is called {USUAL:?}",
                names(several)
            )),
        },
    }
}

/// What a file says about a grid before its transform.
struct Header {
    name: String,
    kind: String,
    /// Name of the grid that has this one's tree; mostly empty.
    instance_of: String,
    metadata: BTreeMap<String, Metadata>,
    version: u32,
    compression: u32,
    /// Offsets of the transform, of the leaves' values, and of what follows the grid.
    transform: usize,
    values: usize,
    end: usize,
}

/// Reads the headers of all grids.
fn headers(bytes: &[u8]) -> Result<Vec<Header>, String> {
    let mut cursor = Cursor::new(bytes);
    if cursor.array() != Ok(MAGIC) {
        return Err("not an OpenVDB file".into());
    }
    let version = cursor.number()?;
    if version < version::OLDEST {
        return Err(format!(
            "OpenVDB's file format {version}; the oldest that is read is {}",
            version::OLDEST
        ));
    }
    // Version of the library.
    cursor.take(8)?;
    if cursor.byte()? == 0 {
        return Err("a stream of OpenVDB, whose grids have no offsets".into());
    }
    let mut compression = compression::ZIP | compression::ACTIVE_MASK;
    if (version::SELECTIVE..version::PER_GRID).contains(&version) {
        compression = u32::from(cursor.byte()? != 0) * compression::ZIP;
    }
    cursor.take(IDENTIFIER)?;
    metadata(&mut cursor)?;
    let mut found = Vec::new();
    for _ in 0..cursor.number()? {
        let header = Header::read(bytes, cursor, version, compression)?;
        // Grids follow one another, so that no byte is read for two of them.
        cursor = Cursor::between(bytes, header.end, bytes.len())?;
        found.push(header);
    }
    Ok(found)
}

impl Header {
    fn read(
        bytes: &[u8],
        mut cursor: Cursor<'_>,
        version: u32,
        compression: u32,
    ) -> Result<Self, String> {
        let (name, kind, instance_of) = (cursor.text()?, cursor.text()?, cursor.text()?);
        let offsets = [cursor.long()?, cursor.long()?, cursor.long()?];
        let [start, mut values, end] = offsets.map(|it| usize::try_from(it).unwrap_or(usize::MAX));
        if !instance_of.is_empty() {
            // No values of its own, and any offset.
            values = end;
        }
        if end > bytes.len() {
            return Err(format!("truncated: grid {name} ends beyond the file"));
        }
        if start < cursor.at() || values < start || end < values {
            return Err(format!(
                "damaged: the offsets of grid {name} are not in order"
            ));
        }
        let mut cursor = Cursor::between(bytes, start, values)?;
        let compression = match version < version::PER_GRID {
            true => compression,
            false => cursor.number()?,
        };
        let known = compression::ZIP | compression::ACTIVE_MASK | compression::BLOSC;
        if compression & !known != 0 {
            return Err(format!(
                "grid {name} has an unknown compression, {compression:#x}"
            ));
        }
        Ok(Self {
            metadata: metadata(&mut cursor)?,
            transform: cursor.at(),
            name,
            kind,
            instance_of,
            version,
            compression,
            values,
            end,
        })
    }

    fn class(&self) -> &str {
        match self.metadata.get("class") {
            Some(Metadata::Text(class)) => class,
            _ => "",
        }
    }

    /// Reads the transform and the tree of a grid of floats.
    fn level_set(&self, bytes: &[u8]) -> Result<LevelSet, String> {
        let fail = |error| format!("grid {}: {error}", self.name);
        self.content(bytes).map_err(fail)
    }

    fn content(&self, bytes: &[u8]) -> Result<LevelSet, String> {
        if !self.instance_of.is_empty() {
            return Err(format!("it shares the tree of grid {}", self.instance_of));
        }
        let mut cursor = Cursor::between(bytes, self.transform, self.values)?;
        let (scale, translation) = transform(&mut cursor)?;
        let mut tree = Tree {
            cursor,
            version: self.version,
            compression: self.compression,
            is_half: self.metadata.get("is_saved_as_half_float") == Some(&Metadata::Flag(true)),
            background: 0.0,
        };
        let origins = tree.topology()?;
        tree.cursor = Cursor::between(bytes, self.values, self.end)?;
        let leaves = origins.into_iter().map(|origin| tree.leaf(origin));
        Ok(LevelSet {
            scale,
            translation,
            leaves: leaves.collect::<Result<_, _>>()?,
        })
    }
}

/// Reads the entries whose kinds are known.
fn metadata(cursor: &mut Cursor<'_>) -> Result<BTreeMap<String, Metadata>, String> {
    let mut entries = BTreeMap::new();
    for _ in 0..cursor.number()? {
        let (name, kind) = (cursor.text()?, cursor.text()?);
        if let Some(value) = Metadata::of(&kind, cursor.counted()?) {
            entries.insert(name, value);
        }
    }
    Ok(entries)
}

/// Reads the edge lengths of a voxel and the centre of voxel (0, 0, 0).
fn transform(cursor: &mut Cursor<'_>) -> Result<(DVec3, DVec3), String> {
    let translation = match cursor.text()?.as_str() {
        "UniformScaleMap" => [0.0; 3],
        "UniformScaleTranslateMap" | "ScaleTranslateMap" => cursor.doubles()?,
        other => {
            return Err(format!(
                "its transform is of kind {other}; allowed are a scale and a translation"
            ));
        }
    };
    let scale = cursor.doubles()?;
    // Voxel size, inverse of the scale, of its square and of its double.
    cursor.take(4 * 24)?;
    Ok((DVec3::from_array(scale), DVec3::from_array(translation)))
}
