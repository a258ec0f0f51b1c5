//! The output folder of pictures: whose pictures it holds, and which processes are working in it.
//!
//! `render.json` names the owner of the pictures, and stays. It is locked briefly while a process
//! enters or leaves. While processes are working, there is a folder `.swell/`:
//!
//! ```text
//! work             locked by each working process: shared, or exclusively to overwrite
//! small.0001.lock  locked by the process that renders that frame
//! small.0001.png   draft of a picture until it is complete
//! ```
//!
//! A lock ends with its process, so the frame of a killed process becomes free again. The last
//! process to leave removes `.swell/`; after a kill the next one to enter does.

use std::{
    collections::BTreeSet,
    fs, io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use crate::numbering::Numbering;
use swell_domain::output::{self, AtPath as _, Draft, FileError, Lock, complete_name, names};
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
            ("numbering", self.numbering == other.numbering),
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
    #[error(transparent)]
    File(#[from] FileError),
    /// A picture of another origin exists.
    #[error("{} is {what}; choose another folder, or overwrite it", file.display())]
    Other {
        /// The first such picture.
        file: PathBuf,
        /// What it is.
        what: String,
    },
    /// A picture of another origin would remain beside those to be rendered.
    #[error(
        "{} is {what}, and these frames would leave it: one folder would hold both; choose \
         another folder, or remove it",
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
        "{} is in use: another process renders there {what}; wait for it, or choose another folder",
        directory.display()
    )]
    InUse {
        /// The folder.
        directory: PathBuf,
        /// What they are doing.
        what: String,
    },
}

/// A process's registration in a folder, held while it works there.
#[derive(Debug)]
pub(super) struct Folder {
    path: PathBuf,
    /// Whether this process created the folder.
    is_new: bool,
    /// Lock on the work file; `None` while it is being released.
    work: Option<Lock>,
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
        let gate = close_gate(path)?;
        let room = path.join(ROOM);
        let in_use = |what: &str| FolderError::InUse {
            directory: path.to_owned(),
            what: what.to_owned(),
        };
        if is_deserted(&room)? {
            let is_ours = recorded(&gate).as_ref() == Some(&wanted.owner);
            check_standing(path, wanted, wanted.overwrite || is_ours)?;
            clear(path, &wanted.owner.shot)?;
            if !is_ours {
                let text = serde_json::to_string_pretty(&wanted.owner).map_err(io::Error::from);
                gate.write(&(text.at(path)? + "\n"))?;
            }
            fs::create_dir(&room).at(&room)?;
        } else if wanted.overwrite {
            return Err(in_use("pictures that this one would overwrite"));
        } else {
            let owner = recorded(&gate).ok_or_else(|| in_use("already"))?;
            if let Some(what) = owner.difference(&wanted.owner) {
                return Err(in_use(&format!("another {what}")));
            }
        }
        let file = room.join(WORK);
        let work = match wanted.overwrite {
            true => Lock::take(&file),
            false => Lock::share(&file),
        };
        let work = Some(work?.ok_or_else(|| in_use("and overwrites pictures"))?);
        Ok(Self {
            path: path.to_owned(),
            is_new,
            work,
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

    /// Claims a frame, `small.0001`, for this process until the lock is dropped; `None` while
    /// another process has it.
    ///
    /// # Errors
    /// [`FolderError::File`].
    pub(super) fn claim(&self, frame: &str) -> Result<Option<Lock>, FolderError> {
        let room = self.path.join(ROOM);
        if !self.work.as_ref().is_some_and(Lock::is_there) {
            let what = io::Error::other("it was removed while this process worked there");
            return Err(FileError::new(&room, what).into());
        }
        let name = room.join(format!("{frame}.lock"));
        Ok(Lock::take(&name)?)
    }

    /// Draft of a claimed frame's picture.
    pub(super) fn draft(&self, name: &str) -> Draft {
        Draft::within(&self.path.join(ROOM), &self.path.join(name))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // The next process to enter clears what cannot be cleared now.
        let Ok(_gate) = close_gate(&self.path) else {
            return;
        };
        self.work = None;
        let room = self.path.join(ROOM);
        if !is_deserted(&room).unwrap_or(false) {
            return;
        }
        let _ = output::remove_folder(&room);
        // If nothing was rendered, nothing is left behind.
        let left = names(&self.path).unwrap_or_default();
        if cfg!(unix) && left == [RECORD] {
            let _ = output::remove_file(&self.path.join(RECORD));
            if self.is_new {
                let _ = fs::remove_dir(&self.path);
            }
        }
    }
}

/// Locks `render.json`: no other process enters or leaves. The holder waits for no other lock.
fn close_gate(folder: &Path) -> Result<Lock, FileError> {
    Lock::wait(&folder.join(RECORD))
}

/// The recorded owner; `None` if the file is empty or was left incomplete by a kill.
fn recorded(gate: &Lock) -> Option<Owner> {
    serde_json::from_str(&gate.read().ok()?).ok()
}

/// Whether no process is working; requires a closed gate.
fn is_deserted(room: &Path) -> Result<bool, FileError> {
    let file = room.join(WORK);
    Ok(!file.exists() || Lock::take(&file)?.is_some())
}

/// Removes what killed processes left: their work folder, and partial pictures beside the complete
/// ones.
fn clear(folder: &Path, shot: &str) -> Result<(), FileError> {
    output::remove_folder(&folder.join(ROOM))?;
    let is_half = |name: &String| {
        let whole = complete_name(name).filter(|name| name.starts_with(&format!("{shot}.")));
        whole.is_some_and(|name| name.ends_with(".png") || name.ends_with(".exr"))
    };
    for name in names(folder)?.iter().filter(|name| is_half(name)) {
        output::remove_file(&folder.join(name))?;
    }
    Ok(())
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
            return Err(FileError::new(&file, io::ErrorKind::IsADirectory).into());
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
