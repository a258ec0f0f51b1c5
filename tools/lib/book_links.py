"""Checks the links, anchors and pictures of a site: book_links.py FOLDER. Prints the dead ones; then the exit code is 1."""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# Pages that mdbook derives from the others, with their links.
DERIVED = {"print.html", "404.html", "toc.html"}


class Page(HTMLParser):
    """What a page refers to, and what may be referred to in it."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        for name, value in attributes:
            if name in ("href", "src") and value:
                self.links.append(value)
            elif name == "id" and value:
                self.anchors.add(value)


def dead(folder: Path) -> tuple[int, list[str]]:
    """The number of links within a site, and those that lead nowhere, each behind its page's name."""
    pages = {file.resolve(): Page(file) for file in folder.glob("**/*.html")}
    count, found = 0, []
    for file, page in pages.items():
        if file.name in DERIVED:
            continue
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            count += 1
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            anchors = pages[target].anchors if target in pages else {""}
            if not target.exists() or unquote(parts.fragment) not in anchors | {""}:
                found.append(f"{file.name}: {link}")
    return count, found


def main() -> int:
    if len(sys.argv) != 2:
        print("usage: book_links.py FOLDER", file=sys.stderr)
        return 2
    count, found = dead(Path(sys.argv[1]))
    for line in found:
        print(f"dead link: {line}", file=sys.stderr)
    print(f"{count} links, {len(found)} dead")
    return int(bool(found) or count == 0)


if __name__ == "__main__":
    sys.exit(main())
