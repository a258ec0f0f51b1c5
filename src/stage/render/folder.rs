//! The folder that pictures go to: whose pictures it holds, and which processes are at work in it.
//!
//! `render.json` says whose pictures they are, and stays. It is locked for the moments in which a process comes or goes.
//! While processes are at work there is a folder `.swell/`:
//!
//! ```text
//! work             locked by each process at work: shared, or alone with --overwrite
//! small.0001.lock  locked by the process that renders that frame
//! small.0001.png   a picture until it is whole
//! ```
//!
//! A lock dies with its process, so the frame of a process that was killed is free again. The last process to leave
//! removes `.swell/`; after a kill the next one to come does.

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

/// Whose pictures they are; its lock is held while a process comes or goes.
const RECORD: &str = "render.json";
/// Folder of what dies with the processes.
const ROOM: &str = ".swell";
/// Locked while a process is at work.
const WORK: &str = "work";

/// What all pictures of a folder have in common.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Owner {
    /// Program and version.
    pub(super) software: String,
    /// Shot of the cache.
    pub(super) shot: String,
    /// Hash of its physics.
    pub(super) scene_hash: String,
    /// Chained hash of its first frame, which covers its manifest.
    pub(super) cache: String,
    /// Hash of the look.
    pub(super) look_hash: String,
    /// What is added to the cache's numbers of frames in the pictures' names.
    #[serde(default)]
    pub(super) numbering: i64,
}

impl Owner {
    /// What differs first.
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

/// Program and version, without what is said of shaders behind them.
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
    /// Whether pictures that stand there are made again, whosever they are.
    pub(super) overwrite: bool,
    /// Hash of a frame of the cache; `None` where the cache has no such frame (yet).
    pub(super) frame_hash: &'a dyn Fn(u32) -> Option<String>,
}

/// Why pictures cannot go to a folder.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// A file or folder that cannot be read, written or locked.
    #[error("{}", file.display())]
    File {
        /// Which.
        file: PathBuf,
        /// The system's words.
        source: io::Error,
    },
    /// A picture of something else stands there.
    #[error("{} is {what}; choose another -o, or render it anew with --overwrite", file.display())]
    Other {
        /// The first one.
        file: PathBuf,
        /// What it is.
        what: String,
    },
    /// A picture of something else would stay beside those that are rendered.
    #[error(
        "{} is {what}, and these frames would leave it: one folder would hold both; choose another -o, or remove it",
        file.display()
    )]
    Left {
        /// The first one.
        file: PathBuf,
        /// What it is.
        what: String,
    },
    /// Other processes are at work there that cannot share it.
    #[error("{} is in use: another process renders there {what}; wait for it, or choose another -o", directory.display())]
    InUse {
        /// Which.
        directory: PathBuf,
        /// What it does.
        what: String,
    },
}

fn at(file: &Path) -> impl FnOnce(io::Error) -> FolderError + use<> {
    let file = file.to_owned();
    move |source| FolderError::File { file, source }
}

/// A process's place in a folder, held while it is at work there.
#[derive(Debug)]
pub(super) struct Folder {
    path: PathBuf,
    /// Whether it was not there before.
    is_new: bool,
    /// `None` while it is given up.
    work: Option<File>,
}

impl Folder {
    /// Enters a folder, which is made where it is missing. Processes that render the same look of the same cache share it.
    ///
    /// # Errors
    /// [`FolderError`]; pictures that stand there are as they were.
    pub(super) fn enter(path: &Path, wanted: &Wanted<'_>) -> Result<Self, FolderError> {
        let is_new = !path.exists();
        if !is_new && !path.join(RECORD).exists() {
            // Once more than needed, so that a folder of something else is refused with nothing written to it.
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

    /// Refuses what [`Self::enter`] would refuse of what stands in a folder, without touching it; whether it is in use is not looked at.
    ///
    /// # Errors
    /// [`FolderError`].
    pub(super) fn look(path: &Path, wanted: &Wanted<'_>) -> Result<(), FolderError> {
        let record = fs::read_to_string(path.join(RECORD)).unwrap_or_default();
        let owner: Option<Owner> = serde_json::from_str(&record).ok();
        let is_ours = owner.as_ref() == Some(&wanted.owner);
        check_standing(path, wanted, wanted.overwrite || is_ours)
    }

    /// Takes a frame, `small.0001`, for this process until the file is dropped; `None` while another has it.
    ///
    /// # Errors
    /// [`FolderError::File`].
    pub(super) fn claim(&self, frame: &str) -> Result<Option<File>, FolderError> {
        let file = self.path.join(ROOM).join(format!("{frame}.lock"));
        let claim = open(&file).map_err(at(&file))?;
        let is_ours = is_had(claim.try_lock()).map_err(at(&file))?;
        Ok(is_ours.then_some(claim))
    }

    /// Where the picture of a claimed frame is written.
    pub(super) fn draft(&self, name: &str) -> PathBuf {
        self.path.join(ROOM).join(name)
    }

    /// Gives a whole picture its name in the folder; tells its bytes.
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
        // What cannot be cleared now is cleared by the next process to come.
        let Ok(_gate) = Gate::close(&self.path) else {
            return;
        };
        self.work = None;
        let room = self.path.join(ROOM);
        if !is_deserted(&room).unwrap_or(false) {
            return;
        }
        let _ = fs::remove_dir_all(room);
        // Where nothing was rendered nothing is left.
        let left = names(&self.path).unwrap_or_default();
        if cfg!(unix) && left.len() == 1 && left.contains(RECORD) {
            let _ = fs::remove_file(self.path.join(RECORD));
            if self.is_new {
                let _ = fs::remove_dir(&self.path);
            }
        }
    }
}

/// `render.json`, locked: no other process comes or goes. Whoever holds it waits for no other lock.
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
            // Another process may have taken it away, having rendered nothing.
            if is_at(&file, &path) {
                return Ok(Self { path, file });
            }
        }
    }

    /// `None` where a kill left half of it, or nothing.
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

/// Whether no process is at work; asked with the gate closed.
fn is_deserted(room: &Path) -> Result<bool, FolderError> {
    let file = room.join(WORK);
    match File::options().read(true).write(true).open(&file) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(true),
        Err(error) => Err(at(&file)(error)),
        Ok(work) => is_had(work.try_lock()).map_err(at(&file)),
    }
}

/// Removes what dead processes left: their room, and half pictures beside the whole ones.
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

/// Of what is in a folder; nothing where there is none.
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

/// Refuses pictures that are not those of `wanted`, but for those that it may replace.
fn check_standing(
    folder: &Path,
    wanted: &Wanted<'_>,
    may_replace: bool,
) -> Result<(), FolderError> {
    for name in names(folder)? {
        let file = folder.join(&name);
        let is_replaced = wanted.names.contains(&name);
        if is_replaced && file.is_dir() {
            // No picture can take its name, whoever it belongs to.
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

/// What a file is where it is a picture of something else. One that tells nothing of itself is of no account, unless
/// it has the name of one that is wanted.
fn stranger(file: &Path, is_wanted: bool, wanted: &Wanted<'_>) -> Option<String> {
    let found = match read_header(file) {
        Ok(None) => return None,
        Ok(Some(found)) if !found.look_hash.is_empty() => found,
        Ok(Some(_)) => return is_wanted.then(|| "a picture of another program".to_owned()),
        Err(_) => return is_wanted.then(|| "no picture that can be read".to_owned()),
    };
    let cache = (wanted.frame_hash)(found.frame);
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let numbering = Numbering::in_name(&name, &found.shot, found.frame);
    let numbering = numbering.map_or(wanted.owner.numbering, |it| it.offset);
    let mut found = owner_of(found, numbering);
    if let Some(frame) = &cache {
        // Behind its frame's hash stand those of what else it was drawn from: other ones are drawn anew, not refused.
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

/// Of one picture: its frame stands for the cache.
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
