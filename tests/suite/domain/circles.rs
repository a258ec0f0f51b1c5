//! Within a room no module imports one that imports it, at however many removes: what is read first stands first.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

/// Rooms without a circle of imports.
const ROOMS: [&str; 3] = ["cache", "compare", "domain"];

/// By module of a room the modules that it imports.
type Imports = BTreeMap<String, BTreeSet<String>>;

/// First names of the paths that begin with `prefix`, of each path in the braces of a `use`.
fn names_after(code: &str, prefix: &str) -> Vec<String> {
    let name = |path: &str| -> String {
        let is_name = |c: char| c.is_alphanumeric() || c == '_';
        path.trim_start()
            .chars()
            .take_while(|&c| is_name(c))
            .collect()
    };
    let mut found = Vec::new();
    for (at, _) in code.match_indices(prefix) {
        let rest = &code[at + prefix.len()..];
        let Some(block) = rest.strip_prefix('{') else {
            found.push(name(rest));
            continue;
        };
        let mut depth = 0;
        let mut item = 0;
        for (at, c) in block.char_indices() {
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => {
                    found.push(name(&block[item..at]));
                    break;
                }
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    found.push(name(&block[item..at]));
                    item = at + 1;
                }
                _ => {}
            }
        }
    }
    found
}

/// Siblings that a module's file imports; `depth` folders lie between the room and the file. Unit tests are left out:
/// they may use what stands on the module.
fn imports(room: &str, depth: usize, text: &str) -> Vec<String> {
    let code: String = text
        .lines()
        .take_while(|line| *line != "#[cfg(test)]")
        .filter(|line| !line.trim_start().starts_with("//"))
        .flat_map(|line| [line, "\n"])
        .collect();
    // Marked, so that one `super::` is not found in two.
    let code = code
        .replace("super::", "^")
        .replace(&format!("crate::{room}::"), "@");
    let up = "^".repeat(depth + 1);
    let code = code.replace(&up, "@");
    names_after(&code, "@")
}

fn of_room(room: &str) -> Imports {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(room);
    let mut found = Imports::new();
    let mut folders = vec![root.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let below = path.strip_prefix(&root).unwrap().with_extension("");
            let parts: Vec<&str> = below.iter().map(|part| part.to_str().unwrap()).collect();
            // The room's own list of modules, and unit tests in a file of their own.
            if parts == ["mod"] || parts.last() == Some(&"tests") {
                continue;
            }
            let depth = parts.len() - 1 - usize::from(parts.last() == Some(&"mod"));
            let text = fs::read_to_string(&path).unwrap();
            let names = found.entry(parts[0].to_owned()).or_default();
            names.extend(imports(room, depth, &text));
            names.remove(parts[0]);
        }
    }
    found
}

/// A circle, from one of its modules back to it.
fn circle(imports: &Imports) -> Option<Vec<String>> {
    fn walk(imports: &Imports, way: &mut Vec<String>, done: &mut BTreeSet<String>) -> bool {
        let at = way.last().unwrap().clone();
        for next in imports.get(&at).into_iter().flatten() {
            let is_back = way.contains(next);
            way.push(next.clone());
            if is_back || (!done.contains(next) && walk(imports, way, done)) {
                return true;
            }
            way.pop();
        }
        done.insert(at);
        false
    }
    let mut done = BTreeSet::new();
    imports.keys().find_map(|module| {
        let mut way = vec![module.clone()];
        walk(imports, &mut way, &mut done).then_some(way)
    })
}

#[test]
fn rooms_have_no_circle_of_imports() {
    for room in ROOMS {
        let imports = of_room(room);
        let edges: usize = imports.values().map(BTreeSet::len).sum();
        assert!(edges > 5, "{room}: {imports:?}");
        assert_eq!(circle(&imports), None, "{room}");
    }
}

#[test]
fn a_circle_is_found_however_it_is_written() {
    let found = |texts: &[(&str, &str)]| {
        let of = |(name, text): &(&str, &str)| {
            let names = imports("room", 0, text).into_iter().collect();
            ((*name).to_owned(), names)
        };
        circle(&texts.iter().map(of).collect())
    };
    let a = ("a", "use super::{\n    b::{self, B},\n    c::C,\n};\n");
    let b = ("b", "fn f() {\n    super::c::g();\n}\n");
    assert_eq!(found(&[a, b, ("c", "use super::d;\n")]), None);
    for back in [
        "use super::a::A;\n",
        "use crate::room::{d::D, a::A};\n",
        "fn f() -> super::b::B {}\n",
    ] {
        assert!(found(&[a, b, ("c", back)]).is_some(), "{back}");
    }
    // What a comment or a unit test names is no import.
    for other in [
        "// use super::a;\n",
        "#[cfg(test)]\nmod tests {\n    use super::a;\n}\n",
    ] {
        assert_eq!(found(&[a, b, ("c", other)]), None, "{other}");
    }
    assert_eq!(
        imports("room", 1, "use super::super::a;\nuse super::own;\n"),
        ["a"]
    );
}
