//! A compressed frame, `.ply.zst`: one Zstandard stream (RFC 8878) of the PLY header of [`super`], with one comment more,
//! and then, in place of rows, blocks of byte planes: byte 0 of the rows of a block one after the other, then byte 1, and so on. In place
//! of positions stand `differences`.
//!
//! Nothing is lost. Neighbours by id are neighbours in space for long, so their high bytes repeat, and in planes of their own they are
//! found: what remains are the low bytes of the mantissas, which nothing shrinks.

mod differences;

use std::io::{self, Read as _, Write};
use std::path::Path;

use super::{
    Counted, HEADER_LIMIT, Head, Stamp, Unpacked, Written, header, header_bytes, pack, read_head,
    row_size,
};
use crate::error::CacheError;
use swell_domain::particles::Particles;

/// Rows of a block, the last one's fewer: a plane is then one block of Zstandard, which are of 128 KiB at most.
const ROWS: usize = 1 << 17;
/// Zstandard's own default.
const LEVEL: i32 = 3;

/// What planes are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Content {
    /// The rows as they are, as this program wrote them until 2026-11-25.
    Values,
    /// [`differences::take`] of each block.
    Differences,
}

impl Content {
    /// The comment that tells that planes follow.
    fn comment(self) -> String {
        match self {
            Self::Values => format!("planes {ROWS}"),
            Self::Differences => format!("differences {ROWS}"),
        }
    }

    /// What these comments tell.
    pub(super) fn told(comments: &[String]) -> Option<Self> {
        let all = [Self::Values, Self::Differences];
        all.into_iter().find(|it| comments.contains(&it.comment()))
    }
}

/// Writes one frame.
///
/// # Errors
/// Those of `out`. The particles must pass [`super::check`].
pub fn encode(
    out: &mut impl Write,
    stamp: &Stamp<'_>,
    particles: &Particles,
) -> io::Result<Written> {
    encode_as(Content::Differences, out, stamp, particles)
}

fn encode_as(
    content: Content,
    out: &mut impl Write,
    stamp: &Stamp<'_>,
    particles: &Particles,
) -> io::Result<Written> {
    let names = particles.attributes.keys().map(String::as_str);
    let mut header = header(stamp, particles.len(), names);
    header.comments.push(content.comment());
    let head = header_bytes(&header)?;
    let row_size = row_size(stamp.origin, particles.attributes.len());
    let mut counted = Counted::new(out);
    let mut stream = zstd::Encoder::new(&mut counted, LEVEL)?;
    let length = head.len() + particles.len() * row_size;
    stream.set_pledged_src_size(Some(length as u64))?;
    stream.write_all(&head)?;
    let (mut rows, mut planes) = (Vec::new(), Vec::new());
    for first in (0..particles.len()).step_by(ROWS) {
        let end = particles.len().min(first + ROWS);
        pack(particles, stamp.origin, first..end, &mut rows);
        if content == Content::Differences {
            differences::take(&mut rows, stamp.origin, row_size);
        }
        turn(&rows, row_size, &mut planes);
        for plane in planes.chunks_exact(end - first) {
            stream.write_all(plane)?;
            // A block of Zstandard ends here: the next plane has statistics of its own.
            stream.flush()?;
        }
    }
    stream.finish()?;
    Ok(counted.written())
}

/// Reads one frame. Of a stream that promises more than it has nothing is allocated but what it has.
///
/// # Errors
/// [`CacheError::Damaged`] with `file` as its name.
pub fn decode(bytes: &[u8], file: &Path) -> Result<Particles, CacheError> {
    parse(bytes).map_err(|what| CacheError::damaged(file, what))
}

/// The comments of a frame's header, in their order; as far as the stream can be read.
pub fn comments(bytes: &[u8]) -> Vec<String> {
    let mut head = Vec::new();
    if let Ok(stream) = zstd::Decoder::with_buffer(bytes) {
        // A torn stream gives what comes before the tear.
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

/// Reads the content of a stream, header and planes.
///
/// # Errors
/// In words, where it is not what [`encode`] compresses.
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
        _ => Err("more follows than its header promises".to_owned()),
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
    Ok(unpacked.finish(head.names))
}

/// Turns a table of bytes, `width` a row, into that of its columns.
fn turn(table: &[u8], width: usize, turned: &mut Vec<u8>) {
    let height = table.len() / width;
    turned.resize(table.len(), 0);
    for (column, place) in turned.chunks_exact_mut(height).enumerate() {
        let bytes = table[column..].iter().step_by(width);
        place
            .iter_mut()
            .zip(bytes)
            .for_each(|(to, from)| *to = *from);
    }
}

#[cfg(test)]
mod tests;
