//! What every kind of study stands on: devices that are opened once, and points whose results are kept, so that a study that
//! was interrupted goes on where it stopped.

use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions},
    io::Write,
    path::{Path, PathBuf},
    sync::{
        OnceLock,
        atomic::{AtomicBool, Ordering},
    },
    time::SystemTime,
};

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::{
    gpu::adapter::{GpuError, Needs},
    scene::{Method, Scene, physics_hash, study::RunsOn},
    stage::{
        device::{Gpu, Opened, needs},
        drive::{Drive, End, Step},
    },
    study::median,
};

use super::{Event, PointEvent, PointStatus, Request, StudyError, claim, report::Report};

/// Changes whenever what a line of results holds does.
const FORM: &str = "swell study 3";

/// A kind of study: what it runs and measures, and what it draws of that.
pub(super) trait Kind {
    /// What its runs ask of an adapter; `None` where they need none.
    fn needs(&self) -> Option<Needs>;

    /// Points that it tells of.
    fn count(&self) -> usize;

    /// Runs, measures and draws.
    ///
    /// # Errors
    /// [`StudyError`]; [`StudyError::Stopped`] where a signal came.
    fn run(&self, bench: &mut Bench<'_>) -> Result<Report, StudyError>;
}

/// What scenes ask of an adapter, each with what it runs on.
pub(super) fn needs_of<'a>(runs: impl Iterator<Item = (&'a Scene, RunsOn)>) -> Option<Needs> {
    let on_gpu = runs.filter(|(_, device)| *device == RunsOn::Gpu);
    on_gpu.fold(None, |all, (scene, _)| {
        let all = all.unwrap_or(Needs { f64: false });
        Some(Needs {
            f64: all.f64 || needs(scene).f64,
        })
    })
}

/// What points run on.
pub struct Devices {
    /// The study's adapter; `None` where nothing runs there.
    pub gpu: Option<Opened>,
    /// The f64 reference.
    pub cpu: Opened,
}

impl Devices {
    /// Where the adapter has no f64 the points that ask for it fail, and the others do not.
    pub(super) fn open(gpu: &Gpu, needs: Option<Needs>) -> Result<Self, GpuError> {
        let open = |needs| match gpu.open(needs) {
            Err(GpuError::NoF64 { .. }) => gpu.open(Needs::default()),
            other => other,
        };
        let gpu = needs.map(open).transpose()?;
        Ok(Self {
            gpu: gpu.map(|context| Opened::Gpu(Box::new(context))),
            cpu: Opened::Cpu,
        })
    }

    /// # Panics
    /// Where a point is on the GPU and none was opened.
    pub fn of(&self, device: RunsOn) -> &Opened {
        match device {
            RunsOn::Cpu => &self.cpu,
            RunsOn::Gpu => self.gpu.as_ref().expect("a device that was asked for"),
        }
    }

    /// A hash of all that a point's results depend on: each run's physics, device and when it gives up; frames, how it is
    /// measured, and the program.
    pub(super) fn hash(&self, runs: &[(&Scene, RunsOn)], frames: u32, measured: &str) -> String {
        let of = |(scene, device): &(&Scene, RunsOn)| {
            let solver = &scene.solver;
            let most = match solver.method {
                Method::Pbf => solver.pbf().max_substeps,
                Method::Flip => solver.flip().max_substeps,
            };
            let (physics, identity) = (physics_hash(scene), self.of(*device).identity());
            format!(
                "{physics} {most} {:?} {:?} {identity}",
                scene.budget, scene.probes
            )
        };
        let study = format!("{FORM} {} {frames} {measured}", program());
        let text: Vec<String> = [study].into_iter().chain(runs.iter().map(of)).collect();
        let hash = blake3::hash(text.join("\n").as_bytes());
        hash.to_hex().to_string()
    }
}

/// BLAKE3 of the program that runs, since another build may compute otherwise; where its file cannot be read, what no other
/// run has.
fn program() -> &'static str {
    static PROGRAM: OnceLock<String> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        let bytes = std::env::current_exe().and_then(fs::read);
        match bytes {
            Ok(bytes) => blake3::hash(&bytes).to_hex().to_string(),
            Err(_) => format!("{:?}", SystemTime::now()),
        }
    })
}

/// What a point came to; `M` is what its kind of study measures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Run<M> {
    /// At the start.
    pub particles: usize,
    /// Output frames that were done, or 1 projection.
    pub frames: u32,
    /// Wall clock of all frames, of each repeat.
    pub seconds: Vec<f64>,
    /// Why it ended before its last frame, or did not begin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<String>,
    /// What was measured so far.
    pub measured: M,
}

impl<M> Run<M> {
    /// Seconds a frame: least, median and greatest of the repeats.
    pub(super) fn per_frame(&self) -> [f64; 3] {
        let frames = f64::from(self.frames.max(1));
        let least = self.seconds.iter().copied().fold(f64::INFINITY, f64::min);
        let most = self.seconds.iter().copied().fold(0.0, f64::max);
        let middle = median(self.seconds.clone()).unwrap_or(0.0);
        [least, middle, most].map(|seconds| seconds / frames)
    }
}

/// What a kind of study has at hand while it runs.
pub(super) struct Bench<'a> {
    pub(super) request: &'a Request,
    pub(super) devices: &'a Devices,
    pub(super) stop: &'a AtomicBool,
    pub(super) tell: &'a mut dyn FnMut(Event),
    pub(super) count: usize,
    pub(super) number: usize,
}

impl Bench<'_> {
    /// Tells what became of the next point.
    pub(super) fn told(&mut self, name: String, status: PointStatus) {
        self.number += 1;
        (self.tell)(Event::Point(PointEvent {
            number: self.number,
            count: self.count,
            name,
            status,
        }));
    }

    /// A point's results and whether they stood in the ledger; they are measured where they did not.
    pub(super) fn point<M: Clone + Default + Serialize>(
        &self,
        ledger: &mut Ledger<M>,
        name: &str,
        hash: String,
        measure: impl FnOnce() -> Result<Run<M>, StudyError>,
    ) -> Result<(Run<M>, bool), StudyError> {
        if let Some(run) = ledger.runs.get(&hash) {
            return Ok((run.clone(), true));
        }
        if self.stop.load(Ordering::Relaxed) {
            return Err(StudyError::Stopped);
        }
        let run = match measure() {
            Err(StudyError::Stopped) => return Err(StudyError::Stopped),
            Err(error) => Run {
                ended: Some(error.of_the_point()?),
                ..Run::default()
            },
            Ok(run) => run,
        };
        let name = name.to_owned();
        let run = ledger.append(Line { hash, name, run })?;
        Ok((run.clone(), false))
    }
}

/// Drives a point's frames up to `last`.
pub(super) fn until_done(
    drive: &mut Drive<'_>,
    last: u32,
    stop: &AtomicBool,
    observe: impl FnMut(Step) -> Result<(), StudyError>,
) -> Result<(), StudyError> {
    match drive.run(last, stop, observe)? {
        End::Done => Ok(()),
        End::Stopped => Err(StudyError::Stopped),
    }
}

/// A finished point as the file holds it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Line<M> {
    /// [`Devices::hash`].
    hash: String,
    /// For a reader of the file.
    name: String,
    run: Run<M>,
}

/// `results.jsonl`, one line a finished point, open for more.
pub(super) struct Ledger<M> {
    path: PathBuf,
    file: File,
    /// By their hashes.
    runs: BTreeMap<String, Run<M>>,
}

impl<M: Serialize + DeserializeOwned> Ledger<M> {
    /// Opens the directory's results, or begins them; a torn last line is cut off. A directory that holds anything but
    /// a study's results is refused, and so is one that another process writes to.
    pub(super) fn open(directory: &Path) -> Result<Self, StudyError> {
        let path = directory.join("results.jsonl");
        let fault = |source| StudyError::File {
            file: path.clone(),
            source,
        };
        fs::create_dir_all(directory).map_err(fault)?;
        let is_other = |entry: std::io::Result<fs::DirEntry>| {
            entry.is_ok_and(|entry| entry.file_name() != claim::FILE)
        };
        let is_used = fs::read_dir(directory).map_err(fault)?.any(is_other);
        if is_used && !path.exists() {
            return Err(StudyError::File {
                file: directory.to_owned(),
                source: std::io::Error::other("it holds what is no study's: choose another -o"),
            });
        }
        let text = match fs::read(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Vec::new(),
            Err(error) => return Err(fault(error)),
        };
        let whole = text.iter().rposition(|&byte| byte == b'\n');
        let whole = whole.map_or(0, |end| end + 1);
        let mut runs = BTreeMap::new();
        let lines = text[..whole].split_inclusive(|&byte| byte == b'\n');
        for (index, line) in lines.enumerate() {
            let line: Line<M> =
                serde_json::from_slice(line).map_err(|error| StudyError::Ledger {
                    file: path.clone(),
                    line: index + 1,
                    what: in_line(&error),
                })?;
            runs.insert(line.hash, line.run);
        }
        let file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&path)
            .map_err(fault)?;
        let busy = |_| std::io::Error::other("another study writes here");
        file.try_lock().map_err(busy).map_err(fault)?;
        file.set_len(whole as u64).map_err(fault)?;
        Ok(Self { path, file, runs })
    }
}

impl<M: Serialize> Ledger<M> {
    /// Adds a line; it is on the disk when this returns.
    fn append(&mut self, line: Line<M>) -> Result<&Run<M>, StudyError> {
        // Finite numbers, strings and lists alone: nothing that JSON cannot hold.
        let text = serde_json::to_string(&line).map_err(std::io::Error::other);
        let written = text.and_then(|text| {
            self.file.write_all(format!("{text}\n").as_bytes())?;
            self.file.sync_data()
        });
        written.map_err(|source| StudyError::File {
            file: self.path.clone(),
            source,
        })?;
        Ok(self.runs.entry(line.hash).or_insert(line.run))
    }
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

    #[test]
    fn a_torn_line_is_cut_off_and_a_spoiled_one_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let line = |hash: &str| Line {
            hash: hash.into(),
            name: "jacobi, k = 4".into(),
            run: Run {
                ended: Some(format!("too fast: {hash}")),
                measured: vec![0.1f64],
                ..Run::default()
            },
        };
        let open = || Ledger::<Vec<f64>>::open(folder.path());
        let mut ledger = open().expect("new");
        ledger.append(line("a")).expect("written");
        ledger.append(line("b")).expect("written");
        let path = folder.path().join("results.jsonl");
        let text = fs::read_to_string(&path).expect("text");
        fs::write(&path, &text[..text.len() - 9]).expect("written");
        assert!(open().is_err(), "two at once");
        drop(ledger);
        let mut ledger = open().expect("torn");
        assert_eq!(ledger.runs.get("a"), Some(&line("a").run));
        assert_eq!(ledger.runs.get("b"), None);
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
}
