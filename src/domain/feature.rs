//! Cargo features that a build may leave out.

/// Error of a function whose cargo feature this build does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{what} needs the cargo feature `{feature}` of swell, which this build does not have: compile \
     with it"
)]
pub struct MissingFeature {
    /// Name of the feature.
    pub feature: &'static str,
    /// The part of swell that needs it, as a subject in the singular.
    pub what: &'static str,
}
