"""Hints on a line that is no TOML: habits of other formats and languages."""

import json
import re
from collections.abc import Callable

_KEY = r"^\s*(?P<key>[\w.\"-]+)\s*"
_END = r"\s*(?:#.*)?$"
_UNITS = r"(?:m|cm|mm|km|s|ms|us|min|h|deg|rad|hz|khz|g|kg|n|mn|v|mv|%|°|px)"


def _number(word: str) -> str:
    """A number as TOML has it, of `.5`, `5.`, `007`."""
    sign = "-" if word.startswith("-") else ""
    whole, point, part = word.lstrip("+-").partition(".")
    return f"{sign}{whole.lstrip('0') or '0'}" + (f".{part or '0'}" if point else "")


def _word(found: re.Match[str]) -> str:
    """A line of YAML: a key with a value, or a table."""
    value = (found["value"] or "").strip()
    if not value:
        return f"this looks like YAML; an experiment is TOML: write [{found['key']}]"
    shown = value if re.fullmatch(r"-?\d+(\.\d+)?|true|false|[\"'\[].*", value) else f'"{value}"'
    return f"this looks like YAML; an experiment is TOML: write {found['key']} = {shown}"


_LINES: tuple[tuple[str, Callable[[re.Match[str]], str]], ...] = (
    (r"[“”„‘’]", lambda _: 'write text in plain quotes: "..."'),
    (r"^\s*(?://|/\*|;|%|--)", lambda _: "a comment begins with #"),
    (
        _KEY + r"=\s*(?P<whole>[+-]?\d+),(?P<part>\d+)" + _END,
        lambda it: f"numbers have a point: write {it['key']} = {it['whole']}.{it['part']}",
    ),
    (
        _KEY + rf"=\s*(?P<number>[+-]?[\d.]+)\s*(?P<unit>{_UNITS}(?:/{_UNITS})?)" + _END,
        lambda it: (
            f"a value is a number alone, its unit is that of the key's name: write "
            f"{it['key']} = {it['number']}"
        ),
    ),
    (
        _KEY + r"=\s*(?P<number>[+-]?(?:\.\d+|\d+\.|0\d+(?:\.\d+)?))" + _END,
        lambda it: f"write {it['key']} = {_number(it['number'])}",
    ),
    (
        _KEY + r"=\s*(?P<word>true|false|yes|no|on|off)" + _END,
        lambda it: (
            f"write {it['key']} = "
            + ("true" if it["word"].lower() in ("true", "yes", "on") else "false")
        ),
    ),
    (_KEY + r"(?:==|:=)", lambda it: f"write {it['key']} = ..., with one ="),
    (_KEY + r"=\s*(?P<value>.*\S);" + _END, lambda it: f"write {it['key']} = {it['value']}"),
    (
        _KEY + r"=\s*(?P<value>[a-z_./~][^\"'\[\]{}=#]*?)" + _END,
        lambda it: f'text has quotes: write {it["key"]} = "{it["value"]}"',
    ),
    (_KEY + r"=" + _END, lambda it: f"a value is missing behind {it['key']} ="),
    (
        _KEY + r"\s(?P<value>-?[\d.]+|\"[^\"]*\"|true|false)" + _END,
        lambda it: f"write {it['key']} = {it['value']}",
    ),
    (r"^\s*\[\[(?P<name>[\w.-]+)\]?" + _END, lambda it: f"write [[{it['name']}]]"),
    (r"^\s*\[(?P<name>[\w.-]+)(?:\]\])?" + _END, lambda it: f"write [{it['name']}]"),
    (r"^\s*(?:-\s+)?(?P<key>[\w-]+):(?:\s+(?P<value>[^#]*))?" + _END, _word),
)
_MESSAGES = (
    ("Cannot declare", "all keys of a table stand below one heading; of several it is [[robots]]"),
    ("Cannot overwrite", "a key stands once in a table; remove one of them"),
    ("Unclosed array", "a list ends with ]"),
)


def hint(text: str, line: int, what: str) -> str:
    """The hint on that line of `text`, the number of one from 1; `what` is wrong with it."""
    if text.lstrip().startswith("{"):
        return f"this is JSON; an experiment is TOML: {_of_json(text)}"
    lines = text.splitlines()
    written = lines[line - 1] if line <= len(lines) else ""
    for pattern, advice in _LINES:
        if found := re.search(pattern, written, re.IGNORECASE):
            return advice(found)
    for begin, advised in _MESSAGES:
        if what.startswith(begin):
            return advised
    if "\\" in written:
        return "write / in a path, or put it into single quotes: 'C:\\folder\\my.c'"
    open_quotes = [
        number
        for number, one in enumerate(lines, 1)
        if one.count('"') % 2 or (one.count("'") % 2 and '"' not in one)
    ]
    if open_quotes and ("\\n" in what or what.startswith("Expected")):
        where = "" if open_quotes[0] == line else f"in line {open_quotes[0]} "
        return f"{where}text does not end with the quote that it began with"
    return "mend this line"


def _of_json(text: str) -> str:
    """The first keys of a JSON object as TOML."""
    example = 'write name = "my run"'
    try:
        known = json.loads(text)
    except (ValueError, RecursionError):
        return f"{example}, and [arena] above its keys"
    if not isinstance(known, dict):
        return example
    values = ((key, it) for key, it in known.items() if isinstance(it, str | int | float))
    tables = (f"[{key}]" for key, it in known.items() if isinstance(it, dict))
    if pair := next(values, None):
        example = f"write {pair[0]} = {json.dumps(pair[1])}"
    table = next(tables, "[arena]")
    return f"{example}, and {table} above its keys"
