//! Reads solids whose shape changes: a mesh file for each of evenly spaced times.

use std::path::{Path, PathBuf};

use super::{
    document::Document,
    keys::{FilesSpec, MeshSpec, SequenceSpec, SolidSpec},
    moving_solid::check_way,
    placed_mesh::placed_mesh_like,
    wave_maker,
};
use swell_domain::{
    mesh_file::Outline, name_pattern::Pattern, shape::ShapeSequence, sources::Emitter,
};
use swell_scene::{
    PlacedMesh, SceneError, mesh_sequence::MeshSequence, moving_solid::MovingSolid, sources::Region,
};

/// Most files of a sequence.
const MOST_FILES: usize = 100_000;

type Result<T> = std::result::Result<T, SceneError>;

/// Builds the solid at `path` from its mesh files.
pub(super) fn build(
    doc: &Document<'_>,
    path: &str,
    (solid, spec): (&SolidSpec, &SequenceSpec),
    around: &wave_maker::Surroundings<'_>,
) -> Result<MovingSolid> {
    let key = format!("{path}.sequence.files");
    let (names, first) = names(doc, &key, spec, around.base_dir)?;
    let hashes = hashes(doc, path, spec, names.len())?;
    let (mut outline, mut placed) = (None, Vec::<PlacedMesh>::new());
    let mut faults = Vec::new();
    for (index, name) in names.iter().enumerate() {
        let mesh = solid.placed(name, hashes.get(index));
        let (one, own) = read(doc, &key, (&mesh, around), outline.as_ref())?;
        note(&mut faults, &one, placed.is_empty());
        outline = Some(own);
        placed.push(one);
    }
    let rate = spec
        .frames_per_second
        .unwrap_or(around.shot.frames_per_second);
    let begin = match spec.start {
        Some(start) => (f64::from(first) - f64::from(start)) / rate + around.shot.time(1),
        None => f64::from(first) / rate,
    };
    let files = placed.iter();
    let files = files
        .map(|it| (it.file.clone(), it.file_hash.clone()))
        .collect();
    let meshes = placed.iter_mut().map(|it| std::mem::take(&mut it.mesh));
    let shape = ShapeSequence::new(meshes.collect(), begin, rate);
    let mut placed = placed.swap_remove(0);
    placed.mesh = shape.mesh(0.0);
    let built = MovingSolid {
        placed,
        slide: None,
        turn: None,
        track: None,
        sequence: Some(MeshSequence {
            shape,
            files,
            first,
            start: spec.start,
            faults,
        }),
        body: None,
        floor: None,
    };
    check_way(doc, &built, path, around.domain, around.shot)?;
    Ok(built)
}

/// Returns the names of the files in order, as a scene would give them, and the first one's number.
fn names(
    doc: &Document<'_>,
    key: &str,
    spec: &SequenceSpec,
    base_dir: &Path,
) -> Result<(Vec<String>, u32)> {
    let fail = |problem: String| doc.fault_of_plain(key, problem);
    match &spec.files {
        FilesSpec::List(names) if (2..=MOST_FILES).contains(&names.len()) => {
            Ok((names.clone(), spec.first.unwrap_or(0)))
        }
        FilesSpec::List(names) => {
            let problem = format!("{} files", names.len());
            Err(fail(format!("{problem}; allowed are 2 to {MOST_FILES}")))
        }
        FilesSpec::Pattern(_) if spec.first.is_some() => {
            let key = key.replace(".files", ".first");
            let problem = "the files have their numbers in their names";
            Err(doc.fault_of_plain(&key, problem))
        }
        FilesSpec::Pattern(text) => {
            let pattern: Pattern = text.parse().map_err(|_| {
                fail(format!(
                    "the file's name in {text:?} has to hold one place for a number: write %04d or \
                     ####"
                ))
            })?;
            let folder = pattern.folder().to_string_lossy().into_owned();
            let numbers = numbers(doc, key, (&pattern, &folder), base_dir)?;
            let listed = numbers.iter().map(|&number| {
                let file = pattern.file(number);
                file.to_string_lossy().into_owned()
            });
            Ok((listed.collect(), numbers[0]))
        }
    }
}

/// Returns the numbers of the files that a pattern names: without a gap, at least two.
fn numbers(
    doc: &Document<'_>,
    key: &str,
    (pattern, folder): (&Pattern, &str),
    base_dir: &Path,
) -> Result<Vec<u32>> {
    let named = |number: u32| {
        let file: PathBuf = pattern.file(number);
        file.display().to_string()
    };
    let fail = |problem: String| doc.fault_of_plain(key, problem);
    let found = doc.find(base_dir, key, if folder.is_empty() { "." } else { folder })?;
    let read = || -> std::io::Result<Vec<u32>> {
        let mut numbers = Vec::new();
        for entry in std::fs::read_dir(&found)? {
            let name = entry?.file_name();
            numbers.extend(name.to_str().and_then(|name| pattern.number_in(name)));
        }
        Ok(numbers)
    };
    let mut numbers = read().map_err(|error| {
        let folder = found.display();
        fail(format!("cannot list the folder {folder}: {error}"))
    })?;
    numbers.sort_unstable();
    let gap = numbers.windows(2).find(|pair| pair[1] != pair[0] + 1);
    if let Some(&[before, after]) = gap {
        let missing = named(before + 1);
        return Err(fail(format!(
            "{missing} is missing between {} and {}",
            named(before),
            named(after)
        )));
    }
    match numbers.len() {
        0 => Err(fail(format!("there is no file like {}", named(1)))),
        1 => Err(fail(format!(
            "there is only {}; a shape changes between two files",
            named(numbers[0])
        ))),
        2..=MOST_FILES => Ok(numbers),
        many => Err(fail(format!("{many} files; allowed are 2 to {MOST_FILES}"))),
    }
}

/// Returns the hashes that files must have; empty where none is given.
fn hashes<'a>(
    doc: &Document<'_>,
    path: &str,
    spec: &'a SequenceSpec,
    files: usize,
) -> Result<&'a [String]> {
    let hashes = spec.blake3.as_deref().unwrap_or_default();
    if hashes.is_empty() || hashes.len() == files {
        return Ok(hashes);
    }
    let problem = format!("{} hashes for {files} files", hashes.len());
    Err(doc.fault_of(&format!("{path}.sequence.blake3"), problem))
}

/// Reads a file with the outline of the one before it, where its faces have the same corners.
fn read(
    doc: &Document<'_>,
    key: &str,
    (mesh, around): (&MeshSpec, &wave_maker::Surroundings<'_>),
    before: Option<&Outline>,
) -> Result<(PlacedMesh, Outline)> {
    let hash_key = key.replace(".files", ".blake3");
    let spec = (mesh, around.spacing);
    placed_mesh_like(doc, around.base_dir, (key, &hash_key), spec, before)
}

/// Notes what is odd in a file; the warnings of a scene cover the first one.
fn note(faults: &mut Vec<String>, placed: &PlacedMesh, is_first: bool) {
    /// Most files that are named.
    const MOST: usize = 4;
    let is_odd = !placed.holes.0.is_empty() || !placed.faults.is_empty();
    if is_first || !is_odd || faults.len() == MOST {
        return;
    }
    let name = placed
        .file
        .file_name()
        .unwrap_or_default()
        .to_string_lossy();
    let open = (!placed.holes.0.is_empty()).then(|| format!("it is open: {}", placed.holes));
    let all: Vec<String> = open
        .into_iter()
        .chain(placed.faults.iter().cloned())
        .collect();
    faults.push(format!("solid.sequence: {name}: {}", all.join("; ")));
}

/// Rejects emitters in whose volume a solid comes whose shape changes: what waits there follows
/// from where solids were before.
pub(super) fn check_emitters(
    doc: &Document<'_>,
    solids: &[MovingSolid],
    emitters: &[Emitter<Region>],
    spacing: f64,
) -> Result<()> {
    for (index, emitter) in emitters.iter().enumerate() {
        let room = emitter.shape.bounds().grown(spacing);
        for solid in solids {
            let both = solid
                .changing_bounds()
                .map(|around| around.intersection(&room));
            if both.is_some_and(|both| both.min.cmplt(both.max).all()) {
                let problem = format!(
                    "the emitter's volume meets the box around {}, whose shape changes; move one \
                     of them",
                    solid.name()
                );
                return Err(doc.fault_of_plain(&format!("emitter[{index}]"), problem));
            }
        }
    }
    Ok(())
}

impl From<&MeshSequence> for SequenceSpec {
    fn from(sequence: &MeshSequence) -> Self {
        let files = sequence.files.iter();
        Self {
            files: FilesSpec::List(
                files
                    .clone()
                    .map(|(file, _)| file.to_string_lossy().into_owned())
                    .collect(),
            ),
            blake3: Some(files.map(|(_, hash)| hash.clone()).collect()),
            first: Some(sequence.first),
            start: sequence.start,
            frames_per_second: Some(sequence.shape.rate()),
        }
    }
}
