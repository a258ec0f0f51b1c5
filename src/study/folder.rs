//! Names of the files in a study's folder, which the study writes and a view reads.

use serde::{Deserialize, Serialize};

use swell_domain::chunk::Chunk;

/// Name of the file that holds a [`Claim`].
pub const CLAIM: &str = "study.json";

/// Name of the ledger of a whole study; [`ledger_of`] gives those of shares.
pub const LEDGER: &str = "results.jsonl";

/// The study that owns a folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Claim {
    /// Name of the study, like that of its file.
    pub study: String,
    /// Command that runs the whole study, without options of the device and of file access; `None`
    /// if another version of the program claimed the folder.
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
