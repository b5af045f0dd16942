"""A program as the compiler has it in between: statements in static single assignment form, in
which each name is set once, so that where a number comes from can be followed.

Read from what `-fdump-tree-optimized` prints: calls of small functions are inlined in it, and loops
of a few turns unrolled.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from kilotwin.experiment.programs import Program
from kilotwin.programs.image.image import program_flags
from kilotwin.programs.image.tools import avr_gcc
from kilotwin.programs.native.guest import run_tool
from kilotwin.programs.port.disassembly import Place

_DUMP = ["-O2", "-w", "-S", "-o", "/dev/null", "-fdump-tree-optimized-lineno=stdout"]
_HEADING = re.compile(r"^;; Function (\S+) \(")
_PARAMETERS = re.compile(r"^(?:[\w ]+ \**)?(\w+) \((.*)\)$")
_STATEMENT = re.compile(
    r"^\s+(?:\[([^\]]+?):(\d+):\d+(?: discrim \d+)?\] )?(.*?);?(?: \[.*%\].*)?$"
)
_PHI = re.compile(r"^# (\S+) = PHI <(.*)>$")
_ARGUMENT = re.compile(r"(\S+?)\(\d+\)")
_SET = re.compile(r"^(\S+) =(?: ?\{v\})? (.*)$")
_CALL = re.compile(r"^(?:__builtin_)?(\w+) \((.*)\)$")
_TEST = re.compile(r"^if \((.*)\)")
_COMPARED = re.compile(r"^(\S+) (u?[<>]=?) (\S+)$")
_CAST = re.compile(r"^\([\w ]+\) (\S+)$")
_BINARY = re.compile(r"^(\S+) (\*|/|\+|-|%|<<|>>|&|\||\^) (\S+)$")
_OWN_NAME = re.compile(r"^[\w.]*_\d+(?:\(D\))?$")
_VARIABLE = re.compile(r"^[A-Za-z_][\w.]*$")
_PARAMETER = re.compile(r"^(\w+?)_\d+\(D\)$")


@dataclass(frozen=True)
class Name:
    """An operand: a name that is set once, a number, or a variable; in its function."""

    function: str
    text: str

    @property
    def number(self) -> float | None:
        """Its value, if it is a number."""
        try:
            return float(self.text.rstrip("BULul"))
        except ValueError:
            return None


@dataclass(frozen=True)
class Value:
    """How a name is made: of others, by `how`: an operator, `cast`, `call NAME`, or `one of`."""

    how: str
    of: tuple[Name, ...]


@dataclass(frozen=True)
class Comparison:
    """`left` and `right` are compared by size."""

    left: Name
    right: Name
    place: Place


@dataclass
class Gimple:
    """The statements of all sources of a program."""

    values: dict[Name, Value] = field(default_factory=dict)
    comparisons: list[Comparison] = field(default_factory=list)
    returned: dict[str, list[Name]] = field(default_factory=dict)
    """Results of functions, by their name."""
    stored: dict[str, list[Name]] = field(default_factory=dict)
    """Values that variables get, by their name."""
    passed: dict[str, list[tuple[Name, ...]]] = field(default_factory=dict)
    """Arguments of calls, by the function's name."""
    parameters: dict[str, list[str]] = field(default_factory=dict)

    def sources_of(self, name: Name) -> Value | None:
        """How a name is made, across calls and variables; None where it comes from elsewhere."""
        found = self.values.get(name)
        if found is not None and found.how.startswith("call "):
            returned = self.returned.get(found.how.removeprefix("call "))
            return Value("one of", tuple(returned)) if returned else found
        if found is not None:
            return found
        if parameter := _PARAMETER.match(name.text):
            return self._argument(name.function, parameter[1])
        stored = self.stored.get(name.text)
        return Value("one of", tuple(stored)) if stored else None

    def _argument(self, function: str, parameter: str) -> Value | None:
        names = self.parameters.get(function, [])
        if parameter not in names:
            return None
        at = names.index(parameter)
        calls = self.passed.get(function, [])
        return Value("one of", tuple(given[at] for given in calls if at < len(given)))


def gimple_of(program: Program) -> Gimple:
    """The statements of the program's sources, for the robot.

    InputError if they do not compile.
    """
    found = Gimple()
    flags = [flag for flag in program_flags(program) if flag != "-fstack-usage"]
    for source in program.sources:
        words = [avr_gcc(), *flags, *_DUMP, str(source)]
        read(run_tool(words, str(source), confine=True).splitlines(), found)
    return found


def read(lines: Sequence[str], found: Gimple) -> None:
    """Adds the statements of a compiler's dump to `found`."""
    function = ""
    for line in lines:
        if heading := _HEADING.match(line):
            function = heading[1]
        elif (header := _PARAMETERS.match(line)) and header[1] == function:
            words = [part.split() for part in header[2].split(",")]
            found.parameters[function] = [word[-1].lstrip("*") for word in words if word]
        elif statement := _STATEMENT.match(line):
            file, number, text = statement.groups()
            place = Place(file, int(number)) if file else None
            _take(text, function, place, found)


def _take(text: str, function: str, place: Place | None, found: Gimple) -> None:
    if phi := _PHI.match(text):
        of = tuple(Name(function, name) for name in _ARGUMENT.findall(phi[2]))
        found.values[Name(function, phi[1])] = Value("one of", of)
    elif text.startswith("return "):
        found.returned.setdefault(function, []).append(Name(function, text[len("return ") :]))
    elif test := _TEST.match(text):
        found.comparisons += _comparisons(test[1], function, place)
    elif given := _SET.match(text):
        target, expression = given.groups()
        found.comparisons += _comparisons(expression, function, place)
        value = _value(expression, function)
        _note_call(value, found)
        if _OWN_NAME.match(target):
            found.values[Name(function, target)] = value
        elif _VARIABLE.match(target) and value.how == "one of":
            found.stored.setdefault(target, []).extend(value.of)
    elif _CALL.match(text):
        _note_call(_value(text, function), found)


def _note_call(value: Value, found: Gimple) -> None:
    if value.how.startswith("call "):
        found.passed.setdefault(value.how.removeprefix("call "), []).append(value.of)


def _comparisons(text: str, function: str, place: Place | None) -> Iterator[Comparison]:
    compared = _COMPARED.match(text.partition(" ? ")[0])
    if compared and place is not None:
        left, _, right = compared.groups()
        yield Comparison(Name(function, left), Name(function, right), place)


def _value(text: str, function: str) -> Value:
    def names(*texts: str) -> tuple[Name, ...]:
        return tuple(Name(function, text) for text in texts)

    if cast := _CAST.match(text):
        return Value("cast", names(cast[1]))
    if call := _CALL.match(text):
        given = [part.strip() for part in call[2].split(",")] if call[2] else []
        return Value(f"call {call[1]}", names(*given))
    if binary := _BINARY.match(text):
        return Value(binary[2], names(binary[1], binary[3]))
    if text.startswith("-") and _OWN_NAME.match(text[1:]):
        return Value("cast", names(text[1:]))
    if _OWN_NAME.match(text) or _VARIABLE.match(text) or Name("", text).number is not None:
        return Value("one of", names(text))
    # Conditions, references and the like: whatever stands in it.
    return Value("other", names(*re.findall(r"[\w.]*_\d+(?:\(D\))?", text)))
