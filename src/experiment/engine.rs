//! What every kind of study stands on: devices that are opened once, and points whose results are kept, so that a study that
//! was interrupted goes on where it stopped.

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
use swell_gpu::adapter::{GpuError, Needs};
use swell_scene::{Method, Scene, physics_hash, study::RunsOn};
use swell_stage::{
    device::{Gpu, Opened, needs},
    drive::{Drive, End, Step},
};
use swell_study::folder::ledger_of;

use super::{
    Event, PointEvent, PointStatus, Request, StudyError,
    ledger::{Key, Ledger, Line, Reader},
    report::Report,
    run::Run,
};

/// Changes whenever what a line of results holds does.
const FORM: &str = "swell study 3";

/// A kind of study: what it runs and measures, and what it draws of that.
pub(super) trait Kind {
    /// What its runs ask of an adapter; `None` where they need none.
    fn needs(&self) -> Option<Needs>;

    /// Points that it tells of.
    fn count(&self) -> usize;

    /// What a share may run, in the order of [`Bench::is_next_ours`]. `None` where points stand on one cache, so that there are
    /// no shares.
    fn places(&self) -> Option<Vec<Place>>;

    /// Runs, measures and draws; `None` where only a share was run, or looked for.
    ///
    /// # Errors
    /// [`StudyError`]; [`StudyError::Stopped`] where a signal came.
    fn run(&self, bench: &mut Bench<'_>) -> Result<Option<Report>, StudyError>;
}

/// Where a point, or a search that takes several, stands among those that shares are dealt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    /// In its line, from cheap to dear.
    pub(super) rank: usize,
    /// Points that it takes at most.
    pub(super) points: usize,
}

impl Place {
    /// Of one point.
    pub(super) fn of(rank: usize) -> Self {
        Self { rank, points: 1 }
    }
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

    /// What a point is known by. The hash is of all that its results depend on: each run's physics, device and when it gives
    /// up; frames, how it is measured, and the program.
    pub(super) fn key(&self, runs: &[(&Scene, RunsOn)], frames: u32, measured: &str) -> Key {
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

/// What is run of a study.
pub(super) enum Work {
    /// All of it.
    Whole,
    /// A share, with which points are its.
    Share(Chunk, Vec<bool>),
    /// Nothing: points that no ledger has are counted.
    Look,
}

/// What a kind of study has at hand while it runs.
pub(super) struct Bench<'a> {
    pub(super) request: &'a Request,
    pub(super) devices: &'a Devices,
    pub(super) stop: &'a AtomicBool,
    tell: RefCell<&'a mut dyn FnMut(Event)>,
    work: Work,
    pub(super) count: usize,
    /// Points that were told of.
    number: usize,
    /// Points of the study, a share's or not, that were come to.
    dealt: usize,
    /// Points that were run, those that stood there, and what is left.
    pub(super) ran: Cell<usize>,
    pub(super) stood: Cell<usize>,
    pub(super) left: Cell<usize>,
    /// Whether what is left may come to less.
    pub(super) is_left_at_most: Cell<bool>,
    /// Hashes of points whose results are there: two points of one key have one.
    there: RefCell<BTreeSet<String>>,
    /// Shares that ran points, with how many; known at the end of a whole study.
    shares: RefCell<Vec<(String, usize)>>,
}

impl<'a> Bench<'a> {
    pub(super) fn new(
        request: &'a Request,
        devices: &'a Devices,
        stop: &'a AtomicBool,
        tell: &'a mut dyn FnMut(Event),
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

    pub(super) fn tell(&self, event: Event) {
        (self.tell.borrow_mut())(event);
    }

    /// Whether there is nothing to draw, since others run what is not of the share.
    pub(super) fn is_part(&self) -> bool {
        !matches!(self.work, Work::Whole)
    }

    /// Whether the next of [`Kind::places`] is to be run, or looked for.
    pub(super) fn is_next_ours(&mut self) -> bool {
        self.dealt += 1;
        match &self.work {
            Work::Share(_, is_ours) => is_ours[self.dealt - 1],
            Work::Whole | Work::Look => true,
        }
    }

    /// Tells what became of the next point.
    pub(super) fn told(&mut self, name: String, status: PointStatus) {
        if matches!(self.work, Work::Look) {
            return;
        }
        self.number += 1;
        self.tell(Event::Point(PointEvent {
            number: self.number,
            count: self.count,
            name,
            status,
        }));
    }

    fn reader(&self) -> Reader {
        match self.work {
            Work::Whole => Reader::Whole,
            Work::Share(chunk, _) => Reader::Share(chunk),
            Work::Look => Reader::Look,
        }
    }

    /// Results that stand in the study's folder.
    pub(super) fn ledger<M: Serialize + DeserializeOwned>(&self) -> Result<Ledger<M>, StudyError> {
        let warn = &mut |text| self.tell(Event::Warning(text));
        Ledger::open(&self.request.directory, self.reader(), warn)
    }

    /// A point's results and whether they stood in a ledger; they are measured where they did not. `None` of a point that is
    /// only looked for, and of which there are none.
    pub(super) fn point<M: Clone + Default + Serialize>(
        &self,
        ledger: &mut Ledger<M>,
        name: &str,
        key: Key,
        measure: impl FnOnce() -> Result<Run<M>, StudyError>,
    ) -> Result<Option<(Run<M>, bool)>, StudyError> {
        let add = |to: &Cell<usize>| to.set(to.get() + 1);
        let warn = &mut |text| self.tell(Event::Warning(text));
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
        let run = ledger.append(Line {
            key,
            name,
            share,
            run,
        })?;
        add(&self.ran);
        Ok(Some((run.clone(), false)))
    }

    /// At the end of all points: which shares ran some of them.
    pub(super) fn joined<M: Clone + Serialize>(&self, ledger: &Ledger<M>) {
        let (shares, unknown) = ledger.joined();
        for (share, points) in &shares {
            let file = ledger_of(share.parse().ok());
            let (share, points) = (share.clone(), *points);
            self.tell(Event::Joined {
                share,
                file,
                points,
            });
        }
        for text in unknown {
            self.tell(Event::Warning(text));
        }
        *self.shares.borrow_mut() = shares;
    }

    /// What a page says of points that shares ran; `None` where none did.
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
            "Of {all} points, {} (results.jsonl names each point's share). Shares may have run on several machines: compare \
             the times of two of them only where these machines are alike and did nothing else meanwhile.",
            told.join(", ")
        ))
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
