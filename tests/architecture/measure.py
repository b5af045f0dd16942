"""Measures of sources: comments, code and lengths of functions; C and C++ by a scan of braces."""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass

# One token that matters to the scan, or any other character.
TOKEN = re.compile(
    r"""(?P<line>//[^\n]*)|(?P<block>/\*.*?\*/)
      |R"(?P<tag>[^(\s]*)\(.*?\)(?P=tag)"|"(?:\\.|[^"\\\n])*"
      |(?<![0-9A-Fa-f])'(?:\\.|[^'\\\n])+'""",
    re.VERBOSE | re.DOTALL,
)
ATTRIBUTE = re.compile(r"\b(alignas|__attribute__|decltype)\s*\((?:[^()]|\([^()]*\))*\)")
DIRECTIVE = re.compile(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", re.MULTILINE)


@dataclass
class Function:
    """A function: where it begins, and how many lines its body has, braces not counted."""

    name: str
    line: int
    lines: int


def _blank(text: str) -> str:
    """Spaces in place of every character but line ends."""
    return re.sub(r"[^\n]", " ", text)


def code_of(text: str) -> str:
    """A C source, line by line as it was, without comments and what texts say."""
    code, end = [], 0
    for match in TOKEN.finditer(text):
        token = match[0]
        is_comment = match["line"] or match["block"]
        code.append(text[end : match.start()])
        code.append(_blank(token) if is_comment else '""' + _blank(token[2:]))
        end = match.end()
    return "".join([*code, text[end:]])


@dataclass
class _Scope:
    """An open brace: what it belongs to, and where."""

    kind: str  # "scope": declarations follow, "function", "init": a list of values, "block"
    head: str
    line: int
    brace_line: int


def _kind(head: str, inside: _Scope | None) -> str:
    """Kind of block that the brace behind `head` opens."""
    if inside is not None and inside.kind != "scope":
        return "block"
    head = ATTRIBUTE.sub("", head)
    head = re.sub(r"\btemplate\s*<[^{}]*?>\s*(?=\w)", "", head.strip())
    if re.match(r"(inline\s+)?namespace\b|extern\s*\"", head):
        return "scope"
    outside = head
    while (inner := re.sub(r"\((?:[^()])*\)", "@", outside)) != outside:
        outside = inner
    if "@" in outside and ("operator" in outside or "=" not in outside):
        # A member initialiser in braces: its name stands before the brace, behind the colon.
        if re.search(r"@[^:]*(?<!:):(?!:)", outside) and re.search(r"[\w>]\s*$", outside):
            return "member"
        return "function"
    if "=" not in outside and re.search(r"\b(class|struct|union|enum)\b", outside):
        return "init" if re.search(r"\benum\b", outside) else "scope"
    return "init"


def c_functions(text: str) -> Iterator[Function]:
    """The functions of a C or C++ source; ValueError where its braces do not match."""
    code = code_of(text)
    code = DIRECTIVE.sub(lambda match: _blank(match[0]), code)
    stack: list[_Scope] = []
    head, head_line, line = "", 1, 1
    for character in code:
        if character == "\n":
            line += 1
        if character == "{":
            kind = _kind(head, stack[-1] if stack else None)
            stack.append(_Scope(kind, head, head_line, line))
            head = "" if kind != "member" else head
        elif character == "}":
            if not stack:
                raise ValueError(f"line {line}: a brace too many")
            scope = stack.pop()
            if scope.kind == "function":
                yield Function(_name(scope.head), scope.line, max(0, line - scope.brace_line - 1))
            head = scope.head + "@" if scope.kind == "member" else ""
        elif character == ";" and (not stack or stack[-1].kind != "member"):
            head = ""
        elif not stack or stack[-1].kind == "scope":
            if not head.strip():
                head_line = line
            head = head + character if head.strip() or not character.isspace() else ""
            # Access labels are not part of what follows.
            head = re.sub(r"^\s*(public|private|protected)\s*:(?!:)", "", head)
    if stack:
        raise ValueError(f"line {stack[-1].brace_line}: a brace that is not closed")


def _name(head: str) -> str:
    match = re.search(r"([\w~:]+|operator\s*\S+)\s*\(", head)
    return match[1] if match else head.strip()[:40]


def python_functions(text: str) -> Iterator[Function]:
    """The functions of a Python source; signature and docstring are declarations, not lines."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            body = node.body[1:] if ast.get_docstring(node) is not None else node.body
            lines = (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0
            yield Function(node.name, node.lineno, lines)
