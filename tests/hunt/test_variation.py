"""Variations: the ordinary experiments that they make."""

import json
from dataclasses import replace

from kilotwin.studies.hunt.variation import LATE, Addition, Base, Variation

TABLES = {
    "duration_s": 60,
    "arena": {"diameter_m": 1.0},
    "swarm": {"profile": "kilobot", "program": "walk.c", "size": 3},
    "hunt": {"failing": 0},
}
THREE = Base(TABLES, (1, 2, 3), (3,))
TWO_KINDS = Base(
    {
        **TABLES,
        "swarm": {"profile": "kilobot"},
        "robots": [
            {"program": "a.c", "count": 2, "poses": [[0, 0, 0], [1, 0, 0]]},
            {"program": "b.c", "count": 1, "uids": [9]},
        ],
        "command": [{"at_s": 1, "send": "run", "robot": 2}, {"at_s": 0, "send": "run"}],
        "step": [{"at_s": 1, "robot": 9, "pose": [0, 0, 0]}, {"at_s": 2, "ambient": 3.0}],
        "faults": {"robot": [{"kind": "dead", "at_s": 1, "robots": [1, 9]}]},
    },
    (1, 2, 9),
    (2, 1),
)
FAULT = Addition(("faults", "robot"), (("kind", "deaf"), ("at_s", 2.0)), 1, "robots", listed=True)


def test_one_without_anything_is_the_experiment_without_its_hunt() -> None:
    assert THREE.varied(Variation()) == {k: v for k, v in TABLES.items() if k != "hunt"}
    assert "hunt" in TABLES


def test_seed_duration_and_keys_are_written_where_an_experiment_has_them() -> None:
    one = Variation(seed=7, duration_s=5.0).put(("medium", "loss"), 0.1)
    tables = THREE.varied(one.put(("medium", "loss"), 0.2))
    assert (tables["seed"], tables["duration_s"]) == (7, 5.0)
    assert tables["medium"] == {"loss": 0.2}


def test_a_table_about_a_robot_names_it_by_the_uid_that_it_has_now() -> None:
    one = Variation().add(FAULT)
    assert THREE.varied(one)["faults"]["robot"] == [{"kind": "deaf", "at_s": 2.0, "robots": [2]}]
    named = THREE.varied(replace(one, uids=(7, 300, 5)))
    assert named["faults"]["robot"][0]["robots"] == [300]
    assert named["robots"] == [{"program": "walk.c", "count": 3, "uids": [7, 300, 5]}]
    assert named["swarm"] == {"profile": "kilobot"}


def test_a_robot_that_does_not_take_part_takes_its_tables_with_it() -> None:
    assert "faults" not in THREE.varied(replace(Variation().add(FAULT), robots=(0, 2)))
    tables = TWO_KINDS.varied(Variation(robots=(0,)))
    assert tables["robots"] == [{"program": "a.c", "count": 1, "poses": [[0, 0, 0]]}]
    assert tables["command"] == [{"at_s": 0, "send": "run"}]
    assert tables["step"] == [{"at_s": 2, "ambient": 3.0}]
    assert tables["faults"]["robot"] == [{"kind": "dead", "at_s": 1, "robots": [1]}]
    assert "robot" not in TWO_KINDS.varied(Variation(robots=(1,)))["faults"].get("robot", [])
    assert TWO_KINDS.varied(Variation(robots=(1,)))["faults"]["robot"] == []


def test_robots_keep_uids_that_no_place_gives_them() -> None:
    tables = THREE.varied(Variation(robots=(1, 2)))
    assert tables["robots"] == [{"program": "walk.c", "count": 2, "uids": [2, 3]}]
    tables = TWO_KINDS.varied(Variation(robots=(0, 1, 2), uids=(1, 2, 3)))
    assert [kind.get("uids") for kind in tables["robots"]] == [None, None]


def test_poses_take_the_place_of_other_starts() -> None:
    base = replace(
        TWO_KINDS,
        tables={
            **TWO_KINDS.tables,
            "robots": [{"program": "a.c", "count": 3, "formation": {"shape": "line"}}],
        },
        counts=(3,),
    )
    tables = base.varied(Variation(robots=(0, 2), poses=((0, 0, 0), (1, 1, 1), (2, 2, 2))))
    assert tables["robots"][0] == {
        "program": "a.c",
        "count": 2,
        "poses": [[0, 0, 0], [2, 2, 2]],
        "uids": [1, 9],
    }


def test_robots_that_run_late_leave_run_at_0_to_the_others() -> None:
    late = Variation().add(Addition(LATE, (("at_s", 0.5),), 1))
    assert THREE.varied(late)["command"] == [
        {"at_s": 0.0, "send": "run", "robot": 1},
        {"at_s": 0.5, "send": "run", "robot": 2},
        {"at_s": 0.0, "send": "run", "robot": 3},
    ]
    last = Variation().add(Addition(LATE, (("at_s", 0.5),), 2))
    assert THREE.varied(last)["command"][0] == {
        "at_s": 0.0,
        "send": "run",
        "uid_first": 1,
        "uid_last": 2,
    }


def test_an_order_more_does_not_take_the_place_of_run() -> None:
    reset = Variation().add(Addition(("command",), (("at_s", 2.0), ("send", "reset")), 0))
    assert THREE.varied(reset)["command"] == [
        {"at_s": 0.0, "send": "run", "uid_first": 1, "uid_last": 3},
        {"at_s": 2.0, "send": "reset", "robot": 1},
    ]
    assert TWO_KINDS.varied(reset)["command"][-1] == {"at_s": 2.0, "send": "reset", "robot": 1}


def test_a_variation_survives_a_file() -> None:
    one = Variation(5, (0, 2), 3.5, (1, 2, 70), ((0, 0, 0.5),) * 3).put(("swarm", "on_s"), 9.0)
    one = one.add(FAULT, Addition(("step",), (("at_s", 1.0), ("pose", [0, 0, 1])), 2))
    assert Variation.of(json.loads(json.dumps(one.as_dict()))) == one
    assert Variation().as_dict() == {}
    assert Variation.of({}) == Variation()


def test_a_value_of_an_addition_can_be_another() -> None:
    assert FAULT.of("at_s") == 2.0
    assert FAULT.of("left") is None
    assert FAULT.with_value("at_s", 3.0).of("at_s") == 3.0


def test_what_holds_throughout_is_cut_with_the_run_and_else_an_expectation_stays() -> None:
    expects = [
        {"that": "led.red == 0", "throughout_s": 60},
        {"that": "led.red == 0", "after_s": 10, "throughout_s": 50},
        {"that": "led.red == 0", "after_s": 30, "throughout_s": 30},
        {"that": "led.red == 0", "within_s": 60},
        {"that": "led.red == 0", "at_s": 60},
    ]
    base = replace(THREE, tables={**THREE.tables, "expect": expects})
    cut = base.varied(Variation(duration_s=25.5))["expect"]
    assert [row.get("throughout_s") for row in cut] == [25.5, 15.5, 30, None, None]
    assert base.varied(Variation())["expect"] == expects
