//! Restricts where the files that a scene or a look names may be.

use std::path::{Component, Path, PathBuf};

use swell_scene::LEADS_OUT;

/// How far the paths in a scene or a look may lead. A file from elsewhere must not read arbitrary
/// files of the machine, and a cache that keeps copies must not carry them away.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reach {
    /// Files below the folder of the file that names them, after symbolic links are resolved.
    #[default]
    Folder,
    /// Any file that the user can read.
    Anywhere,
}

impl Reach {
    /// Resolves `name` relative to `folder`.
    ///
    /// # Errors
    /// A description if the path leads too far, or if no such file exists and the name has
    /// backslashes or control characters.
    pub(super) fn find(self, folder: &Path, name: &Path) -> Result<PathBuf, String> {
        let path = folder.join(name);
        if let (Some(problem), false) = (odd(&name.to_string_lossy()), path.exists()) {
            return Err(problem);
        }
        let is_below = match (path.canonicalize(), real(folder).canonicalize()) {
            (Ok(path), Ok(folder)) => path.starts_with(folder),
            // A missing file is not read, but a path that leads out is the more useful message.
            _ => stays_below(name),
        };
        if self == Self::Anywhere || is_below {
            return Ok(path);
        }
        Err(format!(
            "{} leads out of the folder {}; {LEADS_OUT}",
            path.display(),
            real(folder).display()
        ))
    }
}

/// Describes what is wrong with a path that contains backslashes, or control characters that TOML
/// made from them in double quotes.
pub(super) fn odd(name: &str) -> Option<String> {
    let escaped = |c: char| {
        Some(match c {
            '\u{8}' => 'b',
            '\t' => 't',
            '\n' => 'n',
            '\u{c}' => 'f',
            '\r' => 'r',
            '\u{1b}' => 'e',
            _ => return None,
        })
    };
    let written = |between: char| -> String {
        let letters = name.chars().map(|c| match escaped(c) {
            Some(letter) => format!("{between}{letter}"),
            None if c == '\\' => between.to_string(),
            None => c.to_string(),
        });
        letters.collect()
    };
    let (as_meant, with_slashes) = (written('\\'), written('/'));
    if let Some(letter) = name.chars().find_map(escaped) {
        return Some(format!(
            "{as_meant}: \\{letter} in double quotes is a control character in TOML; use / between \
             folders: \"{with_slashes}\""
        ));
    }
    name.contains('\\')
        .then(|| format!("there is no {as_meant}; use / between folders: \"{with_slashes}\""))
}

fn real(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    }
}

/// Whether a path stays below its start, judged by its components only.
fn stays_below(name: &Path) -> bool {
    let mut depth = 0i32;
    name.components().all(|part| {
        depth += match part {
            Component::Normal(_) => 1,
            Component::CurDir => 0,
            Component::ParentDir => -1,
            Component::RootDir | Component::Prefix(_) => return false,
        };
        depth >= 0
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn paths_of_windows_and_what_toml_makes_of_them_are_named() {
        let dir = tempfile::tempdir().expect("a folder");
        let find = |name: &str| Reach::Folder.find(dir.path(), Path::new(name));
        for (name, words) in [
            (
                "sub\u{8}ox.obj",
                "sub\\box.obj: \\b in double quotes is a control character in TOML; use / between \
                 folders: \"sub/box.obj\"",
            ),
            ("sub\ttub.obj", "sub\\ttub.obj: \\t in double quotes"),
            (
                "sub\\city.obj",
                "there is no sub\\city.obj; use / between folders: \"sub/city.obj\"",
            ),
            (
                "C:\\sub\\city.obj",
                "use / between folders: \"C:/sub/city.obj\"",
            ),
        ] {
            let said = find(name).expect_err(name);
            assert!(said.contains(words), "{said}");
        }
        // A file with such a name is read.
        #[cfg(unix)]
        {
            fs::write(dir.path().join("a\\b.obj"), "v 0 0 0").expect("written");
            assert!(find("a\\b.obj").is_ok());
        }
    }

    #[test]
    fn no_path_leads_out_of_the_folder() {
        let dir = tempfile::tempdir().expect("a folder");
        let folder = dir.path().join("scenes");
        fs::create_dir_all(folder.join("assets")).expect("made");
        for file in ["secret.obj", "scenes/in.obj", "scenes/assets/city.obj"] {
            fs::write(dir.path().join(file), "v 0 0 0").expect("written");
        }
        let outside = dir.path().join("secret.obj").display().to_string();
        let inside = folder.join("in.obj").display().to_string();
        let find = |name: &str| Reach::Folder.find(&folder, Path::new(name));
        for good in [
            "in.obj",
            "./in.obj",
            "assets/city.obj",
            "assets/../in.obj",
            &inside,
            "none.obj",
            "a/../none.obj",
        ] {
            assert_eq!(find(good), Ok(folder.join(good)), "{good}");
        }
        for bad in [
            "../secret.obj",
            "assets/../../secret.obj",
            &outside,
            "../none.obj",
            "/none.obj",
            "a/../../none.obj",
        ] {
            let said = find(bad).expect_err(bad);
            assert!(
                said.contains("leads out of the folder") && said.contains(LEADS_OUT),
                "{said}"
            );
            assert_eq!(
                Reach::Anywhere.find(&folder, Path::new(bad)),
                Ok(folder.join(bad))
            );
        }
        #[cfg(unix)]
        {
            use std::os::unix::fs::symlink;
            symlink("../secret.obj", folder.join("link.obj")).expect("linked");
            symlink("in.obj", folder.join("inner.obj")).expect("linked");
            symlink(dir.path(), folder.join("up")).expect("linked");
            assert!(find("inner.obj").is_ok());
            assert!(find("link.obj").is_err() && find("up/secret.obj").is_err());
            // The folder itself may be reached through a link.
            let linked = dir.path().join("linked");
            symlink("scenes", &linked).expect("linked");
            assert!(Reach::Folder.find(&linked, Path::new("in.obj")).is_ok());
            assert!(
                Reach::Folder
                    .find(&linked, Path::new("../secret.obj"))
                    .is_err()
            );
        }
    }
}
