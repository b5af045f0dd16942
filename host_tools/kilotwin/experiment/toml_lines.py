"""Finds the line of each key in a TOML text, for errors that name the place.

The text must already have been accepted by `tomllib`, which is why this scanner checks nothing. A
path is a tuple of keys and of indexes into arrays: ("site", 1, "diameter_m").
"""

import re
import tomllib

KeyPath = tuple[str | int, ...]

_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_STRING = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}'  # the closing quotes may be preceded by up to two of the text
    r"|'''.*?'{3,5}"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'",
    re.DOTALL,
)
_SCALAR = re.compile(r"[^,\]}#\n]+")


def locate(text: str) -> dict[KeyPath, int]:
    """The line (from 1) of every key, table and array item of a valid TOML text."""
    return _Scanner(text.replace("\r\n", "\n")).scan()


def line_of(lines: dict[KeyPath, int], path: KeyPath) -> int | None:
    """The line of `path`, or of the innermost thing around it that is written down."""
    for length in range(len(path), 0, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return None


class _Scanner:
    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0
        self._lines: dict[KeyPath, int] = {}
        self._array_tables: dict[KeyPath, int] = {}  # path of a [[table]] -> its newest index
        self._counted_to = 0
        self._line = 1

    def scan(self) -> dict[KeyPath, int]:
        table: KeyPath = ()
        while self._skip_blank():
            if self._take("[["):
                table = self._array_header()
            elif self._take("["):
                table = self._mark_keys((), follow=True)
                self._take("]")
            else:
                self._pair(table)
        return self._lines

    def _array_header(self) -> KeyPath:
        start = self._at
        names = self._key()
        outer = self._follow(names[:-1])
        self._mark_each(outer, start)
        array = (*outer, names[-1])
        index = self._array_tables.get(array, -1) + 1
        self._array_tables[array] = index
        table = (*array, index)
        self._mark(array, start)
        self._mark(table, start)
        self._take("]]")
        return table

    def _pair(self, table: KeyPath) -> None:
        path = self._mark_keys(table, follow=False)
        self._skip_blank()
        self._take("=")
        self._value(path)

    def _value(self, path: KeyPath) -> None:
        self._skip_blank()
        if self._take("["):
            index = 0
            while self._skip_blank() and not self._take("]"):
                self._mark((*path, index), self._at)
                self._value((*path, index))
                index += 1
                self._skip_blank()
                self._take(",")
        elif self._take("{"):
            while self._skip_blank() and not self._take("}"):
                self._pair(path)
                self._skip_blank()
                self._take(",")
        else:
            found = _STRING.match(self._text, self._at) or _SCALAR.match(self._text, self._at)
            assert found is not None, "tomllib accepted what this scanner does not know"
            self._at = found.end()

    def _mark_keys(self, table: KeyPath, *, follow: bool) -> KeyPath:
        start = self._at
        names = self._key()
        path = self._follow(names) if follow else (*table, *names)
        self._mark_each(path, start, beyond=len(table))
        return path

    def _mark_each(self, path: KeyPath, start: int, beyond: int = 0) -> None:
        for length in range(beyond + 1, len(path) + 1):
            self._mark(path[:length], start)

    def _mark(self, path: KeyPath, start: int) -> None:
        self._line += self._text.count("\n", self._counted_to, start)
        self._counted_to = start
        self._lines.setdefault(path, self._line)

    def _follow(self, names: list[str]) -> KeyPath:
        """A header's names as a path: inside an array of tables they mean its newest item."""
        path: KeyPath = ()
        for name in names:
            path = (*path, name)
            if path in self._array_tables:
                path = (*path, self._array_tables[path])
        return path

    def _key(self) -> list[str]:
        """A dotted key; each part bare or quoted."""
        names: list[str] = []
        while True:
            self._skip_blank()
            bare = _BARE_KEY.match(self._text, self._at)
            if bare is not None:
                names.append(bare.group())
                self._at = bare.end()
            else:
                quoted = _STRING.match(self._text, self._at)
                assert quoted is not None, "tomllib accepted a key this scanner does not know"
                names.append(tomllib.loads(f"key = {quoted.group()}")["key"])
                self._at = quoted.end()
            self._skip_blank()
            if not self._take("."):
                return names

    def _skip_blank(self) -> bool:
        """Moves over blanks, line ends and comments; False at the end of the text."""
        found = _BLANK.match(self._text, self._at)
        assert found is not None
        self._at = found.end()
        return self._at < len(self._text)

    def _take(self, token: str) -> bool:
        if self._text.startswith(token, self._at):
            self._at += len(token)
            return True
        return False
