//! A frame's drawing in parts, so that one that takes minutes can say how far it has come.

use std::time::{Duration, Instant};

use super::Renderer;
use crate::RenderError;
use swell_gpu::{
    program::Program,
    recording::{Command, Recording},
};

/// How far the drawing of a frame has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Parts that are drawn.
    pub done: u32,
    /// Parts of the frame: bands of its samples, those of the channels beside it among them.
    pub count: u32,
}

/// Counts the parts of a frame, and tells of each.
pub(super) struct Parts<'a> {
    pub(super) part: Part,
    tell: &'a mut dyn FnMut(Part),
}

impl<'a> Parts<'a> {
    /// Tells that none of `count` is done.
    pub(super) fn new(count: usize, tell: &'a mut dyn FnMut(Part)) -> Self {
        let part = Part {
            done: 0,
            count: u32::try_from(count).unwrap_or(u32::MAX),
        };
        tell(part);
        Self { part, tell }
    }

    fn add(&mut self, more: usize) {
        self.part.done += more as u32;
        (self.tell)(self.part);
    }
}

/// A sample that took longer is waited for band by band. Below that all of it is submitted at once, and the device never waits for the
/// next band.
const SLOW: Duration = Duration::from_secs(1);

/// The passes that end a band by rays, whose bands are small so that none runs long.
const ENDS: [&str; 2] = ["rays/cast", "rays/aovs"];

/// Commands of a sample, up to the end of each band; what follows the last one goes with it.
pub(super) fn portions(commands: &[Command]) -> Vec<&[Command]> {
    let is_end = |command: &Command| command.pass().is_some_and(|pass| ENDS.contains(&pass));
    let ends = commands.iter().filter(|it| is_end(it)).count();
    let mut seen = 0;
    let mut is_split = |command: &Command| {
        seen += usize::from(is_end(command));
        is_end(command) && seen < ends
    };
    commands.split_inclusive(&mut is_split).collect()
}

/// Each of the portions, bound to the program's buffers as they are now.
pub(super) fn record(program: &Program, commands: &[Command]) -> Vec<Recording> {
    portions(commands)
        .into_iter()
        .map(|portion| Recording::new(program, portion))
        .collect()
}

impl Renderer {
    /// Runs what draws a sample, or with `aovs` the channels of one.
    pub(super) fn run_portions(
        &mut self,
        aovs: bool,
        parts: &mut Parts<'_>,
    ) -> Result<(), RenderError> {
        let recordings = if aovs { &self.aovs } else { &self.sample };
        let begun = Instant::now();
        if self.is_slow {
            for recording in recordings {
                recording.run(&self.program, self.timer.as_mut())?;
                self.program.context.wait()?;
                parts.add(1);
            }
        } else {
            let all: Vec<&Recording> = recordings.iter().collect();
            Recording::run_all(&all, &self.program, self.timer.as_mut())?;
            self.program.context.wait()?;
            parts.add(recordings.len());
        }
        self.is_slow = begun.elapsed() > SLOW;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::portions;
    use swell_gpu::recording::Command;

    #[test]
    fn a_sample_is_cut_behind_each_band_but_the_last() {
        let run = |names: &[&'static str]| {
            let commands: Vec<Command> = names
                .iter()
                .map(|name| Command::with(name, 1, Vec::new()))
                .collect();
            let portions = portions(&commands);
            let passes = |portion: &&[Command]| portion.iter().filter_map(Command::pass).collect();
            portions.iter().map(passes).collect::<Vec<Vec<_>>>()
        };
        assert_eq!(
            run(&["rays/first", "rays/cast", "rays/cast", "rays/objects"]),
            [
                vec!["rays/first", "rays/cast"],
                vec!["rays/cast", "rays/objects"]
            ]
        );
        // Splats are one.
        assert_eq!(run(&["ssfr/shade", "ssfr/shade"]).len(), 1);
        assert!(run(&[]).is_empty());
    }
}
