//! Modules of a crate import each other without cycles, direct or indirect.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

/// Crates whose modules are free of import cycles.
const CRATES: [&str; 14] = [
    "cache",
    "check",
    "cli",
    "compare",
    "domain",
    "experiment",
    "export",
    "files",
    "reference",
    "render",
    "scene",
    "solve",
    "stage",
    "study",
];

/// Every path of a `use` tree.
fn paths(tree: &str) -> Vec<String> {
    let (Some(open), Some(close)) = (tree.find('{'), tree.rfind('}')) else {
        return vec![tree.trim().to_owned()];
    };
    if close < open {
        return Vec::new();
    }
    let (mut depth, mut items) = (0, vec![String::new()]);
    for c in tree[open + 1..close].chars() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        match (c, items.last_mut()) {
            (',', _) if depth == 0 => items.push(String::new()),
            (c, Some(item)) => item.push(c),
            (_, None) => {}
        }
    }
    let whole = |item: &String| paths(&format!("{}{}", &tree[..open], item.trim()));
    items.iter().flat_map(whole).collect()
}

/// Modules of its crate that a file imports which is `depth` levels deep, without its tests.
fn imports(text: &str, depth: usize, modules: &BTreeSet<String>) -> BTreeSet<String> {
    let code = text.split("\nmod tests {").next().unwrap_or("");
    let is_code = |line: &&str| !line.trim_start().starts_with("//");
    let code: Vec<&str> = code.lines().filter(is_code).collect();
    let code = code.join("\n");
    let prefixes = ["super::".repeat(depth), "crate::".to_owned()];
    let uses = code.split("use ").skip(1);
    let trees = uses.filter_map(|rest| rest.split(';').next());
    let named = trees.flat_map(paths).filter_map(|path| {
        let rest = prefixes.iter().find_map(|way| path.strip_prefix(way))?;
        rest.split("::").next().map(str::to_owned)
    });
    named.filter(|name| modules.contains(name)).collect()
}

/// Collects the imports of each module from the files below `folder`, without those of tests.
fn gather(
    folder: &Path,
    module: Option<&str>,
    depth: usize,
    modules: &BTreeSet<String>,
    found: &mut BTreeMap<String, BTreeSet<String>>,
) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
        if stem == "tests" {
            continue;
        }
        let name = module.unwrap_or(&stem);
        if path.is_dir() {
            gather(&path, Some(name), depth + 1, modules, found);
            continue;
        }
        let is_root = stem == "mod" || (module.is_none() && stem == "lib");
        if module.is_none() && is_root {
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        let below = if is_root { depth - 1 } else { depth };
        let mut all = imports(&text, below, modules);
        all.remove(name);
        found.entry(name.to_owned()).or_default().extend(all);
    }
}

/// Returns a module that reaches itself through imports, with the path.
fn circle(of: &BTreeMap<String, BTreeSet<String>>) -> Option<Vec<String>> {
    fn walk(of: &BTreeMap<String, BTreeSet<String>>, way: &mut Vec<String>) -> Option<Vec<String>> {
        let here = way.last()?.clone();
        for next in of.get(&here).into_iter().flatten() {
            if let Some(from) = way.iter().position(|module| module == next) {
                return Some(way[from..].to_vec());
            }
            way.push(next.clone());
            let found = walk(of, way);
            if found.is_some() {
                return found;
            }
            way.pop();
        }
        None
    }
    of.keys()
        .find_map(|module| walk(of, &mut vec![module.clone()]))
}

/// For each module of a crate, the others that it imports.
fn of_crate(krate: &str) -> BTreeMap<String, BTreeSet<String>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("src")
        .join(krate);
    let names = fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut modules: BTreeSet<_> = names
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    modules.remove("lib");
    let mut found = BTreeMap::new();
    gather(&folder, None, 1, &modules, &mut found);
    found
}

#[test]
fn modules_of_a_crate_import_each_other_without_cycles() {
    for krate in CRATES {
        assert_eq!(circle(&of_crate(krate)), None, "{krate}");
    }
    // Negative controls: the imports are found, also within braces, and one back makes a cycle.
    let mut found = of_crate("files");
    assert!(found["build"].contains("document") && found["document"].contains("key"));
    assert!(found["keys"].contains("look") && found["look"].contains("key"));
    let modules = BTreeSet::from(["document".to_owned()]);
    for nested in [
        "use super::{\n    super::{Reach, document::Document},\n    SceneFile,\n};",
        "use crate::{Reach, document::Document};",
    ] {
        assert_eq!(imports(nested, 2, &modules), modules, "{nested}");
    }
    found
        .get_mut("document")
        .unwrap()
        .insert("build".to_owned());
    let way = circle(&found).unwrap();
    assert!(["build", "document"].map(|name| way.iter().any(|module| module == name)) == [true; 2]);
    let of_cache = of_crate("cache");
    assert!(of_cache["writer"].contains("sink") && of_cache["tables"].contains("ledger"));
}
