"""Draws of few bits: probabilities that are smaller than a draw's step come out larger, or never.

Where a number comes from is followed in the compiler's own statements (gimple.py), so that a draw
is known through variables, functions and scales, and so is a probability that is computed.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from kilotwin.errors import InputError
from kilotwin.experiment.programs import Program
from kilotwin.programs.port.findings import Finding, Weight
from kilotwin.programs.port.gimple import Comparison, Gimple, Name, Value, gimple_of
from kilotwin.programs.port.roles import Line

# A draw of 8 bits that is taken modulo a number: the compiler leaves out a modulo without effect.
_MODULO_DRAW = re.compile(r"\brand_(?:soft|hard)\s*\(\s*\)\s*%\s*\(?\s*(\d+)")
_BITS = {"rand_soft": 8, "rand_hard": 8, "rand": 15, "random": 31}
_BYTE = 8
_VALUES = 1 << _BYTE
# Functions that give numbers as small as one likes.
_TO_NOTHING = {"exp", "expf", "exp2", "exp2f", "exp10", "exp10f", "pow", "powf"}
_DO = "draw two bytes: (uint16_t)(rand_soft() << 8 | rand_soft())"
_NUMBER = r"(\d*\.?\d+(?:[eE][-+]?\d+)?)f?\s*[;,]"


@dataclass(frozen=True)
class Draw:
    """A drawn number: of how many bits, by which function, and how far apart its values are."""

    bits: int
    by: str
    step: float = 1.0


def draws(program: Program, lines: Sequence[Line]) -> Iterator[Finding]:
    """Draws that are too coarse for what they are compared with. `lines`: the program's own."""
    for line in lines:
        found = _MODULO_DRAW.search(line.text)
        if found and int(found[1]) > _VALUES:
            yield Finding(
                "few-bits",
                Weight.WARNS,
                f"a draw is 0 to 255, so that modulo {found[1]} changes nothing",
                _DO,
                line.place,
            )
    try:
        gimple = gimple_of(program)
    except InputError:
        return  # the image was built; a compiler that prints no statements shows nothing here
    yield from coarse(gimple, "\n".join(line.text for line in lines))


def coarse(gimple: Gimple, text: str = "") -> Iterator[Finding]:
    """Comparisons of a draw with something smaller than its step. `text`: the program's own, which
    has the first values of variables."""
    follow = _Follow(gimple, text)
    for comparison in gimple.comparisons:
        for drawn, other in (
            (comparison.left, comparison.right),
            (comparison.right, comparison.left),
        ):
            draw = follow.draw(drawn)
            if draw is not None and follow.draw(other) is None:
                yield from _judged(follow, draw, other, comparison)


def _judged(
    follow: "_Follow", draw: Draw, other: Name, comparison: Comparison
) -> Iterator[Finding]:
    values, constants = 1 << draw.bits, follow.constants(other)
    smallest = min((abs(number) for number in constants if number != 0), default=draw.step)
    if smallest < draw.step:
        share = smallest / draw.step / (values - 1)
        what = f"a probability of {share:.3g} becomes {1 / values:.4g}"
    elif draw.bits <= _BYTE and follow.comes_to_nothing(other):
        what = (
            f"the probability that it is compared with is computed, and below {1 / values:.4f} "
            "comes out as that or as 0"
        )
    else:
        return
    yield Finding(
        "few-bits",
        Weight.WARNS,
        f"a draw of {draw.by}() has {values} values: {what}",
        _DO,
        comparison.place,
    )


class _Follow:
    """Numbers of a program, followed to where they come from."""

    def __init__(self, gimple: Gimple, text: str) -> None:
        self._gimple = gimple
        self._text = text

    def draw(self, name: Name, open_: frozenset[Name] = frozenset()) -> Draw | None:
        """The draw that a number is, scaled by constants; None for one that is none, or is more
        than a draw."""
        if name in open_ or name.number is not None:
            return None
        value = self._gimple.sources_of(name)
        if value is None:
            return None
        if value.how.startswith("call "):
            by = value.how.removeprefix("call ")
            return Draw(_BITS[by], by) if by in _BITS else None
        open_ |= {name}
        if value.how == "one of":
            # A loop that draws again and again has as many bits as turns: no step is known.
            if any(source in open_ for source in value.of):
                return None
            found = [self.draw(source, open_) for source in value.of]
            return max(filter(None, found), key=lambda one: one.step, default=None)
        return self._computed(value, open_)

    def _computed(self, value: Value, open_: frozenset[Name]) -> Draw | None:
        drawn = [self.draw(source, open_) for source in value.of]
        if value.how == "cast":
            return drawn[0]
        if len(drawn) != len(("left", "right")) or value.how not in ("*", "/", "%", "<<", ">>"):
            return _joined(drawn) if value.how in ("|", "+", "^") else None
        left, right = drawn
        by_left, by_right = value.of[0].number, value.of[1].number
        if left is not None and by_right:
            return _scaled(left, value.how, by_right)
        if right is not None and by_left and value.how == "*":
            return _scaled(right, "*", by_left)
        return None

    def constants(self, name: Name, open_: frozenset[Name] = frozenset()) -> list[float]:
        """Numbers that a name may stand for, where it is one of some; none where it is computed."""
        if name.number is not None:
            return [name.number]
        if name in open_:
            return []
        value = self._gimple.sources_of(name)
        if value is None:
            return self._first_value(name)
        if value.how not in ("one of", "cast"):
            return []
        return [one for source in value.of for one in self.constants(source, open_ | {name})]

    def _first_value(self, name: Name) -> list[float]:
        """Its initializer, of a variable that nothing else is stored into."""
        if not re.fullmatch(r"[A-Za-z]\w*", name.text) or name.text in self._gimple.stored:
            return []
        found = re.findall(rf"\b{name.text}\s*=\s*{_NUMBER}", self._text)
        return [float(number) for number in found] if len(found) == 1 else []

    def comes_to_nothing(self, name: Name, open_: frozenset[Name] = frozenset()) -> bool:
        """Whether a number is computed of an exponential function or a power."""
        if name in open_ or name.number is not None:
            return False
        value = self._gimple.sources_of(name)
        if value is None:
            return False
        if value.how.removeprefix("call ") in _TO_NOTHING:
            return True
        return any(self.comes_to_nothing(source, open_ | {name}) for source in value.of)


def _joined(drawn: Sequence[Draw | None]) -> Draw | None:
    """Bytes of which one was shifted: a draw of all their bits."""
    several = [one for one in drawn if one is not None]
    if len(several) < len(drawn) or not several:
        return None
    return replace(
        several[0], bits=sum(one.bits for one in several), step=min(one.step for one in several)
    )


def _scaled(draw: Draw, how: str, by: float) -> Draw | None:
    if how == "*":
        return replace(draw, step=abs(draw.step * by))
    if how == "/":
        return replace(draw, step=abs(draw.step / by))
    if how == "<<":
        return replace(draw, step=draw.step * 2**by)
    if how == ">>":
        return replace(draw, bits=max(draw.bits - int(by), 0), step=max(draw.step / 2**by, 1.0))
    return draw
