"""Experiment files: what is filled in, what `--set` does, what a resolved experiment means."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import pytest
from pydantic import BaseModel

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.controller import CONTROLLER_DEFAULTS
from kilotwin.experiment.schema.experiment import ExperimentSchema, ProfileName
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.experiment.text import parse_setting

from ..conftest import SMALL, Load

PAPER = sorted((Path(__file__).parents[3] / "experiments" / "paper").glob("*-n*.toml"))


def test_defaults_are_filled_in(load: Load) -> None:
    keys = load().keys
    assert keys.seed == 1
    assert keys.record.sample_s == 10
    assert keys.engine.step_ticks == 2
    assert keys.medium.range_m == 0.8
    assert keys.reading.signal_from == "rest"
    assert keys.controller is None


def sections_of(section: type[BaseModel]) -> Iterator[type[BaseModel]]:
    """The section and all below."""
    yield section
    for field in section.model_fields.values():
        for part in (field.annotation, *get_args(field.annotation)):
            if isinstance(part, type) and issubclass(part, BaseModel):
                yield from sections_of(part)


def test_a_table_that_is_left_out_means_what_an_empty_one_does() -> None:
    defaults = [
        (name, field.default)
        for section in sections_of(ExperimentSchema)
        for name, field in section.model_fields.items()
        if isinstance(field.default, BaseModel)
    ]
    assert {name for name, _ in defaults} == {"battery", "cells", "faults", "light"}
    for _, default in defaults:
        assert default == type(default).model_validate({})


def test_a_file_without_a_name_is_called_after_itself(load: Load) -> None:
    assert load(SMALL.replace('name = "small"\n', "")).keys.name == "small"


def test_a_run_that_a_setting_makes_short_leaves_out_what_comes_later(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cases = Path(__file__).parents[2] / "bad_input" / "cases"
    monkeypatch.chdir(cases)  # its program is named from there
    file = cases / "command" / "command_after_the_end.toml"
    short = Experiment.load(file, [parse_setting("duration_s=30")])
    assert short.keys.command is not None
    assert short.keys.command[-1].at_s > short.keys.duration_s


def test_a_controller_has_the_defaults_of_its_robot(load: Load) -> None:
    controller = load(f"{SMALL}\n[controller]\nbeta = 1.5\n").keys.controller
    assert controller is not None
    assert (controller.alpha, controller.beta, controller.update_s) == (0.5, 1.5, 2.0)
    assert (controller.empty_windows, controller.wall_ignore_s) == (1, 0.0)
    assert not controller.leave_turn


def test_the_time_out_of_neighbours_follows_their_window(load: Load) -> None:
    controller = load(f"{SMALL}\n[controller]\nneighbour_window_s = 2.5\n").keys.controller
    assert controller is not None
    assert controller.neighbour_timeout_s == 2.5


def test_every_profile_can_be_named_and_has_defaults() -> None:
    assert set(get_args(ProfileName)) == set(PROFILES)
    assert set(PROFILES) <= set(CONTROLLER_DEFAULTS)


@pytest.mark.parametrize("file", PAPER, ids=lambda file: file.stem)
def test_the_papers_experiments_are_sound(file: Path) -> None:
    experiment = Experiment.load(file)
    controller, arena = experiment.keys.controller, experiment.keys.arena
    assert controller is not None
    assert file.stem == f"{controller.rule}-n{experiment.size}"
    assert arena.diameter_m == {50: 12.9, 100: 19.2}[experiment.size]
    for site, side in zip(experiment.keys.site, (-1, 1), strict=True):
        assert site.centre_m == [side * arena.diameter_m / 4, 0]
        assert site.diameter_m == {50: 2.8, 100: 4.0}[experiment.size]
    assert experiment.keys.duration_s == 30_000


def test_all_four_experiments_of_the_paper_are_there() -> None:
    assert len(PAPER) == 4


@pytest.mark.parametrize(
    ("setting", "path", "value"),
    [
        ("swarm.informed=0", ("swarm", "informed"), 0.0),
        ("name=hello world", ("name",), "hello world"),
        ('name="12"', ("name",), "12"),
        ("reading.signal_from=crossing", ("reading", "signal_from"), "crossing"),
        ("reading.line_of_sight=false", ("reading", "line_of_sight"), False),
        ("site.0.diameter_m=0.5", ("site", 0, "diameter_m"), 0.5),
        ("site.1.centre_m=[1.0, 0.5]", ("site", 1, "centre_m"), [1.0, 0.5]),
        ("controller.alpha=1", ("controller", "alpha"), 1.0),
        ("states.busy=red", ("states", "busy"), [1, 0, 0]),
    ],
)
def test_a_setting_takes_the_place_of_a_key(
    load: Load, setting: str, path: tuple[str | int, ...], value: object
) -> None:
    tables = load(SMALL, setting).resolved()
    for step in path:
        tables = tables[step]  # type: ignore[index]
    assert tables == value


def test_settings_can_add_a_site(load: Load) -> None:
    settings = ["site.2.name=red", "site.2.centre_m=[0, 1]", "site.2.diameter_m=0.5"]
    assert [site.name for site in load(SMALL, *settings).keys.site] == ["black", "white", "red"]


def test_settings_can_make_a_list(load: Load) -> None:
    text = SMALL.replace('program = "blink.c"\nsize = 10\n', "")
    settings = ["robots.0.program=blink.c", "robots.0.count=3"]
    assert load(text, *settings).size == 3


def test_a_later_setting_wins(load: Load) -> None:
    assert load(SMALL, "seed=2", "seed=3").keys.seed == 3


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("seed", "--set seed: not of the form key=value"),
        ("=3", "--set =3: not of the form key=value"),
        ("a b=3", "not of the form key=value"),
        ("duration_s.x=3", "--set duration_s.x=3: duration_s is a value and has no keys below it"),
        ("site.7.name=x", "--set site.7.name=x: site is a list of 2; for its first type"),
        ("swarm.informd=1", "--set swarm.informd=1: unknown key 'informd' in [swarm]"),
        ("seed=-1", "--set seed=-1: seed is -1; it must be from 0 up to 9223372036854775807"),
        ("site.0.diameter_m=3", "--set site.0.diameter_m=3: site 'black' does not lie inside"),
        ("arena.diameter_m=2", "--set arena.diameter_m=2: site 'black' does not lie inside"),
        ("site.2.name=x", "--set site.2.name=x: [[site]] lacks 'centre_m'"),
        ("site.0.centre_m=[0.3,0]", "--set site.0.centre_m=[0.3,0]: sites 'black' and 'white'"),
        ("site.1.name=black", "--set site.1.name=black: two sites are called 'black'"),
    ],
)
def test_a_wrong_setting_is_named(load: Load, setting: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        load(SMALL, setting)
    assert said in str(caught.value)


def test_a_resolved_experiment_means_the_same(load: Load, folder: Path) -> None:
    text = f"{SMALL}\n[controller]\nrule = 'firat'\n\n[states]\nbusy = 'bright-red'\n"
    first = load(text)
    (folder / "elsewhere").mkdir()
    again = folder / "elsewhere" / "again.toml"
    again.write_text(first.to_toml())
    second = Experiment.load(again)
    assert second.resolved() == first.resolved()
    assert second.identity() == first.identity()


def test_a_resolved_experiment_lists_every_key(load: Load) -> None:
    tables = tomllib.loads(load().to_toml())
    assert tables["reading"]["obstacle_m"] == 0.05
    assert tables["medium"] == {"kind": "ideal", "range_m": 0.8}


def test_a_run_folder_of_an_older_version_may_name_box2d_as_its_solver(load: Load) -> None:
    old = load(f'{SMALL}\n[engine]\ncontact_solver = "box2d"\n')
    assert old.resolved() == load().resolved()


def test_comments_and_order_do_not_change_the_identity(load: Load) -> None:
    plain = load().identity()
    assert load(f"# a comment\n{SMALL}\n[record]\nsample_s = 10\n").identity() == plain
    assert load(SMALL, "seed=2").identity() != plain


def test_our_programs_are_named_portably(load: Load) -> None:
    tables = load(SMALL, "swarm.program=firmware/aggregation").resolved()
    assert tables["swarm"]["program"] == "firmware/aggregation"


def test_mixed_swarms_have_groups(load: Load) -> None:
    text = SMALL.replace('program = "blink.c"\nsize = 10\n', "")
    text += """
[[robots]]
program = "blink.c"
count = 2
poses = [[0.0, 1.0, 0.0], [0.0, -1.0, 3.1]]

[[robots]]
program = "firmware/aggregation"
count = 5
"""
    experiment = load(text)
    assert [(group.program.name, group.count) for group in experiment.groups] == [
        ("blink", 2),
        ("aggregation", 5),
    ]
    assert experiment.groups[0].poses == [[0.0, 1.0, 0.0], [0.0, -1.0, 3.1]]
    assert experiment.size == 7
    assert [experiment.program_of(robot).name for robot in (0, 1, 2, 6)] == [
        "blink",
        "blink",
        "aggregation",
        "aggregation",
    ]


def test_a_setting_remembers_what_was_typed() -> None:
    assert parse_setting("swarm.informed = 0.5").written == "--set swarm.informed = 0.5"


def test_a_swarms_program_may_be_several_files(load: Load, folder: Path) -> None:
    (folder / "more.c").write_text("int more;\n")
    text = SMALL.replace('program = "blink.c"', 'program = ["blink.c", "more.c"]')
    experiment = load(text)
    (group,) = experiment.groups
    assert [source.name for source in group.program.sources] == ["blink.c", "more.c"]
    assert len(experiment.resolved()["swarm"]["program"]) == 2


@pytest.mark.parametrize(
    ("sample_s", "step_ticks", "sample_ticks", "finer"),
    [(0.1, 4, 4, 2), (0.04, 4, 4, 1), (0.04, 2, 2, 1), (0.04, 1, 1, None), (0.13, 4, 4, None)],
)
def test_samples_come_no_oftener_than_steps_and_that_is_told(
    load: Load, sample_s: float, step_ticks: int, sample_ticks: int, finer: int | None
) -> None:
    settings = f"record.sample_s={sample_s}", f"engine.step_ticks={step_ticks}"
    experiment = load(SMALL, *settings)
    assert experiment.keys.sample_ticks == sample_ticks
    told = list(experiment.notes())
    assert [f"record.sample_s = {sample_s:g} is shorter" in text for text in told] == [True] * (
        finer is not None
    )
    assert all(text.endswith(f"set engine.step_ticks = {finer}") for text in told)


def test_a_key_of_a_thousand_parts_is_refused_with_what_is_allowed(tmp_path: Path) -> None:
    file = tmp_path / "deep.toml"
    file.write_text(f"{'.'.join('a' * 1000)} = 1\n")
    with pytest.raises(InputError, match=r"deep\.toml: nested too deep; tables have three levels"):
        Experiment.load(file)
