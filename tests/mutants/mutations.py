"""Small faults to plant in a source: each changes one place of one line.

The sources' one format tells what a sign is: an operator of two operands stands between blanks, in
C, C++ and Python alike, and what is a type or a template does not.
"""

import io
import re
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

# Texts that are found, between blanks or as a word, and their faults.
OPERATORS = {
    "<": "<=",
    "<=": "<",
    ">": ">=",
    ">=": ">",
    "==": "!=",
    "!=": "==",
    "+": "-",
    "-": "+",
    "*": "/",
    "/": "*",
    "&&": "||",
    "||": "&&",
    "+=": "-=",
    "-=": "+=",
    "and": "or",
    "or": "and",
    "<<": ">>",
    ">>": "<<",
    "&": "|",
    "|": "&",
}
WORDS = {
    "true": "false",
    "false": "true",
    "True": "False",
    "False": "True",
    "std::min": "std::max",
    "std::max": "std::min",
    "break": "continue",
}
_OPERATOR = re.compile(
    r"(?<=[ ])(" + "|".join(map(re.escape, sorted(OPERATORS, key=len, reverse=True))) + r")(?= )"
)
_WORD = re.compile(r"(?<![\w.])(" + "|".join(map(re.escape, WORDS)) + r")(?!\w)")
_NUMBER = re.compile(r"(?<![\w.\"'#])(\d+)(?![\w.\"'])")
_NOT = re.compile(r"(?<=[ (])!(?=[\w(])|\bnot (?!in\b)")
# A statement that is a whole line: a call, or an assignment to what is there already.
_C_CALL = re.compile(r"^\s+[\w.>\-\[\]:*]+(\(.*\)|\+\+|--| [-+*/|&]?= .+);$")
_PY_CALL = re.compile(r"^\s+[\w.\[\]]+(\(.*\)| [-+*/|&]?= .+)$")
# The larger or smaller of two, and their distance: with = or without it is the same.
_EITHER = re.compile(r"([\w.>\-]+) [<>]=? ([\w.>\-]+) \? (\1 : \2|\2 : \1|\1 - \2 : \2 - \1)\b")
# prefetch: brings memory into the cache, and changes no result.
_SKIPPED = re.compile(
    r".*prefetch|^\s*(#|static_assert|using |namespace |import |from |template|assert)"
)
_C_TEXT = re.compile(r'//.*|"(\\.|[^"\\])*"|\'(\\.|[^\'\\])*\'')


@dataclass(frozen=True)
class Mutation:
    """One fault: in `line` (from 1) of `file`, `column` (from 0), `old` becomes `new`."""

    file: str
    line: int
    column: int
    old: str
    new: str
    text: str  # the whole line before, stripped
    indent: int  # blanks in front of it

    def of(self, source: str) -> str:
        """The source with this fault."""
        lines = source.split("\n")
        line = lines[self.line - 1]
        assert line[self.column :].startswith(self.old), (self, line)
        end = self.column + len(self.old)
        lines[self.line - 1] = line[: self.column] + self.new + line[end:]
        return "\n".join(lines)

    @property
    def after(self) -> str:
        """The line with the fault, stripped; with `text` it names the place in a changed file."""
        at = self.column - self.indent
        return self.text[:at] + self.new + self.text[at + len(self.old) :]


def mutations(root: Path, file: str) -> list[Mutation]:
    """All faults of a file, in the order of the text."""
    source = (root / file).read_text()
    code = _python_code(source) if file.endswith(".py") else _c_code(source)
    found = []
    before = ""
    for number, line in enumerate(code, start=1):
        if line.strip() and not _SKIPPED.match(line):
            original = source.split("\n")[number - 1]
            indent = len(original) - len(original.lstrip())
            for column, old, new in _places(line, before, python=file.endswith(".py")):
                whole = original[column : column + len(old)]
                found.append(Mutation(file, number, column, whole, new, original.strip(), indent))
        if line.strip():
            before = line.strip()
    return found


def _places(line: str, before: str, *, python: bool) -> Iterator[tuple[int, str, str]]:
    same = _EITHER.search(line)
    for match in _OPERATOR.finditer(line):
        if same and same.start() < match.start() < line.index("?", same.start()):
            continue
        # Python joins types and flags with | and &, C without blanks writes references.
        if not (python and match[0] in ("|", "&", "*", "/") and _is_signature(line)):
            yield match.start(), match[0], OPERATORS[match[0]]
    for match in _WORD.finditer(line):
        if not _is_signature(line):
            yield match.start(), match[0], WORDS[match[0]]
    for match in _NUMBER.finditer(line):
        yield match.start(), match[0], {"0": "1", "1": "2"}.get(match[0], str(2 * int(match[0])))
    for match in _NOT.finditer(line):
        yield match.start(), match[0], ""
    whole = (_PY_CALL if python else _C_CALL).match(line)
    if whole and (python or before.endswith((";", "{", "}", ")", ":", "else"))):
        start = len(line) - len(line.lstrip())
        if not (python and _opens_bracket(line)) and not line.strip().startswith("return"):
            yield start, line[start:].rstrip(), "pass" if python else "(void)0;"


def _is_signature(line: str) -> bool:
    return bool(re.match(r"^\s*(async )?(def|class) ", line)) or "->" in line.partition("(")[0]


def _opens_bracket(line: str) -> bool:
    return any(line.count(a) != line.count(b) for a, b in ("()", "[]", "{}"))


def _c_code(source: str) -> list[str]:
    """The lines with comments and texts blanked, so that columns stay."""

    def blank(match: re.Match[str]) -> str:
        return re.sub(r"[^\n]", " ", match[0])

    source = re.sub(r"/\*.*?\*/", blank, source, flags=re.DOTALL)
    return [_C_TEXT.sub(blank, line) for line in source.split("\n")]


def _python_code(source: str) -> list[str]:
    lines = source.split("\n")
    texts = (tokenize.STRING, tokenize.COMMENT)
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in texts:
            continue
        (first, begin), (last, end) = token.start, token.end
        for number in range(first, last + 1):
            line = lines[number - 1]
            left = begin if number == first else 0
            right = end if number == last else len(line)
            lines[number - 1] = line[:left] + " " * (right - left) + line[right:]
    return lines
