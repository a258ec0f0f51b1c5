//! Quotes words of commands that messages, pages and logs print, for a POSIX shell.

use std::{borrow::Cow, path::Path};

/// Quotes a word of a command: in single quotes unless a shell takes it literally.
pub fn word(text: &str) -> Cow<'_, str> {
    let is_plain = |c: char| c.is_alphanumeric() || "_-./:=,@%+".contains(c);
    match !text.is_empty() && text.chars().all(is_plain) {
        true => text.into(),
        // Within single quotes every character is literal, except the closing quote.
        false => format!("'{}'", text.replace('\'', r"'\''")).into(),
    }
}

/// Quotes a path.
pub fn path(path: &Path) -> String {
    word(&path.to_string_lossy()).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_a_shell_takes_otherwise_is_quoted() {
        for plain in [
            "scenes/dam-break.toml",
            "1-240x2",
            "p.%04d.npy",
            "energy=4%",
            "été",
        ] {
            assert_eq!(word(plain), plain);
        }
        assert_eq!(word("my shots/dt.toml"), "'my shots/dt.toml'");
        assert_eq!(word("dt's"), r"'dt'\''s'");
        assert_eq!(word(""), "''");
        assert_eq!(path(Path::new("new results")), "'new results'");
    }

    #[cfg(unix)]
    #[test]
    fn a_shell_gives_every_word_back() {
        let words = [
            "plain",
            "two words",
            "",
            "dt's",
            "'",
            "\"$HOME\"",
            "`date`",
            "~/a",
            "a\\b",
            "*",
            "a;b&c|d",
            "#",
            "keep={compression=\"zstd\"}",
            "two\nlines",
        ];
        let given_back = |words: String| {
            let script = format!("printf '%s\\0' {words}");
            let output = std::process::Command::new("sh")
                .args(["-c", &script])
                .output();
            String::from_utf8(output.unwrap().stdout).unwrap()
        };
        let wanted: String = words.iter().map(|it| format!("{it}\0")).collect();
        assert_eq!(given_back(words.map(word).join(" ")), wanted);
        // Negative control: a shell splits unquoted words.
        assert_ne!(given_back(words[..2].join(" ")), "plain\0two words\0");
    }
}
