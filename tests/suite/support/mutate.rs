//! Corrupts valid input.
/// Truncates, overwrites, inserts and duplicates bytes as `edits` say.
pub fn mutate(mut bytes: Vec<u8>, edits: &[(u16, u8, u8)]) -> Vec<u8> {
    for &(at, kind, value) in edits {
        if bytes.is_empty() {
            break;
        }
        let at = at as usize % bytes.len();
        match kind % 5 {
            0 => bytes[at] = value,
            1 => bytes.truncate(at),
            2 => bytes.insert(at, value),
            3 => {
                let end = (at + value as usize).min(bytes.len());
                let part = bytes[at..end].to_vec();
                bytes.extend(part);
            }
            _ => {
                // Text formats fail most easily in their numbers.
                let digits = [b"-1 ".as_slice(), b"nan", b"1e39", b"99999999999999999999"];
                let digit = digits[value as usize % digits.len()];
                bytes.splice(at..at + 1, digit.iter().copied());
            }
        }
    }
    bytes
}
