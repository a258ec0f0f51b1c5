//! Computed frames on their way to the cache.

use std::{path::Path, time::Instant};

use serde_json::{Value, json};

use swell_cache::{CacheWriter, Clock, Summary, failed};
use swell_scene::{Held, Scene};

use super::{BakeError, BakeEvent, BakePlan, BakeRequest, water};
use crate::{drive::ComputedFrame, probes};

/// Writes the frames of a running bake, and counts what it warns of at its end.
pub(super) struct Frames<'a> {
    scene: &'a Scene,
    directory: &'a Path,
    writer: CacheWriter,
    /// Clock after the last frame.
    clock: Clock,
    /// First frame that this run computes.
    first: u32,
    /// How often probes sampled.
    looked: probes::Looked,
    /// Walls that were held at the ends of their ways.
    held: Held,
    /// Emitted particles that never entered.
    blocked: u64,
    /// Greatest number of particles.
    most: usize,
    /// When the frame before was done.
    before: Instant,
}

impl<'a> Frames<'a> {
    /// Before the frame that follows the one at which `clock` stands.
    pub(super) fn new(
        request: &'a BakeRequest,
        plan: &BakePlan<'a>,
        writer: CacheWriter,
        clock: Clock,
    ) -> Self {
        Self {
            scene: plan.scene,
            directory: &request.directory,
            writer,
            clock,
            first: clock.frame + 1,
            looked: probes::Looked::new(plan.scene),
            held: Held::default(),
            blocked: 0,
            most: plan.start.particles.len(),
            before: Instant::now(),
        }
    }

    /// Evaluates the probes of a frame, submits it to the writer and reports it.
    pub(super) fn add(
        &mut self,
        step: ComputedFrame,
        tell: &mut dyn FnMut(BakeEvent),
    ) -> Result<(), BakeError> {
        let scene = self.scene;
        self.looked.add(scene, step.frame, &step.looks);
        let time = scene.shot.time(step.frame);
        let looks = Some(step.looks);
        let seen = probes::look(scene, time, &step.particles, &step.pressures, looks);
        let now = Instant::now();
        let seconds = (now - self.before).as_secs_f64();
        self.before = now;
        let ComputedFrame {
            frame,
            particles,
            next_id,
            report,
            ..
        } = step;
        self.held.add(scene, &particles);
        self.most = self.most.max(particles.len());
        self.blocked += report.exchange.map_or(0, |exchange| exchange.blocked);
        self.clock = Clock {
            frame,
            time,
            substeps: report.substeps,
            steps: self.clock.steps + u64::from(report.substeps),
            substep: particles.substep,
            walls: particles.walls,
            next_id,
        };
        let extra = json!({ "seconds": seconds });
        let reported = serde_json::to_value(&report).unwrap_or(Value::Null);
        self.writer
            .submit(self.clock, particles, seen, reported, extra)?;
        if frame == self.first {
            // Left by an earlier bake that failed at this frame.
            failed::remove(self.directory)?;
        }
        tell(BakeEvent::Frame {
            frame,
            report,
            seconds,
        });
        Ok(())
    }

    /// Waits for the disk; returns what was written, and warnings about the frames.
    pub(super) fn finish(self) -> Result<(Summary, Vec<String>), BakeError> {
        let scene = self.scene;
        let warnings = [
            self.looked.warnings(scene),
            self.held.warnings(),
            water::never_entered(self.blocked),
            water::overfull(scene, self.most),
        ];
        Ok((self.writer.finish()?, warnings.concat()))
    }
}
