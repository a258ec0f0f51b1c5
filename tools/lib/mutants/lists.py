"""The lists in tests/mutants: read and checked against the tree."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

KEYS = {"name", "file", "from", "to", "caught_by", "survives"}


class Mistake(Exception):
    """What is wrong with a list, the build or a test, so that no result could be trusted."""


@dataclass(frozen=True)
class Mutant:
    """One fault: `before` stands exactly once in `file`, on one line, and `after` takes its place."""

    number: int
    area: str
    name: str
    file: str
    before: str
    after: str
    caught_by: tuple[str, ...]
    reason: str | None

    @property
    def is_shader(self) -> bool:
        return self.file.endswith(".wgsl")


def read(root: Path) -> list[Mutant]:
    """All mutants of all lists, numbered from 1. Raises Mistake with every fault that was found."""
    mutants: list[Mutant] = []
    faults: list[str] = []
    for path in sorted((root / "tests/mutants").glob("*.toml")):
        for entry in tomllib.loads(path.read_text()).get("mutant", []):
            unknown = set(entry) - KEYS
            missing = {"name", "file", "from", "to"} - set(entry)
            if unknown or missing:
                faults.append(f"{path.name}: {entry.get('name')}: unknown {unknown or '-'}, missing {missing or '-'}")
                continue
            mutant = Mutant(
                len(mutants) + 1,
                path.stem,
                entry["name"],
                entry["file"],
                entry["from"],
                entry["to"],
                tuple(entry.get("caught_by", [])),
                entry.get("survives"),
            )
            fault = fault_of(root, mutant)
            if fault:
                faults.append(f"{path.name}: {mutant.name}: {fault}")
            mutants.append(mutant)
    names = [mutant.name for mutant in mutants]
    faults += [f"{name} is there twice" for name in sorted({n for n in names if names.count(n) > 1})]
    if faults:
        raise Mistake("the lists are not in order:\n  " + "\n  ".join(faults))
    return mutants


def fault_of(root: Path, mutant: Mutant) -> str | None:
    """What is wrong with one entry, in words; None where nothing is."""
    if not mutant.file.startswith(("src/", "shaders/")) or not (root / mutant.file).is_file():
        return f"{mutant.file} is no file under src/ or shaders/"
    if "\n" in mutant.before + mutant.after or not mutant.before.strip():
        return "`from` and `to` are parts of one line"
    count = (root / mutant.file).read_text().count(mutant.before)
    if count != 1:
        return f"`{mutant.before}` stands {count} times in {mutant.file}, and has to stand there once"
    if mutant.before == mutant.after:
        return "`to` is `from`"
    if not mutant.is_shader and not (is_expression(mutant.before) and is_expression(mutant.after)):
        return "a Rust `from` and its `to` are complete expressions"
    if bool(mutant.caught_by) == bool(mutant.reason):
        return "either caught_by or survives"
    for name in mutant.caught_by:
        if not is_test(root, name):
            return f"there is no test {name}; caught_by is TEST_BINARY::test::path"
    return None


def is_expression(text: str) -> bool:
    """Whether a line of Rust may be one: it opens what it closes, and is no statement. What else is wrong the compiler says."""
    is_balanced = all(text.count(opened) == text.count(closed) for opened, closed in ("()", "[]", "{}"))
    return is_balanced and not text.rstrip().endswith((";", ",")) and not text.lstrip().startswith(("let ", "const ", "<", ">", "."))


def is_test(root: Path, name: str) -> bool:
    """Whether a function of that name stands in the file that the path before it leads to."""
    binary, *modules, function = name.split("::")
    folder = root / ("src" if binary == "lib" else f"tests/{binary}")
    for depth in range(len(modules), 0, -1):
        module = folder.joinpath(*modules[:depth])
        for file in (module.with_suffix(".rs"), module / "mod.rs", module / "lib.rs"):
            if file.is_file():
                return f"fn {function}(" in file.read_text()
    return False
