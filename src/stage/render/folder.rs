//! The output folder of pictures: whose pictures it holds, and which processes are working in it.
//!
//! `render.json` names the owner of the pictures, and stays. It is locked briefly while a process
//! enters or leaves. While processes are working, there is a folder `.swell/`:
//!
//! ```text
//! work             locked by each working process: shared, or exclusively with --overwrite
//! small.0001.lock  locked by the process that renders that frame
//! small.0001.png   draft of a picture until it is complete
//! ```
//!
//! A lock ends with its process, so the frame of a killed process becomes free again. The last
//! process to leave removes `.swell/`; after a kill the next one to enter does.

use std::{
    collections::BTreeSet,
    fs::{self, File},
    io::{self, Read as _, Seek as _, Write as _},
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use crate::{
    locked::{is_at, is_had, open},
    numbering::Numbering,
};
use swell_render::{Attributes, image::read_header};

/// Record of the pictures' owner; locked while a process enters or leaves.
const RECORD: &str = "render.json";
/// Folder of files that last only as long as the processes.
const ROOM: &str = ".swell";
/// File that is locked while a process is working.
const WORK: &str = "work";

/// What all pictures of a folder have in common.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Owner {
    /// Program and version.
    pub(super) software: String,
    /// Shot name of the cache.
    pub(super) shot: String,
    /// Hash of its physics.
    pub(super) scene_hash: String,
    /// Chained hash of its first frame, which covers its manifest.
    pub(super) cache: String,
    /// Hash of the look.
    pub(super) look_hash: String,
    /// Offset from the cache's frame numbers to those in the pictures' names.
    #[serde(default)]
    pub(super) numbering: i64,
}

impl Owner {
    /// The first field that differs.
    fn difference(&self, other: &Self) -> Option<&'static str> {
        let rows = [
            ("shot", self.shot == other.shot),
            ("scene", self.scene_hash == other.scene_hash),
            ("cache", self.cache == other.cache),
            ("look", self.look_hash == other.look_hash),
            (
                "numbering (--number-from)",
                self.numbering == other.numbering,
            ),
            (
                "version of the program",
                version_of(&self.software) == version_of(&other.software),
            ),
            ("set of shaders", self.software == other.software),
        ];
        rows.into_iter().find(|row| !row.1).map(|row| row.0)
    }
}

/// Program and version without the note about shaders.
fn version_of(software: &str) -> &str {
    let shaders = software.find(" with shaders ");
    let cache = software.find(", of a cache ");
    let end = [shaders, cache].into_iter().flatten().min();
    &software[..end.unwrap_or(software.len())]
}

/// What a process is going to do in a folder.
pub(super) struct Wanted<'a> {
    pub(super) owner: Owner,
    /// Names of the pictures.
    pub(super) names: BTreeSet<String>,
    /// Whether to replace existing pictures, whoever owns them.
    pub(super) overwrite: bool,
    /// Hash of a frame of the cache; `None` if the cache does not have the frame (yet).
    pub(super) frame_hash: &'a dyn Fn(u32) -> Option<String>,
}

/// Why pictures cannot be written to a folder.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FolderError {
    /// A file or folder that cannot be read, written or locked.
    #[error("{}", file.display())]
    File {
        /// The file or folder.
        file: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// A picture of another origin exists.
    #[error("{} is {what}; choose another -o, or render it again with --overwrite", file.display())]
    Other {
        /// The first such picture.
        file: PathBuf,
        /// What it is.
        what: String,
    },
    /// A picture of another origin would remain beside those to be rendered.
    #[error(
        "{} is {what}, and these frames would leave it: one folder would hold both; choose \
         another -o, or remove it",
        file.display()
    )]
    Left {
        /// The first such picture.
        file: PathBuf,
        /// What it is.
        what: String,
    },
    /// Other processes are working in the folder and cannot share it.
    #[error(
        "{} is in use: another process renders there {what}; wait for it, or choose another -o",
        directory.display()
    )]
    InUse {
        /// The folder.
        directory: PathBuf,
        /// What they are doing.
        what: String,
    },
}

fn at(file: &Path) -> impl FnOnce(io::Error) -> FolderError + use<> {
    let file = file.to_owned();
    move |source| FolderError::File { file, source }
}

/// A process's registration in a folder, held while it works there.
#[derive(Debug)]
pub(super) struct Folder {
    path: PathBuf,
    /// Whether this process created the folder.
    is_new: bool,
    /// Lock on the work file; `None` while it is being released.
    work: Option<File>,
}

impl Folder {
    /// Enters a folder and creates it if it is missing. Processes that render the same look of the
    /// same cache share it.
    ///
    /// # Errors
    /// [`FolderError`]; existing pictures are untouched.
    pub(super) fn enter(path: &Path, wanted: &Wanted<'_>) -> Result<Self, FolderError> {
        let is_new = !path.exists();
        if !is_new && !path.join(RECORD).exists() {
            // An additional check, so that a foreign folder is refused without writing anything to
            // it.
            check_standing(path, wanted, wanted.overwrite)?;
        }
        let mut gate = Gate::close(path)?;
        let room = path.join(ROOM);
        let in_use = |what: &str| FolderError::InUse {
            directory: path.to_owned(),
            what: what.to_owned(),
        };
        if is_deserted(&room)? {
            let is_ours = gate.owner().as_ref() == Some(&wanted.owner);
            check_standing(path, wanted, wanted.overwrite || is_ours)?;
            clear(path, &wanted.owner.shot)?;
            gate.write(&wanted.owner)?;
            fs::create_dir(&room).map_err(at(&room))?;
        } else if wanted.overwrite {
            return Err(in_use("that --overwrite would harm"));
        } else {
            let owner = gate.owner().ok_or_else(|| in_use("already"))?;
            if let Some(what) = owner.difference(&wanted.owner) {
                return Err(in_use(&format!("another {what}")));
            }
        }
        let file = room.join(WORK);
        let work = open(&file).map_err(at(&file))?;
        let tried = match wanted.overwrite {
            true => work.try_lock(),
            false => work.try_lock_shared(),
        };
        if !is_had(tried).map_err(at(&file))? {
            return Err(in_use("with --overwrite"));
        }
        Ok(Self {
            path: path.to_owned(),
            is_new,
            work: Some(work),
        })
    }

    /// Refuses existing pictures that [`Self::enter`] would refuse, without touching the folder.
    /// Does not check whether it is in use.
    ///
    /// # Errors
    /// [`FolderError`].
    pub(super) fn look(path: &Path, wanted: &Wanted<'_>) -> Result<(), FolderError> {
        let record = fs::read_to_string(path.join(RECORD)).unwrap_or_default();
        let owner: Option<Owner> = serde_json::from_str(&record).ok();
        let is_ours = owner.as_ref() == Some(&wanted.owner);
        check_standing(path, wanted, wanted.overwrite || is_ours)
    }

    /// Claims a frame, `small.0001`, for this process until the file is dropped; `None` while
    /// another process has it.
    ///
    /// # Errors
    /// [`FolderError::File`].
    pub(super) fn claim(&self, frame: &str) -> Result<Option<File>, FolderError> {
        let file = self.path.join(ROOM).join(format!("{frame}.lock"));
        let claim = open(&file).map_err(at(&file))?;
        let is_ours = is_had(claim.try_lock()).map_err(at(&file))?;
        Ok(is_ours.then_some(claim))
    }

    /// Path of the draft of a claimed frame's picture.
    pub(super) fn draft(&self, name: &str) -> PathBuf {
        self.path.join(ROOM).join(name)
    }

    /// Moves a complete picture to its final name. Returns its size in bytes.
    ///
    /// # Errors
    /// [`FolderError::File`].
    pub(super) fn publish(&self, name: &str) -> Result<u64, FolderError> {
        let (draft, file) = (self.draft(name), self.path.join(name));
        let bytes = fs::metadata(&draft).map_err(at(&draft))?.len();
        fs::rename(draft, &file).map_err(at(&file))?;
        Ok(bytes)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // The next process to enter clears what cannot be cleared now.
        let Ok(_gate) = Gate::close(&self.path) else {
            return;
        };
        self.work = None;
        let room = self.path.join(ROOM);
        if !is_deserted(&room).unwrap_or(false) {
            return;
        }
        let _ = fs::remove_dir_all(room);
        // If nothing was rendered, nothing is left behind.
        let left = names(&self.path).unwrap_or_default();
        if cfg!(unix) && left.len() == 1 && left.contains(RECORD) {
            let _ = fs::remove_file(self.path.join(RECORD));
            if self.is_new {
                let _ = fs::remove_dir(&self.path);
            }
        }
    }
}

/// A lock on `render.json`: no other process enters or leaves. Its holder waits for no other lock.
struct Gate {
    path: PathBuf,
    file: File,
}

impl Gate {
    fn close(folder: &Path) -> Result<Self, FolderError> {
        let path = folder.join(RECORD);
        loop {
            fs::create_dir_all(folder).map_err(at(folder))?;
            let file = open(&path).map_err(at(&path))?;
            file.lock().map_err(at(&path))?;
            // Another process that rendered nothing may have removed it.
            if is_at(&file, &path) {
                return Ok(Self { path, file });
            }
        }
    }

    /// The recorded owner; `None` if the file is empty or was left incomplete by a kill.
    fn owner(&mut self) -> Option<Owner> {
        let mut text = String::new();
        self.file.rewind().ok()?;
        self.file.read_to_string(&mut text).ok()?;
        serde_json::from_str(&text).ok()
    }

    fn write(&mut self, owner: &Owner) -> Result<(), FolderError> {
        if self.owner().as_ref() == Some(owner) {
            return Ok(());
        }
        let mut write = || {
            let text = serde_json::to_string_pretty(owner)?;
            self.file.set_len(0)?;
            self.file.rewind()?;
            self.file.write_all(text.as_bytes())?;
            self.file.write_all(b"\n")?;
            self.file.sync_all()
        };
        write().map_err(at(&self.path))
    }
}

/// Whether no process is working; requires a closed gate.
fn is_deserted(room: &Path) -> Result<bool, FolderError> {
    let file = room.join(WORK);
    match File::options().read(true).write(true).open(&file) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(true),
        Err(error) => Err(at(&file)(error)),
        Ok(work) => is_had(work.try_lock()).map_err(at(&file)),
    }
}

/// Removes what killed processes left: their work folder, and partial pictures beside the complete
/// ones.
fn clear(folder: &Path, shot: &str) -> Result<(), FolderError> {
    let room = folder.join(ROOM);
    match fs::remove_dir_all(&room) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        other => other.map_err(at(&room))?,
    }
    let is_half = |name: &String| {
        let is_ours = name.starts_with(&format!("{shot}."));
        is_ours && (name.ends_with(".png.part") || name.ends_with(".exr.part"))
    };
    for name in names(folder)?.iter().filter(|name| is_half(name)) {
        let file = folder.join(name);
        fs::remove_file(&file).map_err(at(&file))?;
    }
    Ok(())
}

/// Names of a folder's entries; empty if it does not exist.
fn names(folder: &Path) -> Result<BTreeSet<String>, FolderError> {
    let name = |entry: io::Result<fs::DirEntry>| {
        let entry = entry.map_err(at(folder))?;
        Ok(entry.file_name().to_string_lossy().into_owned())
    };
    match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(BTreeSet::new()),
        other => other.map_err(at(folder))?.map(name).collect(),
    }
}

/// Refuses pictures of another owner, except those that `wanted` may replace.
fn check_standing(
    folder: &Path,
    wanted: &Wanted<'_>,
    may_replace: bool,
) -> Result<(), FolderError> {
    for name in names(folder)? {
        let file = folder.join(&name);
        let is_replaced = wanted.names.contains(&name);
        if is_replaced && file.is_dir() {
            // No picture can take its name, whoever owns it.
            return Err(at(&file)(io::ErrorKind::IsADirectory.into()));
        }
        let Some(what) = stranger(&file, is_replaced, wanted) else {
            continue;
        };
        if !may_replace {
            return Err(FolderError::Other { file, what });
        }
        if !is_replaced {
            return Err(FolderError::Left { file, what });
        }
    }
    Ok(())
}

/// Describes a file that is a picture of another origin. A picture without metadata is ignored
/// unless it has the name of a wanted picture.
fn stranger(file: &Path, is_wanted: bool, wanted: &Wanted<'_>) -> Option<String> {
    let found = match read_header(file) {
        Ok(None) => return None,
        Ok(Some(found)) if !found.look_hash.is_empty() => found,
        Ok(Some(_)) => return is_wanted.then(|| "a picture of another program".to_owned()),
        Err(_) => return is_wanted.then(|| "not a readable picture".to_owned()),
    };
    let cache = (wanted.frame_hash)(found.frame);
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let numbering = Numbering::in_name(&name, &found.shot, found.frame);
    let numbering = numbering.map_or(wanted.owner.numbering, |it| it.offset);
    let mut found = owner_of(found, numbering);
    if let Some(frame) = &cache {
        // The hash of the frame is followed by those of other inputs. If only those differ, the
        // picture is drawn again, not refused.
        let rest = found.cache.strip_prefix(frame.as_str());
        if rest.is_some_and(|rest| rest.starts_with(' ')) {
            found.cache.clone_from(frame);
        }
    }
    let expected = Owner {
        cache: cache.unwrap_or_else(|| found.cache.clone()),
        ..wanted.owner.clone()
    };
    let what = found.difference(&expected)?;
    Some(format!("of another {what}"))
}

/// The owner of a single picture: its frame's hash represents the cache.
fn owner_of(picture: Attributes, numbering: i64) -> Owner {
    Owner {
        software: picture.software,
        shot: picture.shot,
        scene_hash: picture.scene_hash,
        cache: picture.cache_hash,
        look_hash: picture.look_hash,
        numbering,
    }
}

#[cfg(test)]
#[path = "folder/tests.rs"]
mod tests;
