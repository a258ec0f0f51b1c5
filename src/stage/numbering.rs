//! Frame numbers in file names, if they differ from the cache's.

/// Maps a frame's number in the cache to the number in the names of its files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Numbering {
    /// Difference that is added.
    pub(super) offset: i64,
}

impl Numbering {
    /// Gives the first of `frames` the number `from`; the others keep their distances. Without
    /// `from`, the cache's own numbers.
    pub(super) fn new(frames: &[u32], from: Option<u32>) -> Self {
        let first = frames.first().copied();
        let offset = from
            .zip(first)
            .map_or(0, |(from, first)| i64::from(from) - i64::from(first));
        Self { offset }
    }

    /// The number of a frame; not below 0.
    pub(super) fn of(self, frame: u32) -> u32 {
        (i64::from(frame) + self.offset).clamp(0, u32::MAX.into()) as u32
    }

    /// The offset in the name `SHOT.0001.png` of a frame's picture; `None` for other names.
    pub(super) fn in_name(name: &str, shot: &str, frame: u32) -> Option<Self> {
        let rest = name.strip_prefix(shot)?.strip_prefix('.')?;
        let (digits, _) = rest.split_once('.')?;
        let is_plain = digits.bytes().all(|byte| byte.is_ascii_digit());
        let number: u32 = digits.parse().ok().filter(|_| is_plain)?;
        Some(Self {
            offset: i64::from(number) - i64::from(frame),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_frame_has_the_number_and_the_others_their_distance() {
        let numbers = |frames: &[u32], from| {
            let numbering = Numbering::new(frames, from);
            frames
                .iter()
                .map(|&it| numbering.of(it))
                .collect::<Vec<_>>()
        };
        assert_eq!(numbers(&[1, 2, 5], Some(1001)), [1001, 1002, 1005]);
        assert_eq!(numbers(&[40, 42], Some(1)), [1, 3]);
        assert_eq!(numbers(&[40, 42], None), [40, 42]);
        assert_eq!(numbers(&[], Some(7)), [] as [u32; 0]);
        let in_name = |name: &str| Numbering::in_name(name, "a.b", 3).map(|it| it.offset);
        assert_eq!(in_name("a.b.1003.png"), Some(1000));
        assert_eq!(in_name("a.b.0001.exr"), Some(-2));
        for name in [
            "a.1003.png",
            "a.b.1003",
            "a.b.best.png",
            "a.b.+3.png",
            "x.png",
        ] {
            assert_eq!(in_name(name), None, "{name}");
        }
    }
}
