//! Stores the pictures of a page: inside it or beside it.

use std::{
    fs,
    path::{Path, PathBuf},
};

use base64::{Engine as _, engine::general_purpose::STANDARD};

use super::{ViewError, player::MARK};
use swell_domain::output::{self, AtPath as _, Draft};

/// Where the pictures of a page are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Placing {
    /// Inside the page up to [`MOST`] bytes, otherwise beside it.
    #[default]
    Auto,
    /// Inside the page, whatever their size.
    Within,
    /// In a folder beside the page.
    Beside,
}

/// Default for the most bytes of pictures inside a page. A browser reads the whole page before it
/// shows the first picture, and text three times that long starts to be slow.
pub const MOST: u64 = 64_000_000;

/// Names of the page's file and its picture folder.
const PAGE: &str = "index.html";
const FOLDER: &str = "pictures";

/// Pictures of a page under construction.
pub(super) struct Store {
    directory: PathBuf,
    /// Those beside the page.
    folder: Draft,
    placing: Placing,
    most: u64,
    /// Names and PNG data of the pictures to embed.
    kept: Vec<(String, Vec<u8>)>,
    bytes: u64,
    is_beside: bool,
    names: Vec<String>,
}

impl Store {
    /// Starts a store; refuses to overwrite a page that swell did not make.
    pub(super) fn begin(directory: &Path, placing: Placing, most: u64) -> Result<Self, ViewError> {
        let page = directory.join(PAGE);
        let is_ours = match fs::read(&page) {
            Ok(text) => text
                .windows(MARK.len())
                .take(4096)
                .any(|part| part == MARK.as_bytes()),
            Err(_) => !directory.join(FOLDER).exists() && !page.exists(),
        };
        if !is_ours {
            return Err(ViewError::Foreign(directory.to_owned()));
        }
        let folder = Draft::folder_beside(&directory.join(FOLDER));
        output::remove_folder(folder.path())?;
        Ok(Self {
            directory: directory.to_owned(),
            folder,
            placing,
            most,
            kept: Vec::new(),
            bytes: 0,
            is_beside: false,
            names: Vec::new(),
        })
    }

    /// Adds the next picture, a PNG, under this name.
    pub(super) fn push(&mut self, name: String, png: Vec<u8>) -> Result<(), ViewError> {
        self.bytes += png.len() as u64;
        self.kept.push((name, png));
        let is_beside = match self.placing {
            Placing::Auto => self.bytes > self.most,
            placing => placing == Placing::Beside,
        };
        if is_beside {
            let folder = self.folder.path();
            if !std::mem::replace(&mut self.is_beside, true) {
                output::create_folder(folder)?;
            }
            for (name, png) in std::mem::take(&mut self.kept) {
                let file = folder.join(&name);
                fs::write(&file, png).at(&file)?;
                self.names.push(name);
            }
        }
        Ok(())
    }

    /// Bytes of pictures so far, and whether they are stored beside the page.
    pub(super) fn summary(&self) -> (u64, bool) {
        (self.bytes, self.is_beside)
    }

    /// The pictures' addresses in the order in which they were added.
    pub(super) fn addresses(&self) -> Vec<String> {
        let beside = self
            .names
            .iter()
            .map(|name| format!("{FOLDER}/{}", in_address(name)));
        let within = self.kept.iter();
        let within =
            within.map(|(_, png)| format!("data:image/png;base64,{}", STANDARD.encode(png)));
        beside.chain(within).collect()
    }

    /// Writes the page, which contains [`Self::addresses`]. Returns its path and size in bytes.
    pub(super) fn finish(mut self, html: &str) -> Result<(PathBuf, u64), ViewError> {
        output::remove_folder(self.folder.target())?;
        if self.is_beside {
            self.folder.publish()?;
        }
        let page = self.directory.join(PAGE);
        output::write(&page, html)?;
        Ok((page, html.len() as u64))
    }
}

/// Percent-encodes a file's name for an address.
fn in_address(name: &str) -> String {
    let byte = |b: u8| match b {
        b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'.' | b'_' | b'-' => char::from(b).to_string(),
        _ => format!("%{b:02X}"),
    };
    name.bytes().map(byte).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(folder: &Path, placing: Placing, most: u64) -> Store {
        let mut store = Store::begin(folder, placing, most).unwrap();
        for k in 0..4u8 {
            store.push(format!("a.{k} %.png"), vec![k; 10]).unwrap();
        }
        store
    }

    #[test]
    fn pictures_stand_beside_a_page_that_would_hold_too_much() {
        let folder = tempfile::tempdir().unwrap();
        let store = filled(folder.path(), Placing::Auto, 40);
        assert_eq!(store.summary(), (40, false));
        assert_eq!(
            store.addresses()[1],
            "data:image/png;base64,AQEBAQEBAQEBAQ=="
        );
        store.finish(MARK).unwrap();
        assert!(!folder.path().join(FOLDER).exists());

        let store = filled(folder.path(), Placing::Auto, 39);
        assert_eq!(store.summary(), (40, true));
        assert_eq!(store.addresses()[3], "pictures/a.3%20%25.png");
        store.finish(MARK).unwrap();
        assert_eq!(
            fs::read(folder.path().join("pictures/a.3 %.png")).unwrap(),
            [3; 10]
        );

        // An aborted store leaves the old pictures; one that embeds them all removes the folder.
        drop(filled(folder.path(), Placing::Beside, 0));
        assert!(
            folder.path().join("pictures/a.0 %.png").exists()
                && !folder.path().join("pictures.tmp").exists()
        );
        filled(folder.path(), Placing::Within, 0)
            .finish(MARK)
            .unwrap();
        assert!(!folder.path().join(FOLDER).exists());
    }

    #[test]
    fn a_page_of_something_else_stays() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(PAGE), "a study").unwrap();
        assert!(Store::begin(folder.path(), Placing::Auto, 1).is_err());
        fs::write(folder.path().join(PAGE), format!("<head>{MARK}")).unwrap();
        assert!(Store::begin(folder.path(), Placing::Auto, 1).is_ok());
        fs::remove_file(folder.path().join(PAGE)).unwrap();
        fs::create_dir(folder.path().join(FOLDER)).unwrap();
        assert!(Store::begin(folder.path(), Placing::Auto, 1).is_err());
    }
}
