//! Statements of the documents about the tree: paths exist, and files are short enough to read.

use std::{fs, path::Path, process::Command};

/// Paths between backticks that begin in one of the tree's folders. `NAME` and other words in
/// capitals are placeholders.
fn paths(text: &str) -> impl Iterator<Item = &str> {
    let quoted = text.split('`').skip(1).step_by(2);
    let roots = ["src/", "shaders/", "scenes/", "tests/", "tools/", "docs/"];
    quoted.filter(move |path| {
        let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "/._-".contains(c);
        roots.iter().any(|root| path.starts_with(root))
            && (path.chars().all(is_plain) || path.starts_with("docs/"))
    })
}

fn missing(root: &Path, text: &str) -> Vec<String> {
    let absent = paths(text).filter(|path| !root.join(path).exists());
    absent.map(str::to_owned).collect()
}

#[test]
fn every_path_that_a_document_names_is_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = vec![root.join("README.md")];
    for entry in fs::read_dir(root.join("docs")).unwrap() {
        files.push(entry.unwrap().path());
    }
    files.retain(|file| file.extension().is_some_and(|end| end == "md"));
    let (mut seen, mut absent) = (0, Vec::new());
    for file in files.iter().filter(|file| !file.ends_with("mutants.md")) {
        // A code block contains backticks of its own.
        let text = fs::read_to_string(file).unwrap().replace("```", "");
        seen += paths(&text).count();
        for path in missing(root, &text) {
            absent.push(format!("{}: {path}", file.display()));
        }
    }
    assert!(seen > 40, "{seen}");
    assert!(absent.is_empty(), "{absent:#?}");
    let said = "`src/lib.rs`, `src/no_such_room`, `shaders/ROOM/NAME.wgsl`";
    assert_eq!(missing(root, said), ["src/no_such_room"]);
}

/// Lines of a page without its blocks of code.
fn prose(page: &str) -> impl Iterator<Item = &str> {
    let mut is_code = false;
    page.lines().filter(move |line| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        !is_code && !is_fence
    })
}

/// Anchors of a page's headings, by the rule of GitHub and mdbook.
fn anchors(page: &str) -> Vec<String> {
    let headings = prose(page).filter(|line| line.starts_with('#'));
    let is_kept = |c: &char| c.is_alphanumeric() || " -_".contains(*c);
    let anchor = |line: &str| -> String {
        let text = line.trim_start_matches('#').trim().to_lowercase();
        text.chars()
            .filter(is_kept)
            .collect::<String>()
            .replace(' ', "-")
    };
    headings.map(anchor).collect()
}

/// Relative targets of a page's links and pictures.
fn links(page: &str) -> Vec<String> {
    // Inline code is between backticks.
    let text = prose(page).collect::<Vec<_>>().join("\n");
    let text: String = text.split('`').step_by(2).collect();
    let targets = text.split("](").skip(1);
    let targets = targets.filter_map(|rest| rest.split_once(')').map(|(target, _)| target));
    let is_relative = |target: &&str| !target.contains("://");
    targets.filter(is_relative).map(str::to_owned).collect()
}

/// Links of a page, with that text, that lead to no file or heading, or from the site's pages to
/// what is not in the site.
fn dead_links(root: &Path, page: &str, text: &str) -> Vec<String> {
    let folder = root.join(page).parent().unwrap().canonicalize().unwrap();
    let leads = |link: &String| {
        let (path, anchor) = link.split_once('#').unwrap_or((link, ""));
        let Ok(file) = folder.join(path).canonicalize() else {
            return false;
        };
        let is_in_site = !page.starts_with("docs/") || file.starts_with(&folder);
        let target = match path {
            "" => text.to_owned(),
            _ if anchor.is_empty() => return is_in_site,
            _ => fs::read_to_string(file).unwrap(),
        };
        is_in_site && anchors(&target).iter().any(|it| it == anchor)
    };
    links(text)
        .into_iter()
        .filter(|link| !leads(link))
        .collect()
}

#[test]
fn links_of_pages_lead_somewhere() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let summary = fs::read_to_string(root.join("docs/SUMMARY.md")).unwrap();
    let mut pages = [
        "README.md",
        "CHANGELOG.md",
        "CONTRIBUTING.md",
        "SECURITY.md",
    ]
    .map(str::to_owned)
    .to_vec();
    for entry in fs::read_dir(root.join("docs")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if name.ends_with(".md") {
            let is_listed = name == "SUMMARY.md" || links(&summary).contains(&name);
            assert!(is_listed, "docs/SUMMARY.md lacks {name}");
            pages.push(format!("docs/{name}"));
        }
    }
    let (mut seen, mut dead) = (0, Vec::new());
    for page in &pages {
        let text = fs::read_to_string(root.join(page)).unwrap();
        seen += links(&text).len();
        let found = dead_links(root, page, &text);
        dead.extend(found.into_iter().map(|link| format!("{page}: {link}")));
    }
    assert!(seen > 150, "{seen}");
    assert!(dead.is_empty(), "{dead:#?}");
    // Negative controls; code is no link.
    let text = "# A `b`, c\n[a](#a-b-c) [b](#b) [c](no.md) [d](look.md#no) [e](../README.md) \
                `[f](g)`\n```sh\n# [h](i)\n```\n[j](look.md#spray)";
    let found = dead_links(root, "docs/page.md", text);
    assert_eq!(found, ["#b", "no.md", "look.md#no", "../README.md"]);
}

/// Crates of the workspace that a manifest depends on, without its tests.
fn depends_on(manifest: &str) -> Vec<&str> {
    let needed = manifest.split("[dev-dependencies]").next().unwrap();
    let lines = needed.lines();
    lines
        .filter_map(|line| {
            line.strip_prefix("swell-")?
                .strip_suffix(".workspace = true")
        })
        .collect()
}

/// Crate and dependencies of a row of the map's table.
fn row(line: &str) -> Option<(&str, Vec<&str>)> {
    let cells: Vec<&str> = line.strip_prefix("| `")?.split(" | ").collect();
    let [name, _, needed] = cells[..] else {
        return None;
    };
    let names = needed.split('`').skip(1).step_by(2);
    Some((name.strip_suffix('`')?, names.collect()))
}

#[test]
fn crates_depend_as_the_map_says() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = fs::read_to_string(root.join("docs/ARCHITECTURE.md")).unwrap();
    let listed: Vec<_> = page.lines().filter_map(row).collect();
    let workspace = fs::read_to_string(root.join("Cargo.toml")).unwrap();
    let members = workspace.matches("\n    \"src/").count();
    assert_eq!(listed.len(), members, "{listed:?}");
    for (name, needed) in listed {
        let manifest = root.join(format!("src/{name}/Cargo.toml"));
        let manifest = fs::read_to_string(manifest).unwrap();
        assert_eq!(depends_on(&manifest), needed, "{name}");
        // Negative control: one more.
        let more = format!("swell-cli.workspace = true\n{manifest}");
        assert_ne!(depends_on(&more), needed, "{name}");
    }
}

/// Maximum number of lines of a source file.
const LONGEST: usize = 600;

fn is_too_long(text: &str) -> bool {
    text.lines().count() > LONGEST
}

pub(super) fn sources(folder: &Path, ends: &[&str], visit: &mut dyn FnMut(&Path)) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let end = path.extension().and_then(|end| end.to_str());
        if path.is_dir() {
            sources(&path, ends, visit);
        } else if end.is_some_and(|end| ends.contains(&end)) {
            visit(&path);
        }
    }
}

#[test]
fn no_source_file_is_too_long() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut seen, mut long) = (0, Vec::new());
    for folder in ["src", "shaders", "tests/suite", "tools"] {
        sources(&root.join(folder), &["rs", "wgsl", "py"], &mut |file| {
            seen += 1;
            if is_too_long(&fs::read_to_string(file).unwrap()) {
                long.push(file.to_owned());
            }
        });
    }
    assert!(seen > 300, "{seen}");
    assert!(long.is_empty(), "over {LONGEST} lines: {long:#?}");
    assert!(!is_too_long(&"x\n".repeat(LONGEST)));
    assert!(is_too_long(&"x\n".repeat(LONGEST + 1)));
}

/// Columns of a source line at most.
const WIDEST: usize = 100;

/// The end that closes the first raw string of a text, and the text behind its opening quote. Only
/// raw strings with a `#` count, as none without one spans lines.
fn raw_string(text: &str) -> Option<(String, &str)> {
    text.match_indices("r#").find_map(|(at, _)| {
        let behind = text[at + 1..].trim_start_matches('#');
        let hashes = text.len() - (at + 1) - behind.len();
        let body = behind.strip_prefix('"')?;
        Some((format!("\"{}", "#".repeat(hashes)), body))
    })
}

/// Numbers, from 1, of the lines wider than [`WIDEST`]. A line with a URL or with a part of a raw
/// string, which cannot be continued, may be wider.
fn wide_lines(text: &str) -> Vec<usize> {
    let mut wide = Vec::new();
    // What closes the raw string that is open.
    let mut end: Option<String> = None;
    for (index, line) in text.lines().enumerate() {
        let mut may_be_wider = end.is_some() || line.contains("://");
        let mut rest = line;
        loop {
            if let Some(close) = end.take() {
                let Some((_, behind)) = rest.split_once(close.as_str()) else {
                    end = Some(close);
                    break;
                };
                rest = behind;
            } else if let Some((close, body)) = raw_string(rest) {
                may_be_wider = true;
                end = Some(close);
                rest = body;
            } else {
                break;
            }
        }
        if !may_be_wider && line.chars().count() > WIDEST {
            wide.push(index + 1);
        }
    }
    assert_eq!(end, None, "a raw string without an end");
    wide
}

#[test]
fn no_source_line_is_too_wide() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut seen, mut wide) = (0, Vec::new());
    for folder in ["src", "shaders"] {
        sources(&root.join(folder), &["rs", "wgsl"], &mut |file| {
            seen += 1;
            for line in wide_lines(&fs::read_to_string(file).unwrap()) {
                wide.push(format!("{}:{line}", file.display()));
            }
        });
    }
    assert!(seen > 300, "{seen}");
    assert!(wide.is_empty(), "over {WIDEST} columns: {wide:#?}");
    // Negative control: one column more. Columns are characters, not bytes.
    let full = "π".repeat(WIDEST);
    assert_eq!(wide_lines(&format!("{full}\n{full}x\n{full}")), [2]);
    // Raw strings and URLs may be wider, the line behind them may not.
    let text = format!("r##\"{full}\n{full}x\"#\n{full}\"##\n{full}x\n// https://{full}\n");
    assert_eq!(wide_lines(&text), [4]);
}

/// Whether a page has exactly one marker of the tool for its table, with an end marker after it.
fn has_place(page: &str, tool: &str) -> bool {
    let mark = format!("<!-- {tool} -->\n");
    let mut parts = page.split(&mark);
    let behind = parts.nth(1);
    behind.is_some_and(|text| text.contains("<!-- end -->\n")) && parts.next().is_none()
}

#[test]
fn performance_page_has_one_marker_for_the_peers_tables() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = fs::read_to_string(root.join("docs/performance.md")).unwrap();
    assert!(has_place(&page, "tools/bench peers"));
    assert!(!has_place(&page, "tools/bench others"));
    let cut = page.replace("<!-- end -->", "");
    assert!(!has_place(&cut, "tools/bench peers"));
    assert!(!has_place(&page.repeat(2), "tools/bench peers"));
}

#[test]
fn an_unknown_peer_is_usage() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let run = |words: &[&str]| {
        let mut command = Command::new(root.join("tools/bench"));
        command.arg("peers").args(words).output().unwrap()
    };
    let output = run(&["--only", "houdini"]);
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{told}");
    for name in ["houdini", "splishsplash", "mantaflow"] {
        assert!(told.contains(name), "{told}");
    }
    // The message about a known peer concerns another argument.
    let output = run(&["--only", "mantaflow", "--rounds", "0"]);
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{told}");
    assert!(
        told.contains("--rounds") && !told.contains("invalid choice"),
        "{told}"
    );
}
