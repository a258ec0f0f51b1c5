//! Selection of a substep of a frame.

use std::{fmt, str::FromStr};

/// Selects a substep of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SubstepChoice {
    /// The substep with this number, counted from 1.
    Number(u32),
    /// The last substep of the frame, whatever its number.
    Last,
}

impl Default for SubstepChoice {
    fn default() -> Self {
        Self::Number(1)
    }
}

impl fmt::Display for SubstepChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Last => write!(f, "last"),
        }
    }
}

/// Error for a text that is not a substep.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a substep: give a number from 1 on, or last")]
pub struct NoSubstep(String);

impl FromStr for SubstepChoice {
    type Err = NoSubstep;

    fn from_str(text: &str) -> Result<Self, NoSubstep> {
        let fault = || NoSubstep(text.to_owned());
        if text == "last" {
            return Ok(Self::Last);
        }
        // `parse` would accept `+1`.
        if !text.bytes().all(|byte| byte.is_ascii_digit()) {
            return Err(fault());
        }
        let number = text.parse().ok().filter(|&number| number > 0);
        number.map(Self::Number).ok_or_else(fault)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_substep_is_a_number_from_1_on_or_last() {
        for (text, which) in [
            ("1", SubstepChoice::Number(1)),
            ("12", SubstepChoice::Number(12)),
            ("last", SubstepChoice::Last),
        ] {
            assert_eq!(text.parse(), Ok(which));
            assert_eq!(which.to_string(), text);
        }
        for text in ["", "0", "-1", "+1", "1.5", "first", "Last", "4294967296"] {
            let error = text.parse::<SubstepChoice>().unwrap_err().to_string();
            assert!(error.contains("from 1 on, or last"), "{text}: {error}");
        }
    }
}
