"""The sources of the documentation site, for `make docs`: a folder that holds all of it.

The README is the landing page and the CHANGELOG a page; docs/*.md are taken as they are. A link
that leads to another file of the tree leads to a copy of that file.
"""

import os
import re
import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "build/docs/source"

# Parts of a browser that the search needs on pages that are opened from a disk.
WORKER = Path(__file__).with_name("iframe-worker.js")

LINK = re.compile(r"(\]\()(?!\w+:)([^)#\s]+)(#[^)\s]*)?(\))")


def main() -> None:
    """Gathers them anew."""
    shutil.rmtree(SOURCE, ignore_errors=True)
    SOURCE.mkdir(parents=True)
    gather(ROOT, SOURCE)


def gather(root: Path, target: Path) -> None:
    """Writes the pages of the tree at `root` into the folder `target`, which is empty.

    FileNotFoundError for a link to nothing.
    """
    shutil.copytree(root / "docs/images", target / "images")
    shutil.copy(WORKER, target)
    pages = {file: target / file.name for file in (root / "docs").glob("*.md")}
    pages |= {root / name: target / name for name in ("README.md", "CHANGELOG.md")}
    for file, page in pages.items():
        page.write_text(relinked(file, root, target, pages), encoding="utf-8")


def relinked(file: Path, root: Path, target: Path, pages: dict[Path, Path]) -> str:
    """The text of a page, whose links lead to where their files are in `target`."""

    def moved(link: re.Match[str]) -> str:
        begin, to, anchor, end = link.groups()
        return f"{begin}{place_of(file.parent / to, root, target, pages)}{anchor or ''}{end}"

    return LINK.sub(moved, file.read_text(encoding="utf-8"))


def place_of(named: Path, root: Path, target: Path, pages: dict[Path, Path]) -> str:
    """Where a file of the tree is, from the pages' folder; one outside the pages is copied."""
    named = Path(os.path.normpath(named))
    if named in pages:
        return pages[named].name
    if named.is_relative_to(root / "docs"):
        return named.relative_to(root / "docs").as_posix()
    copy = target / "files" / named.relative_to(root)
    copy.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(named, copy)
    return copy.relative_to(target).as_posix()


if __name__ == "__main__":
    main()
