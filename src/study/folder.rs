//! What lies in a study's folder, by name: the study writes it, and `swell view` reads it.

use serde::{Deserialize, Serialize};

use swell_domain::chunk::Chunk;

/// The file that holds a [`Claim`].
pub const CLAIM: &str = "study.json";

/// The study's own ledger; [`ledger_of`] has those of shares.
pub const LEDGER: &str = "results.jsonl";

/// Whose the folder is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Claim {
    /// Of the study, as its file is called.
    pub study: String,
    /// What runs the whole study, but for options of the device and of what may be read; `None` where another version of the program took the folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<String>,
}

/// Name of the ledger of a share, or of the whole study.
pub fn ledger_of(chunk: Option<Chunk>) -> String {
    chunk.map_or(LEDGER.to_owned(), |chunk| {
        let name = chunk.to_string().replace('/', "-of-");
        format!("results.{name}.jsonl")
    })
}

/// Whether a file of this name is the ledger of a share.
pub fn is_share(name: &str) -> bool {
    let share = name.strip_prefix("results.");
    let share = share.and_then(|rest| rest.strip_suffix(".jsonl"));
    share.is_some_and(|share| share.replace("-of-", "/").parse::<Chunk>().is_ok())
}

/// Whether a file of this name is a ledger.
pub fn is_ledger(name: &str) -> bool {
    name == LEDGER || is_share(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ledgers_are_known_by_their_names() {
        for (name, is, is_of_a_share) in [
            ("results.jsonl", true, false),
            ("results.12-of-12.jsonl", true, true),
            ("results.3-of-2.jsonl", false, false),
            ("results.csv", false, false),
        ] {
            assert_eq!(
                (is_ledger(name), is_share(name)),
                (is, is_of_a_share),
                "{name}"
            );
        }
        let share = "2/3".parse().expect("a share");
        assert!(is_share(&ledger_of(Some(share))) && !is_share(&ledger_of(None)));
    }
}
