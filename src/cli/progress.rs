//! Progress: a bar on a terminal, plain lines otherwise, JSON lines for render farms.
//!
//! The JSON events are documented in `docs/commands.md`: the last line of a command is its `end`,
//! even if it failed.

mod recurring;
mod within;

use std::{
    cell::RefCell,
    collections::VecDeque,
    io::IsTerminal as _,
    time::{Duration, Instant},
};

use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Map, Value, json};

pub(super) use self::recurring::Recurring;
use self::{
    recurring::Recurrences,
    within::{Notice, Within},
};
use super::output;

/// How progress is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Mode {
    /// A bar on a terminal, lines otherwise.
    #[default]
    Auto,
    /// One line a frame.
    Plain,
    /// One JSON object a line, on standard output.
    Json,
    /// Nothing.
    None,
}

/// Outcome of a frame, or of a point of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Status {
    /// It was made by this run.
    Done,
    /// It existed already, or another process made it.
    Skipped,
    /// It could not be made.
    Failed,
}

impl Status {
    fn name(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Skipped => "skipped",
            Self::Failed => "failed",
        }
    }
}

/// Number of recent frames that the remaining time is estimated from: frames of a shot get slower
/// as the water starts to move.
const RECENT: usize = 8;

/// Frames of one job: their number and the progress.
struct JobProgress {
    frames: u64,
    seen: u64,
    /// When the last of them ended, or when the job began.
    before: Instant,
    /// Times of the most recent frames that were made.
    recent: VecDeque<Duration>,
}

impl JobProgress {
    fn new(frames: u64) -> Self {
        Self {
            frames,
            seen: 0,
            before: Instant::now(),
            recent: VecDeque::new(),
        }
    }

    fn add(&mut self, status: Status, now: Instant) {
        self.seen += 1;
        if status == Status::Done {
            self.recent.push_back(now - self.before);
            if self.recent.len() > RECENT {
                self.recent.pop_front();
            }
        }
        self.before = now;
    }

    /// Mean seconds of the recent frames; `None` if none was made yet.
    fn frame_seconds(&self) -> Option<f64> {
        let took: Duration = self.recent.iter().sum();
        let many = self.recent.len();
        (many > 0).then(|| took.as_secs_f64() / many as f64)
    }

    /// Estimated seconds for the remaining frames, each as long as the recent ones; `None` if none
    /// was made yet.
    fn seconds_left(&self) -> Option<f64> {
        match self.frames.saturating_sub(self.seen) {
            0 => Some(0.0),
            left => self.frame_seconds().map(|each| tenths(each * left as f64)),
        }
    }

    /// The same estimate during a frame with the progress `told`: the rest of it, plus the frames
    /// after it, each as long as the recent ones, or else as this one. `None` before its first
    /// part, and before there are frames.
    fn seconds_left_within(&self, told: &Notice) -> Option<f64> {
        let left = told.left?.as_secs_f64();
        let after = self.frames.checked_sub(self.seen + 1)?;
        let own = told.elapsed.as_secs_f64() + left;
        let each = self.frame_seconds().unwrap_or(own);
        Some(tenths(left + after as f64 * each))
    }
}

fn tenths(seconds: f64) -> f64 {
    (10.0 * seconds).round() / 10.0
}

/// State of a whole command.
struct State {
    bar: Option<ProgressBar>,
    job: JobProgress,
    /// Whether the job was started by [`Progress::set_frames`].
    is_set: bool,
    done: u64,
    skipped: u64,
    failed: u64,
    /// Bytes written; `None` if unknown.
    bytes: Option<u64>,
    /// Progress within a frame, or before the first one.
    within: Option<Within>,
    /// Whether the adapter was warned of.
    has_warned_of_adapter: bool,
    /// Warnings about the job's frames.
    recurrences: Recurrences,
    /// Fields that the command adds to the last event.
    end: Map<String, Value>,
}

/// A command's progress, over the frames of one job or of several, one after another.
pub(super) struct Progress {
    mode: Mode,
    begun: Instant,
    state: RefCell<State>,
}

impl Progress {
    pub(super) fn new(mode: Mode) -> Self {
        let mode = match mode {
            Mode::Auto if !std::io::stderr().is_terminal() => Mode::Plain,
            other => other,
        };
        Self {
            mode,
            begun: Instant::now(),
            state: RefCell::new(State {
                bar: None,
                job: JobProgress::new(0),
                is_set: false,
                done: 0,
                skipped: 0,
                failed: 0,
                bytes: None,
                within: None,
                has_warned_of_adapter: false,
                recurrences: Recurrences::default(),
                end: Map::new(),
            }),
        }
    }

    /// Whether the output is for a program.
    pub(super) fn is_json(&self) -> bool {
        self.mode == Mode::Json
    }

    /// Starts a job of `frames` frames.
    pub(super) fn begin(&self, frames: u64) {
        self.sum_up();
        self.finish();
        let mut state = self.state.borrow_mut();
        state.job = JobProgress::new(frames);
        state.is_set = false;
        state.bar = (self.mode == Mode::Auto).then(|| bar(frames));
    }

    /// Sets the number of frames of a job. Starts the job unless the previous call has; otherwise
    /// only its length changes.
    pub(super) fn set_frames(&self, frames: u64) {
        if !self.state.borrow().is_set {
            self.begin(frames);
        }
        let mut state = self.state.borrow_mut();
        state.is_set = true;
        state.job.frames = frames;
        if let Some(bar) = &state.bar {
            bar.set_length(frames);
        }
    }

    /// Prints a line that is not a frame; `event` is its JSON form.
    pub(super) fn say(&self, text: &str, event: Value) {
        match self.mode {
            Mode::Json => output::event(&event),
            Mode::None => {}
            _ => match &self.state.borrow().bar {
                Some(bar) => bar.println(text),
                None => return output::say(text),
            },
        }
        output::log(text);
    }

    /// Prints a warning about the adapter, if there is one: once in a command, which may open it
    /// for several jobs.
    pub(super) fn warn_of_adapter(&self, warning: Option<&str>) {
        let Some(text) = warning else { return };
        if !std::mem::replace(&mut self.state.borrow_mut().has_warned_of_adapter, true) {
            self.say(
                &format!("warning: {text}"),
                json!({ "event": "warning", "what": "adapter", "text": text }),
            );
        }
    }

    /// Handles a warning about a frame: prints it if it is the first of its kind in the job;
    /// otherwise the job's end reports the worst frame.
    pub(super) fn recur(&self, warning: Recurring) {
        let said = self.state.borrow_mut().recurrences.add(warning);
        if let Some((text, event)) = said {
            self.say(&text, event);
        }
    }

    /// Ends a job's warnings: reports the worst frame of each kind.
    fn sum_up(&self) {
        let said = self.state.borrow_mut().recurrences.end();
        for (text, event) in said {
            self.say(&text, event);
        }
    }

    /// Sends an event that has no text form.
    pub(super) fn tell(&self, event: Value) {
        if self.is_json() {
            output::event(&event);
        }
    }

    /// Records a completed frame. Its event also has the frame's position in the job and the
    /// estimated remaining time.
    pub(super) fn frame(&self, text: &str, status: Status, event: Value) {
        let event = self.count(status, event);
        let bar = self.state.borrow().bar.clone();
        let Some(bar) = bar else {
            let left = self.state.borrow().job.seconds_left();
            // A bar shows the time itself.
            let left = left.filter(|left| *left >= 1.0);
            let left = left.map_or(String::new(), |left| format!(", {left:.0} s left"));
            return self.say(&format!("{text}{left}"), event);
        };
        match status {
            Status::Failed => self.say(text, event),
            _ => {
                bar.set_message(text.to_owned());
                output::log(text);
            }
        }
        bar.set_prefix(ahead(self.state.borrow().job.seconds_left()));
        bar.inc(1);
    }

    /// Reports that `done` of `count` parts of `name` are done: of a frame, or of the work before
    /// the first one, as `of` in the event says. A bar always shows it. Plain mode prints a line
    /// every ten seconds, and one when work before the frames begins; JSON mode sends an event at
    /// the beginning and every second.
    pub(super) fn part(&self, name: &str, (done, count): (u64, u64), event: Value) {
        let mut state = self.state.borrow_mut();
        let state = &mut *state;
        let told = Within::step(&mut state.within, name, (done, count), Instant::now());
        let is_before = state.job.frames == 0;
        let left = told.left.map(|left| tenths(left.as_secs_f64()));
        let job_left = state.job.seconds_left_within(&told);
        let seconds = |left: Option<f64>, words: &str| {
            let left = left.filter(|left| *left >= 1.0);
            left.map_or(String::new(), |left| format!(", {left:.0} s {words}"))
        };
        let in_all = job_left.filter(|_| state.job.seen + 1 < state.job.frames);
        let text = format!(
            "{name}: {done} of {count}{}{}",
            seconds(left, "left"),
            seconds(in_all, "for all frames")
        );
        if self.mode == Mode::Auto && is_before {
            let bar = state.bar.get_or_insert_with(|| bar(count));
            bar.set_position(done);
            bar.set_prefix(ahead(left));
            bar.set_message(name.to_owned());
        } else if let Some(bar) = &state.bar {
            bar.set_prefix(ahead(job_left.or_else(|| state.job.seconds_left())));
            bar.set_message(format!(
                "{name}: {done} of {count}{}",
                seconds(left, "left")
            ));
        }
        let is_line = told.line || (is_before && done == 0);
        if is_line {
            match self.mode {
                Mode::Plain => output::say(&text),
                _ => output::log(&text),
            }
        }
        if told.event
            && self.is_json()
            && let Value::Object(mut event) = event
        {
            event.insert("event".to_owned(), json!("part"));
            event.insert("done".to_owned(), json!(done));
            event.insert("count".to_owned(), json!(count));
            event.insert("seconds_left".to_owned(), json!(left));
            event.insert("job_seconds_left".to_owned(), json!(job_left));
            output::event(&Value::Object(event));
        }
    }

    fn count(&self, status: Status, mut event: Value) -> Value {
        let mut state = self.state.borrow_mut();
        let state = &mut *state;
        state.job.add(status, Instant::now());
        *match status {
            Status::Done => &mut state.done,
            Status::Skipped => &mut state.skipped,
            Status::Failed => &mut state.failed,
        } += 1;
        if let Some(event) = event.as_object_mut() {
            let counted = [
                ("status", json!(status.name())),
                ("number", json!(state.job.seen)),
                ("count", json!(state.job.frames)),
                ("seconds_left", json!(state.job.seconds_left())),
            ];
            for (key, value) in counted {
                // A study numbers its points itself.
                event.entry(key).or_insert(value);
            }
        }
        event
    }

    /// Adds to the bytes written.
    pub(super) fn wrote(&self, bytes: u64) {
        let mut state = self.state.borrow_mut();
        state.bytes = Some(state.bytes.unwrap_or(0) + bytes);
    }

    /// Sends a command's result as an event: the object that its `--json` prints.
    pub(super) fn result(&self, mut object: Value) {
        object["event"] = json!("result");
        self.tell(object);
    }

    /// Adds fields to the last event, which [`Self::end`] sends.
    pub(super) fn tell_end(&self, event: Value) {
        if let Value::Object(event) = event {
            self.state.borrow_mut().end.extend(event);
        }
    }

    /// [`Self::tell_end`], and prints the command's last line.
    pub(super) fn conclude(&self, text: &str, event: Value) {
        self.sum_up();
        self.tell_end(event);
        match self.mode {
            Mode::Json | Mode::None => output::log(text),
            _ => output::say(text),
        }
    }

    /// Removes the bar.
    pub(super) fn finish(&self) {
        if let Some(bar) = self.state.borrow_mut().bar.take() {
            bar.finish_and_clear();
        }
    }

    /// Reports an error, whatever the mode.
    pub(super) fn fail(&self, message: &str, code: u8) {
        self.finish();
        self.sum_up();
        output::say(&format!("swell: {message}"));
        self.tell(failed(message, code));
    }

    /// Sends the last event; none may follow.
    pub(super) fn end(&self, code: u8) {
        self.finish();
        self.sum_up();
        let mut state = self.state.borrow_mut();
        let mut end = std::mem::take(&mut state.end);
        let totals = json!({
            "event": "end", "exit_code": code, "frames_done": state.done,
            "frames_skipped": state.skipped,
            "frames_failed": state.failed, "bytes": state.bytes,
            "seconds": self.begun.elapsed().as_secs_f64(),
        });
        if let Value::Object(totals) = totals {
            end.extend(totals);
        }
        end.entry("interrupted").or_insert(json!(false));
        self.tell(Value::Object(end));
    }
}

fn bar(length: u64) -> ProgressBar {
    // indicatif's own estimate counts whole steps only, and has none before the first.
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} [{elapsed} < {prefix}] {msg}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(length).with_style(style);
    bar.with_prefix(ahead(None))
}

/// Remaining time, as shown in a bar.
fn ahead(seconds: Option<f64>) -> String {
    seconds.map_or("?".to_owned(), |seconds| format!("{seconds:.0} s"))
}

/// The event of an error that ends a command.
fn failed(message: &str, code: u8) -> Value {
    json!({ "event": "error", "message": message, "exit_code": code })
}

/// Sends the error of an unparsable command line as an event if it asks for JSON.
pub(super) fn unread(arguments: &[String], message: &str, code: u8) {
    let asks = |pair: &[String]| pair[0] == "--progress" && pair[1] == "json";
    if arguments.windows(2).any(asks) || arguments.iter().any(|it| it == "--progress=json") {
        let progress = Progress::new(Mode::Json);
        progress.tell(failed(message, code));
        progress.end(code);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_is_that_of_the_last_frames() {
        let begin = Instant::now();
        let mut job = JobProgress::new(24);
        job.before = begin;
        assert_eq!(job.seconds_left(), None);
        // Frames that existed already carry no information.
        job.add(Status::Skipped, begin);
        job.add(Status::Failed, begin);
        assert_eq!(job.seconds_left(), None);
        let mut now = begin;
        for k in 0..12 {
            now += Duration::from_secs(if k < 4 { 100 } else { 2 });
            job.add(Status::Done, now);
        }
        // The eight most recent took 2 s each, and ten are left.
        assert_eq!(job.seconds_left(), Some(20.0));
        // During the next frame, half of which is drawn in 3 s, with nine more after it.
        let told = |left| Notice {
            line: false,
            event: false,
            elapsed: Duration::from_secs(3),
            left,
        };
        let half = told(Some(Duration::from_secs(3)));
        assert_eq!(job.seconds_left_within(&half), Some(21.0));
        assert_eq!(job.seconds_left_within(&told(None)), None);
        // The first frame is all that is known about the others.
        let first = JobProgress::new(10);
        assert_eq!(first.seconds_left_within(&half), Some(57.0));
        assert_eq!(JobProgress::new(0).seconds_left_within(&half), None);
        for _ in 0..10 {
            job.add(Status::Skipped, now);
        }
        assert_eq!(job.seconds_left(), Some(0.0));
    }
}
