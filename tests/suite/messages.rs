//! Messages of the libraries speak of files, keys and requests. Options are named where they are
//! read, in `src/cli`.

use std::{fs, path::Path};

/// String literals of Rust source as written, lines joined where a backslash ends them.
fn literals(source: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = source;
    while let Some(at) = rest.find(['"', '\'', '/', 'r']) {
        let raw = rest[at..]
            .strip_prefix('r')
            .map(|it| it.split_at(hashes(it)));
        rest = &rest[at..];
        rest = if rest.starts_with("//") {
            &rest[rest.find('\n').unwrap_or(rest.len())..]
        } else if let Some((hashes, body)) = raw
            && let Some(body) = body.strip_prefix('"')
        {
            let end = format!("\"{hashes}");
            let (text, after) = body.split_once(&end).unwrap_or((body, ""));
            found.push(text.to_owned());
            after
        } else if let Some(body) = rest.strip_prefix('"') {
            let (text, after) = body.split_at(end(body, '"'));
            found.push(joined(text));
            &after[1..]
        } else if let Some(body) = rest.strip_prefix('\'') {
            // A lifetime has no closing quote behind its first letter.
            let is_char = body.starts_with('\\') || body.chars().nth(1) == Some('\'');
            &body[if is_char { end(body, '\'') + 1 } else { 0 }..]
        } else {
            &rest[1..]
        };
    }
    found
}

fn hashes(text: &str) -> usize {
    text.len() - text.trim_start_matches('#').len()
}

/// Where the quote that ends a literal is; a backslash escapes the character after it.
fn end(body: &str, quote: char) -> usize {
    let mut is_escaped = false;
    let closes = |c: char| {
        let is_end = c == quote && !is_escaped;
        is_escaped = c == '\\' && !is_escaped;
        is_end
    };
    body.find(closes).expect("a literal ends")
}

fn joined(literal: &str) -> String {
    let mut parts = literal.split("\\\n");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |text, part| text + part.trim_start())
}

/// Whether a text names an option, `--resume` or `-o`, or a command, `swell bake`.
fn names_an_option(text: &str) -> bool {
    let is_long = |word: &str| {
        let name = word.trim_start_matches(|c: char| !c.is_alphanumeric() && c != '-');
        let name = name.strip_prefix("--");
        name.is_some_and(|it| it.starts_with(|c: char| c.is_ascii_lowercase()))
    };
    let mut words = text.split_whitespace();
    text.contains("`swell ") || text.contains(" -o") || words.any(is_long)
}

/// Sources whose texts may: the command line, and the reference of keys that it prints.
fn may_name_options(file: &str) -> bool {
    let folders = ["src/cli/", "src/files/keys/"];
    folders.iter().any(|folder| file.starts_with(folder)) || file == "src/files/look/keys.rs"
}

fn is_test(file: &str) -> bool {
    file.ends_with("tests.rs") || file.contains("/tests/")
}

#[test]
fn libraries_name_no_option() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut seen, mut found) = (0, Vec::new());
    super::docs::sources(&root.join("src"), &["rs"], &mut |path| {
        let file = path.strip_prefix(root).unwrap().to_str().unwrap();
        if may_name_options(file) || is_test(file) {
            return;
        }
        let source = fs::read_to_string(path).unwrap();
        let source = source.split("#[cfg(test)]\nmod tests {").next().unwrap();
        let texts = literals(source);
        seen += texts.len();
        // Advice to run OpenUSD's own program has options of it.
        let named = |text: &String| names_an_option(text) && !text.contains("usdcat");
        found.extend(
            texts
                .into_iter()
                .filter(named)
                .map(|text| format!("{file}: {text}")),
        );
    });
    assert!(seen > 5000, "{seen}");
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn an_option_in_a_literal_is_seen() {
    let source = r##"
        // A comment: "--resume".
        fn of<'a>(it: &'a str) -> char { '"' }
        const ONE: &str = "choose \"another\" or \
            (`--resume`)";
        const TWO: &str = r#"say "--from"#;
        const THREE: &str = "choose another -o, 5 -- 6 or one-off";
        const FOUR: &str = "make it with `swell \
            whitewater`";
    "##;
    let found = literals(source);
    let expected = [
        r#"choose \"another\" or (`--resume`)"#,
        r#"say "--from"#,
        "choose another -o, 5 -- 6 or one-off",
        "make it with `swell whitewater`",
    ];
    assert_eq!(found, expected);
    assert!(found.iter().all(|text| names_an_option(text)));
    for sound in [
        "resume it, or choose another",
        "a -- b",
        "<!-- x",
        "one-off",
        "swell 0.1",
    ] {
        assert!(!names_an_option(sound), "{sound}");
    }
}
