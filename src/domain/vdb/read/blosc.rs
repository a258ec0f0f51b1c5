//! Decompresses Blosc 1 chunks as OpenVDB writes them: LZ4, with or without byte shuffle.
//!
//! A chunk is a header, the offset of each block, and the blocks. A block is one stream, or one for
//! each byte of a value; a stream is LZ4's block format, preceded by its length.
//! (`README_CHUNK_FORMAT.rst` of c-blosc, `lz4_Block_format.md` of LZ4.)

use crate::vdb::cursor::Cursor;

const SHUFFLED: u8 = 0x1;
/// The blocks follow the header uncompressed, without offsets.
const COPIED: u8 = 0x2;
const SHUFFLED_BITS: u8 = 0x4;
/// Each block is one stream.
const WHOLE: u8 = 0x10;
/// The upper bits of the flags name the codec; this one is LZ4.
const LZ4: u8 = 1;

/// Smallest number of values in a block that has a stream for each byte of a value.
const LEAST_SPLIT: usize = 128;

/// Returns the content of a chunk, which must have `size` bytes.
pub(super) fn decompress(chunk: &[u8], size: usize) -> Result<Vec<u8>, String> {
    let mut header = Cursor::new(chunk);
    let [_version, _codec_version, flags, value] = header.array()?;
    let (bytes, block) = (header.number()? as usize, header.number()? as usize);
    let _chunk = header.number()?;
    if bytes != size {
        return Err(format!("damaged: {bytes} bytes of Blosc instead of {size}"));
    }
    if flags & COPIED != 0 {
        return header.take(size).map(<[u8]>::to_vec);
    }
    if flags & SHUFFLED_BITS != 0 || flags >> 5 != LZ4 {
        return Err("compressed by Blosc, and not as OpenVDB does it (LZ4, bytes shuffled)".into());
    }
    if block == 0 {
        return Err("damaged: a Blosc block of 0 bytes".into());
    }
    let value = usize::from(value).max(1);
    let mut out = Vec::with_capacity(size);
    while out.len() < size {
        let from = header.number()? as usize;
        let mut stream = Cursor::between(chunk, from, chunk.len())?;
        let here = block.min(size - out.len());
        let is_split =
            flags & WHOLE == 0 && value <= 16 && block / value >= LEAST_SPLIT && here == block;
        let streams = if is_split { value } else { 1 };
        let mut content = Vec::with_capacity(here);
        for _ in 0..streams {
            let packed = stream.counted()?;
            if packed.len() == here / streams {
                content.extend_from_slice(packed);
            } else {
                lz4(packed, &mut content, here / streams).ok_or("damaged: invalid LZ4")?;
            }
        }
        if flags & SHUFFLED != 0 {
            content = unshuffled(&content, value);
        }
        out.extend_from_slice(&content);
    }
    Ok(out)
}

/// Appends the `size` bytes that a stream stands for; `None` if it stands for anything else.
fn lz4(packed: &[u8], out: &mut Vec<u8>, size: usize) -> Option<()> {
    let (start, end) = (out.len(), out.len() + size);
    let mut packed = Cursor::new(packed);
    loop {
        let token = packed.byte().ok()?;
        let literals = length(&mut packed, token >> 4)?;
        let literals = packed.take(literals).ok()?;
        if literals.len() > end - out.len() {
            return None;
        }
        out.extend_from_slice(literals);
        if packed.is_at_end() {
            return (out.len() == end).then_some(());
        }
        let back = usize::from(u16::from_le_bytes(packed.array().ok()?));
        let count = length(&mut packed, token & 15)? + 4;
        if !(1..=out.len() - start).contains(&back) || count > end - out.len() {
            return None;
        }
        // The bytes that are repeated may be among those that are appended.
        for from in out.len() - back..out.len() - back + count {
            out.push(out[from]);
        }
    }
}

/// A length whose first four bits are in the token.
fn length(packed: &mut Cursor<'_>, first: u8) -> Option<usize> {
    let mut length = usize::from(first);
    let mut last = if first == 15 { 255 } else { 0 };
    while last == 255 {
        last = packed.byte().ok()?;
        length += usize::from(last);
    }
    Some(length)
}

/// Values whose first bytes come first, then the second ones; a part of a value stays at the end.
fn unshuffled(content: &[u8], value: usize) -> Vec<u8> {
    let values = content.len() / value;
    let byte = |at: usize| match at < values * value {
        true => content[at % value * values + at / value],
        false => content[at],
    };
    (0..content.len()).map(byte).collect()
}
