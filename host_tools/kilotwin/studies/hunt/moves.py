"""Moves: what a hunt changes in a variation, drawn by chance within what [hunt] allows."""

import math
import random
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from kilotwin.experiment.areas import area_of
from kilotwin.experiment.checks.arena import pose_problems
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.hunt import Hunt
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.studies.hunt.variation import LATE, Addition, Pose, Put, Variation

# Uids that programs take for granted, or forget.
_ODD_UIDS = (0, 255, 256, 32_767, 32_768, 65_535)
# Clocks at which numbers of 8, 16 and 15 bits wrap, in ticks; a run begins some seconds before.
_WRAPS = (256, 32_768, 65_536, 131_072, 196_608)
_TICK_S = 1 / 30.517578125
_BEFORE_S = 10.0
_SEEDS = 2**31
_GAP = 1.06
_NUDGE_M = 0.003
_TRIES = 200
_FAR = 2
_BY_CONSTANT = 0.3
"""The share of numbers that are near a constant of a program's."""
_ABOUT_S = 2.0
_LEAST_TICKS = 16

Move = Callable[[random.Random, Variation], Variation]


@dataclass(frozen=True)
class Ground:
    """Facts of the experiment for moves: numbers of robots and lamps, the arena's box (left,
    bottom, right, top) in metres, whether a robot may stand at x, y in it, poses, where all robots
    have them, and numbers that programs compare with: uids or ticks, maybe."""

    hunt: Hunt
    size: int
    duration_s: float
    box: tuple[float, float, float, float]
    has_room: Callable[[float, float], bool]
    radius_m: float
    range_m: float
    poses: tuple[Pose, ...] | None
    fixed_uids: bool
    has_commands: bool
    has_pulses: bool
    drifts: bool
    ambient: float
    modules: tuple[int, int] | None
    battery_h: float
    constants: tuple[int, ...] = ()

    @staticmethod
    def of(experiment: Experiment, constants: Iterable[int] = ()) -> "Ground":
        """That of an experiment, and constants of its programs."""
        keys = experiment.keys
        place, grid = area_of(keys.arena), keys.grid
        half = place.width / 2, place.height / 2
        profile = PROFILES[keys.swarm.profile]
        return Ground(
            keys.hunt or Hunt(),
            experiment.size,
            keys.duration_s,
            (place.x - half[0], place.y - half[1], place.x + half[0], place.y + half[1]),
            lambda x, y: next(pose_problems((), x, y, profile.radius_m, keys), None) is None,
            profile.radius_m,
            keys.medium.range_m,
            _poses_of(experiment),
            bool(experiment.lab and keys.swarm.lab) or _has_informed(experiment),
            keys.command is not None or grid is not None,
            keys.medium.clock_spread is not None,
            profile.legs,
            keys.light.ambient,
            None if grid is None else (grid.columns, grid.rows),
            keys.battery.hours,
            tuple(sorted(constants)),
        )

    def moves(self) -> dict[str, Move]:
        """The moves that [hunt] allows, by their names in reports."""
        hunt, more_s = self.hunt, self.duration_s > 1
        has_grid = self.modules is not None
        return {
            name: move
            for name, move, allowed in (
                ("seed", _other_seed, True),
                ("starts", self._start, hunt.starts),
                ("uids", self._name, hunt.uids and not self.fixed_uids),
                ("clocks at the start", self._wait, hunt.on_s > 0),
                ("RUN late", self._delay, hunt.stagger_s > 0 and not self.has_commands),
                ("oscillators", self._detune, hunt.clock_spread > 0 and self.has_pulses),
                ("losses", self._lose, hunt.loss > 0 and self.has_pulses),
                ("deaf or mute for a while", self._spell, hunt.spells > 0 and more_s),
                ("robots that fail", self._fail, hunt.failing > 0),
                ("resets", self._reset, hunt.resets > 0 and more_s and not self.has_commands),
                ("robots moved", self._move, hunt.moved > 0 and more_s),
                ("light", self._shine, hunt.light > 0),
                ("batteries", self._drain, hunt.battery and self.battery_h == 0),
                ("modules reset", self._reset_module, hunt.modules > 0 and has_grid),
                ("CAN errors", self._disturb_bus, hunt.can_errors > 0 and has_grid),
                ("host gone", self._silence_host, hunt.host_gone_s > 0 and has_grid and more_s),
            )
            if allowed
        }

    # Each takes the source of chance and a variation.

    def _start(self, chance: random.Random, one: Variation) -> Variation:
        if self.poses is not None:
            return replace(one, poses=tuple(self._nudged(chance, pose) for pose in self.poses))
        return replace(one, poses=self._crowd(chance) or one.poses)

    def _nudged(self, chance: random.Random, pose: Pose) -> Pose:
        x, y, _ = pose
        by = [chance.uniform(-_NUDGE_M, _NUDGE_M) for _ in range(2)]
        return round(x + by[0], 4), round(y + by[1], 4), _heading(chance)

    def _crowd(self, chance: random.Random) -> tuple[Pose, ...]:
        """All within a part of the arena, down to one that they fill; () if they find no room."""
        left, bottom, right, top = self.box
        need = 2 * self.radius_m * _GAP * math.sqrt(2.5 * self.size)
        whole = min(right - left, top - bottom)
        side = min(whole, max(need, whole * chance.random() ** _FAR))
        x0 = left + (right - left - side) * chance.random()
        y0 = bottom + (top - bottom - side) * chance.random()
        span, least = max(side - 2 * self.radius_m, 0.0), 2 * self.radius_m * _GAP
        taken: list[Pose] = []
        for _ in range(self.size):
            for _ in range(_TRIES):
                x = round(x0 + self.radius_m + chance.random() * span, 4)
                y = round(y0 + self.radius_m + chance.random() * span, 4)
                is_clear = all(math.hypot(x - a, y - b) >= least for a, b, _ in taken)
                if is_clear and self.has_room(x, y):
                    taken.append((x, y, _heading(chance)))
                    break
            else:
                return ()
        return tuple(taken)

    def _name(self, chance: random.Random, one: Variation) -> Variation:
        known = [*_ODD_UIDS, chance.randrange(65_536)]
        if self.constants and chance.random() < _BY_CONSTANT:
            known = [(chance.choice(self.constants) + chance.randint(-1, 1)) % 65_536]
        first = chance.choice(known)
        if chance.random() < 0.5:
            named = [(first + index) % 65_536 for index in range(self.size)]
        else:
            named = chance.sample(range(65_536), self.size)
        return replace(one, uids=tuple(named))

    def _wait(self, chance: random.Random, one: Variation) -> Variation:
        """On for any time; more often until shortly before a number wraps, or a constant."""
        on_s = chance.uniform(0, self.hunt.on_s)
        kinds = (_WRAPS, self.constants)
        known = [[at * _TICK_S for at in kind if at * _TICK_S <= self.hunt.on_s] for kind in kinds]
        if any(known) and chance.random() < 0.75:
            before_s = min(_BEFORE_S, self.duration_s)
            kind = chance.choice([one for one in known if one])
            on_s = max(0.0, chance.choice(kind) - chance.uniform(0, before_s))
        return one.put(("swarm", "on_s"), round(on_s, 3))

    def _delay(self, chance: random.Random, one: Variation) -> Variation:
        kept = [it for it in one.additions if it.path != LATE]
        late = chance.sample(range(self.size), chance.randint(1, self.size))
        most_s = min(self.hunt.stagger_s, self.duration_s / 2)
        told = [_late(robot, round(chance.uniform(0, most_s), 3)) for robot in sorted(late)]
        return replace(one, additions=(*kept, *told))

    def _detune(self, chance: random.Random, one: Variation) -> Variation:
        return one.put(
            ("medium", "clock_spread"), round(chance.uniform(0, self.hunt.clock_spread), 5)
        )

    def _lose(self, chance: random.Random, one: Variation) -> Variation:
        near = round(chance.uniform(0, self.hunt.loss), 3)
        return one.put(("medium", "loss"), near).put(
            ("medium", "loss_at_range"), round(chance.uniform(near, max(near, self.hunt.loss)), 3)
        )

    def _spell(self, chance: random.Random, one: Variation) -> Variation:
        for_s = chance.uniform(0.1, self.hunt.spell_s)
        if (known_s := self._time_of_constant(chance)) is not None:
            for_s = min(max(0.1, known_s * chance.uniform(0.9, 1.5)), self.hunt.spell_s)
        for_s = round(for_s, 3)
        kind = chance.choice(("deaf", "mute"))
        spell = self._fault(chance, kind, for_s=for_s)
        return _with_most(one, spell, self.hunt.spells, _is_spell)

    def _fail(self, chance: random.Random, one: Variation) -> Variation:
        kind = chance.choice(("dead", "dead", "stuck", "deaf", "mute", "drift"))
        if kind == "drift" and not self.drifts:
            kind = "dead"
        motors = {"left": round(chance.uniform(0, 1.2), 2)} if kind == "drift" else {}
        return _with_most(one, self._fault(chance, kind, **motors), self.hunt.failing, _is_for_good)

    def _fault(self, chance: random.Random, kind: str, **more: float) -> Addition:
        table = {"kind": kind, "at_s": self._moment(chance), **more}
        robot = chance.randrange(self.size)
        return Addition(("faults", "robot"), tuple(table.items()), robot, "robots", listed=True)

    def _reset(self, chance: random.Random, one: Variation) -> Variation:
        at_s, robot = self._moment(chance), chance.randrange(self.size)
        back_s = min(round(at_s + chance.uniform(0.5, 2), 3), self.duration_s * 0.999)
        orders = [
            Addition(("command",), (("at_s", when_s), ("send", what)), robot)
            for when_s, what in ((at_s, "reset"), (back_s, "run"))
        ]
        before = [it for it in one.additions if it.path == ("command",)]
        old = before[: max(0, len(before) - 2 * (self.hunt.resets - 1))]
        return replace(one, additions=(*(it for it in one.additions if it not in old), *orders))

    def _move(self, chance: random.Random, one: Variation) -> Variation:
        left, bottom, right, top = self.box
        robot = chance.randrange(self.size)
        for _ in range(_TRIES):
            x = round(chance.uniform(left + self.radius_m, right - self.radius_m), 4)
            y = round(chance.uniform(bottom + self.radius_m, top - self.radius_m), 4)
            if self.has_room(x, y):
                break
        else:
            return one
        pose = [x, y, _heading(chance)]
        table = {"at_s": self._moment(chance), "pose": pose}
        moved = Addition(("step",), tuple(table.items()), robot)
        return _with_most(one, moved, self.hunt.moved, lambda it: it.of("pose") is not None)

    def _shine(self, chance: random.Random, one: Variation) -> Variation:
        by = chance.uniform(-self.hunt.light, self.hunt.light)
        reading = round(min(max(self.ambient + by, 0.0), 1023.0), 1)
        table = (("at_s", self._moment(chance)), ("ambient", reading))
        lit = Addition(("step",), table)
        return _with_most(one, lit, 2, lambda it: it.of("ambient") is not None)

    def _drain(self, chance: random.Random, one: Variation) -> Variation:
        lasts_s = self.duration_s * chance.uniform(0.5, 4)
        return one.put(("battery", "hours"), max(round(lasts_s / 3600, 4), 0.0001))

    def _reset_module(self, chance: random.Random, one: Variation) -> Variation:
        assert self.modules is not None
        module = [chance.randrange(number) for number in self.modules]
        table = {"at_s": self._moment(chance), "kind": "reset", "module": module}
        reset = Addition(("faults", "module"), tuple(table.items()))
        return _with_most(one, reset, self.hunt.modules, lambda it: it.of("module") is not None)

    def _disturb_bus(self, chance: random.Random, one: Variation) -> Variation:
        return one.put(("faults", "error_share"), round(chance.uniform(0, self.hunt.can_errors), 4))

    def _silence_host(self, chance: random.Random, one: Variation) -> Variation:
        from_s = self._moment(chance)
        until_s = round(from_s + chance.uniform(0.1, max(0.1, self.hunt.host_gone_s)), 3)
        gone = Addition(("faults", "host"), (("from_s", from_s), ("until_s", until_s)))
        return _with_most(one, gone, 1, lambda it: it.of("until_s") is not None)

    def _moment(self, chance: random.Random) -> float:
        """In the run; the first half more often, and about a constant of a program's."""
        most_s = self.duration_s * 0.95
        at_s = float(chance.random() ** 1.5) * most_s
        if (known_s := self._time_of_constant(chance)) is not None:
            at_s = min(max(0.0, known_s + chance.uniform(-_ABOUT_S, _ABOUT_S)), most_s)
        return round(at_s, 3)

    def _time_of_constant(self, chance: random.Random) -> float | None:
        """A constant as ticks within the run, in seconds; now and then."""
        most = self.duration_s / _TICK_S
        known = [one for one in self.constants if _LEAST_TICKS <= one < most]
        if not known or chance.random() >= _BY_CONSTANT:
            return None
        return chance.choice(known) * _TICK_S


def fresh(chance: random.Random, moves: dict[str, Move]) -> Variation:
    """A variation by one move to a handful."""
    one = _other_seed(chance, Variation())
    for _ in range(chance.choice((0, 1, 1, 2, 2, 3, 5))):
        one = moves[chance.choice(list(moves))](chance, one)
    return one


def mutated(
    chance: random.Random, moves: dict[str, Move], one: Variation, other: Variation
) -> Variation:
    """A variation near one that was interesting, perhaps with something of another such one."""
    drawn = chance.random()
    if drawn < 0.2 and (one.puts or one.additions):
        one = _less(chance, one)
    elif drawn < 0.35:
        one = replace(
            one,
            puts=tuple({put.path: put for put in (*one.puts, *other.puts)}.values()),
            poses=one.poses or other.poses,
            uids=one.uids or other.uids,
        )
    for _ in range(chance.choice((1, 1, 2))):
        one = moves[chance.choice(list(moves))](chance, one)
    return one


def _less(chance: random.Random, one: Variation) -> Variation:
    parts: list[Put | Addition] = [*one.puts, *one.additions]
    gone = chance.choice(parts)
    return replace(
        one,
        puts=tuple(it for it in one.puts if it is not gone),
        additions=tuple(it for it in one.additions if it is not gone),
    )


def _other_seed(chance: random.Random, one: Variation) -> Variation:
    return replace(one, seed=chance.randrange(1, _SEEDS))


def _late(robot: int, at_s: float) -> Addition:
    return Addition(LATE, (("at_s", at_s),), robot)


def _with_most(
    one: Variation, added: Addition, most: int, is_alike: Callable[[Addition], bool]
) -> Variation:
    """With that one, and of those alike the newest, so that there are `most`."""
    alike = [it for it in one.additions if is_alike(it)]
    old = alike[: max(0, len(alike) - most + 1)]
    return replace(one, additions=(*(it for it in one.additions if it not in old), added))


def _is_spell(it: Addition) -> bool:
    return it.of("for_s") is not None


def _is_for_good(it: Addition) -> bool:
    return it.path == ("faults", "robot") and not _is_spell(it)


def _heading(chance: random.Random) -> float:
    return round(chance.uniform(-math.pi, math.pi), 3)


def _poses_of(experiment: Experiment) -> tuple[Pose, ...] | None:
    kinds = [group.poses for group in experiment.groups]
    if any(poses is None for poses in kinds):
        return None
    return tuple((x, y, turn) for poses in kinds for x, y, turn in poses or ())


def _has_informed(experiment: Experiment) -> bool:
    from kilotwin.experiment.spec.informed import informed_ranges

    return any(count for _, _, count in informed_ranges(experiment.keys))
