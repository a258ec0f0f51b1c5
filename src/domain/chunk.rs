//! Shares of a range of frames or of the points of a study, written `1/4`.

use std::{fmt, str::FromStr};

/// Share `index` of `count`; `index` starts at 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chunk {
    index: u32,
    count: u32,
}

/// Error for a text that is not a share.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ChunkError {
    /// The text is not two numbers separated by `/`.
    #[error("`{0}` is not a share: write 1/4 for the first of four")]
    Form(String),
    /// The index is not within 1..=count.
    #[error("there is no share {index} of {count}: the shares are 1/{count} to {count}/{count}")]
    Beyond {
        /// Index requested.
        index: u32,
        /// Number of shares.
        count: u32,
    },
}

/// Returns the frames of a share, or all frames if there is none.
pub fn share(frames: &[u32], chunk: Option<Chunk>) -> &[u32] {
    chunk.map_or(frames, |chunk| chunk.of(frames))
}

impl Chunk {
    /// Returns the frames of this share: consecutive ones, and at most one more than in any
    /// other share.
    pub fn of(self, frames: &[u32]) -> &[u32] {
        let end =
            |share: u32| (frames.len() as u64 * u64::from(share) / u64::from(self.count)) as usize;
        &frames[end(self.index - 1)..end(self.index)]
    }

    /// Returns which points belong to this share. Points are dealt one by one in order of cost, so
    /// that each share gets cheap and expensive ones. `places` holds each point's position in its
    /// own line, from cheap to expensive. Where a line would fall to the same share again and
    /// again, the dealing shifts by one share, so that no share holds only one line.
    pub fn deal(self, places: &[usize]) -> Vec<bool> {
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by_key(|&point| places[point]);
        let (share, shares) = (self.index as usize - 1, self.count as usize);
        let mut is_its = vec![false; places.len()];
        let (mut dealt, mut shift) = (0, 0);
        for of_place in order.chunk_by(|&a, &b| places[a] == places[b]) {
            for &point in of_place {
                is_its[point] = (dealt + shift) % shares == share;
                dealt += 1;
            }
            // All shares have received equally many so far.
            shift += usize::from(dealt % shares == 0);
        }
        is_its
    }
}

impl fmt::Display for Chunk {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Chunk {
    type Err = ChunkError;

    fn from_str(text: &str) -> Result<Self, ChunkError> {
        let (index, count) = text
            .split_once('/')
            .and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)))
            .ok_or_else(|| ChunkError::Form(text.to_owned()))?;
        match (1..=count).contains(&index) {
            true => Ok(Self { index, count }),
            false if count == 0 => Err(ChunkError::Form(text.to_owned())),
            false => Err(ChunkError::Beyond { index, count }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_disjoint_and_make_up_all() {
        let frames: Vec<u32> = (1..=10).collect();
        for count in [1, 3, 10, 12] {
            let share = |index: u32| format!("{index}/{count}").parse::<Chunk>().unwrap();
            let all: Vec<u32> = (1..=count)
                .flat_map(|k| share(k).of(&frames).to_vec())
                .collect();
            assert_eq!(all, frames);
        }
        assert_eq!(share(&frames, None), frames);
        assert_eq!(share(&frames, "2/5".parse().ok()), [3, 4]);
        for text in ["0/4", "5/4", "1", "a/b", "1/0", "-1/4"] {
            assert!(text.parse::<Chunk>().is_err(), "{text}");
        }
    }

    /// Three lines of four values: with three shares, each has one of each value; with four, none
    /// has two of the most expensive.
    #[test]
    fn points_are_dealt_so_that_each_share_has_cheap_and_dear_ones() {
        let places: Vec<usize> = (0..3).flat_map(|_| 0..4).collect();
        let dealt = |text: &str| text.parse::<Chunk>().unwrap().deal(&places);
        for count in [1, 3, 4, 5, 12, 13] {
            let all: Vec<_> = (1..=count)
                .map(|k| dealt(&format!("{k}/{count}")))
                .collect();
            for point in 0..places.len() {
                assert_eq!(all.iter().filter(|share| share[point]).count(), 1);
            }
            let dearest = |share: &Vec<bool>| [3, 7, 11].iter().filter(|&&k| share[k]).count();
            let most = all.iter().map(dearest).max().unwrap();
            assert_eq!(most, if count == 1 { 3 } else { 1 }, "{count}");
            let sizes = all.iter().map(|s| s.iter().filter(|&&is| is).count());
            let (least, most) = (sizes.clone().min().unwrap(), sizes.max().unwrap());
            assert!(most - least <= 1, "{count}");
        }
    }

    /// Lines of two to four methods by six values: no share holds more of a line than its part plus
    /// one, for any count.
    #[test]
    fn no_share_has_one_line_alone() {
        let values = 6;
        for lines in 2..=4 {
            let places: Vec<usize> = (0..lines).flat_map(|_| 0..values).collect();
            for count in 2..=6 {
                for k in 1..=count {
                    let share: Chunk = format!("{k}/{count}").parse().unwrap();
                    let dealt = share.deal(&places);
                    for line in dealt.chunks(values) {
                        let its = line.iter().filter(|&&is| is).count();
                        assert!(
                            its <= values.div_ceil(count) + 1,
                            "{lines} {share} {dealt:?}"
                        );
                    }
                }
            }
        }
    }
}
