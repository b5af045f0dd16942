"""Every citation leads to a heading: "hardware.md 1.6" in a comment, an anchor in a document."""

import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from .tree import ROOT, plant, texts

# A page, and the sections of it that are named: "1.6", "1.3, 1.4", "1.2 to 1.6 and 2".
NUMBER = r"\d+(?:\.\d+)*"
PAGE = re.compile(
    r"(?<![\w/.-])((?:\.\./|\./)*(?:[\w-]+/)*[\w-]+\.md)(?![\w-])"
    rf"(?: ({NUMBER}(?:(?:,| to| and|, and) {NUMBER}(?![\w%]))*))?"
)
LINK = re.compile(r"\]\(([^()\s#]*)(#[^()\s]*)?\)")  # sections may be named behind it, too
HEADING = re.compile(r"^#+ +(.*?)\s*$", re.MULTILINE)
CODE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
# Marks before the text of a comment's next line.
CONTINUED = re.compile(r"\n[ \t]*(?:///?<?|#+|\*(?!/))?[ \t]*")


def headings(text: str) -> list[str]:
    """Headings of a Markdown text, without those in blocks of code."""
    return HEADING.findall(CODE.sub("", text))


def sections(text: str) -> set[str]:
    """The numbers of its headings, "1" and "1.6". An item of a list cannot be searched for."""
    return {match[0] for heading in headings(text) if (match := re.match(NUMBER, heading))}


def anchors(text: str) -> set[str]:
    """Anchors that a link may name behind its hash."""
    found: set[str] = set()
    for heading in headings(text):
        anchor = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        same = (f"{anchor}-{n}" for n in range(1, len(found) + 1))
        found.add(anchor if anchor not in found else next(a for a in same if a not in found))
    return found


def page_of(root: Path, citing: Path, name: str) -> Path | None:
    """The page that `name` means in the file `citing`: beside it, in docs/, or from the top."""
    for folder in (citing.parent, Path("docs"), Path()):
        page = Path(os.path.normpath(folder / name))
        if (root / page).is_file():
            return page
    return None


def bad_citations(root: Path) -> Iterator[str]:
    """Citations by name: pages that are not there, and sections that they do not have."""
    for path, text in texts(root):
        if path.name == Path(__file__).name:
            continue  # it is full of planted ones
        prose = CONTINUED.sub(" ", text) if path.suffix != ".md" else text.replace("\n", " ")
        prose = LINK.sub(r"](\1", re.sub(r"\w+://\S+", "", prose))
        for name, numbers in PAGE.findall(prose):
            page = page_of(root, path, name)
            if page is None:
                yield f"{path}: cites {name}, which is not there"
            elif numbers:
                known = sections((root / page).read_text(encoding="utf-8"))
                for number in re.findall(NUMBER, numbers):
                    if number not in known:
                        yield f"{path}: cites {name} {number}, which has no such section"


def bad_links(root: Path) -> Iterator[str]:
    """Links of documents: files that are not there, and anchors that no heading makes."""
    for path, text in texts(root):
        for target, anchor in LINK.findall(text) if path.suffix == ".md" else ():
            if "://" in target:
                continue
            page = root / os.path.normpath(path.parent / target) if target else root / path
            if not page.exists():
                yield f"{path}: links to {target}, which is not there"
            elif anchor and anchor[1:] not in anchors(page.read_text(encoding="utf-8")):
                yield f"{path}: links to {target}{anchor}, which no heading makes"


Rule = Callable[[Path], Iterator[str]]
RULES: list[Rule] = [bad_citations, bad_links]


@pytest.mark.parametrize("rule", RULES)
def test_every_citation_of_the_tree_leads_to_a_heading(rule: Rule) -> None:
    assert list(rule(ROOT)) == []


def test_citations_are_seen() -> None:
    """A pattern that finds nothing would find nothing wrong."""
    cited = [
        match
        for path, text in texts(ROOT)
        if path.parts[0] in {"emulator", "firmware", "kilogrid_modules"}
        for match in PAGE.findall(CONTINUED.sub(" ", text))
    ]
    assert len([1 for name, numbers in cited if name == "hardware.md" and numbers]) > 30


GOOD = {
    "docs/facts.md": "# Facts\n\n## 1. Radio\n\n### 1.6 Timing, and more\n\n"
    "```\n# 3 no heading\n```\n### 1.7 Chance\n\nSee [above](#16-timing-and-more).\n\n"
    "## 2. Rules\n\n1. One.\n2. Two.\n",
    "docs/page.md": "# Page\n\nAs [facts](facts.md#17-chance) say, and facts.md 1.6,\n1.7 too;\n"
    "as do [they](facts.md) 1.7 and 2.\n",
    "emulator/x.h": "/// Waits (facts.md\n/// 1.6 to 1.7).\n// As docs/page.md says, 5 times.\n",
    "tools/y.py": '"""Numbers, facts.md 1: 18 ticks."""\n# facts.md\n# 1.7, 2.\n',
}


@pytest.mark.parametrize("rule", RULES)
def test_a_good_tree_passes(rule: Rule, tmp_path: Path) -> None:
    assert list(rule(plant(tmp_path, GOOD))) == []


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("emulator/x.h", "// facts.md 1.8\n"),
        ("emulator/x.h", "/// (facts.md\n/// 3)\n"),
        ("emulator/x.h", "/// (facts.md 2.1)\n"),
        ("emulator/x.h", "// facts.md 1.6, 1.9\n"),
        ("emulator/x.h", "// facts.md 1.6 to 1.9\n"),
        ("emulator/x.h", "// facts.md 3: a comment of shell is no heading\n"),
        ("emulator/x.h", "// hardware.md 1\n"),
        ("tools/y.py", '"""docs/nowhere.m' + 'd"""\n'),
        ("docs/page.md", "facts.md\n1.9\n"),
        ("docs/page.md", "([facts](facts.md) 2.1)\n"),
        ("docs/page.md", "[facts](facts.md#17-chance) 1.7, 1.9\n"),
        ("docs/page.md", "[facts](fact.md)\n"),
        ("docs/page.md", "[facts](facts.md#16-timing)\n"),
        ("docs/page.md", "[here](#there)\n"),
    ],
)
def test_a_planted_bad_citation_is_caught(name: str, text: str, tmp_path: Path) -> None:
    plant(tmp_path, GOOD)
    plant(tmp_path, {name: text})
    found = {line for rule in (bad_citations, bad_links) for line in rule(tmp_path)}
    assert len({line.split(":")[0] for line in found}) == 1, found
    assert all(line.startswith(name) for line in found)
