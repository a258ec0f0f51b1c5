//! Results that are kept, a line a finished point: `results.jsonl`, and for each share of a study (`--chunk 1/4`) a file of its
//! own beside it, `results.1-of-4.jsonl`, so that no two machines write one file.
//!
//! A point that stands in any ledger of the folder is not run again. The study without a share copies the others' lines into its own
//! ledger, with the share that ran each, and says why it leaves one out.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{self, File, OpenOptions},
    io::{self, Write},
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use swell_domain::chunk::Chunk;
use swell_stage::locked::{is_at, is_had};
use swell_study::folder::{CLAIM, LEDGER, is_ledger, ledger_of};

use super::{StudyError, run::Run};

/// What a point is known by.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Key {
    /// Of all that its results depend on.
    pub(super) hash: String,
    /// Hash of the program that ran it.
    #[serde(default)]
    pub(super) program: String,
    /// What its runs ran on.
    #[serde(default)]
    pub(super) devices: Vec<String>,
}

/// A finished point as a file holds it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Line<M> {
    #[serde(flatten)]
    pub(super) key: Key,
    /// Of the point, as it is told.
    pub(super) name: String,
    /// The share of the study that ran it, such as `1/4`; `None` of the whole study.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) share: Option<String>,
    pub(super) run: Run<M>,
}

/// Who opens the ledgers of a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reader {
    /// The study itself: no share may be at work, and it says what is wrong with a line.
    Whole,
    /// A share: other shares may be at work.
    Share(Chunk),
    /// Who only counts what is there.
    Look,
}

/// Results of a folder, and a file of it that is open for more.
pub(super) struct Ledger<M> {
    path: PathBuf,
    /// `None` for who only looks.
    file: Option<File>,
    /// Its own, by their hashes.
    lines: BTreeMap<String, Line<M>>,
    /// Of the folder's other ledgers, in the order of their names.
    others: Vec<Other<M>>,
    /// Names of points that were asked for.
    asked: BTreeSet<String>,
    /// Hashes of points that were found, by the shares that ran them.
    of_shares: BTreeMap<String, BTreeSet<String>>,
}

/// Another ledger of the folder.
struct Other<M> {
    file: String,
    lines: Vec<Line<M>>,
}

/// A file's lines.
struct Read<M> {
    lines: Vec<Line<M>>,
    /// Bytes of whole lines.
    whole: usize,
    is_torn: bool,
}

impl<M: Serialize + DeserializeOwned> Ledger<M> {
    /// Opens a folder's results, or begins them; a torn last line of its own is cut off. A folder that holds anything but a
    /// study's results is refused, and so is a ledger that another process writes to. `warn` hears of what is torn elsewhere.
    pub(super) fn open(
        directory: &Path,
        reader: Reader,
        warn: &mut dyn FnMut(String),
    ) -> Result<Self, StudyError> {
        let (own, file) = match reader {
            Reader::Whole => (ledger_of(None), true),
            Reader::Share(chunk) => (ledger_of(Some(chunk)), true),
            Reader::Look => (ledger_of(None), false),
        };
        let path = directory.join(&own);
        fs::create_dir_all(directory).map_err(fault(&path))?;
        let names = names(directory).map_err(fault(&path))?;
        let is_used = names.iter().any(|name| name != CLAIM);
        if is_used && !names.iter().any(|name| is_ledger(name)) {
            let what = "it holds what is no study's: choose another -o";
            return Err(fault(directory)(io::Error::other(what)));
        }
        // The lock first: what is read is then what stands there until it is written to.
        let file = file.then(|| locked(&path)).transpose()?;
        let is_strict = reader == Reader::Whole;
        let standing = read::<M>(&path, reader != Reader::Look)?;
        if let Some(file) = &file {
            file.set_len(standing.whole as u64).map_err(fault(&path))?;
        }
        let mut others = Vec::new();
        for name in names
            .into_iter()
            .filter(|name| is_ledger(name) && *name != own)
        {
            let other = directory.join(&name);
            // The study waits for all shares; a share for the study, which runs what is missing.
            if is_strict || name == LEDGER && reader != Reader::Look {
                refuse_busy(&other)?;
            }
            let read = read(&other, is_strict)?;
            if is_strict && read.is_torn {
                warn(format!(
                    "{} ends within a line, which is not taken: what wrote there was killed",
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
    /// What a point came to. The study takes over what a share has; `warn` hears why it cannot.
    pub(super) fn find(
        &mut self,
        name: &str,
        key: &Key,
        reader: Reader,
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
            (Some(line), Reader::Whole) if !is_own => Ok(Some(self.append(line)?.clone())),
            (Some(line), _) => Ok(Some(line.run)),
            (None, Reader::Whole) => {
                self.others_differ(name, key, warn);
                Ok(None)
            }
            (None, _) => Ok(None),
        }
    }

    /// Why the lines of this name are not this point's.
    fn others_differ(&self, name: &str, key: &Key, warn: &mut dyn FnMut(String)) {
        for other in &self.others {
            for line in other.lines.iter().filter(|line| line.name == name) {
                let why = if line.key.program != key.program {
                    "is of another build of the program".to_owned()
                } else if line.key.devices != key.devices {
                    let [theirs, ours] = [&line.key, key].map(|key| key.devices.join(", "));
                    format!("ran on {theirs}, not on {ours}")
                } else {
                    "is of another scene, or of other settings of the study".to_owned()
                };
                warn(format!("{}: `{name}` {why}; it is run again", other.file));
            }
        }
    }

    /// Adds a line; it is on the disk when this returns.
    ///
    /// # Panics
    /// Of a ledger that was opened to look.
    pub(super) fn append(&mut self, line: Line<M>) -> Result<&Run<M>, StudyError> {
        let mut file = self.file.as_ref().expect("opened to write");
        // Finite numbers, strings and lists alone: nothing that JSON cannot hold.
        let text = serde_json::to_string(&line).map_err(io::Error::other);
        let written = text.and_then(|text| {
            file.write_all(format!("{text}\n").as_bytes())?;
            file.sync_data()
        });
        written.map_err(fault(&self.path))?;
        if !is_at(file, &self.path) {
            let what = "it was taken away while its worker ran: what was run since is lost";
            return Err(fault(&self.path)(io::Error::other(what)));
        }
        let hash = line.key.hash.clone();
        Ok(&self.lines.entry(hash).or_insert(line).run)
    }

    /// Shares that ran points of the study, whenever these were taken over, with how many, and what is said of lines that nobody
    /// asked for.
    pub(super) fn joined(&self) -> (Vec<(String, usize)>, Vec<String>) {
        let shares = self.of_shares.iter();
        let shares = shares.map(|(share, hashes)| (share.clone(), hashes.len()));
        let unknown = |other: &Other<M>| {
            let mut lines = other.lines.iter();
            let line = lines.find(|line| !self.asked.contains(&line.name))?;
            Some(format!(
                "{}: `{}` is no point of this study: it and other such lines are left out",
                other.file, line.name
            ))
        };
        (
            shares.collect(),
            self.others.iter().filter_map(unknown).collect(),
        )
    }
}

fn fault(file: &Path) -> impl FnOnce(io::Error) -> StudyError + use<> {
    let file = file.to_owned();
    move |source| StudyError::File { file, source }
}

/// Of the files of a folder, in order.
pub(super) fn names(directory: &Path) -> io::Result<Vec<String>> {
    let entries = fs::read_dir(directory)?;
    let name =
        |entry: io::Result<fs::DirEntry>| Ok(entry?.file_name().to_string_lossy().into_owned());
    let mut names = entries.map(name).collect::<io::Result<Vec<_>>>()?;
    names.sort();
    Ok(names)
}

/// Opens a ledger to write at its end, and keeps others from it.
fn locked(path: &Path) -> Result<File, StudyError> {
    let mut options = OpenOptions::new();
    let file = options.create(true).append(true).open(path);
    let file = file.map_err(fault(path))?;
    match is_had(file.try_lock()).map_err(fault(path))? {
        true => Ok(file),
        false => Err(fault(path)(io::Error::other("another process writes here"))),
    }
}

/// Of a share's ledger: whether its worker is at work.
fn refuse_busy(path: &Path) -> Result<(), StudyError> {
    let file = File::open(path).map_err(fault(path))?;
    match is_had(file.try_lock_shared()).map_err(fault(path))? {
        true => Ok(()),
        false => Err(fault(path)(io::Error::other(
            "a worker writes here: wait for it",
        ))),
    }
}

/// Lines of a file, none where it is missing. A line that cannot be read is a fault where `is_strict`, and left out else.
fn read<M: DeserializeOwned>(path: &Path, is_strict: bool) -> Result<Read<M>, StudyError> {
    let text = match fs::read(path) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        Err(error) => return Err(fault(path)(error)),
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

/// What is wrong with a line, without the number that it has as a text of its own.
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

    fn line(hash: &str) -> Line<Vec<f64>> {
        Line {
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

    fn line_of(share: &str, hash: &str) -> Line<Vec<f64>> {
        Line {
            share: Some(share.to_owned()),
            ..line(hash)
        }
    }

    #[test]
    fn a_torn_line_is_cut_off_and_a_spoiled_one_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let open = || Ledger::<Vec<f64>>::open(folder.path(), Reader::Whole, &mut |_| ());
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

    /// What shares have is taken over once, whoever wrote what does not fit, is torn or is at work is named.
    #[test]
    fn ledgers_of_shares_are_joined_and_what_is_off_is_said() {
        let folder = tempfile::tempdir().expect("a folder");
        let open = |reader, said: &mut Vec<String>| {
            Ledger::<Vec<f64>>::open(folder.path(), reader, &mut |text| said.push(text))
        };
        let share = |text: &str| Reader::Share(text.parse().expect("a share"));
        let mut said = Vec::new();
        let mut first = open(share("1/2"), &mut said).expect("new");
        first.append(line_of("1/2", "a")).expect("written");
        let mut second = open(share("2/2"), &mut said).expect("beside the first");
        assert!(open(share("2/2"), &mut said).is_err(), "twice");
        second.append(line_of("2/2", "b")).expect("written");
        let error = open(Reader::Whole, &mut said).err().expect("at work");
        assert!(
            error.to_string().contains("results.1-of-2.jsonl"),
            "{error}"
        );
        drop((first, second));
        let path = folder.path().join("results.2-of-2.jsonl");
        let text = fs::read_to_string(&path).expect("text");
        fs::write(&path, format!("{text}{{\"has")).expect("written");
        assert!(said.is_empty(), "{said:?}");

        let mut ledger = open(Reader::Whole, &mut said).expect("free");
        assert!(
            said[0].contains("2-of-2.jsonl ends within a line"),
            "{said:?}"
        );
        said.clear();
        let mut find = |of: &Line<Vec<f64>>, said: &mut Vec<String>| {
            let warn = &mut |text| said.push(text);
            let found = ledger.find(&of.name, &of.key, Reader::Whole, warn);
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
        let ledger = open(Reader::Whole, &mut said).expect("free");
        let (shares, unknown) = ledger.joined();
        assert!(shares.is_empty(), "none was asked for: {shares:?}");
        assert!(unknown.len() == 2 && unknown[1].contains("`jacobi, k = b` is no point"));
        // Whoever joins again, as after a signal, is told once more: also where the share's file is gone.
        drop(ledger);
        fs::remove_file(folder.path().join("results.1-of-2.jsonl")).expect("there");
        let mut ledger = open(Reader::Whole, &mut said).expect("free");
        let mut find = |of: &Line<Vec<f64>>| {
            let found = ledger.find(&of.name, &of.key, Reader::Whole, &mut |_| ());
            found.expect("readable")
        };
        assert_eq!(find(&line("a")), Some(line("a").run));
        assert_eq!(find(&line("b")), Some(line("b").run));
        let shares = ledger.joined().0;
        let each = ["1/2", "2/2"].map(|share| (share.to_owned(), 1));
        assert_eq!(shares, each);
        // A point of the whole study is no share's.
        let own = Line {
            name: "own".to_owned(),
            ..line("d")
        };
        ledger.append(own.clone()).expect("written");
        let found = ledger.find(&own.name, &own.key, Reader::Whole, &mut |_| ());
        assert!(found.expect("readable").is_some());
        assert_eq!(ledger.joined().0, each);

        // A spoiled line of a share stops the study that would take it over, and no other share.
        drop(ledger);
        fs::write(&path, format!("{{}}\n{text}")).expect("written");
        let error = open(Reader::Whole, &mut said).err().expect("spoiled");
        let error = error.to_string();
        assert!(error.contains("results.2-of-2.jsonl:1: missing"), "{error}");
        let mut first = open(share("1/2"), &mut said).expect("its own is whole");
        let b = line("b");
        let found = first.find(&b.name, &b.key, share("1/2"), &mut |_| ());
        assert_eq!(found.expect("readable"), Some(b.run));
    }
}
