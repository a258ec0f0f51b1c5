//! Sampling rate of a probe.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// How often a probe samples the water.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Rate {
    /// At the end of each frame.
    #[default]
    Frame,
    /// At the end of each substep.
    Substep,
    /// A number of times per second: at the end of each substep that contains one of its times.
    Hertz(f64),
}

impl Rate {
    /// Word for [`Rate::Substep`] in files that otherwise hold a number.
    pub const SUBSTEP: &'static str = "substep";

    /// How far beyond a substep's end a time may lie and still count, in sampling intervals: the
    /// round-off of summed substep lengths is 1e-12 over a shot of a million intervals.
    const NEAR: f64 = 1e-6;

    /// Returns whether a sample is due at the end of the substep from `start` to `end`, seconds
    /// from the start of the shot. Sampling times are k / rate for whole k; a substep with several
    /// of them has one sample.
    pub fn is_due(self, start: f64, end: f64) -> bool {
        match self {
            Self::Frame => false,
            Self::Substep => true,
            Self::Hertz(_) => self.times(start, end) > 0,
        }
    }

    /// Returns how many sampling times lie after `start` and up to `end`, seconds; 0 for
    /// [`Rate::Frame`] and [`Rate::Substep`].
    pub fn times(self, start: f64, end: f64) -> u64 {
        match self {
            Self::Frame | Self::Substep => 0,
            Self::Hertz(rate) => {
                let passed = |time: f64| (time * rate + Self::NEAR).floor();
                (passed(end) - passed(start)) as u64
            }
        }
    }
}

/// A number of hertz or `"substep"`; [`Rate::Frame`] is written as none.
impl Serialize for Rate {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Frame => serializer.serialize_none(),
            Self::Substep => serializer.serialize_str(Self::SUBSTEP),
            Self::Hertz(rate) => serializer.serialize_f64(*rate),
        }
    }
}

impl<'de> Deserialize<'de> for Rate {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Written {
            Number(f64),
            Word(String),
        }
        match Written::deserialize(deserializer)? {
            Written::Number(rate) => Ok(Self::Hertz(rate)),
            Written::Word(word) if word == Self::SUBSTEP => Ok(Self::Substep),
            Written::Word(word) => Err(serde::de::Error::custom(format!("{word:?} is no rate"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 10 Hz over a second of substeps: a sample at the first end at or after each tenth, and only
    /// one if several lie in a substep.
    #[test]
    fn a_look_is_at_the_first_end_after_its_time() {
        let due = |substeps: u32, rate: Rate| -> Vec<u32> {
            let time = |k: u32| f64::from(k) / f64::from(substeps);
            (1..=substeps)
                .filter(|&k| rate.is_due(time(k - 1), time(k)))
                .collect()
        };
        assert_eq!(
            due(20, Rate::Hertz(10.0)),
            [2, 4, 6, 8, 10, 12, 14, 16, 18, 20]
        );
        // Tenths are at 2.3, 4.6, …, 23 of 23.
        assert_eq!(
            due(23, Rate::Hertz(10.0)),
            [3, 5, 7, 10, 12, 14, 17, 19, 21, 23]
        );
        assert_eq!(due(4, Rate::Hertz(10.0)), [1, 2, 3, 4]);
        assert_eq!(due(4, Rate::Substep), [1, 2, 3, 4]);
        assert!(due(4, Rate::Frame).is_empty());
    }

    /// Frames of 1/24 s in uneven substeps, summed as solvers do: never a sample more or less than
    /// the rate.
    #[test]
    fn round_off_neither_adds_nor_loses_a_look() {
        for (rate, substeps) in [(24.0, 7), (240.0, 30), (1000.0, 97), (120.0, 11)] {
            let mut count = 0;
            for frame in 0..2400 {
                let start = f64::from(frame) / 24.0;
                let mut elapsed = 0.0;
                for k in 0..substeps {
                    let remaining: f64 = 1.0 / 24.0 - elapsed;
                    let length = remaining / f64::from(substeps - k);
                    let from = start + elapsed;
                    elapsed += length;
                    count += u32::from(Rate::Hertz(rate).is_due(from, start + elapsed));
                }
            }
            assert_eq!(f64::from(count), 100.0 * rate);
        }
    }

    #[test]
    fn a_rate_is_written_as_scenes_write_it() {
        for (rate, text) in [
            (Rate::Substep, "\"substep\""),
            (Rate::Hertz(250.0), "250.0"),
        ] {
            assert_eq!(serde_json::to_string(&rate).unwrap(), text);
            assert_eq!(serde_json::from_str::<Rate>(text).unwrap(), rate);
        }
        assert!(serde_json::from_str::<Rate>("\"frame\"").is_err());
    }
}
