//! A small file system for a test.
use std::{
    io::{self, Write},
    path::Path,
    process::Command,
};

use tempfile::TempDir;

/// A tmpfs, unmounted when dropped.
pub struct Tmpfs {
    folder: TempDir,
}

impl Tmpfs {
    /// Mounts a tmpfs of `bytes` bytes, rounded up to whole pages. Where mounting is not permitted,
    /// returns `None` and writes the reason and the name of the skipped test to the terminal,
    /// bypassing the captured output.
    pub fn mount(bytes: u64, test: &str) -> Option<Self> {
        let folder = TempDir::new().unwrap();
        match mount(&format!("size={bytes}"), folder.path()) {
            Ok(()) => Some(Self { folder }),
            Err(reason) => {
                let _ = writeln!(
                    io::stderr(),
                    "SKIPPED {test}: this machine mounts no tmpfs for us ({reason})"
                );
                None
            }
        }
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Remounts with other options, such as `size=4194304` or `ro`.
    pub fn remount(&self, options: &str) {
        mount(&format!("remount,{options}"), self.path()).unwrap();
    }
}

impl Drop for Tmpfs {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.path()).status();
    }
}

fn mount(options: &str, folder: &Path) -> Result<(), String> {
    let words = ["-t", "tmpfs", "-o", options, "none"];
    let output = Command::new("mount").args(words).arg(folder).output();
    match output {
        Ok(output) if output.status.success() => Ok(()),
        Ok(output) => Err(String::from_utf8_lossy(&output.stderr).trim().to_owned()),
        Err(error) => Err(error.to_string()),
    }
}
