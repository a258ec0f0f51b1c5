"""The copy of the tree that holds every Rust fault, and its test binaries."""

import json
import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from .lists import Mistake, Mutant


# Switches of a crate's faults, one of which an environment variable sets.
SWITCH = """
#[doc(hidden)]
pub mod mutants {
    static ON: std::sync::LazyLock<Option<u32>> = std::sync::LazyLock::new(|| {
        let text = std::env::var("SWELL_MUTANT").ok()?;
        Some(text.parse().expect("SWELL_MUTANT is a number"))
    });

    pub fn on(number: u32) -> bool {
        *ON == Some(number)
    }
}
"""
# The shaders that the program has where none are named: those of a folder, never told apart from the shipped ones.
SHIPPED = """    fn default() -> Self {
        Self::SHIPPED
    }
"""
FROM_FOLDER = """    fn default() -> Self {
        static FOLDER: std::sync::LazyLock<Option<Shaders>> = std::sync::LazyLock::new(|| {
            let folder = std::env::var_os("SWELL_SHADERS")?;
            let mut read = Shaders::read(Path::new(&folder)).expect("the whole of shaders/");
            read.hash = None;
            Some(read)
        });
        FOLDER.clone().unwrap_or(Self::SHIPPED)
    }
"""


@dataclass(frozen=True)
class Tree:
    """The copy: `root` holds sources with the Rust faults in them, `shaders` plain ones, `target` the build."""

    root: Path
    shaders: Path
    work: Path
    target: Path


def copy(root: Path, mutants: list[Mutant]) -> Tree:
    """Copies what git tracks or would track; a file is written only where it differs, so that cargo rebuilds little."""
    work = Path(os.environ.get("CARGO_TARGET_DIR", root / "target")).resolve() / "mutants"
    tree = Tree(work / "tree", work / "tree/shaders", work / "run", work / "build")
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=root, check=True, capture_output=True
    )
    names = {name for name in listed.stdout.decode().split("\0") if name and (root / name).is_file()}
    if tree.root.exists():
        for path in tree.root.rglob("*"):
            relative = path.relative_to(tree.root).as_posix()
            if path.is_file() and relative not in names and not relative.startswith(("cache/", "renders/")):
                path.unlink()
    faulty = by_file(mutants)
    for name in sorted(names):
        source, target = root / name, tree.root / name
        data = source.read_bytes()
        if name in faulty:
            data = with_switches(data.decode(), faulty[name]).encode()
        if name.startswith("src/") and name.endswith("/lib.rs"):
            # Warnings would be of the switches: parentheses, a unit in both arms.
            data = b"#![allow(warnings)]\n" + data + SWITCH.encode()
        if name == "src/gpu/shader.rs":
            if data.count(SHIPPED.encode()) != 1:
                raise Mistake(f"{name} has no such default of Shaders any more")
            data = data.replace(SHIPPED.encode(), FROM_FOLDER.encode())
        if not target.exists() or target.read_bytes() != data:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
            shutil.copymode(source, target)
    return tree


def by_file(mutants: list[Mutant]) -> dict[str, list[Mutant]]:
    """Rust faults by the file that they are made in."""
    files: dict[str, list[Mutant]] = {}
    for mutant in mutants:
        if not mutant.is_shader:
            files.setdefault(mutant.file, []).append(mutant)
    return files


def check(root: Path, mutants: list[Mutant]) -> None:
    """Raises Mistake where faults overlap. Writes nothing, so that it may be asked while a run is at work in the copy."""
    for name, own in by_file(mutants).items():
        with_switches((root / name).read_text(), own)


def with_switches(text: str, mutants: list[Mutant]) -> str:
    """Each expression with its faults beside it, chosen at run time."""
    places: dict[str, list[Mutant]] = {}
    for mutant in mutants:
        places.setdefault(mutant.before, []).append(mutant)
    spans = sorted((text.index(before), before) for before in places)
    for (at, before), (next_at, other) in zip(spans, spans[1:]):
        if at + len(before) > next_at:
            raise Mistake(f"{places[before][0].name} and {places[other][0].name} change overlapping text of {mutants[0].file}")
    for at, before in reversed(spans):
        faults = "".join(f"if crate::mutants::on({m.number}) {{ {m.after} }} else " for m in places[before])
        text = text[:at] + f"({faults}{{ {before} }})" + text[at + len(before) :]
    return text


def binary_of(test: str) -> str:
    """What a test's name begins with: `suite`, or `lib::` and the crate whose own test it is."""
    first, second, *_ = test.split("::")
    return f"lib::{second}" if first == "lib" else first


def compile(tree: Tree, tests: set[str]) -> dict[str, Path]:
    """Test binary of each name that `tests` begin with: `suite`, or `lib::` and a crate."""
    binaries = sorted({binary_of(name) for name in tests} | {"suite"})
    crates = [name.removeprefix("lib::") for name in binaries if name != "suite"]
    packages = [word for crate in crates for word in ("-p", f"swell-{crate}")]
    command = ["cargo", "test", "--release", "--locked", "--no-run", "--message-format=json-render-diagnostics"]
    command += ["-p", "swell", *packages, "--lib", "--test", "suite"]
    print(f"compiling {len(binaries)} test binaries with every fault in them", flush=True)
    environment = os.environ | {"CARGO_TARGET_DIR": str(tree.target)}
    done = subprocess.run(command, cwd=tree.root, env=environment, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        raise Mistake("the tree with the faults in it does not compile; a Rust `from` has to be a complete expression")
    found: dict[str, Path] = {}
    for line in done.stdout.splitlines():
        message = json.loads(line)
        if message.get("reason") == "compiler-artifact" and message["profile"]["test"] and message["executable"]:
            is_unit = "lib" in message["target"]["kind"]
            name = message["target"]["name"]
            found[f"lib::{name.removeprefix('swell_')}" if is_unit else name] = Path(message["executable"])
    missing = [name for name in binaries if name not in found]
    if missing:
        raise Mistake(f"no test binary {', '.join(missing)}")
    return found
