//! Writers of files for other programs: bytes from a frame's mesh or particles, and nothing of where they go.
//!
//! Each format stands in a file of its own. What opens what they write is a table in `docs/interchange.md`.

pub mod mesh;
pub mod table;
pub mod usd;

/// What a file says of where it comes from.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// Program and version.
    pub software: &'a str,
    /// Name of the shot.
    pub shot: &'a str,
    /// Number of the frame.
    pub frame: u32,
}
