//! Reads text that people and other programs write: UTF-8, with or without a byte order mark.

use std::{fs, io, path::Path};

/// Reason why bytes are not readable text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoText {
    /// UTF-16, as written by `>` in Windows PowerShell and by some editors.
    #[error("it is text in UTF-16; save it as UTF-8")]
    Utf16,
    /// Another encoding, or not text.
    #[error("line {line} is not UTF-8; save it as UTF-8")]
    Other {
        /// Line of the first invalid byte, counted from 1.
        line: usize,
    },
}

/// Strips the byte order mark that some editors write. Does not check for UTF-8.
///
/// # Errors
/// [`NoText::Utf16`], also without a mark if the first characters are ASCII.
pub fn without_mark(bytes: &[u8]) -> Result<&[u8], NoText> {
    let is_letter = |b: u8| b.is_ascii_graphic() || b.is_ascii_whitespace();
    let is_wide = match *bytes {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => true,
        [a, 0, b, 0, ..] | [0, a, 0, b, ..] => is_letter(a) && is_letter(b),
        _ => false,
    };
    if is_wide {
        return Err(NoText::Utf16);
    }
    Ok(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))
}

/// Decodes bytes as UTF-8 text, without the byte order mark.
///
/// # Errors
/// [`NoText`] if they are not UTF-8.
pub fn of(bytes: &[u8]) -> Result<&str, NoText> {
    let bytes = without_mark(bytes)?;
    std::str::from_utf8(bytes).map_err(|error| {
        let before = &bytes[..error.valid_up_to()];
        let line = 1 + before.iter().filter(|b| **b == b'\n').count();
        NoText::Other { line }
    })
}

/// Reads a text file.
///
/// # Errors
/// If the file cannot be read, or [`NoText`] as [`io::ErrorKind::InvalidData`].
pub fn read(file: &Path) -> io::Result<String> {
    let bytes = fs::read(file)?;
    let text = of(&bytes).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))?;
    Ok(text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_taken_off_and_other_encodings_named() {
        assert_eq!(of("caf\u{e9}".as_bytes()), Ok("caf\u{e9}"));
        assert_eq!(of("\u{feff}a = 1".as_bytes()), Ok("a = 1"));
        assert_eq!(of(b""), Ok(""));
        let wide = |order: fn(u16) -> [u8; 2], text: &str| -> Vec<u8> {
            text.encode_utf16().flat_map(order).collect()
        };
        for order in [u16::to_le_bytes, u16::to_be_bytes] {
            for text in ["\u{feff}a = 1", "a = 1", "\u{feff}"] {
                assert_eq!(of(&wide(order, text)), Err(NoText::Utf16), "{text:?}");
            }
        }
        assert_eq!(of(b"a\nb\ncaf\xe9"), Err(NoText::Other { line: 3 }));
        assert_eq!(of(b"\0\0\0\0").map(str::len), Ok(4));
    }
}
