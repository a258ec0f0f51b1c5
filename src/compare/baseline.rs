//! A baseline: what a bake was when it was last looked at, small enough to be tracked with the program.
//!
//! On the adapter that a baseline knows, the particles of every frame have to be the same, bit for bit. On
//! another one roundings differ and trajectories part, and the aggregates decide.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::frames::{Fault, aggregate_faults};
use crate::domain::{aggregates::Aggregates, particles::Particles, tolerance::Limit};

/// The format that this program writes and reads.
pub const FORMAT_VERSION: u32 = 1;

/// Name, absolute limit in particle spacings of lengths and plain of the others, relative limit, reason. The
/// measurements are the largest over the shipped scenes and both solvers in the frames that `tools/regress`
/// bakes, with gravity changed in its last place (-9.81 to -9.810001, `swell diff --json`): PBF's particles
/// part by up to 1.3 m by that, FLIP's by up to 0.03 mm.
const DEFAULT_TOLERANCES: [(&str, f64, f64, &str); 8] = [
    (
        "kinetic_energy",
        0.0,
        0.03,
        "gravity off by its last place: 0.8 % (wave-city, PBF); other drivers round everywhere",
    ),
    (
        "potential_energy",
        0.0,
        0.001,
        "gravity off by its last place: 0.03 % (quickstart, PBF)",
    ),
    (
        "volume",
        0.0,
        0.01,
        "gravity off by its last place: 0.2 % (quickstart, PBF)",
    ),
    (
        "crest_height",
        0.5,
        0.0,
        "half a particle spacing; gravity off by its last place: 0.08 spacings (quickstart, PBF)",
    ),
    (
        "front",
        0.5,
        0.0,
        "half a particle spacing; gravity off by its last place: 0.1 spacings (quickstart, PBF)",
    ),
    (
        "splash_height",
        1.0,
        0.0,
        "a particle spacing; gravity off by its last place: 0.15 spacings (quickstart, PBF)",
    ),
    (
        "airborne",
        0.002,
        0.0,
        "few drops, each with a way of its own; gravity off by its last place: 0.0004 (quickstart, PBF)",
    ),
    (
        "density_error",
        1e-4,
        0.1,
        "gravity off by its last place: 2.7 % (dam-break, PBF)",
    ),
];

/// A stored baseline: one scene with one solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Baseline {
    /// [`FORMAT_VERSION`] when it was written.
    pub format_version: u32,
    /// Shot name.
    pub shot: String,
    /// `pbf`, `flip`.
    pub solver: String,
    /// The scene as baked, by line.
    pub scene: Vec<String>,
    /// Limits of the aggregates by name, each with its reason.
    pub tolerances: BTreeMap<String, StatedLimit>,
    /// The adapter on which the aggregates were taken.
    pub aggregates_from: String,
    /// From the start, 0, on.
    pub frames: Vec<BaselineFrame>,
    /// By adapter and driver: [`particles_hash`] of each frame of `frames`.
    pub hashes: BTreeMap<String, Vec<String>>,
}

/// One frame of a baseline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BaselineFrame {
    /// Output frame.
    pub frame: u32,
    /// How many.
    pub particles: usize,
    /// What they sum up to.
    pub aggregates: Aggregates,
}

/// A limit and why it is what it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatedLimit {
    /// In the aggregate's unit.
    pub absolute: f64,
    /// Of the baseline's value.
    pub relative: f64,
    /// In words.
    pub reason: String,
}

/// One frame of the cache that is held against a baseline.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Count and aggregates.
    pub frame: BaselineFrame,
    /// [`particles_hash`].
    pub hash: String,
}

/// How a cache was compared with a baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// Every frame's hash: the baseline knows the adapter.
    Hashes,
    /// Aggregates within their limits: it does not.
    Aggregates,
}

/// A frame that is not as the baseline has it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BaselineFault {
    /// Output frame.
    pub frame: u32,
    /// What is off.
    pub fault: Fault,
}

/// BLAKE3, hex, over every bit of the particles: count, then positions, velocities, ids, and the attributes
/// with their names, little-endian. The frame's file would not do: it names the program's version.
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

/// What a new baseline allows its aggregates; particles are `spacing` metres apart at rest.
pub fn default_tolerances(spacing: f64) -> BTreeMap<String, StatedLimit> {
    let is_length = |name: &str| Aggregates::NAMES.contains(&(name, "m"));
    let stated = |&(name, absolute, relative, reason): &(&str, f64, f64, &str)| {
        let limit = StatedLimit {
            absolute: absolute * if is_length(name) { spacing } else { 1.0 },
            relative,
            reason: reason.to_owned(),
        };
        (name.to_owned(), limit)
    };
    DEFAULT_TOLERANCES.iter().map(stated).collect()
}

impl Baseline {
    /// Compares frames with the baseline's, those that both have. On an adapter that it knows, every fault
    /// is a `hash`; the aggregates that are out as well stand behind it, to tell a rounding from a change.
    pub fn compare(&self, adapter: &str, measured: &[Measured]) -> (Basis, Vec<BaselineFault>) {
        let hashes = self.hashes.get(adapter);
        let limits = self.limits();
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
            match hashes {
                Some(hashes) if hashes.get(index) == Some(&found.hash) => continue,
                Some(_) => push(fault("particles", "hash", 1.0)),
                None => {}
            }
            let counts = [found.frame.particles, expected.particles];
            if counts[0] != counts[1] {
                push(fault(
                    "particles",
                    "difference",
                    counts[0].abs_diff(counts[1]) as f64,
                ));
            }
            let pair = [found.frame.aggregates, expected.aggregates];
            // Where one side alone has a front the wave is about a cube high, and the crest is judged.
            aggregate_faults(&pair, |name| limits.get(name).copied())
                .into_iter()
                .filter(|fault| fault.what != "front" || fault.value.is_finite())
                .for_each(push);
        }
        let basis = hashes.map_or(Basis::Aggregates, |_| Basis::Hashes);
        (basis, faults)
    }

    /// What aggregates may differ by.
    pub fn limits(&self) -> BTreeMap<String, Limit> {
        let limit = |stated: &StatedLimit| Limit {
            absolute: stated.absolute,
            relative: stated.relative,
        };
        let tolerances = self.tolerances.iter();
        tolerances
            .map(|(name, stated)| (name.clone(), limit(stated)))
            .collect()
    }

    /// What is off with a baseline that was read.
    ///
    /// # Errors
    /// The first thing, in words.
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
            if !(limit.absolute >= 0.0 && limit.relative >= 0.0) {
                return Err(format!("tolerances.{name} is below 0"));
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
    use super::*;

    fn aggregates(height: f64, front: Option<f64>) -> Aggregates {
        Aggregates {
            crest_height: height,
            front,
            ..Aggregates::default()
        }
    }

    fn measured(hash: &str, aggregates: Aggregates) -> Vec<Measured> {
        let frame = BaselineFrame {
            frame: 3,
            particles: 10,
            aggregates,
        };
        let hash = hash.to_owned();
        vec![Measured { frame, hash }]
    }

    fn baseline() -> Baseline {
        let known = ("here".to_owned(), vec!["abc".to_owned()]);
        Baseline {
            format_version: FORMAT_VERSION,
            shot: "shot".to_owned(),
            solver: "pbf".to_owned(),
            scene: Vec::new(),
            tolerances: default_tolerances(0.1),
            aggregates_from: "here".to_owned(),
            frames: vec![measured("", aggregates(0.2, None)).remove(0).frame],
            hashes: BTreeMap::from([known]),
        }
    }

    fn faults(adapter: &str, hash: &str, found: Aggregates) -> Vec<String> {
        let (_, faults) = baseline().compare(adapter, &measured(hash, found));
        let name = |f: BaselineFault| format!("{} {}", f.fault.what, f.fault.measure);
        faults.into_iter().map(name).collect()
    }

    #[test]
    fn hashes_decide_where_the_adapter_is_known_and_aggregates_elsewhere() {
        assert_eq!(baseline().check(), Ok(()));
        let same = aggregates(0.2, None);
        assert!(faults("here", "abc", same).is_empty());
        assert_eq!(faults("here", "abd", same), ["particles hash"]);
        assert!(faults("there", "abd", same).is_empty());
        // Half a spacing of 0.1 m is allowed; a front on one side alone is not judged, the crest is.
        assert!(faults("there", "", aggregates(0.249, Some(1.0))).is_empty());
        let high = aggregates(0.26, None);
        assert_eq!(faults("there", "", high), ["crest_height difference"]);
        let both = ["particles hash", "crest_height difference"];
        assert_eq!(faults("here", "", high), both);
        // A hash that matches is enough.
        assert!(faults("here", "abc", high).is_empty());
        assert_eq!(faults("there", "", aggregates(f64::NAN, None)).len(), 1);
    }

    #[test]
    fn every_bit_is_in_the_hash() {
        let particles = Particles {
            position: vec![[0.0, 1.0, 2.0]],
            velocity: vec![[0.0; 3]],
            id: vec![7],
            attributes: BTreeMap::from([("foam".to_owned(), vec![0.5])]),
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
