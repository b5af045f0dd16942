"""Failures by cause, as summaries and terminals show them."""

from kilotwin.runs.causes import causes, listed


def crash(robot: int, tick: int, line: int = 0, text: str = "it fell") -> dict[str, object]:
    event = {"robot": robot, "tick": tick, "program": "walk", "kind": "crash", "text": text}
    if not line:
        return event
    placed = {"file": "/lab/walk.c", "line": line, "function": "loop"}
    return {**event, "text": f"at walk.c:{line} in loop(): {text}", **placed}


def test_robots_that_fail_at_one_line_are_one_cause_wherever_their_pointers_point() -> None:
    events = [crash(robot, 50 - robot, 42, f"address {robot}") for robot in range(6)]
    (cause,) = causes(events)
    assert cause.text("robot") == (
        "crash at walk.c:42 in loop(): address 0: robots 1, 2, 3 and 3 more (walk), from tick 45"
    )
    assert cause.as_dict("robot") == {
        "what": "crash at walk.c:42 in loop(): address 0",
        "program": "walk",
        "file": "/lab/walk.c",
        "line": 42,
        "first_tick": 45,
        "robots": 6,
        "first_robot": "1",
    }


def test_a_robot_is_named_by_the_uid_of_its_event_else_by_its_index_and_one() -> None:
    (cause,) = causes([{**crash(0, 1, 42), "uid": 7}, crash(2, 1, 42)])
    assert cause.whose == ["7", "3"]


def test_other_lines_and_other_words_are_other_causes() -> None:
    events = [crash(0, 1, 42), crash(1, 1, 43), crash(2, 1), crash(3, 1, text="it sank")]
    assert [cause.what for cause in causes([*events, crash(4, 9)])] == [
        "crash at walk.c:42 in loop(): it fell",
        "crash at walk.c:43 in loop(): it fell",
        "crash: it fell",
        "crash: it sank",
    ]


def test_names_are_listed_up_to_four() -> None:
    assert listed("robot", ["3"]) == "robot 3"
    assert listed("module", ["1-2", "0-0"]) == "modules 1-2 and 0-0"
    assert listed("robot", list("1234")) == "robots 1, 2, 3 and 4"
    assert listed("robot", list("12345")) == "robots 1, 2, 3 and 2 more"
