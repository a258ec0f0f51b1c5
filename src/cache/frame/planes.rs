//! A compressed frame, `.ply.zst`: one Zstandard stream (RFC 8878).
//!
//! It holds the PLY header of [`super`] with one more comment, followed by blocks of byte planes in
//! place of rows: byte 0 of all rows of a block, then byte 1, and so on. Positions are replaced by
//! their `differences`.
//!
//! The compression is lossless. Particles with neighbouring ids stay neighbours in space for a long
//! time, so their high bytes repeat, and separate planes let Zstandard find that. What remains are
//! the low bytes of the mantissas, which nothing compresses.

mod differences;

use std::io::{self, Read as _, Write};
use std::path::Path;

use rayon::prelude::*;

use super::{
    Counted, HEADER_LIMIT, Head, Stamp, Unpacked, WrittenFile, deep, header, header_bytes, pack,
    read_head, row_size,
};
use crate::error::CacheError;
use swell_domain::particles::Particles;

/// Rows of a block (the last block may have fewer). A plane then fills exactly one Zstandard block,
/// whose limit is 128 KiB.
const ROWS: usize = 1 << 17;
/// Zstandard's default compression level.
const LEVEL: i32 = 3;

/// Encoding of the rows before they are split into planes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Content {
    /// Raw rows, as older versions of swell wrote them.
    Values,
    /// [`differences::take`] applied to each block.
    Differences,
}

impl Content {
    /// The header comment that announces the planes.
    fn comment(self) -> String {
        match self {
            Self::Values => format!("planes {ROWS}"),
            Self::Differences => format!("differences {ROWS}"),
        }
    }

    /// The encoding that these comments announce.
    pub(super) fn from_comments(comments: &[String]) -> Option<Self> {
        let all = [Self::Values, Self::Differences];
        all.into_iter().find(|it| comments.contains(&it.comment()))
    }
}

/// Writes one frame. The particles must pass [`super::check`].
///
/// # Errors
/// Those of `out`.
pub fn encode(
    out: &mut impl Write,
    stamp: &Stamp<'_>,
    particles: &Particles,
) -> io::Result<WrittenFile> {
    encode_as(Content::Differences, out, stamp, particles)
}

fn encode_as(
    content: Content,
    out: &mut impl Write,
    stamp: &Stamp<'_>,
    particles: &Particles,
) -> io::Result<WrittenFile> {
    let names = particles.attributes.keys().map(String::as_str);
    let mut header = header(stamp, particles.len(), names, &particles.deep);
    header.comments.push(content.comment());
    let head = header_bytes(&header)?;
    let row_size = row_size(stamp.origin, particles.attributes.len());
    let mut counted = Counted::new(out);
    let mut stream = zstd::Encoder::new(&mut counted, LEVEL)?;
    let of_deep = deep::pack(&particles.deep);
    let length = head.len() + particles.len() * row_size + of_deep.len();
    stream.set_pledged_src_size(Some(length as u64))?;
    stream.write_all(&head)?;
    let (mut rows, mut planes, mut next) = (Vec::new(), Vec::new(), Vec::new());
    for first in (0..=particles.len()).step_by(ROWS) {
        let range = first..particles.len().min(first + ROWS);
        rayon::in_place_scope(|scope| {
            scope.spawn(|_| {
                pack(particles, stamp.origin, range, &mut rows);
                if content == Content::Differences {
                    differences::take(&mut rows, stamp.origin, row_size);
                }
                turn(&rows, row_size, &mut next);
            });
            compress(&mut stream, &planes, row_size)
        })?;
        std::mem::swap(&mut planes, &mut next);
    }
    compress(&mut stream, &planes, row_size)?;
    turn(&of_deep, deep::ROW, &mut next);
    compress(&mut stream, &next, deep::ROW)?;
    stream.finish()?;
    Ok(counted.written())
}

/// Compresses a block of `count` planes.
fn compress(stream: &mut impl Write, planes: &[u8], count: usize) -> io::Result<()> {
    let rows = planes.len() / count;
    for plane in planes.chunks_exact(rows.max(1)) {
        stream.write_all(plane)?;
        // Ends a Zstandard block, so that the next plane has its own statistics.
        stream.flush()?;
    }
    Ok(())
}

/// Reads one frame. Memory grows only with the data found, not with what the header promises.
///
/// # Errors
/// [`CacheError::Damaged`] with `file` as its name.
pub fn decode(bytes: &[u8], file: &Path) -> Result<Particles, CacheError> {
    parse(bytes).map_err(|what| CacheError::damaged(file, what))
}

/// The comments in a frame's header, in order, as far as the stream can be read.
pub fn comments(bytes: &[u8]) -> Vec<String> {
    let mut head = Vec::new();
    if let Ok(stream) = zstd::Decoder::with_buffer(bytes) {
        // A truncated stream gives what comes before the cut.
        let _ = stream.take(HEADER_LIMIT as u64).read_to_end(&mut head);
    }
    super::comments(&head)
}

fn parse(mut bytes: &[u8]) -> Result<Particles, String> {
    let stream = zstd::Decoder::with_buffer(&mut bytes).map_err(fault)?;
    let particles = read(stream.single_frame())?;
    match bytes {
        [] => Ok(particles),
        _ => Err(format!("{} bytes follow its stream", bytes.len())),
    }
}

/// Reads the content of a decompressed stream, header and planes.
///
/// # Errors
/// A message if it is not what [`encode`] compresses.
pub fn read(mut content: impl io::Read) -> Result<Particles, String> {
    let mut begin = Vec::new();
    let limit = HEADER_LIMIT as u64;
    (content.by_ref().take(limit).read_to_end(&mut begin)).map_err(fault)?;
    let head = read_head(&begin)?;
    let Some(content_of) = head.planes else {
        return Err("its PLY header is not that of a compressed frame".to_owned());
    };
    let mut body = begin[head.bytes..].chain(content);
    let particles = read_blocks(&mut body, head, content_of)?;
    match body.read(&mut [0]).map_err(fault)? {
        0 => Ok(particles),
        _ => Err("it has more data than its header declares".to_owned()),
    }
}

fn fault(error: io::Error) -> String {
    format!("Zstandard: {error}")
}

fn read_blocks(
    body: &mut impl io::Read,
    head: Head,
    content: Content,
) -> Result<Particles, String> {
    let row_size = head.row_size();
    let mut unpacked = Unpacked::new(&head, head.count.min(ROWS));
    let (mut planes, mut rows) = (Vec::new(), Vec::new());
    let mut found = 0;
    while found < head.count {
        let count = ROWS.min(head.count - found);
        planes.clear();
        let length = (count * row_size) as u64;
        let read = body.take(length).read_to_end(&mut planes);
        if read.map_err(fault)? as u64 != length {
            return Err(head.misfit((found * row_size + planes.len()) as u64));
        }
        turn(&planes, count, &mut rows);
        if content == Content::Differences {
            differences::add_up(&mut rows, head.origin, row_size);
        }
        unpacked.add(&rows)?;
        found += count;
    }
    let length = head.deep.count.saturating_mul(deep::ROW) as u64;
    planes.clear();
    let read = body.take(length).read_to_end(&mut planes);
    if read.map_err(fault)? as u64 != length {
        return Err(head.misfit((found * row_size + planes.len()) as u64));
    }
    turn(&planes, head.deep.count, &mut rows);
    let deep = deep::unpack(head.deep, &rows)?;
    Ok(unpacked.finish(head.names, deep))
}

/// Transposes a table of bytes with `width` bytes a row.
fn turn(table: &[u8], width: usize, turned: &mut Vec<u8>) {
    let height = table.len() / width.max(1);
    turned.resize(table.len(), 0);
    let columns = turned.par_chunks_exact_mut(height.max(1)).enumerate();
    columns.for_each(|(column, place)| {
        let bytes = table[column..].iter().step_by(width);
        place
            .iter_mut()
            .zip(bytes)
            .for_each(|(to, from)| *to = *from);
    });
}

#[cfg(test)]
mod tests;
