//! The folder of a cache: which directories are acceptable for a new one, its subfolders, and the
//! clean-up after a killed process.

use std::fs;
use std::path::{Path, PathBuf};

use super::disk;
use super::error::{AtPath, CacheError};
use super::ledger;
use super::manifest::{self, Manifest};
use super::stream::{PARTICLES, STREAMS, Stream};

/// The cache that contains `path`, or would contain it, with links resolved. A cache whose creation
/// has only begun counts too.
pub fn around(path: &Path) -> Option<PathBuf> {
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

/// Creates a folder for each stream of the manifest.
pub(super) fn make_streams(dir: &Path, manifest: &Manifest) -> Result<(), CacheError> {
    Stream::all(manifest).try_for_each(|stream| disk::create_directory(&dir.join(stream.folder)))
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
        other => other.at(dir).and_then(|_| disk::names(dir))?,
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
        let names = if path.is_dir() {
            disk::names(&path)?
        } else {
            Vec::new()
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

/// A name without the extension of a temporary file.
fn plain(name: &str) -> &str {
    name.strip_suffix(disk::TEMPORARY)
        .and_then(|name| name.strip_suffix('.'))
        .unwrap_or(name)
}

/// Removes everything that [`refuse_occupied`] accepts, except the lock.
pub(super) fn clear_unfinished(dir: &Path) -> Result<(), CacheError> {
    for name in disk::names(dir)? {
        let path = dir.join(&name);
        let is_stream = STREAMS.iter().any(|stream| stream.folder == name);
        if is_stream || name == manifest::ASSETS {
            fs::remove_dir_all(&path).at(&path)?;
        } else if name != disk::LOCK {
            fs::remove_file(&path).at(&path)?;
        }
    }
    Ok(())
}

/// Removes what a crash leaves in the folders of all streams: temporary files, files after frame
/// `last` (renamed, but without a line in the ledger), and particles that the manifest does not
/// keep.
pub(super) fn clear_leftovers(
    dir: &Path,
    manifest: &Manifest,
    last: u32,
) -> Result<(), CacheError> {
    for stream in Stream::all(manifest) {
        let folder = dir.join(stream.folder);
        for name in disk::names(&folder)? {
            let is_behind = frame_of(&name).is_some_and(|frame| {
                let file = stream.frame_file(manifest, frame);
                let is_ours = stream.is_by_frame() && Path::new(&file).ends_with(&name);
                let stays = stream.name != PARTICLES || manifest.has_particles(frame, last);
                is_ours && (frame > last || !stays)
            });
            if is_behind || plain(&name).len() < name.len() {
                let path = folder.join(&name);
                fs::remove_file(&path).at(&path)?;
            }
        }
        disk::sync_directory(&folder)?;
    }
    Ok(())
}

/// The number in `NAME.0001.EXTENSION`, compressed or not.
fn frame_of(name: &str) -> Option<u32> {
    let (stem, _) = name.strip_suffix(".zst").unwrap_or(name).rsplit_once('.')?;
    stem.rsplit_once('.')?.1.parse().ok()
}
