//! Shader composition with `#import "path"`, `#ifdef NAME`, `#else` and `#endif`, from the files
//! embedded in the binary or from a folder of edited ones.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs, io,
    path::{Path, PathBuf},
    sync::Arc,
};

use include_dir::{Dir, include_dir};

use super::error::GpuError;

static SHADERS: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/../../shaders");

/// Lists every WGSL file that is a pass, as `folder/name`, sorted; `shared/` holds only imports.
pub fn pass_files() -> Vec<String> {
    let mut names: Vec<String> = SHADERS
        .dirs()
        .filter(|dir| dir.path() != Path::new("shared"))
        .flat_map(|dir| dir.files())
        .filter(|file| is_wgsl(file.path()))
        .map(|file| {
            file.path()
                .with_extension("")
                .to_string_lossy()
                .replace('\\', "/")
        })
        .collect();
    names.sort();
    names
}

/// Composes the shipped shader `name`, as [`Shaders::compose`].
///
/// # Errors
/// Those of [`Shaders::compose`].
pub fn compose(name: &str, defines: &[&str]) -> Result<String, GpuError> {
    Shaders::default().compose(name, defines)
}

/// Texts of all shipped files.
#[cfg(test)]
pub(super) fn shipped_texts() -> impl Iterator<Item = &'static str> {
    let files = SHADERS.dirs().flat_map(Dir::files);
    files.filter_map(|file| file.contents_utf8())
}

fn is_wgsl(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension == "wgsl")
}

/// WGSL files that passes are composed from: the shipped ones by default, or a snapshot of those in
/// a folder.
#[derive(Clone, Debug)]
pub struct Shaders {
    /// Text by path relative to the folder, with `/`; `None` for the shipped files.
    files: Option<Arc<BTreeMap<String, String>>>,
    hash: Option<Arc<str>>,
}

/// WGSL of a pass, with the origin of each line.
#[derive(Clone, Debug, Default)]
pub(super) struct Composed {
    pub(super) text: String,
    files: Vec<String>,
    /// For each line of the text, the index of its file and its line number there, from 1.
    places: Vec<(usize, usize)>,
}

impl Composed {
    /// Origin of a line of the text, counted from 1, such as `shared/walls.wgsl:12`.
    pub(super) fn location(&self, line: usize) -> String {
        let place = line.checked_sub(1).and_then(|index| self.places.get(index));
        place.map_or_else(
            || format!("line {line}"),
            |&(file, line)| format!("{}:{line}", self.files[file]),
        )
    }
}

/// Error in a folder of edited shaders.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ShadersError {
    /// A file or folder cannot be read.
    #[error("cannot read the shaders in {}", file.display())]
    Unreadable {
        /// Path concerned.
        file: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// A shipped file has no counterpart in the folder.
    #[error(
        "the edited shaders in {} lack {file}; begin from a copy of the whole folder \
         shaders/ of swell's source",
        folder.display()
    )]
    Missing {
        /// The folder.
        folder: PathBuf,
        /// Path of the missing file in the folder.
        file: String,
    },
}

impl Default for Shaders {
    fn default() -> Self {
        Self::SHIPPED
    }
}

impl Shaders {
    const SHIPPED: Self = Self {
        files: None,
        hash: None,
    };

    /// Reads every WGSL file below `folder`. Files that nothing imports are allowed, so that a pass
    /// can be split.
    ///
    /// # Errors
    /// [`ShadersError`], also if a shipped file is missing: the set would be taken for an
    /// edited one.
    pub fn read(folder: &Path) -> Result<Self, ShadersError> {
        let mut files = BTreeMap::new();
        collect(folder, folder, &mut files)?;
        let shipped = shipped();
        if let Some(file) = shipped.keys().find(|&file| !files.contains_key(file)) {
            return Err(ShadersError::Missing {
                folder: folder.to_owned(),
                file: file.clone(),
            });
        }
        let hash = (files != shipped).then(|| hash(&files).into());
        Ok(Self {
            files: Some(Arc::new(files)),
            hash,
        })
    }

    /// Adds a file, or replaces one, such as `own/speeds.wgsl` for a pass `own/speeds`; it may
    /// import the others.
    #[must_use]
    pub fn with_file(&self, path: &str, text: &str) -> Self {
        let mut files = match &self.files {
            Some(files) => files.as_ref().clone(),
            None => shipped(),
        };
        files.insert(path.to_owned(), text.to_owned());
        Self {
            hash: Some(hash(&files).into()),
            files: Some(Arc::new(files)),
        }
    }

    /// Returns a hash of edited files: BLAKE3 in hex over all WGSL files in the order of their
    /// paths, for each the lengths of path and text as 8 bytes each, little-endian, then both.
    /// `None` for the shipped files, even if they were read from a folder.
    pub fn edited(&self) -> Option<&str> {
        self.hash.as_deref()
    }

    /// Composes the WGSL text of `name` (such as `pbf/predict`), with each import included once and
    /// conditions resolved.
    ///
    /// # Errors
    /// If a file does not exist, or a condition is not closed.
    pub fn compose(&self, name: &str, defines: &[&str]) -> Result<String, GpuError> {
        self.compose_with_places(name, defines)
            .map(|composed| composed.text)
    }

    /// Same as [`Self::compose`], with the origin of each line.
    pub(super) fn compose_with_places(
        &self,
        name: &str,
        defines: &[&str],
    ) -> Result<Composed, GpuError> {
        let mut out = Composed::default();
        let mut seen = BTreeSet::new();
        self.append(&format!("{name}.wgsl"), None, defines, &mut seen, &mut out)?;
        Ok(out)
    }

    /// Marks a shader error as one of edited shaders, if they are edited.
    pub(crate) fn blamed(&self, error: GpuError) -> GpuError {
        match error {
            GpuError::Shader { name, message } if self.hash.is_some() => {
                GpuError::EditedShader { name, message }
            }
            error => error,
        }
    }

    /// Returns the shipped shaders if these are edited and a pass of this name is shipped.
    pub(super) fn shipped_beside(&self, name: &str) -> Option<Self> {
        let is_shipped = Self::SHIPPED.source(&format!("{name}.wgsl")).is_some();
        (self.hash.is_some() && is_shipped).then_some(Self::SHIPPED)
    }

    fn source(&self, path: &str) -> Option<&str> {
        match &self.files {
            Some(files) => files.get(path).map(String::as_str),
            None => SHADERS.get_file(path)?.contents_utf8(),
        }
    }
    fn append(
        &self,
        path: &str,
        importer: Option<&str>,
        defines: &[&str],
        seen: &mut BTreeSet<String>,
        out: &mut Composed,
    ) -> Result<(), GpuError> {
        if !seen.insert(path.to_owned()) {
            return Ok(());
        }
        let fault = |line: usize, what: &str| GpuError::Shader {
            name: path.to_owned(),
            message: format!("line {line}: {what}"),
        };
        let text = self.source(path).ok_or_else(|| GpuError::Shader {
            name: path.to_owned(),
            message: match importer {
                Some(place) => format!("no such file, and {place} imports it"),
                None => "no such file".to_owned(),
            },
        })?;
        let file = out.files.len();
        out.files.push(path.to_owned());
        let mut open: Vec<(usize, bool)> = Vec::new();
        for (index, line) in text.lines().enumerate() {
            let mut words = line.split_whitespace();
            let directive = words.next().unwrap_or("");
            let argument = words.next().unwrap_or("").trim_matches('"');
            let live = open.iter().all(|&(_, on)| on);
            match directive {
                "#import" if live => {
                    let place = format!("{path}:{}", index + 1);
                    self.append(argument, Some(&place), defines, seen, out)?;
                }
                "#import" => {}
                "#ifdef" => open.push((index + 1, defines.contains(&argument))),
                "#ifndef" => open.push((index + 1, !defines.contains(&argument))),
                "#else" => match open.last_mut() {
                    Some((_, on)) => *on = !*on,
                    None => return Err(fault(index + 1, "#else without #ifdef")),
                },
                "#endif" => {
                    open.pop()
                        .ok_or_else(|| fault(index + 1, "#endif without #ifdef"))?;
                }
                _ if live => {
                    out.text.push_str(line);
                    out.text.push('\n');
                    out.places.push((file, index + 1));
                }
                _ => {}
            }
        }
        match open.pop() {
            Some((line, _)) => Err(fault(line, "#ifdef without #endif")),
            None => Ok(()),
        }
    }
}

fn shipped() -> BTreeMap<String, String> {
    let files = SHADERS.dirs().flat_map(|dir| dir.files());
    files
        .filter(|file| is_wgsl(file.path()))
        .filter_map(|file| {
            let path = file.path().to_string_lossy().replace('\\', "/");
            Some((path, file.contents_utf8()?.to_owned()))
        })
        .collect()
}

fn collect(
    root: &Path,
    folder: &Path,
    files: &mut BTreeMap<String, String>,
) -> Result<(), ShadersError> {
    let unreadable = |file: &Path| {
        let file = file.to_owned();
        |source| ShadersError::Unreadable { file, source }
    };
    for entry in fs::read_dir(folder).map_err(unreadable(folder))? {
        let path = entry.map_err(unreadable(folder))?.path();
        if path.is_dir() {
            collect(root, &path, files)?;
        } else if is_wgsl(&path) {
            let text = fs::read_to_string(&path).map_err(unreadable(&path))?;
            let relative = path.strip_prefix(root).unwrap_or(&path);
            files.insert(relative.to_string_lossy().replace('\\', "/"), text);
        }
    }
    Ok(())
}

fn hash(files: &BTreeMap<String, String>) -> String {
    let mut hasher = blake3::Hasher::new();
    for (path, text) in files {
        hasher.update(&(path.len() as u64).to_le_bytes());
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(path.as_bytes());
        hasher.update(text.as_bytes());
    }
    hasher.finalize().to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &BTreeMap<String, String>) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        for (path, text) in files {
            let path = folder.path().join(path);
            fs::create_dir_all(path.parent().expect("a room")).expect("a room");
            fs::write(path, text).expect("a file");
        }
        folder
    }

    #[test]
    fn a_folder_is_edited_where_a_byte_of_it_is() {
        let mut files = shipped();
        let same = Shaders::read(folder(&files).path()).expect("the shipped files");
        assert_eq!(same.edited(), None);
        assert_eq!(
            same.compose("pbf/predict", &[]).expect("it composes"),
            compose("pbf/predict", &[]).expect("it composes")
        );
        let mut hashes = BTreeSet::new();
        for (path, more) in [
            ("pbf/predict.wgsl", "// a word\n"),
            ("shared/walls.wgsl", "// a word\n"),
            ("shared/another.wgsl", ""),
        ] {
            let mut edited = files.clone();
            *edited.entry(path.to_owned()).or_default() += more;
            let read = Shaders::read(folder(&edited).path()).expect("whole");
            hashes.insert(read.edited().expect("edited").to_owned());
        }
        assert_eq!(hashes.len(), 3);
        files.remove("shared/walls.wgsl");
        let error = Shaders::read(folder(&files).path()).expect_err("a file is missing");
        assert!(error.to_string().contains("shared/walls.wgsl"), "{error}");
        assert!(Shaders::read(Path::new("/nowhere")).is_err());
    }

    #[test]
    fn a_fault_of_an_edited_shader_is_its_editors() {
        let fault = || GpuError::Shader {
            name: "pbf/predict".into(),
            message: "what".into(),
        };
        let mut files = shipped();
        files.insert("shared/more.wgsl".into(), String::new());
        let edited = Shaders::read(folder(&files).path()).expect("whole");
        assert!(matches!(
            edited.blamed(fault()),
            GpuError::EditedShader { .. }
        ));
        assert!(matches!(
            Shaders::default().blamed(fault()),
            GpuError::Shader { .. }
        ));
    }
}
