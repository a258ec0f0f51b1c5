//! Stored results, one line per finished point: `results.jsonl`, and for each share of a study
//! (share 1 of 4) a separate file beside it, `results.1-of-4.jsonl`, so that no two machines write
//! to the same file.
//!
//! A point in any ledger of the folder is not run again. A whole study copies the lines of shares
//! into its own ledger, with the share that ran each, and warns about lines it leaves out.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs, io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use swell_domain::{
    chunk::Chunk,
    output::{AtPath as _, FileError, Lock, append, is_taken, names},
};
use swell_study::folder::{CLAIM, LEDGER, is_ledger, ledger_of};

use super::{StudyError, run::Run};

/// Identity of a point.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Key {
    /// Hash of everything the results depend on.
    pub(super) hash: String,
    /// Hash of the executable that ran the point.
    #[serde(default)]
    pub(super) program: String,
    /// Identities of the devices that ran the point.
    #[serde(default)]
    pub(super) devices: Vec<String>,
}

/// A finished point as stored in a ledger.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(expecting = "struct Line")]
pub(super) struct LedgerLine<M> {
    #[serde(flatten)]
    pub(super) key: Key,
    /// Name of the point in reports.
    pub(super) name: String,
    /// Share of the study that ran the point, such as `1/4`; `None` for a whole study.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) share: Option<String>,
    pub(super) run: Run<M>,
}

/// Purpose for which the ledgers of a folder are opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LedgerAccess {
    /// To run the whole study: no share may be running, and invalid lines are errors.
    Whole,
    /// To run a share: other shares may be running.
    Share(Chunk),
    /// Only to count existing results.
    Look,
}

/// Results in a folder, with a ledger open for appending.
pub(super) struct Ledger<M> {
    path: PathBuf,
    /// `None` for [`LedgerAccess::Look`].
    file: Option<Lock>,
    /// Lines of its own ledger by hash.
    lines: BTreeMap<String, LedgerLine<M>>,
    /// Other ledgers of the folder in order of their names.
    others: Vec<Other<M>>,
    /// Names of the points that were looked up.
    asked: BTreeSet<String>,
    /// Hashes of the points found, by the share that ran them.
    of_shares: BTreeMap<String, BTreeSet<String>>,
}

/// Another ledger of the folder.
struct Other<M> {
    file: String,
    lines: Vec<LedgerLine<M>>,
}

/// Lines of a file.
struct Read<M> {
    lines: Vec<LedgerLine<M>>,
    /// Number of bytes in complete lines.
    whole: usize,
    is_torn: bool,
}

impl<M: Serialize + DeserializeOwned> Ledger<M> {
    /// Opens the results of a folder, or creates them. Truncates an incomplete last line of its own
    /// ledger, and reports incomplete lines of others through `warn`.
    ///
    /// # Errors
    /// [`StudyError::File`] if the folder holds anything but a study's results or if another
    /// process writes to the ledger; [`StudyError::Ledger`] for an invalid line.
    pub(super) fn open(
        directory: &Path,
        reader: LedgerAccess,
        warn: &mut dyn FnMut(String),
    ) -> Result<Self, StudyError> {
        let (own, file) = match reader {
            LedgerAccess::Whole => (ledger_of(None), true),
            LedgerAccess::Share(chunk) => (ledger_of(Some(chunk)), true),
            LedgerAccess::Look => (ledger_of(None), false),
        };
        let path = directory.join(&own);
        let names = names(directory)?;
        let is_used = names.iter().any(|name| name != CLAIM);
        if is_used && !names.iter().any(|name| is_ledger(name)) {
            return Err(StudyError::Occupied(directory.to_owned()));
        }
        // Takes the lock first, so that the ledger cannot change between reading and writing.
        let file = file.then(|| locked(&path)).transpose()?;
        let is_strict = reader == LedgerAccess::Whole;
        let standing = read::<M>(&path, reader != LedgerAccess::Look)?;
        if let Some(file) = &file {
            file.file().set_len(standing.whole as u64).at(&path)?;
        }
        let mut others = Vec::new();
        for name in names
            .into_iter()
            .filter(|name| is_ledger(name) && *name != own)
        {
            let other = directory.join(&name);
            // The whole study waits for all shares; a share waits for the whole study, which runs
            // what is missing.
            if is_strict || name == LEDGER && reader != LedgerAccess::Look {
                refuse_busy(&other)?;
            }
            let read = read(&other, is_strict)?;
            if is_strict && read.is_torn {
                warn(format!(
                    "{} ends in an incomplete line, which is ignored: its writer was killed",
                    other.display()
                ));
            }
            others.push(Other {
                file: name,
                lines: read.lines,
            });
        }
        let lines = standing.lines.into_iter();
        Ok(Self {
            path,
            file,
            lines: lines.map(|line| (line.key.hash.clone(), line)).collect(),
            others,
            asked: BTreeSet::new(),
            of_shares: BTreeMap::new(),
        })
    }
}

impl<M: Clone + Serialize> Ledger<M> {
    /// Looks up the results of a point. The whole study copies lines of shares; `warn` receives the
    /// reason where it cannot use one.
    pub(super) fn find(
        &mut self,
        name: &str,
        key: &Key,
        reader: LedgerAccess,
        warn: &mut dyn FnMut(String),
    ) -> Result<Option<Run<M>>, StudyError> {
        self.asked.insert(name.to_owned());
        let mut others = self.others.iter().flat_map(|other| &other.lines);
        let (found, is_own) = match self.lines.get(&key.hash) {
            Some(line) => (Some(line.clone()), true),
            None => (others.find(|it| it.key.hash == key.hash).cloned(), false),
        };
        if let Some(share) = found.as_ref().and_then(|line| line.share.clone()) {
            let of_share = self.of_shares.entry(share).or_default();
            of_share.insert(key.hash.clone());
        }
        match (found, reader) {
            (Some(line), LedgerAccess::Whole) if !is_own => Ok(Some(self.append(line)?.clone())),
            (Some(line), _) => Ok(Some(line.run)),
            (None, LedgerAccess::Whole) => {
                self.others_differ(name, key, warn);
                Ok(None)
            }
            (None, _) => Ok(None),
        }
    }

    /// Reports why lines with this name belong to a different point.
    fn others_differ(&self, name: &str, key: &Key, warn: &mut dyn FnMut(String)) {
        for other in &self.others {
            for line in other.lines.iter().filter(|line| line.name == name) {
                let why = if line.key.program != key.program {
                    "was run by another build of the program".to_owned()
                } else if line.key.devices != key.devices {
                    let [theirs, ours] = [&line.key, key].map(|key| key.devices.join(", "));
                    format!("ran on {theirs}, not on {ours}")
                } else {
                    "was run with another scene, or other settings of the study".to_owned()
                };
                warn(format!("{}: `{name}` {why}; it is run again", other.file));
            }
        }
    }

    /// Appends a line and synchronises it to disk.
    ///
    /// # Panics
    /// If the ledger was opened with [`LedgerAccess::Look`].
    pub(super) fn append(&mut self, line: LedgerLine<M>) -> Result<&Run<M>, StudyError> {
        let lock = self.file.as_ref().expect("opened to write");
        // Only finite numbers, strings and lists, which JSON can represent.
        let text = serde_json::to_string(&line).map_err(io::Error::other);
        text.and_then(|text| append(lock.file(), format!("{text}\n").as_bytes()))
            .at(&self.path)?;
        if !lock.is_there() {
            let what = "it was removed while its worker ran: what was run since is lost";
            return Err(FileError::new(&self.path, io::Error::other(what)).into());
        }
        let hash = line.key.hash.clone();
        Ok(&self.lines.entry(hash).or_insert(line).run)
    }

    /// Returns the shares that ran points of the study, with the number of points, whenever these
    /// were copied; and warnings about lines that no point of the study asked for.
    pub(super) fn joined(&self) -> (Vec<(String, usize)>, Vec<String>) {
        let shares = self.of_shares.iter();
        let shares = shares.map(|(share, hashes)| (share.clone(), hashes.len()));
        let unknown = |other: &Other<M>| {
            let mut lines = other.lines.iter();
            let line = lines.find(|line| !self.asked.contains(&line.name))?;
            Some(format!(
                "{}: `{}` is not a point of this study: it and other such lines are ignored",
                other.file, line.name
            ))
        };
        (
            shares.collect(),
            self.others.iter().filter_map(unknown).collect(),
        )
    }
}

/// Locks a ledger for appending.
fn locked(path: &Path) -> Result<Lock, FileError> {
    let busy = || FileError::new(path, io::Error::other("another process writes here"));
    Lock::take(path)?.ok_or_else(busy)
}

/// Fails if another process writes to this ledger.
fn refuse_busy(path: &Path) -> Result<(), FileError> {
    match is_taken(path)? {
        false => Ok(()),
        true => Err(io::Error::other("a worker writes here: wait for it")).at(path),
    }
}

/// Reads the lines of a file, none where it is missing. An invalid line is an error if `is_strict`,
/// and skipped otherwise.
fn read<M: DeserializeOwned>(path: &Path, is_strict: bool) -> Result<Read<M>, StudyError> {
    let text = match fs::read(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        other => other.at(path)?,
    };
    let whole = text.iter().rposition(|&byte| byte == b'\n');
    let whole = whole.map_or(0, |end| end + 1);
    let mut lines = Vec::new();
    let texts = text[..whole].split_inclusive(|&byte| byte == b'\n');
    for (index, line) in texts.enumerate() {
        match serde_json::from_slice(line.trim_ascii_end()) {
            Ok(line) => lines.push(line),
            Err(_) if !is_strict => {}
            Err(error) => {
                return Err(StudyError::Ledger {
                    file: path.to_owned(),
                    line: index + 1,
                    what: in_line(&error),
                });
            }
        }
    }
    Ok(Read {
        lines,
        whole,
        is_torn: whole < text.len(),
    })
}

/// Message of a JSON error without its line number, which counts within the line's own text.
fn in_line(error: &serde_json::Error) -> String {
    let text = error.to_string();
    match text.rsplit_once(" at line 1 column ") {
        Some((what, _)) => what.to_owned(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(hash: &str) -> LedgerLine<Vec<f64>> {
        LedgerLine {
            key: Key {
                hash: hash.into(),
                program: "p".into(),
                devices: vec!["a card".into()],
            },
            name: format!("jacobi, k = {hash}"),
            share: None,
            run: Run {
                ended: Some(format!("too fast: {hash}")),
                measured: vec![0.1f64],
                ..Run::default()
            },
        }
    }

    fn line_of(share: &str, hash: &str) -> LedgerLine<Vec<f64>> {
        LedgerLine {
            share: Some(share.to_owned()),
            ..line(hash)
        }
    }

    #[test]
    fn a_torn_line_is_cut_off_and_a_spoiled_one_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let open = || Ledger::<Vec<f64>>::open(folder.path(), LedgerAccess::Whole, &mut |_| ());
        let mut ledger = open().expect("new");
        ledger.append(line("a")).expect("written");
        ledger.append(line("b")).expect("written");
        let path = folder.path().join("results.jsonl");
        let text = fs::read_to_string(&path).expect("text");
        fs::write(&path, &text[..text.len() - 9]).expect("written");
        assert!(open().is_err(), "two at once");
        drop(ledger);
        let mut ledger = open().expect("torn");
        assert_eq!(ledger.lines.get("a"), Some(&line("a")));
        assert_eq!(ledger.lines.get("b"), None);
        ledger.append(line("b")).expect("written");
        assert_eq!(fs::read_to_string(&path).expect("text"), text);
        drop(ledger);
        fs::write(&path, format!("{text}{{}}\n")).expect("written");
        let error = open().err().expect("spoiled").to_string();
        assert!(error.contains("results.jsonl:3: missing field"), "{error}");
        assert!(!error.contains("line 1"), "{error}");
        let bytes = [text.as_bytes(), b"{\"hash\":\"\xff\"}\n"].concat();
        fs::write(&path, bytes).expect("written");
        let error = open().err().expect("no UTF-8").to_string();
        assert!(
            error.contains("results.jsonl:3: invalid unicode"),
            "{error}"
        );
    }

    /// Lines of shares are copied once, and foreign, truncated and locked ledgers are reported.
    #[test]
    fn ledgers_of_shares_are_joined_and_what_is_off_is_said() {
        let folder = tempfile::tempdir().expect("a folder");
        let open = |reader, said: &mut Vec<String>| {
            Ledger::<Vec<f64>>::open(folder.path(), reader, &mut |text| said.push(text))
        };
        let share = |text: &str| LedgerAccess::Share(text.parse().expect("a share"));
        let mut said = Vec::new();
        let mut first = open(share("1/2"), &mut said).expect("new");
        first.append(line_of("1/2", "a")).expect("written");
        let mut second = open(share("2/2"), &mut said).expect("beside the first");
        assert!(open(share("2/2"), &mut said).is_err(), "twice");
        second.append(line_of("2/2", "b")).expect("written");
        let error = open(LedgerAccess::Whole, &mut said).err().expect("at work");
        assert!(
            error.to_string().contains("results.1-of-2.jsonl"),
            "{error}"
        );
        drop((first, second));
        let path = folder.path().join("results.2-of-2.jsonl");
        let text = fs::read_to_string(&path).expect("text");
        fs::write(&path, format!("{text}{{\"has")).expect("written");
        assert!(said.is_empty(), "{said:?}");

        let mut ledger = open(LedgerAccess::Whole, &mut said).expect("free");
        assert!(
            said[0].contains("2-of-2.jsonl ends in an incomplete line"),
            "{said:?}"
        );
        said.clear();
        let mut find = |of: &LedgerLine<Vec<f64>>, said: &mut Vec<String>| {
            let warn = &mut |text| said.push(text);
            let found = ledger.find(&of.name, &of.key, LedgerAccess::Whole, warn);
            found.expect("readable")
        };
        assert_eq!(find(&line("a"), &mut said), Some(line("a").run));
        assert_eq!(find(&line("a"), &mut said), Some(line("a").run));
        assert!(said.is_empty(), "{said:?}");
        type Change = fn(&mut Key);
        let changes: [(Change, &str); 3] = [
            (
                |key| key.program = "q".into(),
                "another build of the program",
            ),
            (
                |key| key.devices = vec!["another".into()],
                "ran on a card, not on another",
            ),
            (|_| (), "another scene"),
        ];
        for (change, why) in changes {
            let mut other = line("b");
            other.key.hash = "c".into();
            change(&mut other.key);
            assert_eq!(find(&other, &mut said), None);
            let said = said.pop().expect("said");
            assert!(said.contains(why) && said.contains("k = b"), "{said}");
        }
        let own = fs::read_to_string(folder.path().join(LEDGER)).expect("text");
        assert_eq!(own.lines().count(), 1, "taken over once: {own}");
        let (shares, unknown) = ledger.joined();
        assert_eq!(shares, [("1/2".to_owned(), 1)]);
        assert!(unknown.is_empty(), "{unknown:?}");
        drop(ledger);
        let ledger = open(LedgerAccess::Whole, &mut said).expect("free");
        let (shares, unknown) = ledger.joined();
        assert!(shares.is_empty(), "none was asked for: {shares:?}");
        assert!(unknown.len() == 2 && unknown[1].contains("`jacobi, k = b` is not a point"));
        // Joining again, for example after a signal, reports the same shares, even where a share's
        // file is gone.
        drop(ledger);
        fs::remove_file(folder.path().join("results.1-of-2.jsonl")).expect("there");
        let mut ledger = open(LedgerAccess::Whole, &mut said).expect("free");
        let mut find = |of: &LedgerLine<Vec<f64>>| {
            let found = ledger.find(&of.name, &of.key, LedgerAccess::Whole, &mut |_| ());
            found.expect("readable")
        };
        assert_eq!(find(&line("a")), Some(line("a").run));
        assert_eq!(find(&line("b")), Some(line("b").run));
        let shares = ledger.joined().0;
        let each = ["1/2", "2/2"].map(|share| (share.to_owned(), 1));
        assert_eq!(shares, each);
        // A point run by the whole study belongs to no share.
        let own = LedgerLine {
            name: "own".to_owned(),
            ..line("d")
        };
        ledger.append(own.clone()).expect("written");
        let found = ledger.find(&own.name, &own.key, LedgerAccess::Whole, &mut |_| ());
        assert!(found.expect("readable").is_some());
        assert_eq!(ledger.joined().0, each);

        // An invalid line of a share stops the whole study, which would copy it, but not other
        // shares.
        drop(ledger);
        fs::write(&path, format!("{{}}\n{text}")).expect("written");
        let error = open(LedgerAccess::Whole, &mut said).err().expect("spoiled");
        let error = error.to_string();
        assert!(error.contains("results.2-of-2.jsonl:1: missing"), "{error}");
        let mut first = open(share("1/2"), &mut said).expect("its own is whole");
        let b = line("b");
        let found = first.find(&b.name, &b.key, share("1/2"), &mut |_| ());
        assert_eq!(found.expect("readable"), Some(b.run));
    }
}
