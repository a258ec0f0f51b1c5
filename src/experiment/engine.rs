//! Common machinery of all kinds of studies: devices that are opened once, and points with stored
//! results, so that an interrupted study resumes.

use std::{
    cell::{Cell, RefCell},
    collections::BTreeSet,
    fs,
    sync::{
        OnceLock,
        atomic::{AtomicBool, Ordering},
    },
    time::SystemTime,
};

use serde::{Serialize, de::DeserializeOwned};

use swell_domain::chunk::Chunk;
use swell_files::{physics_hash, study::RunsOn};
use swell_gpu::adapter::{GpuError, Needs};
use swell_scene::Scene;
use swell_stage::{
    device::{Gpu, Opened, needs},
    drive::{ComputedFrame, Drive, End},
};
use swell_study::folder::ledger_of;

use super::{
    PointEvent, PointStatus, StudyError, StudyEvent, StudyRequest,
    ledger::{Key, Ledger, LedgerAccess, LedgerLine},
    report::Report,
    run::Run,
};

/// Version of the format of result lines; changes with their content.
const FORM: &str = "swell study 3";

/// A kind of study: what it runs, measures and draws.
pub(super) trait StudyKind {
    /// Requirements of its runs on an adapter; `None` where they need none.
    fn needs(&self) -> Option<Needs>;

    /// Number of points that are reported.
    fn count(&self) -> usize;

    /// Units of work that are divided among shares, in the order of [`Bench::is_next_ours`]. `None`
    /// where all points depend on one cache, so that the study cannot be divided.
    fn work_units(&self) -> Option<Vec<WorkUnit>>;

    /// Runs, measures and draws the study; returns `None` where only a share was run or missing
    /// points were counted.
    ///
    /// # Errors
    /// [`StudyError`]; [`StudyError::Stopped`] after a stop signal.
    fn run(&self, bench: &mut Bench<'_>) -> Result<Option<Report>, StudyError>;
}

/// A unit of work among those that are divided among shares: a point, or a search that takes
/// several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct WorkUnit {
    /// Rank within its line, from cheap to expensive.
    pub(super) rank: usize,
    /// Largest number of points that it takes.
    pub(super) points: usize,
}

impl WorkUnit {
    /// A unit of one point.
    pub(super) fn of(rank: usize) -> Self {
        Self { rank, points: 1 }
    }
}

/// Combined requirements of scenes on an adapter, ignoring those that do not run on a GPU.
pub(super) fn needs_of<'a>(runs: impl Iterator<Item = (&'a Scene, RunsOn)>) -> Option<Needs> {
    let on_gpu = runs.filter(|(_, device)| *device == RunsOn::Gpu);
    on_gpu.fold(None, |all, (scene, _)| {
        let all = all.unwrap_or(Needs { f64: false });
        Some(Needs {
            f64: all.f64 || needs(scene).f64,
        })
    })
}

/// Devices on which points run.
pub struct Devices {
    /// The study's adapter; `None` where no point runs on a GPU.
    pub gpu: Option<Opened>,
    /// The f64 reference solver on the CPU.
    pub cpu: Opened,
}

impl Devices {
    /// Opens the devices. On an adapter without f64, only the points that need it fail.
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

    /// Returns the device for a run.
    ///
    /// # Panics
    /// If the run is on a GPU and no adapter was opened.
    pub fn of(&self, device: RunsOn) -> &Opened {
        match device {
            RunsOn::Cpu => &self.cpu,
            RunsOn::Gpu => self.gpu.as_ref().expect("a device that was asked for"),
        }
    }

    /// Identifies a point. The hash covers everything its results depend on: the physics, device
    /// and limits of each run, the number of frames, the settings of the measurement, and the
    /// program.
    pub(super) fn key(&self, runs: &[(&Scene, RunsOn)], frames: u32, measured: &str) -> Key {
        let of = |(scene, device): &(&Scene, RunsOn)| {
            let most = scene.solver.max_substeps();
            let (physics, identity) = (physics_hash(scene), self.of(*device).identity());
            format!(
                "{physics} {most} {:?} {:?} {identity}",
                scene.budget, scene.probes
            )
        };
        let study = format!("{FORM} {} {frames} {measured}", program());
        let text: Vec<String> = [study].into_iter().chain(runs.iter().map(of)).collect();
        let hash = blake3::hash(text.join("\n").as_bytes());
        let devices = runs.iter().map(|(_, device)| self.of(*device).identity());
        let mut devices: Vec<String> = devices.map(|identity| identity.to_string()).collect();
        devices.sort();
        devices.dedup();
        Key {
            hash: hash.to_hex().to_string(),
            program: program().to_owned(),
            devices,
        }
    }
}

/// BLAKE3 hash of the running executable, since another build may compute different results; a
/// unique value where the file cannot be read.
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

/// Part of a study to run.
pub(super) enum Work {
    /// The whole study.
    Whole,
    /// A share of it, and which units of work belong to that.
    Share(Chunk, Vec<bool>),
    /// Nothing: only counts the points that no ledger has.
    Look,
}

/// Context in which a kind of study runs.
pub(super) struct Bench<'a> {
    pub(super) request: &'a StudyRequest,
    pub(super) devices: &'a Devices,
    pub(super) stop: &'a AtomicBool,
    tell: RefCell<&'a mut dyn FnMut(StudyEvent)>,
    work: Work,
    pub(super) count: usize,
    /// Number of points reported so far.
    number: usize,
    /// Number of units of work reached so far, whether they belong to the share or not.
    dealt: usize,
    /// Numbers of points that were run, that were found in a ledger, and that are missing.
    pub(super) ran: Cell<usize>,
    pub(super) stood: Cell<usize>,
    pub(super) left: Cell<usize>,
    /// Whether the number of missing points is an upper bound.
    pub(super) is_left_at_most: Cell<bool>,
    /// Hashes of the points with results; points with equal keys share one.
    there: RefCell<BTreeSet<String>>,
    /// Shares that ran points, with the number of points; known at the end of a whole study.
    shares: RefCell<Vec<(String, usize)>>,
}

impl<'a> Bench<'a> {
    pub(super) fn new(
        request: &'a StudyRequest,
        devices: &'a Devices,
        stop: &'a AtomicBool,
        tell: &'a mut dyn FnMut(StudyEvent),
        (work, count): (Work, usize),
    ) -> Self {
        Self {
            request,
            devices,
            stop,
            tell: RefCell::new(tell),
            work,
            count,
            number: 0,
            dealt: 0,
            ran: Cell::default(),
            stood: Cell::default(),
            left: Cell::default(),
            is_left_at_most: Cell::default(),
            there: RefCell::default(),
            shares: RefCell::default(),
        }
    }

    pub(super) fn tell(&self, event: StudyEvent) {
        (self.tell.borrow_mut())(event);
    }

    /// Whether there is nothing to draw because other processes run the rest.
    pub(super) fn is_part(&self) -> bool {
        !matches!(self.work, Work::Whole)
    }

    /// Whether the next unit of [`StudyKind::places`] is to be run or counted here.
    pub(super) fn is_next_ours(&mut self) -> bool {
        self.dealt += 1;
        match &self.work {
            Work::Share(_, is_ours) => is_ours[self.dealt - 1],
            Work::Whole | Work::Look => true,
        }
    }

    /// Reports the outcome of the next point.
    pub(super) fn report_point(&mut self, name: String, status: PointStatus) {
        if matches!(self.work, Work::Look) {
            return;
        }
        self.number += 1;
        self.tell(StudyEvent::Point(PointEvent {
            number: self.number,
            count: self.count,
            name,
            status,
        }));
    }

    fn reader(&self) -> LedgerAccess {
        match self.work {
            Work::Whole => LedgerAccess::Whole,
            Work::Share(chunk, _) => LedgerAccess::Share(chunk),
            Work::Look => LedgerAccess::Look,
        }
    }

    /// Opens the results in the study's folder.
    pub(super) fn ledger<M: Serialize + DeserializeOwned>(&self) -> Result<Ledger<M>, StudyError> {
        let warn = &mut |text| self.tell(StudyEvent::Warning(text));
        Ledger::open(&self.request.directory, self.reader(), warn)
    }

    /// Returns a point's results and whether they come from a ledger; measures them otherwise.
    /// Returns `None` for a missing point that is only counted.
    pub(super) fn point<M: Clone + Default + Serialize>(
        &self,
        ledger: &mut Ledger<M>,
        name: &str,
        key: Key,
        measure: impl FnOnce() -> Result<Run<M>, StudyError>,
    ) -> Result<Option<(Run<M>, bool)>, StudyError> {
        let add = |to: &Cell<usize>| to.set(to.get() + 1);
        let warn = &mut |text| self.tell(StudyEvent::Warning(text));
        if let Some(run) = ledger.find(name, &key, self.reader(), warn)? {
            add(&self.stood);
            self.there.borrow_mut().insert(key.hash);
            return Ok(Some((run, true)));
        }
        if matches!(self.work, Work::Look) {
            add(&self.left);
            return Ok(None);
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
        let share = match self.work {
            Work::Share(chunk, _) => Some(chunk.to_string()),
            Work::Whole | Work::Look => None,
        };
        let name = name.to_owned();
        self.there.borrow_mut().insert(key.hash.clone());
        let run = ledger.append(LedgerLine {
            key,
            name,
            share,
            run,
        })?;
        add(&self.ran);
        Ok(Some((run.clone(), false)))
    }

    /// Reports which shares ran points; to be called after all points.
    pub(super) fn joined<M: Clone + Serialize>(&self, ledger: &Ledger<M>) {
        let (shares, unknown) = ledger.joined();
        for (share, points) in &shares {
            let file = ledger_of(share.parse().ok());
            let (share, points) = (share.clone(), *points);
            self.tell(StudyEvent::Joined {
                share,
                file,
                points,
            });
        }
        for text in unknown {
            self.tell(StudyEvent::Warning(text));
        }
        *self.shares.borrow_mut() = shares;
    }

    /// Sentence for the page about points that shares ran; `None` where none did.
    pub(super) fn told_of_shares(&self) -> Option<String> {
        let shares = self.shares.borrow();
        let theirs: usize = shares.iter().map(|(_, points)| points).sum();
        if theirs == 0 {
            return None;
        }
        let all = self.there.borrow().len();
        let each = shares
            .iter()
            .map(|(share, points)| format!("share {share} ran {points}"));
        let own =
            (all > theirs).then(|| format!("the command that joined them ran {}", all - theirs));
        let told: Vec<String> = each.chain(own).collect();
        Some(format!(
            "Of {all} points, {} (results.jsonl names each point's share). Shares may have run on \
             several machines: compare the times of two of them only where these machines are \
             alike and did nothing else meanwhile.",
            told.join(", ")
        ))
    }
}

/// Advances the frames of a point up to `last`.
pub(super) fn until_done(
    drive: &mut Drive<'_>,
    last: u32,
    stop: &AtomicBool,
    observe: impl FnMut(ComputedFrame) -> Result<(), StudyError>,
) -> Result<(), StudyError> {
    match drive.run(last, stop, observe)? {
        End::Done => Ok(()),
        End::Stopped => Err(StudyError::Stopped),
    }
}
