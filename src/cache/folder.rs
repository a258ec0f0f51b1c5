//! The folder of a cache: which directories are acceptable for a new one, its subfolders, and the
//! clean-up after a killed process.

use std::path::{Path, PathBuf};

use super::disk;
use super::error::CacheError;
use super::ledger;
use super::manifest::{self, Manifest};
use super::stream::{PARTICLES, STREAMS, Stream};
use swell_domain::output::{self, AtPath as _, FileError, complete_name};

/// The cache that contains `path`, or would contain it, with links resolved. A cache whose creation
/// has only begun counts too.
fn around(path: &Path) -> Option<PathBuf> {
    let mut real = std::path::absolute(path).ok()?;
    // A path that does not exist yet is resolved through its nearest existing ancestor.
    while real.canonicalize().map(|found| real = found).is_err() {
        if !real.pop() {
            return None;
        }
    }
    let is_cache = |dir: &Path| {
        (manifest::exists(dir) && dir.join(ledger::FILE).is_file()) || disk::is_begun(dir)
    };
    real.ancestors()
        .find(|dir| is_cache(dir))
        .map(Path::to_owned)
}

/// An output would be written into a cache.
#[derive(Debug, thiserror::Error)]
#[error("{} is in the cache {}: choose another {choose}", path.display(), cache.display())]
pub struct IntoCache {
    path: PathBuf,
    cache: PathBuf,
    choose: &'static str,
}

/// Refuses an output at `path` inside a cache. `choose` says what the user has to change.
///
/// # Errors
/// [`IntoCache`].
pub fn refuse_inside(path: &Path, choose: &'static str) -> Result<(), IntoCache> {
    around(path).map_or(Ok(()), |cache| {
        Err(IntoCache {
            path: path.to_owned(),
            cache,
            choose,
        })
    })
}

/// Creates a folder for each stream of the manifest.
pub(super) fn make_streams(dir: &Path, manifest: &Manifest) -> Result<(), FileError> {
    Stream::all(manifest).try_for_each(|stream| output::create_folder(&dir.join(stream.folder)))
}

/// Refuses a directory that holds anything but an interrupted creation of our own: our lock, no
/// manifest, and at most one frame.
///
/// # Errors
/// [`CacheError::Exists`], [`CacheError::Occupied`], [`CacheError::Io`].
pub fn refuse_occupied(dir: &Path) -> Result<(), CacheError> {
    if manifest::exists(dir) {
        return Err(CacheError::Exists {
            dir: dir.to_owned(),
        });
    }
    let occupied = |found: String| {
        Err(CacheError::Occupied {
            dir: dir.to_owned(),
            found,
        })
    };
    let names = match dir.metadata() {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        other if other.as_ref().is_ok_and(|m| !m.is_dir()) => {
            return occupied("it is a file".to_owned());
        }
        other => other.at(dir).and_then(|_| output::names(dir))?,
    };
    let Some(first) = names.first() else {
        return Ok(());
    };
    if !disk::has_our_lock(dir) {
        return occupied(first.clone());
    }
    let ours = [
        disk::LOCK,
        manifest::SCENE,
        manifest::ASSETS,
        ledger::FILE,
        manifest::FILE,
    ];
    let is_ours = |name: &&String| {
        let name = plain(name);
        ours.contains(&name) || STREAMS.iter().any(|stream| stream.folder == name)
    };
    if let Some(other) = names.iter().find(|name| !is_ours(name)) {
        return occupied(other.clone());
    }
    for stream in &STREAMS {
        let path = dir.join(stream.folder);
        let names = match path.is_dir() {
            true => output::names(&path)?,
            false => Vec::new(),
        };
        let first = names.first().map(|name| plain(name).to_owned());
        let is_ours = |name: &&String| {
            let name = plain(name);
            Path::new(name)
                .extension()
                .is_some_and(|e| e == stream.extension)
                && (!stream.is_by_frame() || first.as_deref() == Some(name))
        };
        if let Some(other) = names.iter().find(|name| !is_ours(name)) {
            let folder = stream.folder;
            return occupied(format!("{folder}/{other}, but no {}", manifest::FILE));
        }
    }
    Ok(())
}

/// A name without the ending of an incomplete file.
fn plain(name: &str) -> &str {
    complete_name(name).unwrap_or(name)
}

/// Removes everything that [`refuse_occupied`] accepts, except the lock.
pub(super) fn clear_unfinished(dir: &Path) -> Result<(), FileError> {
    for name in output::names(dir)? {
        let path = dir.join(&name);
        let is_stream = STREAMS.iter().any(|stream| stream.folder == name);
        if is_stream || name == manifest::ASSETS {
            output::remove_folder(&path)?;
        } else if name != disk::LOCK {
            output::remove_file(&path)?;
        }
    }
    Ok(())
}

/// Removes what a crash leaves in the folders of all streams: temporary files, files after frame
/// `last` (renamed, but without a line in the ledger), and particles that the manifest does not
/// keep.
pub(super) fn clear_leftovers(dir: &Path, manifest: &Manifest, last: u32) -> Result<(), FileError> {
    for stream in Stream::all(manifest) {
        let folder = dir.join(stream.folder);
        for name in output::names(&folder)? {
            let is_behind = frame_of(&name).is_some_and(|frame| {
                let file = stream.frame_file(manifest, frame);
                let is_ours = stream.is_by_frame() && Path::new(&file).ends_with(&name);
                let stays = stream.name != PARTICLES || manifest.has_particles(frame, last);
                is_ours && (frame > last || !stays)
            });
            if is_behind || plain(&name).len() < name.len() {
                output::remove_file(&folder.join(&name))?;
            }
        }
        output::sync_folder(&folder)?;
    }
    Ok(())
}

/// The number in `NAME.0001.EXTENSION`, compressed or not.
fn frame_of(name: &str) -> Option<u32> {
    let (stem, _) = name.strip_suffix(".zst").unwrap_or(name).rsplit_once('.')?;
    stem.rsplit_once('.')?.1.parse().ok()
}
