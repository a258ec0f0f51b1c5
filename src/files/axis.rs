//! Axes by name.

use swell_domain::named::read_by_name;

/// An axis of the domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axis {
    /// The first horizontal axis.
    X,
    /// The vertical axis, upward.
    Y,
    /// The second horizontal axis.
    Z,
}

impl Axis {
    /// All axes with the names used in scenes.
    pub(crate) const NAMED: [(&'static str, Self); 3] =
        [("x", Self::X), ("y", Self::Y), ("z", Self::Z)];

    /// Returns the name used in scenes.
    pub(crate) fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }

    /// Returns the axes whose flag is set.
    pub(super) fn of(periodic: [bool; 3]) -> Vec<Self> {
        let named = Self::NAMED.iter().zip(periodic);
        named
            .filter_map(|((_, axis), is)| is.then_some(*axis))
            .collect()
    }
}

read_by_name!(Axis);
