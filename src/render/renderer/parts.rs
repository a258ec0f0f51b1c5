//! Splits the drawing of a frame into parts, so that a frame that takes minutes can report
//! progress.

use std::{
    ops::ControlFlow,
    time::{Duration, Instant},
};

use super::Renderer;
use crate::RenderError;
use swell_gpu::{
    program::Program,
    recording::{Command, Recording},
};

/// Progress of drawing a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Number of finished parts.
    pub done: u32,
    /// Number of parts of the frame: bands of its samples, including those of the additional
    /// channels.
    pub count: u32,
}

/// Counts the finished parts of a frame and reports progress.
pub(super) struct PartProgress<'a> {
    pub(super) part: Part,
    frame: u32,
    tell: &'a mut dyn FnMut(Part) -> ControlFlow<()>,
}

impl<'a> PartProgress<'a> {
    /// Starts at none of `count` parts of a frame.
    pub(super) fn new(
        frame: u32,
        count: usize,
        tell: &'a mut dyn FnMut(Part) -> ControlFlow<()>,
    ) -> Self {
        let part = Part {
            done: 0,
            count: u32::try_from(count).unwrap_or(u32::MAX),
        };
        Self { part, frame, tell }
    }

    /// Adds finished parts, and reports them.
    ///
    /// # Errors
    /// [`RenderError::Ended`] where the receiver wants no more.
    pub(super) fn add(&mut self, more: usize) -> Result<(), RenderError> {
        self.part.done += more as u32;
        match (self.tell)(self.part) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(RenderError::Ended { frame: self.frame }),
        }
    }
}

/// Duration of a sample above which the next one is submitted and awaited band by band. Faster
/// samples are submitted at once, so that the device never idles between bands.
const SLOW: Duration = Duration::from_secs(1);

/// Passes that end a band of rays, whose bands are small so that none runs long.
const ENDS: [&str; 2] = ["rays/cast", "rays/aovs"];

/// Splits the commands of a sample after each band; commands after the last band belong to it.
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

/// Records each portion with the program's current buffers.
pub(super) fn record(program: &Program, commands: &[Command]) -> Vec<Recording> {
    portions(commands)
        .into_iter()
        .map(|portion| Recording::new(program, portion))
        .collect()
}

impl Renderer {
    /// Runs the recordings of a sample or, with `aovs`, those of its additional channels.
    pub(super) fn run_portions(
        &mut self,
        aovs: bool,
        parts: &mut PartProgress<'_>,
    ) -> Result<(), RenderError> {
        let recordings = if aovs { &self.aovs } else { &self.sample };
        let begun = Instant::now();
        if self.is_slow {
            for recording in recordings {
                recording.run(&self.program, self.timer.as_mut())?;
                self.program.context.wait()?;
                parts.add(1)?;
            }
        } else {
            let all: Vec<&Recording> = recordings.iter().collect();
            Recording::run_all(&all, &self.program, self.timer.as_mut())?;
            self.program.context.wait()?;
            parts.add(recordings.len())?;
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
        // Splats are a single portion.
        assert_eq!(run(&["ssfr/shade", "ssfr/shade"]).len(), 1);
        assert!(run(&[]).is_empty());
    }
}
