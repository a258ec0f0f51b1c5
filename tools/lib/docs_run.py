"""Runs the fenced command blocks of Markdown pages: see tools/lib/docs-run.

A block is marked by an HTML comment on the line before it, parts with ` | ` between them:

    <!-- run -->                         runs as it stands
    <!-- run | 1-72 => 1-4 | ... -->     runs with one text replaced by another wherever it stands in the block
    <!-- run | first COMMAND -->         COMMAND makes what the block takes as given
    <!-- run | makes PATH PATH -->       files or folders that are there when it has run, and were not before
    <!-- run | exits 5 -->               the exit code that the page tells of
    <!-- not run: REASON -->
    <!-- file: NAME | OLD => NEW -->     the reader saves this block as NAME, and so does the runner
    <!-- more of: NAME -->               the reader adds this block to NAME
    <!-- file at start: NAME -->         the same, before the page's first command

Every block of commands needs a mark; blocks of TOML and the like may have one. A page's blocks share a folder, its variables and the current directory.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = {"sh", "bash", "shell", "console", "zsh", "python", "py", "powershell"}
DATA = {"", "toml", "text", "json", "obj", "csv", "wgsl", "rust", "diff"}
# How a line of commands begins: outside of a block that says it is one, nothing would run it.
A_COMMAND = re.compile(r"(\$ )?(swell|target/release/swell|tools/\S+|cargo|pip|python3?|blender|openjd|git) \S")
FENCE = re.compile(r"^( *)(`{3,}|~{3,})([^`]*)$")
MARK = re.compile(r"^ *<!-- *(run|not run|file at start|file|more of)\b *:? *(.*?) *-->$")
LIMIT_S = 300
# Files of the tree that pages name, made small enough for seconds: text to be replaced, and what by.
LOOK = [(r"(?m)^width = \d+", "width = 160"), (r"(?m)^height = \d+", "height = 90"), (r"(?m)^samples = \d+", "samples = 1")]
SMALL = {
    "scenes/quickstart.toml": [("particle_spacing = 0.17", "particle_spacing = 0.5"), ("cell_size = 0.34 ", "cell_size = 1.0 ")],
    "scenes/wave-city.toml": [("frames = 240", "frames = 24"), ("particle_spacing = 0.1", "particle_spacing = 0.4"), ("cell_size = 0.2 ", "cell_size = 0.8 ")],
    "scenes/dam-break.toml": [("particle_spacing = 0.05", "particle_spacing = 0.2"), ("cell_size = 0.1 ", "cell_size = 0.4 ")],
    "scenes/storm.toml": [("particle_spacing = 0.15", "particle_spacing = 0.3"), ("cell_size = 0.2\n", "cell_size = 0.5\n")],
    "scenes/droplets.toml": [("cell_size = 0.001 ", "cell_size = 0.002 ")],
} | {f"scenes/looks/{path.name}": LOOK for path in (ROOT / "scenes/looks").glob("*.toml")}
# What pages take as given: what README's first command has made by then, and the bake of the other scene that they speak of.
GIVEN = "swell bake scenes/quickstart.toml && swell whitewater cache/quickstart/pbf && swell bake scenes/wave-city.toml"
TAKES = re.compile("cache/(quickstart|wave-city)")


class Fault(Exception):
    """Something to be put right, with its page and line."""


@dataclass
class Block:
    """A fenced block. `line` is that of its opening fence, from 1."""

    page: str
    line: int
    language: str
    text: str
    mark: str | None = None
    told: str = ""
    first: list[str] = field(default_factory=list)
    makes: list[str] = field(default_factory=list)
    exits: int = 0

    @property
    def place(self) -> str:
        return f"{self.page}:{self.line}"

    def read_mark(self, as_written: bool) -> None:
        """Takes the mark's parts apart, and applies the replacements, unless the block is to run as it is written."""
        head, *parts = [self.told] if self.mark == "not run" else re.split(r"(?:^| +)\| +", self.told)
        self.told = head
        if self.mark == "run" and head:
            raise Fault(f"{self.place}: `{head}` in its mark is no part of one")
        if self.mark != "run" and not head:
            raise Fault(f"{self.place}: `{self.mark}` needs " + ("a reason" if self.mark == "not run" else "a name"))
        for part in parts:
            word, _, rest = part.partition(" ")
            if " => " in part:
                old, new = part.split(" => ")
                if old not in self.text:
                    raise Fault(f"{self.place}: `{old}` is to be replaced and is not in the block")
                if not as_written:
                    self.text = self.text.replace(old, new)
            elif self.mark == "run" and word == "first":
                self.first.append(rest)
            elif self.mark == "run" and word == "makes":
                self.makes += [] if as_written else rest.split()
            elif self.mark == "run" and word == "exits" and rest.isdigit():
                self.exits = int(rest)
            else:
                raise Fault(f"{self.place}: `{part}` in its mark is no part of one")


def blocks_of(page: str, text: str, as_written: bool = False) -> list[Block]:
    """The page's blocks. A command that stands in none, and a block of commands without a mark, are faults."""
    blocks: list[Block] = []
    opened: re.Match[str] | None = None
    before = ""
    for number, line in enumerate(text.splitlines(), 1):
        fence = FENCE.match(line)
        if opened:
            if fence and fence[2].startswith(opened[2]) and not fence[3].strip():
                opened = None
            else:
                blocks[-1].text += line.removeprefix(opened[1]) + "\n"
            continue
        if fence:
            opened = fence
            blocks.append(Block(page, number, fence[3].strip(), ""))
            if marked := MARK.match(before):
                blocks[-1].mark, blocks[-1].told = marked[1], marked[2]
        elif re.match(r"^( {4,}|\t)", line) and A_COMMAND.match(line.strip()) and not before.lstrip().startswith("-"):
            raise Fault(f"{page}:{number}: a command outside of a fenced block, which nothing runs")
        elif MARK.match(before):
            raise Fault(f"{page}:{number}: a mark that is on no block")
        before = line
    if opened:
        raise Fault(f"{blocks[-1].place}: a block without an end")
    for block in blocks:
        check(block, as_written)
    return blocks


def check(block: Block, as_written: bool) -> None:
    """The block's language and mark."""
    if block.language not in COMMANDS | DATA:
        raise Fault(f"{block.place}: `{block.language}` is no language that docs_run.py knows to be commands or not")
    if block.language in COMMANDS and block.mark is None:
        raise Fault(f"{block.place}: a block of commands without a mark: `<!-- run -->` or `<!-- not run: why -->` on the line before")
    if block.language in DATA and any(A_COMMAND.match(line) for line in block.text.splitlines()):
        raise Fault(f"{block.place}: a block of commands that does not say so: write its language, as in ```sh")
    if block.mark == "run" and block.language not in {"sh", "bash"}:
        raise Fault(f"{block.place}: only sh is run")
    if block.mark:
        block.read_mark(as_written)


def copy_tree(room: Path, small: bool) -> None:
    """A copy of what pages name of the tree, small or as it is."""
    for folder in ("scenes", "shaders", "tools"):
        shutil.copytree(ROOT / folder, room / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for name, replacements in SMALL.items() if small else ():
        text = (room / name).read_text()
        for old, new in replacements:
            pattern = old if old.startswith("(?m)") else re.escape(old)
            text, times = re.subn(pattern, new, text)
            if not times:
                raise Fault(f"{name}: `{old}` is to be made small and is not there: see SMALL in tools/lib/docs_run.py")
        (room / name).write_text(text)


def bash(script: str, folder: Path, program: Path, limit_s: float = LIMIT_S) -> tuple[int, str]:
    """Runs a script; its exit code and all that it printed. The exit code of a script over the limit is 124."""
    search = f"{program.parent}{os.pathsep}{os.environ['PATH']}"
    process = subprocess.Popen(
        ["bash", "-c", script], cwd=folder, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        env=os.environ | {"PATH": search, "CDPATH": "", "HOME": str(folder)}, start_new_session=True,
    )
    try:
        said, _ = process.communicate(timeout=limit_s)
        return process.returncode, said
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        said, _ = process.communicate()
        return 124, f"{said}\nstill ran after {limit_s:.0f} s"


class Page:
    """A page's folder: what the shell had when the last block ended is there for the next."""

    def __init__(self, folder: Path, state: Path, program: Path, limit_s: float = LIMIT_S) -> None:
        self.folder, self.state, self.program, self.limit_s = folder, state, program, limit_s
        state.mkdir()
        (state / "variables").touch()
        (state / "at").write_text(str(folder))

    def at(self) -> Path:
        return Path((self.state / "at").read_text().rstrip("\n"))

    def save(self, block: Block) -> None:
        path = self.at() / block.told
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a" if block.mark == "more of" else "w") as file:
            file.write(block.text)

    def run(self, block: Block) -> None:
        """Runs a block; a fault names the line that failed."""
        # All that is not the block's own is on the script's first line, so that bash's line numbers are the block's, plus one.
        before = (
            f'. {self.state}/variables; cd "$(cat {self.state}/at)"; set -eE -o pipefail; '
            f"trap 'echo $((LINENO - 1)) >{self.state}/line' ERR; rm -f {self.state}/line; "
            f"trap 'code=$?; trap - ERR; export -p >{self.state}/variables; pwd >{self.state}/at; exit $code' EXIT; "
        )
        start = self.at()
        if block.first:
            code, said = bash(before + "\n" + "\n".join(block.first) + "\n", self.folder, self.program, self.limit_s)
            if code:
                raise Fault(f"{block.place}: `first` of its mark: exit code {code}\n{said}")
        for path in block.makes:
            if (start / path).exists():
                raise Fault(f"{block.place}: {path} is there before the block has run")
        code, said = bash(before + "\n" + block.text, self.folder, self.program, self.limit_s)
        if code != block.exits:
            line = self.state / "line"
            number = block.line + (int(line.read_text()) if line.exists() else 1)
            wanted = f", {block.exits} was promised" if block.exits else ""
            raise Fault(f"{block.page}:{number}: exit code {code}{wanted}, in the block of line {block.line}\n{block.text}--\n{said}")
        for path in block.makes:
            if not (start / path).exists():
                raise Fault(f"{block.place}: {path} is promised and not there")


def run_page(blocks: list[Block], page: Page, told: bool = True) -> None:
    """Does with each block what its mark says, and tells how long commands took."""
    for block in blocks:
        if block.mark == "file at start":
            page.save(block)
    for block in blocks:
        if block.mark in ("file", "more of"):
            page.save(block)
        elif block.mark == "run":
            start = time.monotonic()
            page.run(block)
            if told:
                print(f"  {time.monotonic() - start:5.1f} s  {block.place}", flush=True)


# Pages with a fault each, and what has to be said of it; {} is the page's name.
CONTROLS = [
    ("# a\n\n<!-- run -->\n```sh\ntrue\nls no-such-file |\n  cat\n```\n", "{}:7: exit code 2"),
    ("<!-- run -->\n```sh\nls $HOME/no-such-file\n```\n", "{}:3: exit code 2"),
    ("<!-- run | exits 5 -->\n```sh\ntrue\n```\n", "exit code 0, 5 was promised"),
    ("<!-- run -->\n```sh\nsleep 60\n```\n", "still ran after"),
    ("<!-- run | makes b -->\n```sh\ntouch a\n```\n", "{}:2: b is promised and not there"),
    ("<!-- run | makes . -->\n```sh\ntouch a\n```\n", "{}:2: . is there before"),
    ("<!-- run | first false -->\n```sh\ntrue\n```\n", "{}:2: `first`"),
    ("\n```sh\ntrue\n```\n", "{}:2: a block of commands without a mark"),
    ("<!-- seen -->\n```sh\ntrue\n```\n", "{}:2: a block of commands without a mark"),
    ("<!-- not run: -->\n```sh\ntrue\n```\n", "{}:2: `not run` needs a reason"),
    ("<!-- run | ab => c -->\n```sh\ntrue\n```\n", "{}:2: `ab` is to be replaced"),
    ("<!-- run | make b -->\n```sh\ntrue\n```\n", "{}:2: `make b` in its mark"),
    ("<!-- run slowly -->\n```sh\ntrue\n```\n", "{}:2: `slowly` in its mark"),
    ("```\nswell bake scene.toml\n```\n", "{}:1: a block of commands that does not say so"),
    ("Run:\n\n    swell bake scene.toml\n", "{}:3: a command outside"),
    ("```fortran\n```\n", "{}:1: `fortran` is no language"),
    ("<!-- run -->\n\n```sh\ntrue\n```\n", "{}:2: a mark that is on no block"),
    ("```toml\na = 1\n", "{}:1: a block without an end"),
]
# A page without a fault: variables, the directory and files go on from block to block.
SOUND = (
    "<!-- file at start: d/late.toml -->\n```toml\nlate = 1\n```\n<!-- run | b => d -->\n```sh\ncd b\nexport V=1\n```\n<!-- file: new.toml -->\n"
    "```toml\na = 1\n```\nText.\n  <!-- more of: new.toml | 2 => 3 -->\n  ```toml\n  b = 2\n  ```\n<!-- run | makes two -->\n~~~sh\ntest $V = 1\n"
    "grep 'late = 1' late.toml\nprintf 'a = 1\\nb = 3\\n' | cmp - new.toml\ntouch two\n~~~\n<!-- run | exits 1 -->\n```sh\nfalse\n```\n"
)


def hold_controls(room: Path) -> None:
    """The faults are found, each by its place, and a sound page has none."""
    for number, (text, wanted) in enumerate([*CONTROLS, (SOUND, "")]):
        name, folder = f"control-{number}.md", room / f"control-{number}"
        folder.mkdir()
        told = ""
        try:
            run_page(blocks_of(name, text), Page(folder, room / f"state-{number}", room / "swell", 0.5), told=False)
        except Fault as fault:
            told = str(fault)
        if wanted.replace("{}", name) not in told or bool(told) != bool(wanted):
            raise Fault(f"control {number} of tools/lib/docs_run.py: `{wanted}` was to be said; was: `{told}`")


def run_pages(pages: list[list[Block]], program: Path, room: Path, as_written: bool) -> None:
    """Runs what is marked so, and goes on with the next page after a fault."""
    programs = room / "programs"
    programs.mkdir()
    (programs / "swell").symlink_to(program)
    given, limit_s = room / "given", 7200 if as_written else LIMIT_S
    given.mkdir()
    copy_tree(given, small=not as_written)
    (given / "target/release").mkdir(parents=True)
    (given / "target/release/swell").symlink_to(program)
    if any(TAKES.search(block.text) for blocks in pages for block in blocks if block.mark == "run"):
        start = time.monotonic()
        code, said = bash(GIVEN, given, programs / "swell", limit_s)
        if code:
            raise Fault(f"tools/lib/docs_run.py: `{GIVEN}` ends with {code}:\n{said}")
        print(f"  {time.monotonic() - start:5.1f} s  what pages take as given", flush=True)

    def one(number: int, blocks: list[Block]) -> str | None:
        if not any(block.mark == "run" for block in blocks):
            return None
        folder = room / f"page-{number}"
        shutil.copytree(given, folder, symlinks=True)
        fault = None
        try:
            run_page(blocks, Page(folder, room / f"page-state-{number}", programs / "swell", limit_s))
        except Fault as found:
            print(f"FAILED: {found}", file=sys.stderr, flush=True)
            fault = str(found).splitlines()[0]
        if not as_written:
            shutil.rmtree(folder)
        return fault

    # Pages share nothing but what they take as given. A reader runs one at a time.
    with ThreadPoolExecutor(1 if as_written else os.cpu_count()) as pool:
        faults = [fault for fault in pool.map(one, range(len(pages)), pages) if fault]
    if faults:
        raise Fault("\n".join(faults))


def tell(blocks: list[Block]) -> None:
    """How many blocks there are, and each that is not run, with why."""
    for block in blocks:
        if block.mark == "not run":
            print(f"  not run  {block.place}: {block.told}")
    count = {mark: sum(block.mark == mark for block in blocks) for mark in ("run", "not run")}
    print(f"docs run: {count['run']} blocks run, {count['not run']} not run, each for the reason told")


def main() -> int:
    parser = argparse.ArgumentParser(prog="tools/lib/docs-run", description="Runs the command blocks of README.md and docs/*.md.")
    parser.add_argument("--swell", type=Path, default=ROOT / "target/release/swell", help="the program")
    parser.add_argument("--list", action="store_true", help="every block, and what is done with it")
    parser.add_argument("--as-written", type=Path, metavar="FOLDER", help="as a reader would, at full size, in this new folder, and keep it")
    parser.add_argument("pages", nargs="*", help="such as docs/look.md; all where left out")
    arguments = parser.parse_args()
    names = arguments.pages or ["README.md", *sorted(str(path.relative_to(ROOT)) for path in (ROOT / "docs").glob("*.md"))]
    try:
        pages = [blocks_of(name, (ROOT / name).read_text(), arguments.as_written is not None) for name in names]
        every = [block for blocks in pages for block in blocks]
        if not arguments.pages and not any(block.mark == "run" for block in every):
            raise Fault("nothing is run in all of the documentation")
        if arguments.list:
            for block in every:
                if block.mark:
                    print(f"{block.place}: {block.mark} {block.told}")
            return 0
        program = arguments.swell.resolve()
        if not os.access(program, os.X_OK):
            print(f"docs run: {program} is not there: cargo build --release", file=sys.stderr)
            return 3
        with tempfile.TemporaryDirectory(prefix="docs-run-") as room:
            hold_controls(Path(room))
            kept = arguments.as_written
            if kept:
                kept.mkdir(parents=True)
            run_pages(pages, program, kept.resolve() if kept else Path(room), kept is not None)
    except Fault as fault:
        print(f"docs run: FAILED\n{fault}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"docs run: {error}", file=sys.stderr)
        return 2
    tell(every)
    return 0


if __name__ == "__main__":
    sys.exit(main())
