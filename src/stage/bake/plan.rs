//! Plan of a bake, made without a device.

use swell_cache::{CacheError, CacheReader, Clock, Parent, refuse_occupied};
use swell_domain::{
    signed_distance::{SignedDistance, SignedDistanceError},
    sources::Solids,
};
use swell_scene::Scene;

use super::{BakeError, BakeRequest, Inflow, disk};
use crate::{
    branch::{Branch, note_covered},
    prepare::{Start, Volume},
};

/// What a bake begins with, the frames that it will compute, and what is known of them before a
/// device is opened.
#[derive(Clone, Debug)]
pub struct BakePlan<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Particles, solids and sources of the bake's start: the scene's own, or those of the frame of
    /// another cache.
    pub start: Start,
    /// What each emitter brings.
    pub inflows: Vec<Inflow>,
    /// Warnings about the scene and its start, a sentence each.
    pub warnings: Vec<String>,
    /// The frame of another cache that a new bake begins from, if it does.
    pub parent: Option<Parent>,
    /// Notes about beginning from that frame, a sentence each.
    pub notes: Vec<String>,
    /// Clock of a new bake's start.
    pub(super) clock: Clock,
    /// Whether a cache is there that the bake resumes.
    pub(super) is_resumed: bool,
    /// First frame that will be computed.
    pub first: u32,
    /// Last frame that will be computed.
    pub last: u32,
    /// Number of frames that exist from an earlier bake, not counting the start.
    pub standing: u32,
}

impl<'a> BakePlan<'a> {
    /// Plans a new bake of the whole shot from the scene's own start.
    ///
    /// # Errors
    /// Those of [`Start::of`].
    pub fn of(scene: &'a Scene) -> Result<Self, SignedDistanceError> {
        Ok(Self::begun(scene, Start::of(scene)?))
    }

    /// Plans the requested bake. Ignores which device an existing cache was baked on.
    ///
    /// # Errors
    /// Those of [`bake`](super::bake) that need no device.
    pub fn new(request: &'a BakeRequest) -> Result<Self, BakeError> {
        let (scene, directory) = (&request.scene, &request.directory);
        let last = last_frame(request)?;
        let is_resumed = request.resume && swell_cache::exists(directory);
        let open = |from| Branch::open(from, scene);
        let branch = request.from.as_ref().map(open).transpose()?;
        let plan = match (is_resumed, branch) {
            (true, branch) => Self::resumed(request, branch)?,
            (false, Some(branch)) => Self::branched(request, last, branch)?,
            (false, None) => Self::of(scene)?,
        };
        let plan = Self { last, ..plan };
        plan.check_count()?;
        if !is_resumed {
            refuse_occupied(directory)?;
        }
        check_first(request, plan.first)?;
        Ok(plan)
    }

    fn begun(scene: &'a Scene, start: Start) -> Self {
        let inflows = Inflow::of(scene, &start);
        let mut plan = Self {
            scene,
            start,
            inflows,
            warnings: scene.warnings(),
            parent: None,
            notes: Vec::new(),
            clock: Clock::default(),
            is_resumed: false,
            first: 1,
            last: scene.shot.frames,
            standing: 0,
        };
        let lints = plan
            .start
            .lint_dry()
            .into_iter()
            .chain(plan.lint_emitters());
        let emitters = plan.inflows.iter().enumerate();
        let covered = emitters.filter_map(|(index, inflow)| inflow.covered(index));
        let warnings: Vec<String> = lints.chain(covered).collect();
        plan.warnings.extend(warnings);
        plan
    }

    /// The plan from a frame of another cache, after which `last` has to come.
    fn branched(request: &'a BakeRequest, last: u32, branch: Branch) -> Result<Self, BakeError> {
        let scene = &request.scene;
        let frame = branch.clock.frame;
        if last <= frame {
            return Err(BakeError::NothingLeft {
                asked: match (&request.frames, &request.from) {
                    (Some(frames), _) => format!("frames {frames}"),
                    (None, Some(from)) => format!("from {from}"),
                    (None, None) => format!("a shot of {last} frames"),
                },
                frame,
            });
        }
        let start = Start::with(scene, branch.particles)?;
        let covered = note_covered(scene, &start, branch.clock.time);
        Ok(Self {
            parent: Some(branch.parent),
            notes: branch.notes.into_iter().chain(covered).collect(),
            clock: branch.clock,
            first: frame + 1,
            ..Self::begun(scene, start)
        })
    }

    /// The plan that goes on after the last frame of the request's cache, with the start of that
    /// bake.
    fn resumed(request: &'a BakeRequest, branch: Option<Branch>) -> Result<Self, BakeError> {
        let (scene, directory) = (&request.scene, &request.directory);
        let cached = CacheReader::open(directory)?;
        let text = swell_files::scene_to_toml(scene, &swell_scene::asset_path);
        if let Some(difference) = swell_files::physics_difference(cached.scene_toml(), &text)? {
            return Err(BakeError::OtherPhysics {
                directory: directory.clone(),
                difference,
            });
        }
        let start = Start::of_cache::<BakeError>(scene, &cached)?;
        let newest = cached.last_frame();
        Ok(Self {
            parent: branch.map(|branch| branch.parent),
            is_resumed: true,
            first: newest + 1,
            standing: newest - cached.first_frame(),
            ..Self::begun(scene, start)
        })
    }

    /// The volume of water at the start.
    pub fn volume(&self) -> Volume {
        self.start.volume(self.scene)
    }

    /// Greatest number of particles that emitters without a level add until the end of the shot;
    /// `None` if the scene has no inlets.
    pub fn entering(&self) -> Option<f64> {
        let each = self.inflows.iter().filter_map(|inflow| {
            // Where nothing is in the way, to the particle.
            Some((inflow.most? as f64 * inflow.predicted?.open).ceil())
        });
        let entering: f64 = each.sum();
        self.scene.has_inlets().then_some(entering)
    }

    /// Bytes of all frames including the start, each assumed as large as the start.
    ///
    /// # Errors
    /// Particles that cannot be stored in a frame.
    pub fn bytes(&self) -> Result<u64, CacheError> {
        let frame = disk::frame_bytes(self.scene, &self.start.particles)?;
        let later = disk::bytes_of(self.scene, frame, self.first, self.last);
        Ok(frame.iter().sum::<u64>() + later)
    }

    /// Legal but suspicious values of the scene: of its start, only if that is the scene's own.
    pub fn lints(&self) -> Vec<String> {
        let own = self.start.asked.and_then(|_| self.start.lint_dry());
        let lints = self.scene.lints().into_iter().chain(own);
        lints.chain(self.lint_emitters()).collect()
    }

    fn lint_emitters(&self) -> impl Iterator<Item = String> {
        let emitters = self.inflows.iter().enumerate();
        emitters.filter_map(|(index, inflow)| inflow.lint(self.scene, index))
    }

    /// Refuses a bake that is known to exceed the particle budget: at its start, or with what
    /// emitters add when no drain can remove any.
    fn check_count(&self) -> Result<(), BakeError> {
        let Some(limit) = self.scene.budget.particles else {
            return Ok(());
        };
        let begun = self.parent.as_ref().map_or(0, |parent| parent.frame);
        let particles = self.start.particles.len();
        let boundary = &self.start.boundary;
        let moving: Vec<&SignedDistance> = boundary.moving.iter().collect();
        let solids = Solids {
            still: boundary.distance.as_ref(),
            moving: &moving,
            pose: &|index, seconds| self.scene.moving_solids[index].pose(&[], seconds),
        };
        let (sources, frames) = (&self.start.sources, begun + 1..self.last + 1);
        let later = sources.least_counts(particles, frames, &solids);
        let mut counts = std::iter::once((0, particles)).chain(later);
        match counts.find(|(_, count)| *count as f64 > limit) {
            Some((frame, count)) => Err(BakeError::Particles {
                limit,
                frame,
                count,
            }),
            None => Ok(()),
        }
    }
}

/// The last requested frame. A bake computes every frame up to it, and a scene is validated only up
/// to its own last frame.
fn last_frame(request: &BakeRequest) -> Result<u32, BakeError> {
    let shot = request.scene.shot.frames;
    let Some(frames) = &request.frames else {
        return Ok(shot);
    };
    let fault = |what: String| Err(BakeError::Frames(format!("{frames}: {what}")));
    if frames.len() as u64 != u64::from(frames.last() - frames.first()) + 1 {
        return fault("skips frames, and each frame of a bake needs the one before".into());
    }
    if frames.last() > shot {
        return fault(format!("the shot has {shot} frames; raise shot.frames"));
    }
    Ok(frames.last())
}

/// Refuses a range whose first frame lies beyond the next one to bake.
fn check_first(request: &BakeRequest, next: u32) -> Result<(), BakeError> {
    match &request.frames {
        Some(frames) if frames.first() > next => Err(BakeError::Frames(format!(
            "{frames}: frame {next} has not been baked, and each frame needs the one \
             before: bake {next}-{}",
            frames.last()
        ))),
        _ => Ok(()),
    }
}
