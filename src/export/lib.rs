//! Writers of files for other programs: bytes from a frame's mesh or particles, without
//! file access.
//!
//! Each format has its own file. `docs/interchange.md` lists the programs that open each format.

pub mod mesh;
pub mod surface;
pub mod table;
pub mod usd;

/// Origin of a file, written into it as metadata.
#[derive(Clone, Copy, Debug)]
pub struct FileOrigin<'a> {
    /// Name and version of the program.
    pub software: &'a str,
    /// Name of the shot.
    pub shot: &'a str,
    /// Frame number.
    pub frame: u32,
}
