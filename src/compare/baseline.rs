//! Baselines: the recorded results of a bake, small enough to be tracked with the source.
//!
//! On an adapter that a baseline knows, the particles of every frame must be bit-identical, and so
//! must their sums. On other adapters roundings differ and trajectories diverge, so that only the
//! aggregates decide.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{
    frames::{Fault, aggregate_faults},
    limits::StatedLimit,
    spread::{self, Spread},
};
use swell_domain::{aggregates::Aggregates, particles::Particles, tolerance::ErrorLimit};

/// Format version that this program writes and reads.
pub const FORMAT_VERSION: u32 = 1;

/// Stored baseline of one scene with one solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Baseline {
    /// Value of [`FORMAT_VERSION`] when it was written.
    pub format_version: u32,
    /// Shot name.
    pub shot: String,
    /// Solver name, `pbf` or `flip`.
    pub solver: String,
    /// The scene as baked, line by line.
    pub scene: Vec<String>,
    /// Limits of the aggregates by name, each with its reason.
    pub tolerances: BTreeMap<String, StatedLimit>,
    /// Descriptions of the bakes from which the frames' spreads were measured; empty if none were.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub spread_from: Vec<String>,
    /// Adapter on which the aggregates were measured.
    pub aggregates_from: String,
    /// Frames in order, from frame 0, the start.
    pub frames: Vec<BaselineFrame>,
    /// [`particles_hash`] of each frame of `frames`, by adapter and driver.
    pub hashes: BTreeMap<String, Vec<String>>,
}

/// One frame of a baseline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BaselineFrame {
    /// Output frame number.
    pub frame: u32,
    /// Number of particles.
    pub particles: usize,
    /// Sums and shapes over the particles.
    pub aggregates: Aggregates,
    /// How far bakes that differ only in roundings had diverged by then; absent if not measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spread: Option<Spread>,
}

/// One frame of the cache that is compared with a baseline.
#[derive(Clone, Debug)]
pub struct MeasuredFrame {
    /// Particle count and aggregates.
    pub frame: BaselineFrame,
    /// [`particles_hash`] of the particles.
    pub hash: String,
}

/// Basis of a comparison of a cache with a baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// Hash and aggregates of every frame: the baseline knows the adapter.
    Hashes,
    /// Aggregates within their limits: the adapter is unknown, or hashes are ignored.
    Aggregates,
}

/// A frame that differs from the baseline.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BaselineFault {
    /// Output frame number.
    pub frame: u32,
    /// What differs.
    pub fault: Fault,
}

/// Differences between a cache and a baseline.
#[derive(Clone, Debug, Serialize)]
pub struct BaselineDiff {
    /// Program and device that baked the cache.
    pub bake: String,
    /// Basis of the comparison: whether hashes decide as well.
    pub basis: Basis,
    /// Whether hashes were to be ignored.
    pub ignores_hashes: bool,
    /// Adapters whose hashes the baseline holds.
    pub known_adapters: Vec<String>,
    /// Adapter on which the baseline's aggregates were measured.
    pub aggregates_from: String,
    /// First key in which the scenes differ, with the baseline's value, then the cache's.
    pub physics: Option<String>,
    /// Requested frames that the cache lacks.
    pub only_baseline: Vec<u32>,
    /// Frames that were compared.
    pub frames: Vec<FramePair>,
    /// Faults in the order of the frames.
    pub faults: Vec<BaselineFault>,
}

/// Aggregates of one frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FramePair {
    /// Output frame number.
    pub frame: u32,
    /// Aggregates of the cache and of the baseline.
    pub aggregates: [Aggregates; 2],
    /// Limits of their differences, by name.
    pub limits: BTreeMap<String, ErrorLimit>,
}

impl BaselineDiff {
    /// Returns whether everything is within tolerance and no frame is missing.
    pub fn is_within(&self) -> bool {
        self.faults.is_empty() && self.only_baseline.is_empty()
    }
}

/// Returns a BLAKE3 hash, in hex, of all bits of the particles: count, then positions, velocities,
/// ids, and the attributes with their names, little-endian. The frame's file is not suitable,
/// because it contains the program's version.
pub fn particles_hash(particles: &Particles) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&(particles.len() as u64).to_le_bytes());
    for vectors in [&particles.position, &particles.velocity] {
        update(
            &mut hasher,
            vectors.iter().flatten().map(|x| x.to_le_bytes()),
        );
    }
    update(&mut hasher, particles.id.iter().map(|id| id.to_le_bytes()));
    for (name, values) in &particles.attributes {
        hasher.update(&(name.len() as u64).to_le_bytes());
        hasher.update(name.as_bytes());
        update(&mut hasher, values.iter().map(|x| x.to_le_bytes()));
    }
    hasher.finalize().to_hex().to_string()
}

fn update(hasher: &mut blake3::Hasher, values: impl Iterator<Item = [u8; 4]>) {
    let bytes: Vec<u8> = values.flatten().collect();
    hasher.update(&bytes);
}

/// Parts of the previous baseline that the new one drops.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Lost {
    /// Adapters whose hashes belong to another scene or to other frames.
    pub hashes: Vec<String>,
    /// Whether measured spreads, and the limits based on them, were dropped.
    pub has_spread: bool,
}

impl Baseline {
    /// Takes over what remains valid of the previous baseline. For the same scene and frames that
    /// is everything but the aggregates; these as well if they agree and were measured on an
    /// adapter that the old baseline did not know.
    pub fn inherit(
        &mut self,
        before: Self,
        is_same_scene: bool,
        measured: &[MeasuredFrame],
    ) -> Lost {
        let adapter = self.aggregates_from.clone();
        let number = |frame: &BaselineFrame| frame.frame;
        let has_spread = !before.spread_from.is_empty();
        let is_same_frames = before
            .frames
            .iter()
            .map(number)
            .eq(self.frames.iter().map(number));
        if !is_same_scene || !is_same_frames {
            if !has_spread {
                self.tolerances = before.tolerances;
            }
            let mut hashes: Vec<String> = before.hashes.into_keys().collect();
            hashes.retain(|other| *other != adapter);
            return Lost { hashes, has_spread };
        }
        let (basis, faults) = before.compare(Some(&adapter), measured);
        let is_new_adapter = !before.hashes.contains_key(&adapter);
        if is_new_adapter && basis == Basis::Aggregates && faults.is_empty() {
            self.aggregates_from = before.aggregates_from;
            self.frames = before.frames;
        } else {
            for (frame, old) in self.frames.iter_mut().zip(before.frames) {
                frame.spread = old.spread;
            }
        }
        self.hashes = before.hashes;
        self.tolerances = before.tolerances;
        self.spread_from = before.spread_from;
        Lost::default()
    }

    /// Compares frames with the baseline's, as far as both have them. On an `adapter` that the
    /// baseline knows, hashes must be equal; the aggregates are judged there as well, and
    /// distinguish a rounding from a change. `None` ignores the hashes.
    pub fn compare(
        &self,
        adapter: Option<&str>,
        measured: &[MeasuredFrame],
    ) -> (Basis, Vec<BaselineFault>) {
        let hashes = adapter.and_then(|adapter| self.hashes.get(adapter));
        let mut faults = Vec::new();
        for (index, expected) in self.frames.iter().enumerate() {
            let number = expected.frame;
            let Some(found) = measured.iter().find(|m| m.frame.frame == number) else {
                continue;
            };
            let mut push = |fault| {
                faults.push(BaselineFault {
                    frame: number,
                    fault,
                });
            };
            if hashes.is_some_and(|hashes| hashes.get(index) != Some(&found.hash)) {
                push(fault("particles", "hash", 1.0));
            }
            let counts = [found.frame.particles, expected.particles];
            if counts[0] != counts[1] {
                let difference = counts[0].abs_diff(counts[1]) as f64;
                push(fault("particles", "difference", difference));
            }
            let limits = self.limits(adapter, found);
            let is_same = self.is_same(adapter, index, found);
            let pair = [found.frame.aggregates, expected.aggregates];
            // If only one side has a front, the wave is about one cube high, and the crest
            // is judged.
            aggregate_faults(&pair, |name| limits.get(name).copied())
                .into_iter()
                .filter(|fault| is_same || fault.what != "front" || fault.value.is_finite())
                .for_each(push);
        }
        let basis = hashes.map_or(Basis::Aggregates, |_| Basis::Hashes);
        (basis, faults)
    }

    /// Returns the aggregates of the frames that both have, with the limits of their differences.
    pub fn pairs(&self, adapter: Option<&str>, measured: &[MeasuredFrame]) -> Vec<FramePair> {
        let pair = |found: &MeasuredFrame| {
            let frame = found.frame.frame;
            let expected = self.frames.iter().find(|f| f.frame == frame)?;
            Some(FramePair {
                frame,
                aggregates: [found.frame.aggregates, expected.aggregates],
                limits: self.limits(adapter, found),
            })
        };
        measured.iter().filter_map(pair).collect()
    }

    /// Derives new limits from bakes that differ from `expected` only in roundings, each given with
    /// a description of the difference. `spacing` is the distance of particles at rest, metres.
    pub fn take_spread(
        &mut self,
        expected: &[BaselineFrame],
        bakes: Vec<(String, Vec<BaselineFrame>)>,
        spacing: f64,
    ) {
        let (from, bakes): (_, Vec<_>) = bakes.into_iter().unzip();
        let aggregates = |frames: &[BaselineFrame]| frames.iter().map(|f| f.aggregates).collect();
        let expected_values: Vec<Aggregates> = aggregates(expected);
        let bakes: Vec<Vec<Aggregates>> = bakes.iter().map(|bake| aggregates(bake)).collect();
        self.spread_from = from;
        let spreads = spread::of(&expected_values, &bakes);
        let particles = expected.first().map_or(0, |frame| frame.particles);
        self.tolerances = spread::tolerances(&spreads, spacing, particles);
        for (frame, spread) in self.frames.iter_mut().zip(spreads) {
            frame.spread = Some(spread);
        }
    }

    /// Whether the baseline's aggregates of the frame at `index` were measured from these
    /// very particles.
    fn is_same(&self, adapter: Option<&str>, index: usize, found: &MeasuredFrame) -> bool {
        let known = adapter.filter(|adapter| *adapter == self.aggregates_from);
        let hashes = known.and_then(|adapter| self.hashes.get(adapter));
        hashes.and_then(|hashes| hashes.get(index)) == Some(&found.hash)
    }

    /// Returns the limits of a frame's aggregates; empty for a frame that the baseline does not
    /// have. For bit-identical particles the limit is the rounding of a sum of n terms of one sign,
    /// n ε of the sum (Higham 2002, eq. 4.4).
    pub fn limits(
        &self,
        adapter: Option<&str>,
        found: &MeasuredFrame,
    ) -> BTreeMap<String, ErrorLimit> {
        let mut frames = self.frames.iter().enumerate();
        let Some((index, expected)) = frames.find(|(_, f)| f.frame == found.frame.frame) else {
            return BTreeMap::new();
        };
        if self.is_same(adapter, index, found) {
            let limit = ErrorLimit {
                absolute: 0.0,
                relative: expected.particles as f64 * f64::EPSILON,
            };
            let names = Aggregates::NAMES.iter();
            return names.map(|(name, _)| ((*name).to_owned(), limit)).collect();
        }
        let spread = |name: &str| {
            let spread = expected.spread.as_ref().and_then(|spread| spread.get(name));
            spread.copied().unwrap_or(0.0)
        };
        let limit = |(name, stated): (&String, &StatedLimit)| {
            let limit = ErrorLimit {
                absolute: stated.absolute + stated.spreads * spread(name),
                relative: stated.relative,
            };
            (name.clone(), limit)
        };
        self.tolerances.iter().map(limit).collect()
    }

    /// Checks the consistency of a baseline that was just read.
    ///
    /// # Errors
    /// A message about the first fault.
    pub fn check(&self) -> Result<(), String> {
        if self.format_version != FORMAT_VERSION {
            return Err(format!(
                "format_version is {}; this program reads {FORMAT_VERSION}",
                self.format_version
            ));
        }
        if self.frames.is_empty() {
            return Err("frames is empty".to_owned());
        }
        for (adapter, hashes) in &self.hashes {
            let (found, wanted) = (hashes.len(), self.frames.len());
            if found != wanted {
                return Err(format!(
                    "hashes.\"{adapter}\" has {found} of {wanted} frames"
                ));
            }
        }
        for (name, limit) in &self.tolerances {
            let known = Aggregates::NAMES.map(|(known, _)| known);
            if !known.contains(&name.as_str()) {
                let known = known.join(", ");
                return Err(format!("tolerances.{name} is unknown; allowed: {known}"));
            }
            if !(limit.absolute >= 0.0 && limit.relative >= 0.0 && limit.spreads >= 0.0) {
                return Err(format!("tolerances.{name} is below 0"));
            }
            let lacks = |frame: &&BaselineFrame| {
                let spread = frame.spread.as_ref().and_then(|spread| spread.get(name));
                limit.spreads > 0.0 && spread.is_none_or(|spread| *spread < 0.0)
            };
            if let Some(frame) = self.frames.iter().find(lacks) {
                let frame = frame.frame;
                return Err(format!("frame {frame} has no spread of {name}"));
            }
        }
        Ok(())
    }
}

fn fault(what: &str, measure: &'static str, value: f64) -> Fault {
    Fault {
        what: what.to_owned(),
        measure,
        value,
        limit: 0.0,
        parting: None,
    }
}

#[cfg(test)]
mod tests {
    use super::{super::limits::default_tolerances, *};

    fn aggregates(height: f64, front: Option<f64>) -> Aggregates {
        Aggregates {
            crest_height: height,
            front,
            ..Aggregates::default()
        }
    }

    fn measured(hash: &str, aggregates: Aggregates) -> Vec<MeasuredFrame> {
        let frame = BaselineFrame {
            frame: 3,
            particles: 10,
            aggregates,
            spread: None,
        };
        let hash = hash.to_owned();
        vec![MeasuredFrame { frame, hash }]
    }

    fn baseline() -> Baseline {
        let known = ("here".to_owned(), vec!["abc".to_owned()]);
        Baseline {
            format_version: FORMAT_VERSION,
            shot: "shot".to_owned(),
            solver: "pbf".to_owned(),
            scene: Vec::new(),
            tolerances: default_tolerances(0.1),
            spread_from: Vec::new(),
            aggregates_from: "here".to_owned(),
            frames: vec![measured("", aggregates(0.2, None)).remove(0).frame],
            hashes: BTreeMap::from([known]),
        }
    }

    fn faults(adapter: &str, hash: &str, found: Aggregates) -> Vec<String> {
        named(&baseline(), Some(adapter), &measured(hash, found))
    }

    fn named(
        baseline: &Baseline,
        adapter: Option<&str>,
        measured: &[MeasuredFrame],
    ) -> Vec<String> {
        let (_, faults) = baseline.compare(adapter, measured);
        let name = |f: BaselineFault| format!("{} {}", f.fault.what, f.fault.measure);
        faults.into_iter().map(name).collect()
    }

    #[test]
    fn hashes_decide_where_the_adapter_is_known_and_aggregates_everywhere() {
        assert_eq!(baseline().check(), Ok(()));
        let same = aggregates(0.2, None);
        assert!(faults("here", "abc", same).is_empty());
        assert_eq!(faults("here", "abd", same), ["particles hash"]);
        assert!(faults("there", "abd", same).is_empty());
        // Half a spacing of 0.1 m is allowed; a front on only one side is not judged, but the
        // crest is.
        assert!(faults("there", "", aggregates(0.249, Some(1.0))).is_empty());
        let high = aggregates(0.26, None);
        assert_eq!(faults("there", "", high), ["crest_height difference"]);
        let both = ["particles hash", "crest_height difference"];
        assert_eq!(faults("here", "", high), both);
        assert_eq!(faults("there", "", aggregates(f64::NAN, None)).len(), 1);
    }

    #[test]
    fn a_hash_that_matches_does_not_excuse_the_aggregates() {
        let same = aggregates(0.2, None);
        assert!(faults("here", "abc", same).is_empty());
        // Measured from these particles, the aggregates agree to the rounding of a sum: 10 terms,
        // 10 ε.
        let near = aggregates(0.2 * (1.0 + 9.0 * f64::EPSILON), None);
        assert!(faults("here", "abc", near).is_empty());
        for other in [0.2 * (1.0 + 12.0 * f64::EPSILON), 0.201, 0.26] {
            let other = aggregates(other, None);
            assert_eq!(faults("here", "abc", other), ["crest_height difference"]);
        }
        assert_eq!(
            faults("here", "abc", aggregates(0.2, Some(1.0))),
            ["front difference"]
        );
        // If they were measured on another adapter, the stated limit of half a spacing applies.
        let mut elsewhere = baseline();
        elsewhere.aggregates_from = "there".to_owned();
        let judged = |height| {
            let found = measured("abc", aggregates(height, None));
            named(&elsewhere, Some("here"), &found).len()
        };
        assert_eq!((judged(0.201), judged(0.26)), (0, 1));
        // Ignored hashes have no effect, whether right or wrong.
        let ignoring = |hash, height| {
            let found = measured(hash, aggregates(height, None));
            named(&baseline(), None, &found).len()
        };
        assert_eq!((ignoring("abd", 0.201), ignoring("abc", 0.26)), (0, 1));
    }

    #[test]
    fn spreads_are_of_their_frame_and_add_to_the_stated_limit() {
        let mut baseline = baseline();
        let stated = StatedLimit {
            absolute: 0.01,
            relative: 0.1,
            spreads: 5.0,
            reason: String::new(),
        };
        baseline.tolerances = BTreeMap::from([("crest_height".to_owned(), stated)]);
        assert_eq!(
            baseline.check(),
            Err("frame 3 has no spread of crest_height".to_owned())
        );
        let spread = |size| Some(BTreeMap::from([("crest_height".to_owned(), size)]));
        baseline.frames[0].spread = spread(0.002);
        assert_eq!(baseline.check(), Ok(()));
        // 0.01 + 0.1 · 0.2 + 5 · 0.002 = 0.04
        let judged = |height| {
            let found = measured("", aggregates(height, None));
            named(&baseline, Some("there"), &found)
        };
        assert!(judged(0.23995).is_empty());
        assert_eq!(judged(0.24005), ["crest_height difference"]);
        baseline.frames[0].spread = spread(-0.002);
        assert!(baseline.check().is_err());
    }

    #[test]
    fn every_frame_of_the_baseline_is_judged() {
        let mut baseline = baseline();
        let mut second = baseline.frames[0].clone();
        second.frame = 4;
        baseline.frames.push(second);
        baseline.hashes = BTreeMap::from([("here".to_owned(), vec!["abc".into(), "abd".into()])]);
        let mut found = measured("abc", aggregates(0.2, None));
        found.extend(measured("abc", aggregates(0.2, None)));
        found[1].frame.frame = 4;
        let (basis, faults) = baseline.compare(Some("here"), &found);
        assert_eq!(basis, Basis::Hashes);
        assert_eq!(faults.iter().map(|f| f.frame).collect::<Vec<_>>(), [4]);
        // A different number of particles is a fault on any adapter.
        found[0].frame.particles = 11;
        let (basis, faults) = baseline.compare(None, &found);
        assert_eq!(basis, Basis::Aggregates);
        assert_eq!((faults[0].frame, faults[0].fault.value), (3, 1.0));
    }

    #[test]
    fn every_bit_is_in_the_hash() {
        let particles = Particles {
            position: vec![[0.0, 1.0, 2.0]],
            velocity: vec![[0.0; 3]],
            id: vec![7],
            attributes: BTreeMap::from([("foam".to_owned(), vec![0.5])]),
            ..Particles::default()
        };
        let hash = particles_hash(&particles);
        assert_eq!(hash, particles_hash(&particles.clone()));
        let spoils: [fn(&mut Particles); 5] = [
            |p| p.position[0][0] = -0.0,
            |p| p.velocity[0][2] = f32::from_bits(1),
            |p| p.id[0] = 8,
            |p| p.attributes.clear(),
            |p| p.attributes = BTreeMap::from([("foaM".to_owned(), vec![0.5])]),
        ];
        for spoil in spoils {
            let mut spoiled = particles.clone();
            spoil(&mut spoiled);
            assert_ne!(particles_hash(&spoiled), hash);
        }
    }
}
