//! Comparison of two frames of particles, matched by id.

use serde::Serialize;

use super::{
    Deviation,
    deviation::{first_over, out_of_limits, relative},
};
use swell_domain::{
    aggregates::Aggregates,
    particles::Particles,
    tolerance::{ErrorLimit, FieldLimits, Tolerance},
};

/// Differences between two frames, and those that are out of tolerance.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct FrameDiff {
    /// Output frame number.
    pub frame: u32,
    /// Number of particles in both.
    pub matched: usize,
    /// Particles that only a has.
    pub only_a: Missing,
    /// Particles that only b has.
    pub only_b: Missing,
    /// Position, velocity, and the attributes that both frames have.
    pub fields: Vec<FieldDiff>,
    /// Aggregates of a and of b.
    pub aggregates: [Aggregates; 2],
    /// Faults in the order of the fields, then of the aggregates.
    pub faults: Vec<Fault>,
}

/// Particles that the other side lacks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Missing {
    /// Number of particles.
    pub count: usize,
    /// Smallest id.
    pub first: Option<u32>,
}

/// One field of all particles that both frames have.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct FieldDiff {
    /// `position`, `velocity`, or an attribute's name.
    pub field: String,
    /// Error in the field's unit.
    pub deviation: Deviation,
    /// First particle, by id, that is not bit-identical.
    pub first_different: Option<Parting>,
    /// Particle with the largest error; `None` if there is no error.
    pub worst: Option<Parting>,
}

/// A particle in which two frames differ, with its values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parting {
    /// Particle id.
    pub particle: u32,
    /// Value in a.
    pub a: Vec<f32>,
    /// Value in b.
    pub b: Vec<f32>,
}

/// A quantity that is out of tolerance in a frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fault {
    /// Field or aggregate, or `particles` for ids on only one side.
    pub what: String,
    /// `bits`, `max`, `rms`, `p99`, or `difference` of an aggregate.
    pub measure: &'static str,
    /// Value found.
    pub value: f64,
    /// Value allowed.
    pub limit: f64,
    /// First particle, by id, that is out of tolerance, or the worst one for rms and p99; `None`
    /// for an aggregate.
    pub parting: Option<Parting>,
}

/// A field of the particles that both frames have.
struct PairedField<const N: usize> {
    name: String,
    ids: Vec<u32>,
    a: Vec<[f32; N]>,
    b: Vec<[f32; N]>,
}

/// Compares two frames. Without a tolerance, all bits of the particles must be equal. With one,
/// quantities that it does not name are not judged, and a field that it names needs every particle
/// on both sides.
pub fn compare(
    frame: u32,
    particles: [&Particles; 2],
    aggregates: [Aggregates; 2],
    tolerance: Option<&Tolerance>,
) -> FrameDiff {
    let [a, b] = particles;
    let matches = matches(&a.id, &b.id);
    let mut faults = missing_faults(&matches, tolerance);
    let mut fields = Vec::new();
    let vectors = [
        ("position", &a.position, &b.position),
        ("velocity", &a.velocity, &b.velocity),
    ];
    for (name, a_values, b_values) in vectors {
        let field = PairedField::of(name, &a.id, &matches.pairs, a_values, b_values);
        fields.push(field.compare(tolerance, &mut faults));
    }
    for (name, a_values) in &a.attributes {
        let Some(b_values) = b.attributes.get(name) else {
            continue;
        };
        let [a_values, b_values] = [a_values, b_values].map(|values| scalars(values));
        let field = PairedField::of(name, &a.id, &matches.pairs, &a_values, &b_values);
        fields.push(field.compare(tolerance, &mut faults));
    }
    lone_attributes(particles, tolerance, &mut faults);
    if let Some(tolerance) = tolerance {
        let limits = &tolerance.aggregates;
        faults.extend(aggregate_faults(&aggregates, |name| {
            limits.get(name).copied()
        }));
    }
    FrameDiff {
        frame,
        matched: matches.pairs.len(),
        only_a: matches.only_a,
        only_b: matches.only_b,
        fields,
        aggregates,
        faults,
    }
}

/// Returns a fault for each aggregate that differs by more than the limit that `limit_of` returns
/// for its name.
pub fn aggregate_faults(
    [a, b]: &[Aggregates; 2],
    limit_of: impl Fn(&str) -> Option<ErrorLimit>,
) -> Vec<Fault> {
    let values = a.values().into_iter().zip(b.values());
    let mut faults = Vec::new();
    for ((name, _), (a, b)) in Aggregates::NAMES.into_iter().zip(values) {
        let Some(limit) = limit_of(name) else {
            continue;
        };
        let (value, limit) = (aggregate_error(a, b), limit.allowed(b.unwrap_or(0.0)));
        if value > limit {
            faults.push(Fault {
                what: name.to_owned(),
                measure: "difference",
                value,
                limit,
                parting: None,
            });
        }
    }
    faults
}

/// Returns |a − b|; infinite if only one side has a value.
pub fn aggregate_error(a: Option<f64>, b: Option<f64>) -> f64 {
    match (a, b) {
        (Some(a), Some(b)) => Deviation::between(&[a], &[b]).max,
        (None, None) => 0.0,
        _ => f64::INFINITY,
    }
}

/// Indices of equal ids, and ids without a partner.
struct Matches {
    pairs: Vec<(usize, usize)>,
    only_a: Missing,
    only_b: Missing,
}

/// Matches two ascending lists of ids.
fn matches(a: &[u32], b: &[u32]) -> Matches {
    let mut found = Matches {
        pairs: Vec::with_capacity(a.len().min(b.len())),
        only_a: Missing::default(),
        only_b: Missing::default(),
    };
    let miss = |missing: &mut Missing, id: u32| {
        missing.count += 1;
        missing.first.get_or_insert(id);
    };
    let (mut i, mut j) = (0, 0);
    while i < a.len() || j < b.len() {
        match (a.get(i), b.get(j)) {
            (Some(x), Some(y)) if x == y => {
                found.pairs.push((i, j));
                i += 1;
                j += 1;
            }
            (Some(x), y) if y.is_none_or(|y| x < y) => {
                miss(&mut found.only_a, *x);
                i += 1;
            }
            (_, Some(y)) => {
                miss(&mut found.only_b, *y);
                j += 1;
            }
            _ => break,
        }
    }
    found
}

fn missing_faults(matches: &Matches, tolerance: Option<&Tolerance>) -> Vec<Fault> {
    let count = matches.only_a.count + matches.only_b.count;
    let is_judged = tolerance.is_none_or(|tolerance| !tolerance.fields.is_empty());
    let fault = || Fault {
        what: "particles".to_owned(),
        measure: "on one side alone",
        value: count as f64,
        limit: 0.0,
        parting: None,
    };
    (is_judged && count > 0).then(fault).into_iter().collect()
}

/// Adds faults for attributes that only one side has, if they are judged.
fn lone_attributes(
    [a, b]: [&Particles; 2],
    tolerance: Option<&Tolerance>,
    faults: &mut Vec<Fault>,
) {
    let lone = |x: &Particles, y: &Particles| -> Vec<String> {
        let names = x.attributes.keys();
        names
            .filter(|name| !y.attributes.contains_key(*name))
            .cloned()
            .collect()
    };
    for name in lone(a, b).into_iter().chain(lone(b, a)) {
        if tolerance.is_none_or(|tolerance| tolerance.fields.contains_key(&name)) {
            faults.push(Fault {
                what: name,
                measure: "on one side alone",
                value: 1.0,
                limit: 0.0,
                parting: None,
            });
        }
    }
}

fn scalars(values: &[f32]) -> Vec<[f32; 1]> {
    values.iter().map(|&value| [value]).collect()
}

impl<const N: usize> PairedField<N> {
    fn of(
        name: &str,
        ids: &[u32],
        pairs: &[(usize, usize)],
        a: &[[f32; N]],
        b: &[[f32; N]],
    ) -> Self {
        Self {
            name: name.to_owned(),
            ids: pairs.iter().map(|&(i, _)| ids[i]).collect(),
            a: pairs.iter().map(|&(i, _)| a[i]).collect(),
            b: pairs.iter().map(|&(_, j)| b[j]).collect(),
        }
    }

    /// Pads fields of fewer than three components with zeros, which does not change the norm.
    fn pairs(&self) -> impl Iterator<Item = ([f32; 3], [f32; 3])> + '_ {
        let widen =
            |value: &[f32; N]| std::array::from_fn(|k| value.get(k).copied().unwrap_or(0.0));
        self.a.iter().map(widen).zip(self.b.iter().map(widen))
    }

    fn parting(&self, index: usize) -> Parting {
        Parting {
            particle: self.ids[index],
            a: self.a[index].to_vec(),
            b: self.b[index].to_vec(),
        }
    }

    fn compare(&self, tolerance: Option<&Tolerance>, faults: &mut Vec<Fault>) -> FieldDiff {
        let bits = |value: &[f32; N]| value.map(f32::to_bits);
        let different = |(a, b): (&[f32; N], &[f32; N])| bits(a) != bits(b);
        let first = self.a.iter().zip(&self.b).position(different);
        let deviation = Deviation::of(self.pairs());
        let found = FieldDiff {
            field: self.name.clone(),
            deviation,
            first_different: first.map(|index| self.parting(index)),
            worst: deviation.max_at.map(|index| self.parting(index)),
        };
        match tolerance {
            None if first.is_some() => {
                let count = self.a.iter().zip(&self.b).filter(|&pair| different(pair));
                faults.push(Fault {
                    what: self.name.clone(),
                    measure: "bits",
                    value: count.count() as f64,
                    limit: 0.0,
                    parting: found.first_different.clone(),
                });
            }
            None => {}
            Some(tolerance) => {
                if let Some(limits) = tolerance.fields.get(&self.name) {
                    self.judge(limits, &found, faults);
                }
            }
        }
        found
    }

    fn judge(&self, limits: &FieldLimits, found: &FieldDiff, faults: &mut Vec<Fault>) {
        let deviation = &found.deviation;
        let measured = [
            ("max", deviation.max, limits.max),
            ("rms", deviation.rms, limits.rms),
            ("p99", deviation.p99, limits.p99),
        ];
        for (measure, value, limit) in out_of_limits(measured) {
            let parting = if measure == "max" {
                first_over(self.pairs(), limit).map(|index| self.parting(index))
            } else {
                found.worst.clone()
            };
            faults.push(Fault {
                what: self.name.clone(),
                measure,
                value,
                limit,
                parting,
            });
        }
    }
}

/// Largest difference of an aggregate over all frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AggregatePeak {
    /// One of [`Aggregates::NAMES`].
    pub name: &'static str,
    /// Unit; empty if dimensionless.
    pub unit: &'static str,
    /// Largest |a − b| of all frames; infinite if only one side has a value.
    pub difference: f64,
    /// The difference relative to |b|.
    pub relative: f64,
    /// Frame of the difference; the first one if several are equal.
    pub frame: u32,
    /// Value in a at that frame.
    pub a: Option<f64>,
    /// Value in b at that frame.
    pub b: Option<f64>,
}

/// Returns the largest difference of each aggregate; empty if there are no frames.
pub fn aggregate_peaks(frames: &[(u32, [Aggregates; 2])]) -> Vec<AggregatePeak> {
    let names = Aggregates::NAMES.iter().enumerate();
    let peak = |(index, &(name, unit)): (usize, &(&'static str, &'static str))| {
        let at = |&(frame, [a, b]): &(u32, [Aggregates; 2])| {
            let (a, b) = (a.values()[index], b.values()[index]);
            let difference = aggregate_error(a, b);
            AggregatePeak {
                name,
                unit,
                difference,
                relative: relative(difference, b.unwrap_or(0.0)),
                frame,
                a,
                b,
            }
        };
        // Of equal differences, the first one.
        frames.iter().map(at).reduce(|most, next| {
            if next.difference > most.difference {
                next
            } else {
                most
            }
        })
    };
    names.filter_map(peak).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn cloud(ids: impl IntoIterator<Item = u32>) -> Particles {
        let id: Vec<u32> = ids.into_iter().collect();
        Particles {
            position: id.iter().map(|&i| [i as f32, 0.0, 1.0]).collect(),
            velocity: id.iter().map(|&i| [0.0, i as f32, 0.0]).collect(),
            attributes: BTreeMap::from([("c".to_owned(), id.iter().map(|&i| i as f32).collect())]),
            id,
            ..Particles::default()
        }
    }

    fn compared(a: &Particles, b: &Particles, tolerance: Option<&Tolerance>) -> FrameDiff {
        compare(7, [a, b], [Aggregates::default(); 2], tolerance)
    }

    fn limits(field: &str, limits: FieldLimits) -> Tolerance {
        Tolerance {
            fields: BTreeMap::from([(field.to_owned(), limits)]),
            ..Tolerance::default()
        }
    }

    #[test]
    fn equal_frames_are_equal_and_one_bit_is_found() {
        let b = cloud(0..100);
        let same = compared(&b, &b, None);
        assert!(same.faults.is_empty(), "{:?}", same.faults);
        assert_eq!((same.matched, same.fields.len()), (100, 3));

        // A sign of zero is no error, but differs in bits.
        let mut a = b.clone();
        a.velocity[42][0] = -0.0;
        let found = compared(&a, &b, None);
        assert_eq!(found.fields[1].deviation.max, 0.0);
        let [fault] = &found.faults[..] else {
            panic!("{:?}", found.faults);
        };
        assert_eq!((fault.what.as_str(), fault.measure), ("velocity", "bits"));
        assert_eq!(fault.parting.as_ref().map(|p| p.particle), Some(42));
    }

    #[test]
    fn particles_are_matched_by_id() {
        let (a, b) = (cloud([0, 1, 2, 5, 6]), cloud([1, 2, 3, 4, 6, 9]));
        let found = compared(&a, &b, None);
        assert_eq!(found.matched, 3);
        let missing = |count, first| Missing { count, first };
        assert_eq!(found.only_a, missing(2, Some(0)));
        assert_eq!(found.only_b, missing(3, Some(3)));
        // The matched particles are equal; only the missing ones are out of tolerance.
        assert!(found.fields.iter().all(|f| f.first_different.is_none()));
        assert_eq!(found.faults.len(), 1);
        assert_eq!(
            (found.faults[0].what.as_str(), found.faults[0].value),
            ("particles", 5.0)
        );
        // A tolerance that judges no particles ignores them.
        let aggregates = Tolerance {
            aggregates: BTreeMap::from([("volume".to_owned(), ErrorLimit::default())]),
            ..Tolerance::default()
        };
        assert!(compared(&a, &b, Some(&aggregates)).faults.is_empty());
        let none = compared(&cloud([]), &b, None);
        assert_eq!((none.matched, none.only_b), (0, missing(6, Some(1))));
    }

    #[test]
    fn limits_name_the_first_particle_that_is_out() {
        let b = cloud(0..200);
        let mut a = b.clone();
        a.position[10][0] += 0.5;
        a.position[20][1] += 2.0;
        a.position[30][2] += 3.0;
        let max = |max| FieldLimits {
            max: Some(max),
            ..FieldLimits::default()
        };
        let found = compared(&a, &b, Some(&limits("position", max(1.0))));
        assert_eq!(found.faults.len(), 1);
        let fault = &found.faults[0];
        assert_eq!((fault.measure, fault.value, fault.limit), ("max", 3.0, 1.0));
        let parting = fault.parting.as_ref().expect("a particle");
        assert_eq!(
            (parting.particle, &parting.b[..]),
            (20, &[20.0, 0.0, 1.0][..])
        );
        assert_eq!(found.fields[0].worst.as_ref().expect("one").particle, 30);
        assert!(
            compared(&a, &b, Some(&limits("position", max(3.0))))
                .faults
                .is_empty()
        );
        // Fields that are not named are not judged; 3 of 200 are beyond the 99th percentile's 2.
        assert!(
            compared(&a, &b, Some(&limits("velocity", max(0.0))))
                .faults
                .is_empty()
        );
        let tail = FieldLimits {
            p99: Some(0.4),
            rms: Some(0.2),
            max: None,
        };
        let found = compared(&a, &b, Some(&limits("position", tail)));
        let measures: Vec<_> = found.faults.iter().map(|fault| fault.measure).collect();
        assert_eq!(measures, ["rms", "p99"]);
    }

    #[test]
    fn a_nan_is_out_of_every_limit() {
        let b = cloud(0..10);
        let mut a = b.clone();
        a.attributes.get_mut("c").expect("there")[3] = f32::NAN;
        let max = FieldLimits {
            max: Some(1e30),
            ..FieldLimits::default()
        };
        let found = compared(&a, &b, Some(&limits("c", max)));
        assert_eq!(found.faults[0].parting.as_ref().expect("one").particle, 3);
        a.attributes.clear();
        assert_eq!(compared(&a, &b, Some(&limits("c", max))).faults.len(), 1);
        assert!(
            compared(&a, &b, Some(&limits("velocity", max)))
                .faults
                .is_empty()
        );
    }

    #[test]
    fn aggregates_are_judged_by_absolute_and_relative_limits() {
        let b = Aggregates {
            volume: 10.0,
            front: Some(2.0),
            ..Aggregates::default()
        };
        let a = Aggregates {
            volume: 10.5,
            front: None,
            ..b
        };
        let limit = |absolute, relative| ErrorLimit { absolute, relative };
        let judged = |name: &'static str, given: ErrorLimit| {
            aggregate_faults(&[a, b], |asked| (asked == name).then_some(given)).len()
        };
        assert_eq!(judged("volume", limit(0.2, 0.03)), 0);
        assert_eq!(judged("volume", limit(0.2, 0.02)), 1);
        // A front on only one side exceeds any limit.
        assert_eq!(judged("front", limit(1e9, 0.0)), 1);
        assert_eq!(judged("density_error", ErrorLimit::default()), 0);
        let peaks = aggregate_peaks(&[(3, [b, b]), (4, [a, b]), (5, [a, b])]);
        let volume = peaks.iter().find(|p| p.name == "volume").expect("there");
        assert_eq!(
            (volume.frame, volume.difference, volume.relative),
            (4, 0.5, 0.05)
        );
    }
}
