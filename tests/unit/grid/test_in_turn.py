"""Each module is sent its configurations in their order, and none of another module."""

from hypothesis import given
from hypothesis import strategies as st

from kilotwin.experiment.spec.kconf import InTurn
from kilotwin.table.grid.cover import apply
from kilotwin.table.grid.in_turn import behind, last, rounds

Module = tuple[int, int]
MODULES = [(x, y) for y in range(3) for x in range(4)]
contents = st.lists(st.sampled_from([b"\1", b"\2", b"\3"]), min_size=1, max_size=3).map(tuple)


@given(st.dictionaries(st.sampled_from(MODULES), contents))
def test_each_gets_its_own_in_order_and_nothing_else(wanted: dict[Module, InTurn]) -> None:
    got: dict[Module, list[bytes]] = {}
    for messages in rounds(wanted, MODULES):
        in_round: dict[Module, int] = {}
        for message in messages:
            for module in MODULES:
                if message.group.covers(module):
                    got.setdefault(module, []).append(message.content)
                    in_round[module] = in_round.get(module, 0) + 1
        # The time for setup() lies between rounds.
        assert set(in_round.values()) <= {1}
    assert {module: tuple(contents) for module, contents in got.items()} == wanted


def test_lines_of_one_content_take_one_message() -> None:
    wanted: dict[Module, InTurn] = dict.fromkeys(MODULES, (b"\1",))
    assert [len(messages) for messages in rounds(wanted, MODULES)] == [1]
    wanted |= {(0, y): (b"\1", b"\2") for y in range(3)}
    assert [len(messages) for messages in rounds(wanted, MODULES)] == [1, 1]
    wanted[2, 1] = (b"\4",)
    # Two whole rows; of the third each module by itself.
    assert [len(messages) for messages in rounds(wanted, MODULES)] == [6, 1]


@given(st.dictionaries(st.sampled_from(MODULES), st.sampled_from([b"\1", b"\2"])))
def test_bytes_are_what_modules_have_in_the_end(wanted: dict[Module, bytes]) -> None:
    messages = [message for round_ in rounds(wanted, MODULES) for message in round_]
    assert apply(messages, MODULES) == wanted


def test_what_a_reset_module_needs_is_all_that_it_was_sent() -> None:
    assert behind((b"\1", b"\2"), (b"\3",)) == (b"\1", b"\2", b"\3")
    assert behind((b"\1", b"\2"), b"\3") == b"\3"
    assert behind(None, (b"\3",)) == (b"\3",)
    assert behind(b"\1", (b"\3",)) == (b"\1", b"\3")
    assert (last(b"\1"), last((b"\1", b"\2"))) == (b"\1", b"\2")
