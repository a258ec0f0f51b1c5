//! Axes by their names.

use swell_domain::named::read_by_name;

/// An axis of the domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// The first.
    X,
    /// Upward.
    Y,
    /// The last.
    Z,
}

impl Axis {
    /// With the names that scenes use.
    pub const NAMED: [(&'static str, Self); 3] = [("x", Self::X), ("y", Self::Y), ("z", Self::Z)];

    /// As scenes name it.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }

    /// Those that are set.
    pub(super) fn of(periodic: [bool; 3]) -> Vec<Self> {
        let named = Self::NAMED.iter().zip(periodic);
        named
            .filter_map(|((_, axis), is)| is.then_some(*axis))
            .collect()
    }
}

read_by_name!(Axis);
