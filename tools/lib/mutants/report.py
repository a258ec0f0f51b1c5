"""The table of what caught each mutant."""

from itertools import groupby
from pathlib import Path

from .run import Result

HEAD = """# Mutants

Small faults, most of them of one per cent, that were put into swell one at a time, and the test that caught each. A fault that
no test sees stands with its reason. `tools/mutants --write` makes this page, in a quarter of an hour on 2 cores; the lists are in
`tests/mutants`.

"""


def counts(results: list[Result]) -> str:
    caught = sum(result.caught_by is not None for result in results)
    survived = sum(result.survived for result in results)
    stands = len(results) - caught - survived
    return f"{len(results)} mutants: {caught} caught, {stands} stand with a reason, {survived} survived"


def show(results: list[Result]) -> None:
    """The survivors and the counts."""
    for result in results:
        if result.survived:
            tests = ", ".join(result.mutant.caught_by)
            print(f"SURVIVED: {result.mutant.area}/{result.mutant.name}; not seen by {tests}")
    print(counts(results))


def cell(text: str) -> str:
    return text.replace("|", "\\|")


def row(result: Result) -> str:
    mutant = result.mutant
    caught = f"`{result.caught_by}`" if result.caught_by else (mutant.reason or "**nothing**")
    edit = f"`{mutant.before}` → `{mutant.after}`"
    return f"| {mutant.name} | `{mutant.file}` | {cell(edit)} | {cell(caught)} |"


def write(file: Path, results: list[Result]) -> None:
    """The page, a table for each list."""
    text = HEAD + counts(results) + ".\n"
    for area, rows in groupby(results, key=lambda result: result.mutant.area):
        text += f"\n## {area.capitalize()}\n\n| mutant | file | edit | caught by |\n| --- | --- | --- | --- |\n"
        text += "".join(row(result) + "\n" for result in rows)
    file.parent.mkdir(exist_ok=True)
    file.write_text(text)
    print(f"wrote {file}")
