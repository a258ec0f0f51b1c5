//! A position in the bytes of a file.

/// Reads numbers and texts one after another. Nothing is allocated from a length that the bytes do
/// not have.
#[derive(Clone, Copy)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// A cursor from one offset to another.
    pub(super) fn between(bytes: &'a [u8], from: usize, to: usize) -> Result<Self, String> {
        match bytes.get(..to) {
            Some(bytes) if from <= to => Ok(Self { bytes, at: from }),
            _ => Err(format!("damaged: bytes {from} to {to} of {}", bytes.len())),
        }
    }

    pub(super) fn at(&self) -> usize {
        self.at
    }

    pub(super) fn is_at_end(&self) -> bool {
        self.at == self.bytes.len()
    }

    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let part = self.bytes[self.at..].get(..count).ok_or_else(|| {
            let left = self.bytes.len() - self.at;
            format!(
                "truncated or damaged: at byte {}, {count} more are expected, and {left} follow",
                self.at
            )
        })?;
        self.at += count;
        Ok(part)
    }

    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    pub(super) fn byte(&mut self) -> Result<u8, String> {
        self.array().map(|[byte]| byte)
    }

    pub(super) fn number(&mut self) -> Result<u32, String> {
        self.array().map(u32::from_le_bytes)
    }

    pub(super) fn long(&mut self) -> Result<i64, String> {
        self.array().map(i64::from_le_bytes)
    }

    pub(super) fn float(&mut self) -> Result<f32, String> {
        self.array().map(f32::from_le_bytes)
    }

    /// Bytes preceded by their number.
    pub(super) fn counted(&mut self) -> Result<&'a [u8], String> {
        let count = self.number()?;
        self.take(count as usize)
    }

    pub(super) fn text(&mut self) -> Result<String, String> {
        let bytes = self.counted()?;
        Ok(String::from_utf8_lossy(bytes).into_owned())
    }

    pub(super) fn ints(&mut self) -> Result<[i32; 3], String> {
        let mut ints = [0; 3];
        for int in &mut ints {
            *int = i32::from_le_bytes(self.array()?);
        }
        Ok(ints)
    }

    pub(super) fn doubles(&mut self) -> Result<[f64; 3], String> {
        let mut doubles = [0.0; 3];
        for double in &mut doubles {
            *double = f64::from_le_bytes(self.array()?);
        }
        Ok(doubles)
    }

    /// Words of a mask, the lowest bit first.
    pub(super) fn mask<const WORDS: usize>(&mut self) -> Result<[u64; WORDS], String> {
        let mut words = [0; WORDS];
        for word in &mut words {
            *word = u64::from_le_bytes(self.array()?);
        }
        Ok(words)
    }
}
