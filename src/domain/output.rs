//! Output folders: files that are complete when they have their name, locks between processes, and
//! the removal of what a failure leaves.
//!
//! A file is written under another name, flushed to the disk, renamed, and the rename is flushed
//! too. A lock ends with its process. Each job decides on its own what in a folder is its own.

use std::{
    fs::{self, File, TryLockError},
    io::{self, Read as _, Seek as _, SeekFrom, Write as _},
    path::{Path, PathBuf},
};

/// Ending of a file that is still being written.
const PARTIAL: &str = ".tmp";

/// A file or folder that cannot be read, written, locked or removed.
#[derive(Debug, thiserror::Error)]
#[error("{}", path.display())]
pub struct FileError {
    /// The file or folder.
    pub path: PathBuf,
    /// The system's error.
    pub source: io::Error,
}

impl FileError {
    /// Adds the path to an error.
    pub fn new(path: &Path, source: impl Into<io::Error>) -> Self {
        Self {
            path: path.to_owned(),
            source: source.into(),
        }
    }
}

/// Adds the path that an [`io::Error`] lacks.
pub trait AtPath<T> {
    /// # Errors
    /// [`FileError`] if this is an error.
    fn at(self, path: &Path) -> Result<T, FileError>;
}

impl<T> AtPath<T> for io::Result<T> {
    fn at(self, path: &Path) -> Result<T, FileError> {
        self.map_err(|source| FileError::new(path, source))
    }
}

/// A file or folder that gets its name when it is complete. Dropped before that, it is removed.
#[derive(Debug)]
pub struct Draft {
    partial: PathBuf,
    target: PathBuf,
    is_folder: bool,
}

impl Draft {
    /// A file beside its target, so that the rename stays on one file system.
    pub fn beside(path: &Path) -> Self {
        let mut partial = path.as_os_str().to_owned();
        partial.push(PARTIAL);
        Self {
            partial: partial.into(),
            target: path.to_owned(),
            is_folder: false,
        }
    }

    /// A folder beside its target.
    pub fn folder_beside(path: &Path) -> Self {
        let mut draft = Self::beside(path);
        draft.is_folder = true;
        draft
    }

    /// A file with the name of its target in another folder of the same file system.
    pub fn within(folder: &Path, path: &Path) -> Self {
        Self {
            partial: folder.join(path.file_name().unwrap_or_default()),
            target: path.to_owned(),
            is_folder: false,
        }
    }

    /// Path of the draft.
    pub fn path(&self) -> &Path {
        &self.partial
    }

    /// Path that the draft gets.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Flushes the draft to the disk and gives it its name, which no folder may have. Returns the
    /// length of a file, bytes; 0 for a folder, whose files are not flushed.
    ///
    /// # Errors
    /// [`FileError`].
    pub fn publish(&mut self) -> Result<u64, FileError> {
        let flushed = |file: File| {
            file.sync_all()?;
            Ok(file.metadata()?.len())
        };
        let bytes = match self.is_folder {
            true => 0,
            // Windows flushes only what is opened for writing.
            false => File::options()
                .write(true)
                .open(&self.partial)
                .and_then(flushed)
                .at(&self.partial)?,
        };
        self.rename()?;
        Ok(bytes)
    }

    fn rename(&mut self) -> Result<(), FileError> {
        fs::rename(&self.partial, &self.target).at(&self.target)?;
        // From now on another process may use the draft's name.
        self.partial.clear();
        sync_parent(&self.target)
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        // The first error is the one to report.
        let _ = match self.is_folder {
            true => remove_folder(&self.partial),
            false => remove_file(&self.partial),
        };
    }
}

/// Name that the file gets when it is complete; `None` if it is complete.
pub fn complete_name(name: &str) -> Option<&str> {
    name.strip_suffix(PARTIAL)
}

/// Writes a file that is complete when it has its name.
///
/// # Errors
/// [`FileError`]; an existing file is then unchanged.
pub fn write_with<T>(
    path: &Path,
    fill: impl FnOnce(&mut File) -> io::Result<T>,
) -> Result<T, FileError> {
    let mut draft = Draft::beside(path);
    let create = || {
        let mut file = File::create(&draft.partial)?;
        let filled = fill(&mut file)?;
        file.sync_all()?;
        Ok(filled)
    };
    let filled = create().at(&draft.partial)?;
    draft.rename()?;
    Ok(filled)
}

/// [`write_with`] for content that is already in memory.
///
/// # Errors
/// [`FileError`].
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), FileError> {
    write_with(path, |file| file.write_all(bytes.as_ref()))
}

/// As [`write()`] for a path that the user names: a link keeps leading to the file, and what is no
/// file, such as a pipe, is written directly.
///
/// # Errors
/// [`FileError`].
pub fn write_named(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), FileError> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    match fs::metadata(&target) {
        Ok(found) if !found.is_file() && !found.is_dir() => fs::write(&target, bytes).at(path),
        _ => write(&target, bytes),
    }
}

/// Appends to a file and waits until that is on the disk. If it fails, the file is cut back to its
/// former length.
///
/// # Errors
/// The system's error.
pub fn append(mut file: &File, bytes: &[u8]) -> io::Result<()> {
    let length = file.seek(SeekFrom::End(0))?;
    let written = file.write_all(bytes).and_then(|()| file.sync_data());
    written.inspect_err(|_| {
        // The first error is the one to report; whoever resumes drops half a line.
        let _ = file.set_len(length);
    })
}

/// Removes a file or a link if it exists.
///
/// # Errors
/// [`FileError`].
pub fn remove_file(path: &Path) -> Result<(), FileError> {
    unless_missing(fs::remove_file(path)).map(|_| ()).at(path)
}

/// Removes a folder and everything in it if it exists. Links are not followed.
///
/// # Errors
/// [`FileError`].
pub fn remove_folder(path: &Path) -> Result<(), FileError> {
    unless_missing(fs::remove_dir_all(path))
        .map(|_| ())
        .at(path)
}

/// `None` for what does not exist.
fn unless_missing<T>(found: io::Result<T>) -> io::Result<Option<T>> {
    match found {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        other => other.map(Some),
    }
}

/// Creates a folder and its ancestors, and flushes its entry in the parent.
///
/// # Errors
/// [`FileError`].
pub fn create_folder(folder: &Path) -> Result<(), FileError> {
    fs::create_dir_all(folder).at(folder)?;
    sync_parent(folder)
}

/// Paths of a folder's entries, sorted; none if it does not exist.
///
/// # Errors
/// [`FileError`].
pub fn paths(folder: &Path) -> Result<Vec<PathBuf>, FileError> {
    let entries = unless_missing(fs::read_dir(folder)).at(folder)?;
    let paths = entries.into_iter().flatten().map(|it| Ok(it?.path()));
    let mut paths: Vec<_> = paths.collect::<io::Result<_>>().at(folder)?;
    paths.sort_unstable();
    Ok(paths)
}

/// Names of a folder's entries, sorted; none if it does not exist.
///
/// # Errors
/// [`FileError`].
pub fn names(folder: &Path) -> Result<Vec<String>, FileError> {
    let name = |path: &PathBuf| Some(path.file_name()?.to_string_lossy().into_owned());
    Ok(paths(folder)?.iter().filter_map(name).collect())
}

/// Flushes the entries of a folder to the disk.
///
/// # Errors
/// [`FileError`].
pub fn sync_folder(folder: &Path) -> Result<(), FileError> {
    // Windows cannot open a folder as a file; NTFS journals the rename itself.
    if !cfg!(unix) {
        return Ok(());
    }
    // Some network file systems flush no folders, and a folder may be writable but not readable.
    let is_without = |error: &io::Error| {
        use io::ErrorKind::{InvalidInput, PermissionDenied, Unsupported};
        matches!(error.kind(), InvalidInput | PermissionDenied | Unsupported)
    };
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        Err(error) if is_without(&error) => Ok(()),
        other => other.at(folder),
    }
}

/// Flushes the folder that holds `path`; without it a rename may not survive a power cut.
fn sync_parent(path: &Path) -> Result<(), FileError> {
    match path.parent() {
        Some(parent) if parent.as_os_str().is_empty() => sync_folder(Path::new(".")),
        Some(parent) => sync_folder(parent),
        None => Ok(()),
    }
}

/// A lock file, held until it is dropped or the process ends.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    file: File,
    is_temporary: bool,
}

impl Lock {
    /// Takes the lock; `None` while another process has or shares it. Creates the file and its
    /// folder if they are missing.
    ///
    /// # Errors
    /// [`FileError`].
    pub fn take(path: &Path) -> Result<Option<Self>, FileError> {
        Self::by(path, File::try_lock)
    }

    /// [`Self::take`], shared with other processes that call this.
    ///
    /// # Errors
    /// [`FileError`].
    pub fn share(path: &Path) -> Result<Option<Self>, FileError> {
        Self::by(path, File::try_lock_shared)
    }

    /// [`Self::take`] that waits while another process has the lock.
    ///
    /// # Errors
    /// [`FileError`].
    pub fn wait(path: &Path) -> Result<Self, FileError> {
        loop {
            if let Some(lock) = Self::by(path, |file| file.lock().map_err(TryLockError::Error))? {
                return Ok(lock);
            }
        }
    }

    fn by(
        path: &Path,
        lock: impl Fn(&File) -> Result<(), TryLockError>,
    ) -> Result<Option<Self>, FileError> {
        loop {
            if let Some(folder) = path.parent() {
                fs::create_dir_all(folder).at(folder)?;
            }
            let mut options = File::options();
            options.read(true).write(true).create(true).truncate(false);
            let file = options.open(path).at(path)?;
            if !is_had(lock(&file)).at(path)? {
                return Ok(None);
            }
            let lock = Self {
                path: path.to_owned(),
                file,
                is_temporary: false,
            };
            // A lock on a file that its previous holder has removed excludes nobody.
            if lock.is_there() {
                return Ok(Some(lock));
            }
        }
    }

    /// Removes the file when the lock is dropped.
    pub fn temporary(mut self) -> Self {
        self.is_temporary = true;
        self
    }

    /// Whether the file is still the one at its path.
    pub fn is_there(&self) -> bool {
        is_at(&self.file, &self.path)
    }

    /// The locked file, open for reading and writing.
    pub fn file(&self) -> &File {
        &self.file
    }

    /// Content of the file.
    ///
    /// # Errors
    /// [`FileError`].
    pub fn read(&self) -> Result<String, FileError> {
        let mut text = String::new();
        let mut file = &self.file;
        file.rewind()
            .and_then(|()| file.read_to_string(&mut text))
            .at(&self.path)?;
        Ok(text)
    }

    /// Replaces the content of the file and waits until it is on the disk.
    ///
    /// # Errors
    /// [`FileError`].
    pub fn write(&self, text: &str) -> Result<(), FileError> {
        let mut file = &self.file;
        file.set_len(0)
            .and_then(|()| file.rewind())
            .and_then(|()| file.write_all(text.as_bytes()))
            .and_then(|()| file.sync_all())
            .at(&self.path)
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        if self.is_temporary && self.is_there() {
            // A lock file that stays behind does no harm.
            let _ = remove_file(&self.path);
        }
        // Closing the file is not enough: a process that another thread is spawning holds a copy of
        // the handle until it calls exec, and would keep the lock for that moment.
        let _ = self.file.unlock();
    }
}

/// Whether another process has taken the lock of an existing file, which may belong to another
/// user.
///
/// # Errors
/// [`FileError`].
pub fn is_taken(path: &Path) -> Result<bool, FileError> {
    let is_free = File::open(path).and_then(|file| is_had(file.try_lock_shared()));
    is_free.map(|is_free| !is_free).at(path)
}

/// Converts the result of `try_lock`: whether the lock was acquired.
fn is_had(tried: Result<(), TryLockError>) -> io::Result<bool> {
    match tried {
        Ok(()) => Ok(true),
        Err(TryLockError::WouldBlock) => Ok(false),
        Err(TryLockError::Error(error)) => Err(error),
    }
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let identity = |meta: io::Result<fs::Metadata>| meta.map(|m| (m.dev(), m.ino())).ok();
    identity(file.metadata()) == identity(path.metadata())
}

/// On other systems an open file cannot be removed.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Simulates the copy of the handle that a process being spawned by another thread holds.
    #[test]
    fn a_copy_of_the_lock_file_does_not_keep_the_lock() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("new/lock");
        let held = Lock::take(&path).unwrap().unwrap();
        let copy = held.file.try_clone().unwrap();
        assert!(Lock::take(&path).unwrap().is_none() && is_taken(&path).unwrap());
        drop(held);
        assert!(!is_taken(&path).unwrap());
        let shared = [(); 2].map(|()| Lock::share(&path).unwrap().unwrap());
        assert!(Lock::take(&path).unwrap().is_none());
        drop(shared);
        Lock::take(&path).unwrap().unwrap();
        drop(copy);
    }

    /// A lock on a file that was removed meanwhile excludes nobody.
    #[cfg(unix)]
    #[test]
    fn a_lock_file_that_was_taken_away_is_made_anew() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("new/lock");
        let first = Lock::wait(&path).unwrap();
        let waiting = std::thread::spawn({
            let path = path.clone();
            move || Lock::wait(&path).unwrap()
        });
        std::thread::sleep(std::time::Duration::from_millis(50));
        remove_folder(path.parent().unwrap()).unwrap();
        assert!(!first.is_there());
        drop(first);
        let second = waiting.join().unwrap();
        assert!(second.is_there() && Lock::take(&path).unwrap().is_none());
        drop(second);
        drop(Lock::take(&path).unwrap().map(Lock::temporary));
        assert!(!path.exists());
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_temporary_one() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("file");
        write(&path, "old").unwrap();
        let error = write_with(&path, |file| {
            file.write_all(b"ne")?;
            Err::<(), _>(io::Error::other("torn"))
        });
        assert_eq!(
            complete_name(&error.unwrap_err().path.to_string_lossy()),
            path.to_str()
        );
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(dir.path()).unwrap(), ["file"]);
    }

    #[test]
    fn a_draft_gets_its_name_or_goes() {
        let dir = tempfile::tempdir().unwrap();
        let [folder, file] = ["folder", "file"].map(|name| dir.path().join(name));
        for publish in [false, true] {
            let mut draft = Draft::folder_beside(&folder);
            create_folder(draft.path()).unwrap();
            write(&draft.path().join("file"), "1").unwrap();
            assert!(!publish || draft.publish().is_ok());
            drop(draft);
            assert_eq!(
                names(dir.path()).unwrap(),
                &["folder"][..usize::from(publish)]
            );
        }
        let mut draft = Draft::within(&folder, &file);
        fs::write(draft.path(), "four").unwrap();
        assert_eq!(draft.publish().unwrap(), 4);
        let opened = File::options().write(true).open(&file).unwrap();
        append(&opened, b"!").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"four!");
        // What has the name of a draft and is none stays.
        create_folder(Draft::beside(&folder).path()).unwrap();
        assert!(write(&folder, "").is_err());
        assert_eq!(names(dir.path()).unwrap(), ["file", "folder", "folder.tmp"]);
    }

    /// Control: a file that is not written through a link replaces the link.
    #[cfg(unix)]
    #[test]
    fn write_named_keeps_links_and_devices() {
        let dir = tempfile::tempdir().unwrap();
        let [file, link] = ["file", "link"].map(|name| dir.path().join(name));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink("file", &link).unwrap();
        write_named(&link, "new").unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
        write_named(Path::new("/dev/null"), "gone").unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
        write(&link, "own").unwrap();
        assert!(!link.is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
    }

    /// A lock whose file was removed leaves the file that another process has locked since.
    #[cfg(unix)]
    #[test]
    fn dropped_temporary_lock_removes_only_its_own_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("lock");
        let lost = Lock::take(&path).unwrap().unwrap().temporary();
        fs::remove_file(&path).unwrap();
        let held = Lock::take(&path).unwrap().unwrap().temporary();
        drop(lost);
        assert!(held.is_there());
        drop(held);
        assert!(!path.exists());
    }
}
