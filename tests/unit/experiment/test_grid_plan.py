"""Meaning of an experiment for a grid: cells, codes, orders; and what does not go together."""

from pathlib import Path

import numpy as np
import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.engine import (
    commands,
    config_differences,
    config_messages,
    engine_spec,
)
from kilotwin.experiment.spec.grid_layout import Layout, place_of, walls_on_cells
from kilotwin.experiment.spec.grid_plan import GridPlan
from kilotwin.experiment.spec.start_poses import starts
from kilotwin.table.grid.in_turn import last

from ..conftest import GRID, Load

ROOT = Path(__file__).parents[3]


def ours(text: str = GRID) -> str:
    return text.replace('program = "blink.c"\n\n[[site]]', "\n[[site]]", 1)


def plan_of(experiment: Experiment) -> GridPlan:
    assert experiment.plan is not None
    return experiment.plan


def test_the_grid_makes_the_arena_and_switches_the_virtual_floor_off(load: Load) -> None:
    keys = load(ours()).keys
    assert (keys.arena.shape, keys.arena.width_m, keys.arena.height_m) == ("rectangle", 0.4, 0.6)
    assert keys.swarm.floor is False


def test_buses_have_whole_rows_and_every_module_once() -> None:
    layout = Layout(10, 20, 4)
    assert [layout.rows_of(bus) for bus in range(4)] == [
        range(0, 5),
        range(5, 10),
        range(10, 15),
        range(15, 20),
    ]
    modules = [module for bus in range(4) for module in layout.modules_of(bus)]
    assert modules == list(layout.modules())
    uneven = Layout(2, 7, 3)
    assert [len(uneven.rows_of(bus)) for bus in range(3)] == [2, 2, 3]


def test_cells_are_numbered_from_the_top_left() -> None:
    layout = Layout(4, 6, 2)
    assert layout.centre((0, 0), 2) == pytest.approx((-0.175, -0.275))
    assert layout.centre((0, 0), 1) == pytest.approx((-0.125, -0.225))
    assert layout.centre((3, 5), 1) == pytest.approx((0.175, 0.275))
    for module in layout.modules():
        for cell in range(4):
            x, y = layout.centre(module, cell)
            row, column = layout.below(np.array([x]), np.array([y]))
            assert (row[0], column[0]) == place_of(module, cell)


def test_a_cell_is_of_the_site_that_its_middle_lies_in(load: Load) -> None:
    ((_, cells),) = plan_of(load(ours())).site_maps
    assert np.argwhere(cells == 1).tolist() == [[r, c] for r in range(4, 8) for c in (1, 2)]
    # Of the circle of 12 cm those whose middles are nearer than 6 cm: 2 x 2, not the next ring.
    assert np.argwhere(cells == 2).tolist() == [[5, 5], [5, 6], [6, 5], [6, 6]]


def test_the_ring_of_walls_is_as_wide_as_it_says() -> None:
    layout = Layout(3, 3, 1)
    assert [int(walls_on_cells(layout, width).sum()) for width in (0, 1, 2, 3)] == [0, 20, 32, 36]


def test_codes_say_site_light_and_wall(load: Load) -> None:
    """kilogrid_modules/sites/README.md."""
    plan = plan_of(load(ours(), "site.0.light=off", "site.1.light=white"))
    codes = {module: last(content) for module, content in plan.configuration.items()}
    assert codes[0, 0] == bytes([0x9F, 0x80, 0x9F, 0x9F])
    assert codes[1, 2] == bytes([0x81, 0x80, 0x81, 0x80])
    assert codes[2, 2] == bytes([0x80, codes[2, 2][1], 0x80, 0x80])
    assert {code for data in codes.values() for code in data} == {
        0x9F,
        0x80,
        0x81,
        0xF2,
    }
    assert len(codes) == 24


def test_a_labs_own_program_is_told_only_what_its_file_says(load: Load, folder: Path) -> None:
    assert plan_of(load(GRID)).configuration == {}
    (folder / "arena.kconf").write_text("address\ny:0\ndata\n0x01\n0x02\n")
    plan = plan_of(load(GRID, "grid.configuration=arena.kconf"))
    assert plan.configuration == {(x, 0): (b"\1\2",) for x in range(4)}


def test_a_labs_file_without_a_block_configures_no_module(load: Load, folder: Path) -> None:
    (folder / "empty.kconf").write_text("# the program needs none\n")
    assert plan_of(load(GRID, "grid.configuration=empty.kconf")).configuration == {}


def test_an_error_in_a_file_of_the_experiment_names_its_line(load: Load, folder: Path) -> None:
    (folder / "arena.kconf").write_text("address\ny:0\ndata\n0x1g\n")
    with pytest.raises(InputError, match=r"arena\.kconf:4: '0x1g' is no hex byte"):
        load(GRID, "grid.configuration=arena.kconf")


def test_a_swap_changes_the_modules_of_both_sites_and_the_map(load: Load) -> None:
    plan = plan_of(load(ours(), 'grid.change=[{at_s = 50.0, swap = ["black", "white"]}]'))
    (order,) = plan.orders
    assert (order.at_s, order.kind) == (50.0, "change")
    (_, before), (from_s, after) = plan.site_maps
    assert from_s == 50.0
    assert ((before == 1) == (after == 2)).all()
    assert ((before == 2) == (after == 1)).all()
    assert order.configuration is not None
    touched = {(int(c) // 2, int(r) // 2) for r, c in np.argwhere(before > 0)}
    assert set(order.configuration) == touched


def test_commands_become_orders_of_the_host(load: Load) -> None:
    experiment = load(
        ours(), 'command=[{at_s = 60.0, send = "run"}, {at_s = 30.0, send = "pause"}]'
    )
    orders = plan_of(experiment).orders
    assert [(order.at_s, order.kind) for order in orders] == [(30.0, "pause"), (60.0, "resume")]
    assert commands(experiment) == []


def test_robots_are_told_what_is_not_their_default(load: Load) -> None:
    experiment = load(ours(), "controller.beta=1.5", "grid.report_s=0")
    (message,) = config_differences(experiment)
    assert int.from_bytes(message[5:9], "little") == round(1.5 * 65536)
    assert message in [sent for _, _, sent in config_messages(experiment)]
    assert len(config_differences(load(ours()))) == 1  # that they report


def test_robots_of_ours_without_controller_are_told_how_often_to_report(load: Load) -> None:
    text, program = GRID.replace("[controller]", ""), 'swarm.program="firmware/aggregation"'
    (message,) = config_differences(load(text, program, "grid.report_s=5"))
    assert int.from_bytes(message[5:9], "little") == round(5 / 0.032768)
    assert config_differences(load(text, program, "grid.report_s=0")) == []
    assert config_differences(load(text)) == []


def test_other_robots_cannot_be_told_how_often_to_report(load: Load) -> None:
    said = r"only robots that run firmware/aggregation obey 'report_s'; remove it"
    with pytest.raises(InputError, match=said):
        load(GRID.replace("[controller]", ""), "grid.report_s=5")


def test_the_engine_gets_the_grid_and_its_faults(load: Load) -> None:
    fault = 'faults.module=[{at_s = 32.768, kind = "reset", module = [3, 5]}]'
    experiment = load(ours(), fault, "faults.error_share=0.05")
    spec = engine_spec(
        experiment,
        ["robots.so"],
        sample_ticks=10,
        black_box=None,
        module_guest="modules.so",
        lead_ticks=500,
    )
    grid = spec["grid"]
    assert (grid["columns"], grid["rows"], grid["buses"]) == (4, 6, 2)
    assert (grid["program"], grid["name"]) == ("modules.so", "sites")
    assert grid["faults"] == [{"at_tick": 1000, "kind": "reset", "module": [3, 5]}]
    assert grid["error_share"] == 0.05
    assert spec["lead_ticks"] == 500
    assert spec["floor"] is None


def test_a_grid_experiment_loads_again_from_its_run_folder(load: Load, folder: Path) -> None:
    (folder / "arena.kconf").write_text("address\ny:0\ndata\n0x01\n")
    first = load(GRID, "grid.configuration=arena.kconf")
    again = load(first.to_toml())
    assert again.identity() == first.identity()
    assert plan_of(again).configuration == plan_of(first).configuration


def test_robots_begin_in_their_rectangle_apart_and_by_the_seed(load: Load) -> None:
    settings = ["swarm.start_in_m=[-0.1, -0.2, 0.1, 0.0]", "swarm.size=20"]
    (poses,) = starts(load(ours(), *settings))
    assert poses is not None
    assert poses.shape == (20, 3)
    assert (np.abs(poses[:, 0]) <= 0.1 - 0.0165).all()
    assert (poses[:, 1] >= -0.2 + 0.0165).all()
    assert (poses[:, 1] <= -0.0165).all()
    between = np.hypot(*(poses[:, None, :2] - poses[None, :, :2]).T)
    assert between[~np.eye(20, dtype=bool)].min() >= 0.033
    (again,) = starts(load(ours(), *settings))
    (other,) = starts(load(ours(), *settings, "seed=2"))
    assert again is not None
    assert other is not None
    assert (again == poses).all()
    assert (other != poses).any()


@pytest.mark.parametrize("name", ["paper-n50", "stripes-n50", "three-sites", "swap"])
def test_the_experiments_that_kilotwin_brings_are_sound(name: str) -> None:
    experiment = Experiment.load(ROOT / "experiments" / "kilogrid" / f"{name}.toml")
    plan = plan_of(experiment)
    assert len(plan.configuration) == plan.layout.columns * plan.layout.rows
    numbers = set(np.unique(plan.site_maps[0][1]).tolist()) - {0}
    assert numbers == set(range(1, len(experiment.keys.site) + 1))


def test_the_stripes_are_those_of_the_papers_first_author() -> None:
    """hardware.md 4.1: black y = 10 to 25 cm, white 75 to 90, both 80 cm wide."""
    experiment = Experiment.load(ROOT / "experiments" / "kilogrid" / "stripes-n50.toml")
    cells = plan_of(experiment).site_maps[0][1]
    assert np.argwhere(cells == 1).tolist() == [[r, c] for r in (2, 3, 4) for c in range(2, 18)]
    assert np.argwhere(cells == 2).tolist() == [[r, c] for r in (15, 16, 17) for c in range(2, 18)]
