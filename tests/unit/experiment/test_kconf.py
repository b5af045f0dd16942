"""`.kconf`: what is written is read again, a lab's file is understood, errors are named."""

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kilotwin.errors import InputError
from kilotwin.experiment.spec import kconf
from kilotwin.experiment.spec.kconf import Block, Target

numbers = st.integers(0, kconf.LAST)
targets = st.one_of(
    st.builds(lambda x, y: Target("module", x, y), numbers, numbers),
    st.builds(lambda x: Target("x", x=x), numbers),
    st.builds(lambda y: Target("y", y=y), numbers),
)
blocks = st.builds(
    Block,
    st.lists(targets, min_size=1, max_size=12).map(tuple),
    st.binary(min_size=1, max_size=kconf.MOST_BYTES),
)


@given(st.lists(blocks, max_size=8))
def test_what_is_written_is_read_again(written: list[Block]) -> None:
    assert kconf.parse(kconf.to_text(written)) == written


@given(st.lists(blocks, max_size=4))
def test_every_line_of_a_block_is_short_enough_to_read_aloud(written: list[Block]) -> None:
    for line in kconf.to_text(written).splitlines():
        assert not line or line in ("address", "data") or ":" in line or line.startswith("0x")


@given(
    st.dictionaries(
        st.tuples(st.integers(0, 9), st.integers(0, 19)), st.binary(min_size=1, max_size=4)
    )
)
def test_a_configuration_survives_a_file(configuration: dict[kconf.Module, bytes]) -> None:
    text = kconf.to_text(kconf.blocks_of(configuration))
    assert kconf.configurations(kconf.parse(text), 10, 20) == {
        module: (content,) for module, content in configuration.items()
    }


@given(st.text(alphabet="adresmoulxyt:,-0189abFx# \n", max_size=80))
def test_any_text_is_blocks_or_an_error_with_its_line(text: str) -> None:
    said, found = "", []
    try:
        found = kconf.parse(text, "some.kconf")
    except InputError as error:
        said = str(error)
    assert not said or re.match(r"some\.kconf:\d+: ", said)
    assert kconf.parse(kconf.to_text(found)) == found


def test_a_labs_file_is_understood() -> None:
    text = """\
# Experiment:  walls and a spot
# Generation Time:  08/03/2022 12:31:16


address
x:0,9
y:0, 19

data
0x1
0x1
0X1
1

address
module:0-0,4-7 , 5-7
module: 6-7
data
2  # free
0xfF
"""
    walls, spot = kconf.parse(text)
    assert walls == Block(
        (Target("x", x=0), Target("x", x=9), Target("y", y=0), Target("y", y=19)), b"\1\1\1\1"
    )
    assert [target.line for target in walls.targets] == [6, 6, 7, 7]
    assert spot.targets == tuple(
        Target("module", x, y) for x, y in [(0, 0), (4, 7), (5, 7), (6, 7)]
    )
    assert spot.data == b"\x02\xff"
    found = kconf.configurations([walls, spot], 10, 20)
    # In turn, as the blocks and their lines stand in the file.
    assert found[0, 0] == (b"\1\1\1\1", b"\1\1\1\1", b"\x02\xff")
    assert found[0, 1] == found[3, 0] == (b"\1\1\1\1",)
    assert (1, 1) not in found
    assert len(found) == 20 + 20 + 8 + 8 + 3


def test_ranges_are_written_short() -> None:
    block = Block(tuple(Target("y", y=y) for y in (3, 4, 5, 9, 8)), b"\0")
    assert kconf.to_text([block]).splitlines()[1] == "y:3-5,9,8"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0x01\n", ":1: '0x01' stands before any block; begin with 'address'"),
        ("address\nmodule:1-1\n", ":1: the block has no 'data'"),
        ("address\ndata\n0x01\n", ":2: no address above 'data'"),
        ("address\nx:1\ndata\naddress\nx:2\ndata\n1\n", ":1: the block has no bytes"),
        ("address\nx:1\ndata\n0x01\ndata\n", ":5: a second 'data'"),
        ("address\nx:31\ndata\n1\n", ":2: 'x:31': '31' is not 0 to 30"),
        ("address\nmodule:1\n", ":2: 'module:1': write each module as column-row"),
        ("address\nmodule:1-2-3\n", "'2-3' is not 0 to 30"),
        ("address\ny:5-2\n", ":2: 'y:5-2': 5-2 runs backwards; write 2-5"),
        ("address\ny:\n", "'' is not 0 to 30"),
        ("address\nrow:5\n", ":2: 'row:5' is no address; allowed: module:x-y"),
        ("address\ncell:2-3\n", ":2: 'cell:2-3' is an old form; write module:2-3"),
        ("address\nx:1\ndata\n0x100\n", ":4: '0x100' is no hex byte; allowed: 0x00 to 0xff"),
        ("address\nx:1\ndata\n-1\n", ":4: '-1' is no hex byte"),
        ("address\nx:1\ndata\n" + "0\n" * 49, ":52: more than 48 bytes"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(text: str, said: str) -> None:
    with pytest.raises(InputError, match=r"^bad\.kconf:") as caught:
        kconf.parse(text, "bad.kconf")
    assert said in str(caught.value)


def test_a_module_off_the_grid_is_named() -> None:
    found = kconf.parse("address\nmodule:3-4\ndata\n1\n\naddress\nx:1\ny:5\ndata\n1\n")
    with pytest.raises(
        InputError, match=r"^it:8: y:5 is not on a grid of 4 x 5 modules; .*rows 0 to 4"
    ):
        kconf.configurations(found, 4, 5, "it")


@pytest.mark.parametrize("text", ["", "# nothing yet\n\n"])
def test_a_file_that_names_no_module_configures_none(text: str, tmp_path: Path) -> None:
    (tmp_path / "empty.kconf").write_text(text)
    assert kconf.configurations(kconf.read(tmp_path / "empty.kconf"), 10, 20) == {}


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        kconf.read(tmp_path / "none.kconf")


def test_files_are_written_and_read(tmp_path: Path) -> None:
    written = [Block((Target("x", x=3),), b"\x10")]
    kconf.write(tmp_path / "a.kconf", written)
    assert kconf.read(tmp_path / "a.kconf") == written
